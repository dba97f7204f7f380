"""Charts of fleets and stands as documents and as drawn SVG."""

import json
import re
from datetime import UTC, datetime, timedelta

import altair
import pytest
import vl_convert

from app import plots

BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
PERIOD = (BEGIN, BEGIN + timedelta(days=300))


def distribution(values=(1.0, 1.001, 1.5, 3.0)):
    states = ["within", "within", "conditional", "beyond"]
    points = [
        plots.DistributionPoint(value, state, f"gyro {number}", f"g{number}" if state == "beyond" else "",
                                f"/gyros/{number}")
        for number, (value, state) in enumerate(zip(values, states, strict=False))
    ]  # fmt: skip
    limits = [plots.DriftLimit(2.5, "above", ""), plots.DriftLimit(-90.0, "below", "")]
    return plots.distribution(points, limits, (1.0, 1.25, 1.875), "Distribution")


def correlations():
    marks = [
        plots.CorrelationMark("ωg", "Kx", 0.9, True, "ωg with Kx", "#a"),
        plots.CorrelationMark("ωк", "ωg", -0.4, False, "ωк with ωg", "#b"),
    ]
    return plots.correlation_map(marks, ["Kx", "ωg", "ωк"], "Correlation")


def common():
    means = [
        plots.CommonPoint(
            BEGIN + timedelta(days=30 * n), value, 0.9, abs(value) > 0.9, f"mean {n}", f"?n={n}"
        )
        for n, value in enumerate((0.1, -0.3, 2.0))
    ]
    return plots.common_mode(
        means, [(BEGIN, 0.5)], [plots.DriftEvent(BEGIN, "C-17", solid=True)], PERIOD, "Common mode",
        changes=[plots.DriftChange(BEGIN + timedelta(days=40), BEGIN + timedelta(days=60), "+58″")],
    )  # fmt: skip


def drawn(spec):
    return vl_convert.vegalite_to_svg({**plots.printed(spec), "width": 620})


@pytest.mark.parametrize("chart", [distribution, correlations, common])
def test_it_keeps_to_vega_lites_schema(chart):
    spec = chart()
    assert json.loads(json.dumps(spec)) == spec
    altair.LayerChart.from_dict(spec, validate=True)


def test_every_gyro_is_a_dot_with_its_name_and_its_link():
    svg = drawn(distribution())
    assert set(re.findall(r'aria-label="(gyro \d)"', svg)) == {"gyro 0", "gyro 1", "gyro 2", "gyro 3"}
    assert all(f"/gyros/{number}" in svg for number in range(4))
    assert ">g3<" in svg


def test_dots_that_would_lie_on_each_other_are_stacked():
    rows = distribution()["datasets"]["within"]
    assert [row["lane"] for row in rows] == [0, 1]


def test_a_far_limit_is_not_drawn():
    spec = distribution()
    assert [row["v"] for row in spec["datasets"]["limits"]] == [2.5]
    assert next(item["value"] for item in spec["params"] if item["name"] == "low") > 0


def test_one_gyro_alone_is_drawn():
    assert "gyro 0" in drawn(distribution((1.0,)))


def test_every_pair_is_a_mark_with_its_name():
    svg = drawn(correlations())
    assert set(re.findall(r'aria-label="(ω\w with [Kω]\w)"', svg)) == {"ωg with Kx", "ωк with ωg"}


def test_means_events_and_changes_are_drawn():
    svg = drawn(common())
    assert set(re.findall(r'aria-label="(mean \d)"', svg)) == {"mean 0", "mean 1", "mean 2"}
    assert ">C-17<" in svg
    assert ">+58″<" in svg
    assert [row["beyond"] for row in common()["datasets"]["means"]] == [False, False, True]
