"""The settling currents: what scales the axis, what is joined, and what a page is told later."""

import json
import math
import re

import altair
import pytest
import vl_convert

from app import plots
from app.plots import theme
from app.plots.live import SHORTEST_S, LivePoint, live, news


def turned(seconds=100, settled_at=40.0):
    """A current that comes from 2 above and settles to 4.5 with a time constant of 6 s."""
    return [LivePoint(float(t), 4.5 + 2.0 * math.exp(-t / 6.0), t >= settled_at) for t in range(seconds)]


def drawn(spec):
    return vl_convert.vegalite_to_svg({**plots.printed(spec), "width": 500})


def lines(svg):
    """The pieces of the x trace, by their stroke in the light theme."""
    colour = theme.COLOURS["series-1"][0]
    return re.findall(rf'<path d="([^"]*)" stroke="{colour}" stroke-width="1.5"/>', svg)


@pytest.mark.parametrize("channel", ["x", "y"])
@pytest.mark.parametrize("points", [[], turned(1), turned()], ids=["none", "one", "many"])
def test_the_chart_keeps_to_vega_lites_schema_and_can_be_drawn(channel, points):
    spec = live(points, channel, "Current x")
    assert json.loads(json.dumps(spec)) == spec
    assert spec["description"] == "Current x"
    altair.LayerChart.from_dict(spec, validate=True)
    assert "<svg" in drawn(spec)


def test_the_axis_shows_what_has_settled_and_not_the_transient():
    found = news(turned())["params"]
    # From 40 s on 2·exp(−t/6) is below 2·exp(−40/6) = 0.0026; the margin is a quarter of that span.
    assert 4.499 < found["low"] < 4.5 < found["high"] < 4.5026 + 0.0007


def test_before_it_settles_the_axis_shows_the_last_readings():
    found = news(turned(8))["params"]
    assert found["low"] < 4.5 + 2.0 * math.exp(-7 / 6.0)
    assert found["high"] > 6.5


def test_the_first_settled_reading_is_marked():
    assert news(turned())["datasets"]["settled"] == [{"t": 40.0}]
    assert news(turned(30))["datasets"]["settled"] == []


def test_readings_far_apart_are_not_joined():
    points = [LivePoint(t, 1.0 + 0.001 * t, True) for t in (0.0, 1.0, 2.0, 9.0, 10.0, 11.0)]
    rows = news(points)["datasets"]["trace"]
    assert [row["piece"] for row in rows] == [0, 0, 0, 1, 1, 1]
    assert [line.count("L") for line in lines(drawn(live(points, "x", "")))] == [2, 2]
    joined = [LivePoint(float(second), item.value, True) for second, item in enumerate(points)]
    assert [line.count("L") for line in lines(drawn(live(joined, "x", "")))] == [5]


def test_a_minute_fits_before_it_is_over():
    assert (news(turned(5))["params"]["first"], news(turned(5))["params"]["last"]) == (0.0, SHORTEST_S)
    assert news(turned(100))["params"]["last"] == 99.0


def test_without_readings_the_axis_has_no_numbers():
    labels = re.compile(r">(\d+\.\d+|[01])</text>")
    assert labels.findall(drawn(live([], "x", ""))) == []
    assert labels.findall(drawn(live(turned(), "x", ""))) != []


def test_only_the_lower_chart_names_the_seconds():
    assert ">40</text>" in drawn(live(turned(), "y", ""))
    assert ">40</text>" not in drawn(live(turned(), "x", ""))


def test_what_is_told_later_is_what_the_chart_would_have_been():
    """A drawing that is told the news shows the same as one made anew."""
    told, spec = news(turned()), live(turned(3), "x", "Current x")
    spec["datasets"] |= told["datasets"]
    for item in spec["params"]:
        item["value"] = told["params"].get(item["name"], item["value"])
    numbered = re.compile(r"clip\d+")  # counted through the whole process
    assert numbered.sub("", drawn(spec)) == numbered.sub("", drawn(live(turned(), "x", "Current x")))
