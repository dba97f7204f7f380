"""The parts of a drift history that judge: baselines, a repair, a step, a forecast."""

import json
import re
from datetime import UTC, datetime, timedelta

import altair
import pytest
import vl_convert

from app import plots
from app.plots import dates, theme
from app.plots.drift_marks import DriftPoint

BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
PERIOD = (BEGIN, BEGIN + timedelta(days=200))
REPAIR = BEGIN + timedelta(days=100)


def at(days: float) -> datetime:
    return BEGIN + timedelta(days=days)


def points() -> list[DriftPoint]:
    """Ten sessions, a repair after the fifth."""
    return [
        DriftPoint(
            at(10 + 20 * number), 1.0 + 0.5 * (number > 4), 0.01, "beyond" if number == 8 else "within",
            f"session {number}", "", f"/results/{number}", part=int(number > 4),
        )
        for number in range(10)
    ]  # fmt: skip


def chart(**options):
    return plots.drift(points(), [], [], PERIOD, "Drift", **options)


def drawn(spec) -> str:
    return vl_convert.vegalite_to_svg({**plots.printed(spec), "width": 620})


BASELINES = [
    plots.ControlStretch(1.0, [(at(0), 0.9, 1.1)], REPAIR),
    plots.ControlStretch(1.5, [(REPAIR, 1.4, 1.6), (at(150), 1.35, 1.65)], PERIOD[1]),
]
FORECAST = plots.Forecast([at(160), at(180), at(200)], [1.5, 1.5, 1.5], [1.4, 1.39, 1.38], [1.6, 1.61, 1.62])
FULL = {
    "stretches": BASELINES, "forecast": FORECAST, "changes": [plots.DriftChange(at(90), at(110), "step +0.5")],
}  # fmt: skip


@pytest.mark.parametrize("options", [{}, FULL], ids=["bare", "full"])
def test_a_panel_keeps_to_vega_lites_schema(options):
    spec = chart(**options)
    assert json.loads(json.dumps(spec)) == spec
    altair.LayerChart.from_dict(spec, validate=True)


def test_control_limits_are_drawn_over_what_they_judge_only():
    rows = chart(stretches=BASELINES)["datasets"]["control"]
    first, second = ([row for row in rows if row["of"] == number] for number in (0, 1))
    assert {row["t"] for row in first} == {dates.stamp(at(0)), dates.stamp(REPAIR)}
    assert {(row["low"], row["high"]) for row in first} == {(0.9, 1.1)}
    assert [row["t"] for row in second] == [dates.stamp(item) for item in (REPAIR, at(150), PERIOD[1])]
    assert [row["high"] for row in second] == [1.6, 1.65, 1.65]  # the last limits hold to the end


def test_nothing_is_drawn_across_a_repair():
    """Each of line, centre and limits is two paths, one before the repair and one after it."""
    spec = chart(stretches=BASELINES)
    assert {row["part"] for row in spec["datasets"]["line"]} == {0, 1}
    paths = re.findall(r'<path[^>]* d="(M[^"]*L[^"]*)"[^>]*stroke="#666b71"', drawn(spec))
    assert len(paths) == 6  # centre, lower and upper limit, each of two baselines


def test_a_side_without_a_limit_has_no_line():
    one_sided = [plots.ControlStretch(0.1, [(at(0), None, 0.3)], PERIOD[1])]
    paths = re.findall(r'stroke="#666b71"[^>]*stroke-dasharray="4,3"', drawn(chart(stretches=one_sided)))
    assert len(paths) == 1


def test_the_forecast_begins_today_and_ends_with_the_panel():
    svg = drawn(chart(forecast=FORECAST, today=plots.DriftEvent(at(165), "today")))
    assert ">today<" in svg
    rows = chart(forecast=FORECAST)["datasets"]["forecast"]
    assert [row["low"] for row in rows] == [1.4, 1.39, 1.38]


def test_a_forecast_of_wide_band_leaves_the_points_legible():
    """The points span 0.52; a band of ±100 widens the axis by half of that on each side."""
    wide = plots.Forecast([at(160), at(200)], [1.5, 1.5], [1.0, -100.0], [2.0, 100.0])
    values = {item["name"]: item["value"] for item in chart(forecast=wide)["params"]}
    assert values["low"] > 0.99 - 0.26 - 0.1
    assert values["high"] < 1.51 + 0.26 + 0.1


def test_a_step_is_dated_between_two_sessions():
    spec = chart(changes=FULL["changes"])
    assert [(row["t"], row["t2"]) for row in spec["datasets"]["changes"]] == [
        (dates.stamp(at(90)), dates.stamp(at(110)))
    ]
    assert "step +0.5" in drawn(spec)


def test_a_repair_is_a_solid_rule_and_a_certificate_a_dotted_one():
    events = [plots.DriftEvent(REPAIR, "repair", solid=True), plots.DriftEvent(at(30), "C-17")]
    svg = drawn(plots.drift(points(), events, [], PERIOD, "Drift"))
    ink = theme.COLOURS["ink"][0]
    rules = re.findall(rf'<line[^>]*stroke="{ink}"[^>]*>', svg)
    assert sorted("stroke-dasharray" in rule for rule in rules) == [False, True]
    assert {"repair", "C-17"} <= set(re.findall(r">([^<>]+)</text>", svg))


def test_a_steps_label_stands_on_ground_that_hides_the_lines_behind_it():
    labels = re.findall(r"<text ([^>]*)>step \+0.5<", drawn(chart(changes=FULL["changes"])))
    paper = theme.COLOURS["paper"][0]
    assert [f'stroke="{paper}"' in label for label in labels] == [True, False]


def test_layers_without_rows_are_left_out():
    names = {layer["data"]["name"] for layer in chart()["layer"]}
    assert names == {"line", "within", "beyond"}


@pytest.mark.parametrize(
    ("days", "step"), [(366, 1), (3 * 366, 3), (6 * 366, 6), (30 * 366, 12)], ids=["1", "3", "6", "30"]
)
def test_ticks_of_the_dates_have_room(days, step):
    assert dates.step_of((BEGIN, at(days))) == step


def test_a_long_history_names_its_years():
    spec = plots.drift(points(), [], [], (BEGIN - timedelta(days=9000), PERIOD[1]), "Drift")
    assert {"2010", "2025"} <= set(re.findall(r">(\d{4})</text>", drawn(spec)))
