"""Baselines: proposed between events, frozen with everything that was chosen, retired, never changed."""

import numpy as np
import pytest
from laid import BEGIN, METROLOGIST, MONTH, SCATTER, TECHNICIAN, drawn, revision

from app.errors import Conflict, Forbidden, Invalid, NotFound
from app.services.drift import baselines, events, reading, series
from app.services.lookup import find_gyro


def _results(lab, count=None):
    with lab.read(TECHNICIAN) as work:
        found = series.load(work, find_gyro(work, "0417").id, "least-squares")["calibration"].tolist()
    return found[:count]


def _freeze(lab, parameters=("w0x",), **how):
    with lab.write(METROLOGIST) as work:
        return baselines.freeze(
            work, "0417", list(parameters), how.pop("calibrations", _results(lab, 10)), **how
        )


def test_the_stretch_proposed_has_no_event_within(lab, history):
    with lab.write(TECHNICIAN) as work:
        assert baselines.propose(work, "0417").calibrations == tuple(_results(lab))
        events.add(work, "repair", BEGIN + 4.5 * MONTH, gyro="0417")
        found = baselines.propose(work, "0417")
        assert found.calibrations == tuple(_results(lab, 5))
        events.add(work, "moved", BEGIN + 3.5 * MONTH, stand="S1")
        found = baselines.propose(work, "0417")
        assert found.calibrations == tuple(_results(lab)[5:])
        assert found.since == BEGIN + 5 * MONTH
        with pytest.raises(Conflict):
            baselines.propose(work, "0417", since=BEGIN + 9 * MONTH)


def test_what_was_chosen_and_what_followed_is_kept(lab, history):
    rules = {"individuals": ["nelson-1", "nelson-2"], "cusum": {"decision": 4.0}}
    with_moving_range = _freeze(
        lab, ("w0x", "wg"), estimator="moving-range", limits="three-sigma", rules=rules, reason=" accepted "
    )
    assert [item.parameter for item in with_moving_range] == ["w0x", "wg"]
    made = with_moving_range[0]
    values = np.array([value["w0x"] for value in drawn(12)[:10]])
    assert made.centre == pytest.approx(values.mean(), rel=1e-12)
    # NIST e-Handbook 6.3.2.2: the mean moving range over d2 = 1.128.
    assert made.scatter == pytest.approx(np.abs(np.diff(values)).mean() / 1.128, rel=1e-12)
    assert (made.estimator, made.limits, made.reason) == ("moving-range", "three-sigma", "accepted")
    assert made.rules == {
        "individuals": ["nelson-1", "nelson-2"],
        "cusum": {"allowance": 0.5, "decision": 4.0},
    }
    assert made.calibrations == tuple(_results(lab, 10))
    assert made.sessions == tuple(history[:10])
    assert (made.valid_from, made.frozen_by) == (BEGIN, "sokolov")


def test_scatter_and_noise_are_told_apart(lab, history):
    (made,) = _freeze(lab)
    assert made.u_typical == pytest.approx(0.003, rel=1e-9)
    # τ of ten values of standard deviation 0.02: within a factor of two with more than 99.9 %.
    assert SCATTER / 2 < made.scatter < 2 * SCATTER


def test_the_chart_has_each_points_limits_and_a_later_baseline_takes_over(lab, history, follow_jobs):
    (first,) = _freeze(lab)
    (second,) = _freeze(lab, calibrations=_results(lab)[5:], valid_from=BEGIN + 5 * MONTH)
    follow_jobs()
    with lab.read(TECHNICIAN) as work:
        drift = reading.gyro_drift(work, "0417", parameters=["w0x"])
    centres = [point.charts["individuals_centre"] for point in drift.parameters[0].points]
    assert centres == [first.centre] * 5 + [second.centre] * 7
    assert drift.parameters[0].study["charts"]["baseline"] == second.id
    assert {item.id for item in drift.baselines} == {first.id, second.id}


def test_retired_it_judges_no_more_and_stays_to_be_seen(lab, history, follow_jobs):
    (made,) = _freeze(lab)
    with lab.write(METROLOGIST) as work:
        gone = baselines.retire(work, made.id)
        assert gone.retired_by == "sokolov"
        assert baselines.of_gyro(work, "0417") == ()
        assert baselines.of_gyro(work, "0417", retired=True) == (gone,)
        with pytest.raises(Conflict):
            baselines.retire(work, made.id)
        with pytest.raises(NotFound):
            baselines.retire(work, 99)
    follow_jobs()
    with lab.read(TECHNICIAN) as work:
        assert reading.gyro_drift(work, "0417").document["parameters"]["w0x"]["status"] == "no-baseline"


def test_a_correction_leaves_the_baseline_and_says_so(lab, history, follow_jobs):
    (made,) = _freeze(lab)
    with lab.write(TECHNICIAN) as work:
        revision(work, history[2], drawn(1, 9)[0], input_hash="corrected")
    follow_jobs()
    with lab.read(TECHNICIAN) as work:
        (kept,) = baselines.of_gyro(work, "0417")
        study = reading.gyro_drift(work, "0417").document["parameters"]["w0x"]
    assert kept == made
    assert study["charts"]["replaced"] == [made.calibrations[2]]


@pytest.mark.parametrize(
    ("how", "column"),
    [
        ({"parameters": ["w0z"]}, "parameters"),
        ({"parameters": ["w0x", "w0x"]}, "parameters"),
        ({"parameters": []}, "parameters"),
        ({"estimator": "median"}, "estimator"),
        ({"limits": "two-sigma"}, "limits"),
        ({"rules": {"zone": []}}, "rules"),
        ({"rules": {"individuals": ["nelson-9"]}}, "rules"),
        ({"rules": {"individuals": "nelson-1"}}, "rules"),
        ({"rules": {"ewma": {"weight": 1.5}}}, "rules"),
        ({"rules": {"ewma": {"width": True}}}, "rules"),
        ({"rules": {"cusum": 5}}, "rules"),
        ({"calibrations": [1, 2, 3, 4]}, "calibrations"),
        ({"calibrations": [1, 2, 3, 4, 999]}, "calibrations"),
        ({"reason": "x" * 4001}, "reason"),
    ],
    ids=lambda item: item if isinstance(item, str) else next(iter(item)),
)
def test_what_cannot_be_frozen(lab, history, how, column):
    with pytest.raises(Invalid) as refused:
        _freeze(lab, **({"parameters": ("w0x",)} | how))
    assert refused.value.problems[0].column == column


def test_a_technician_freezes_and_retires_nothing(lab, history):
    with lab.write(TECHNICIAN) as work:
        with pytest.raises(Forbidden):
            baselines.freeze(work, "0417", ["w0x"], _results(lab, 10))
        with pytest.raises(Forbidden):
            baselines.retire(work, 1)
