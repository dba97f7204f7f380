"""The chart of a trade as a document and as drawn SVG."""

import json
import re

import altair
import vl_convert

from app import plots


def chart():
    front = [(1.0, 5.0), (2.0, 3.0), (4.0, 1.0)]
    marks = [
        plots.TradeMark("front", x, y, f"front {x}", "", f"?positions={number}")
        for number, (x, y) in enumerate(front)
    ]
    marks += [
        plots.TradeMark(kind, 3.0 + shift, 4.0, f"set {kind}", label, f"?kind={kind}")
        for kind, label, shift in (
            ("paper", "the eight", 0.0),
            ("all", "sixteen", 0.5),
            ("plan", "mine", -1.5),
        )
    ]
    return plots.pareto(marks, "u(K)", "u(ωg)", "Trade")


def drawn():
    return vl_convert.vegalite_to_svg({**plots.printed(chart()), "width": 620})


def test_it_keeps_to_vega_lites_schema():
    spec = chart()
    assert json.loads(json.dumps(spec)) == spec
    assert spec["description"] == "Trade"
    altair.LayerChart.from_dict(spec, validate=True)


def test_every_set_is_drawn_with_its_name_and_its_link():
    svg = drawn()
    names = {"front 1.0", "front 2.0", "front 4.0", "set paper", "set all", "set plan"}
    assert set(re.findall(r'aria-label="((?:front|set) [^"]+)"', svg)) == names
    for number in range(3):
        assert f"?positions={number}" in svg
    for label in ("the eight", "sixteen", "mine", "u(K)", "u(ωg)"):
        assert f">{label}<" in svg


def test_the_stair_goes_through_the_front_and_leaves_its_ends_open():
    stair = chart()["datasets"]["stair"]
    assert [(row["x"], row["y"]) for row in stair[1:-1]] == [(1.0, 5.0), (2.0, 3.0), (4.0, 1.0)]
    assert stair[0]["x"] == 1.0
    assert stair[0]["y"] > 5.0
    assert stair[-1]["y"] == 1.0
    assert stair[-1]["x"] > 4.0


def test_labels_stay_inside():
    rows = chart()["datasets"]
    assert rows["all"][0]["toLeft"] == "sixteen"
    assert rows["plan"][0]["toRight"] == "mine"


def test_without_a_front_there_is_no_stair():
    only = [plots.TradeMark("plan", 1.0, 1.0, "mine", "mine", "?")]
    assert plots.pareto(only, "x", "y", "Trade")["datasets"]["stair"] == []
