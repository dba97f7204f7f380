"""Charts as documents and as drawn SVG: what is drawn is counted in the drawing itself."""

import json
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import altair
import jsonschema
import pytest
import vl_convert

from app import plots
from app.i18n import speaking
from app.plots import dates, theme
from app.plots.drift import template as drift_template
from app.plots.warming import make_templates

STYLESHEET = Path(theme.__file__).parents[1] / "static" / "style.css"
BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
PLACES = [
    plots.Place(4 * row + column + 1, f"{90 * row}°", str(90 * column), 0.002)
    for row in range(4)
    for column in range(4)
]


def drawn(spec, width=620):
    return vl_convert.vegalite_to_svg({**plots.printed(spec), "width": width})


def residual_points(beyond=(7, "y")):
    return [
        plots.Residual(
            place.number,
            axis,
            -0.009 if (place.number, axis) == beyond else 0.001,
            (place.number, axis) == beyond,
            f"position {place.number} {axis}",
            "7 y: −9.0",
            f"/measurements/{place.number}",
        )
        for place in PLACES
        for axis in "xy"
    ]


def residual_chart():
    return plots.residuals(residual_points(), PLACES, -3, "Residuals", "beyond 3 s.d.")


def drift_chart(limits=(), **options):
    points = [
        plots.DriftPoint(
            BEGIN + timedelta(days=30 * number), 1.0 + 0.001 * number, 0.002,
            "beyond" if number == 5 else "within", f"session {number}", "", f"/results/{number}",
        )
        for number in range(6)
    ]  # fmt: skip
    events = [plots.DriftEvent(BEGIN + timedelta(days=100), "C-17")]
    return plots.drift(points, events, limits, (BEGIN, BEGIN + timedelta(days=180)), "Drift", **options)


def convergence_chart():
    changes = [
        plots.Change(name, number, 0.0 if number == 5 else 10.0 ** (-3 * number), f"{name} {number}")
        for name in ("kx", "ky", "kxy", "kyx", "wg", "wk")
        for number in range(2, 6)
    ]
    return plots.convergence(changes, 1e-12, "tolerance", "Convergence")


def record_chart():
    stretches = [plots.Stretch(0.0, 0.5, "first half", "?until=0.5")]
    return plots.record([0.0, 0.5, 1.0], [1.0, 0.9, 1.0], [1.1, 1.9, 1.2], "x", 1.05, stretches, "Record")


def allan_chart():
    points = [
        plots.AllanPoint(axis, tau, 10.0 / tau**0.5, 9.0 / tau**0.5, 12.0 / tau**0.5, f"{axis} at {tau} s")
        for axis in ("x", "y")
        for tau in (0.005, 0.01, 0.1, 1.0, 10.0)
    ]
    means = [plots.MeanPoint("x", 1.3, "u of x"), plots.MeanPoint("y", 1.4, "u of y")]
    return plots.allan(points, means, [("x", [(0.005, 141.0), (60.0, 1.3)])], 60.0, "mean over 60 s", "Allan")


def correlation_chart():
    curve = [(0.0, 1.0), (0.005, 0.4), (0.01, -0.1)]
    return plots.autocorrelation(curve, curve[:2], 0.02, "Autocorrelation")


CHARTS = {
    "allan": allan_chart,
    "autocorrelation": correlation_chart,
    "residuals": residual_chart,
    "drift": drift_chart,
    "convergence": convergence_chart,
    "record": record_chart,
}


@pytest.mark.parametrize("chart", CHARTS.values(), ids=CHARTS)
def test_a_chart_is_plain_json_with_a_description(chart):
    spec = chart()
    assert json.loads(json.dumps(spec)) == spec
    assert spec["description"]
    assert spec["width"] == "container"


@pytest.mark.parametrize("chart", CHARTS.values(), ids=CHARTS)
def test_a_chart_keeps_to_vega_lites_schema(chart):
    altair.LayerChart.from_dict(chart(), validate=True)


def test_the_schema_would_object():
    with pytest.raises(jsonschema.ValidationError):
        altair.LayerChart.from_dict({**residual_chart(), "height": "tall"}, validate=True)


def test_templates_are_made_beforehand():
    make_templates()
    assert drift_template.cache_info().currsize == 1 + len(dates.STEPS)


@pytest.mark.parametrize("chart", CHARTS.values(), ids=CHARTS)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_printed_chart_holds_colours_of_its_theme_only(chart, dark):
    text = json.dumps(plots.printed(chart(), dark=dark))
    assert "var(" not in text
    allowed = {pair[dark] for pair in theme.COLOURS.values()}
    assert set(re.findall(r"#[0-9a-f]{6}", text)) <= allowed


@pytest.mark.parametrize("chart", CHARTS.values(), ids=CHARTS)
def test_the_page_chooses_the_theme(chart):
    assert not re.findall(r"#[0-9a-f]{3,6}\b", json.dumps(chart()))


def test_the_colours_are_the_stylesheets():
    found = re.findall(
        r"--([a-z0-9-]+):\s*(?:light-dark\((#\w{6}), (#\w{6})\)|(#\w{6}));", STYLESHEET.read_text()
    )
    sheet = {name: (light or both, dark or both) for name, light, dark, both in found}
    assert {name: sheet[name] for name in theme.COLOURS} == theme.COLOURS


def test_an_unknown_colour_is_refused():
    with pytest.raises(ValueError, match="no colour green"):
        theme.colour("green")


def test_every_residual_is_drawn_with_its_name_and_its_link():
    spec = residual_chart()
    named = set(re.findall(r'aria-label="(position \d+ [xy])"', drawn(spec)))
    assert named == {f"position {number} {axis}" for number in range(1, 17) for axis in "xy"}
    rows = [row for name in ("x", "y", "beyond") for row in spec["datasets"][name]]
    assert {row["name"].split()[1]: row["href"] for row in rows} == {
        str(number): f"/measurements/{number}" for number in range(1, 17)
    }


def test_a_residual_beyond_its_limit_has_colour_shape_and_label():
    svg = drawn(residual_chart())
    assert svg.count(f'fill="{theme.COLOURS["vermillion"][0]}"') == 1
    assert "7 y: −9.0" in svg


@pytest.mark.parametrize(("position", "anchor"), [(2, "start"), (8, "start"), (9, "end"), (16, "end")])
def test_the_label_of_a_residual_beyond_lies_towards_the_middle(position, anchor):
    """A phone's chart has no room beside the last positions: their labels were cut."""
    spec = plots.residuals(residual_points((position, "y")), PLACES, -3, "Residuals", "beyond 3 s.d.")
    assert re.findall(r'<text text-anchor="(\w+)"[^>]*>7 y: −9.0<', drawn(spec)) == [anchor]


def test_residual_limits_stand_at_three_standard_deviations():
    rows = residual_chart()["datasets"]["limits"]
    assert [(row["low"], row["high"]) for row in rows] == [(-6.0, 6.0)] * 16  # 3 · 0.002 °/h in 10⁻³ °/h


def test_residuals_of_unknown_spread_have_no_limits():
    places = [plots.Place(1, "0°", "0", None), plots.Place(2, "0°", "90", None)]
    points = [
        plots.Residual(1, "x", 0.001, False, "", "", "/a"),
        plots.Residual(2, "x", -0.001, False, "", "", "/b"),
    ]
    spec = plots.residuals(points, places, -3, "Residuals", "beyond")
    assert not spec["datasets"]["limits"]
    assert theme.COLOURS["deviation"][0] not in drawn(spec)


@pytest.mark.parametrize(
    ("values", "exponent"),
    [([0.0021], -3), ([0.9, -1.2], 0), ([2e-11], -12), ([4100.0], 3), ([0.0], 0), ([], 0), ([0.001], -3)],
)
def test_the_scale_leaves_one_to_three_whole_digits(values, exponent):
    assert plots.decade(values) == exponent


def test_a_drift_panel_links_every_session_and_names_the_certificate():
    spec = drift_chart()
    svg = drawn(spec)
    assert set(re.findall(r'aria-label="session (\d)"', svg)) == set("012345")
    assert "C-17" in svg
    shown = [row for name in ("within", "beyond") for row in spec["datasets"][name]]
    assert {row["href"] for row in shown} == {f"/results/{number}" for number in range(6)}


def test_a_near_limit_is_drawn_and_a_far_one_is_not():
    near = plots.DriftLimit(1.009, "above", "limit 1.009")
    far = plots.DriftLimit(-6.0, "below", "limit −6")
    svg = drawn(drift_chart([near, far]))
    assert "limit 1.009" in svg
    assert "limit −6" not in svg


def test_only_the_last_panel_has_dates():
    assert "2026" in drawn(drift_chart())
    assert "2026" not in drawn(drift_chart(with_dates=False))


def test_months_and_decimals_follow_the_language():
    with speaking("ru"):
        svg = drawn(drift_chart())
    assert "мар" in svg
    assert re.search(r">1,00\d<", svg)


def test_a_change_of_zero_is_not_drawn_on_the_logarithmic_scale():
    spec = convergence_chart()
    assert [row["r"] for row in spec["datasets"]["kx"]] == [2, 3, 4]
    assert "10⁻¹²" in drawn(spec)


def test_the_envelope_keeps_a_spike():
    spec = record_chart()
    values = {item["name"]: item["value"] for item in spec["params"]}
    assert values["high"] > 1.9
    assert max(row["h"] for row in spec["datasets"]["trace"]) == 1.9


def test_one_request_leaves_nothing_to_the_next():
    first = json.dumps(residual_chart())
    plots.residuals(residual_points(None), PLACES[:3], 0, "Others", "beyond")
    assert json.dumps(residual_chart()) == first


def test_every_allan_deviation_and_both_uncertainties_are_drawn():
    drawing = drawn(allan_chart())
    named = set(re.findall(r'aria-label="([xy] at [0-9.]+ s|u of [xy])"', drawing))
    assert len(named) == 12
    assert "mean over 60 s" in drawing


def test_the_axes_of_allan_deviations_name_decades():
    labels = re.findall(r">(0\.01|0\.1|1|10|100|20|50)<", drawn(allan_chart()))
    assert {"0.01", "0.1", "1", "10"} <= set(labels)


def test_an_allan_deviation_of_zero_is_not_on_a_logarithmic_axis():
    spec = plots.allan([plots.AllanPoint("x", 1.0, 0.0, 0.0, 0.0, "none")], [], [], 60.0, "60 s", "Allan")
    assert spec["datasets"]["points_x"] == []
    drawn(spec)


def test_a_channel_without_autocorrelation_leaves_its_line_out():
    spec = plots.autocorrelation([(0.0, 1.0), (0.1, 0.0)], [], 0.02, "Autocorrelation")
    assert spec["datasets"]["y"] == []
    drawn(spec)
