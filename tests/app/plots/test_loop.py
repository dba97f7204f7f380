"""The charts of a loop as documents and as drawn SVG."""

import json
import re
from typing import Any

import altair
import pytest
import vl_convert

from app import plots


def steps() -> dict[str, Any]:
    x, y = [(0.0, 0.0), (10.0, 1.2), (20.0, 1.0)], [(0.0, 0.0), (10.0, 0.1), (20.0, 0.0)]
    return plots.step_response(x, y, [1.0], (20.0, "cut off"), "Rates")


def poles() -> dict[str, Any]:
    found = [
        plots.Pole(-16.5, 2787.5, "nutation"),
        plots.Pole(-131.0, -89.0, "slow"),
        plots.Pole(40.0, 366.0, "growing"),
    ]
    return plots.poles(found, "Poles")


def bode() -> dict[str, Any]:
    curve = [(1.0, 40.0), (100.0, 0.0), (10_000.0, -40.0)]
    curves = [("positive", curve[:2]), ("positive", curve[1:]), ("negative", curve)]
    marks = [
        plots.MarginMark("positive", 1000.0, -20.0, 0.0, "gain margin"),
        plots.MarginMark("negative", 900.0, -19.0, 0.0, "other gain margin"),
    ]
    return plots.bode(curves, marks, [0.0], (-45.0, 45.0), 20.0, "Loop gain")


CHARTS = {"steps": steps, "poles": poles, "bode": bode}


def drawn(spec: dict[str, Any]) -> str:
    return str(vl_convert.vegalite_to_svg({**plots.printed(spec), "width": 620}))


@pytest.mark.parametrize("name", CHARTS)
def test_they_keep_to_vega_lites_schema(name: str) -> None:
    spec = CHARTS[name]()
    assert json.loads(json.dumps(spec)) == spec
    altair.LayerChart.from_dict(spec, validate=True)


def test_a_cut_off_response_says_so() -> None:
    assert ">cut off<" in drawn(steps())
    assert steps()["datasets"]["final"] == [{"v": 1.0}]
    assert plots.step_response([(0.0, 1.0)], [], [], None, "Rates")["datasets"]["cut"] == []


def test_every_pole_is_drawn_with_its_name_and_growing_ones_apart() -> None:
    svg = drawn(poles())
    assert set(re.findall(r'aria-label="(nutation|slow|growing)"', svg)) == {"nutation", "slow", "growing"}
    rows = poles()["datasets"]
    assert [row["name"] for row in rows["grows"]] == ["growing"]
    assert [row["name"] for row in rows["decays"]] == ["nutation", "slow"]
    # The washed half begins at zero and reaches beyond the growing pole.
    assert rows["half"][0]["l"] == 0.0
    assert rows["half"][0]["h"] > 40.0


def test_axes_of_the_poles_are_marked_by_decades_on_both_sides() -> None:
    values = {item["name"]: item.get("value") for item in poles()["params"]}
    assert values["linear"] == 10.0  # the power of ten below the smallest real part, 16.5
    assert values["xTicks"] == [-100.0, -10.0, 0.0, 10.0]
    assert values["yTicks"] == [-100.0, -10.0, 0.0, 10.0, 100.0, 1000.0]
    labels = re.findall(r">(−?\d+)<", drawn(poles()))
    assert {"−100", "−10", "0", "10", "1000"} <= set(labels)


def test_margins_are_lines_with_a_point_and_a_name() -> None:
    svg = drawn(bode())
    assert 'aria-label="gain margin"' in svg
    assert 'aria-label="other gain margin"' in svg
    rows = bode()["datasets"]["mark_positive"]
    assert [(row["w"], row["v"], row["e"]) for row in rows] == [(1000.0, -20.0, 0.0)]


def test_decades_are_labelled_and_levels_kept() -> None:
    values = {item["name"]: item.get("value") for item in bode()["params"]}
    assert values["ticks"] == [-40.0, -20.0, 0.0, 20.0, 40.0]
    labels = re.findall(r">([−\d]+)<", drawn(bode()))
    assert {"1", "10", "100", "1000", "10000", "−40", "0", "40"} <= set(labels)


def test_a_curve_in_pieces_is_not_joined() -> None:
    paths = re.findall(r'<path d="(M[^"]+)" stroke="(#0072b2|#009e73)"', drawn(bode()))
    # Two pieces of two points for ω > 0, one of three for ω < 0.
    assert [(path.count("L"), colour) for path, colour in paths] == [
        (1, "#0072b2"), (1, "#0072b2"), (2, "#009e73"),
    ]  # fmt: skip
