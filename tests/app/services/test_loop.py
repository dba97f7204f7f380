"""The loop as a service: what is asked, what is refused, and the documents made of the answer."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from app.errors import Invalid, NotFound
from app.services import access, gyros, loop
from app.services.lab import Lab
from app.services.loop_documents import COLUMNS, as_json, rows, verdict_message
from app.services.views import Nominal
from simdevice.dynamics import GVK_6, GVK_6_AS_PRINTED, LoopDynamics
from simdevice.responses import step_response


def test_the_paper_s_loop_is_stable_and_the_printed_one_is_not() -> None:
    found = loop.answer(GVK_6)
    assert found.stable
    assert found.duration == 0.1
    assert found.margins is not None
    printed = loop.answer(GVK_6_AS_PRINTED)
    assert not printed.stable
    assert printed.verdict == loop.Verdict("integral-time", 2e-3)
    assert printed.margins is None
    assert printed.settling is None
    assert "T1 is not longer than 2·T2 = 0.002 s" in verdict_message(printed).text


@pytest.mark.parametrize(
    ("given", "code", "says"),
    [
        ({"t2_s": 0.0}, "nutation", "The nutation at H/A = 2800 rad/s grows"),
        ({"k_u_a_per_v": 30.0}, "gain", "is stable below 1157 1/s"),
        ({"t1_s": math.inf, "t2_s": 0.0}, "nutation", "needs a T2 above 0.000357 s"),
        ({}, "stable", "within 2 % of it in 0.04 s"),
    ],
    ids=["no-lags", "gain", "proportional", "stable"],
)
def test_the_verdict_gives_its_reason(given: dict[str, float], code: str, says: str) -> None:
    found = loop.answer(loop.changed(GVK_6, given))
    assert found.verdict.code == code
    assert found.stable == (code == "stable")
    assert says in verdict_message(found).text


def test_a_type_gives_its_scale_factor(lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        gyros.set_limits(work, "bare", {"wg": (-1.0, 1.0)})
        gyros.set_nominals(work, "T", {"kx": Nominal(2062.0, 20.0, None), "ky": Nominal(2042.0, 20.0, None)})
    with lab.read(access.SYSTEM) as work:
        # 1 °/h/mA is π/180/3600·1000 rad/(s·A).
        expected = 2052.0 * math.pi / 180 / 3600 * 1000
        assert loop.usual(work, "T").torquer_scale == pytest.approx(expected, rel=1e-5)  # to six digits
        assert loop.usual(work, "T").integral_time == GVK_6.integral_time
        assert loop.usual(work, "bare") == GVK_6
        assert loop.usual(work, None) == GVK_6
        with pytest.raises(NotFound, match="no type none"):
            loop.usual(work, "none")


@pytest.mark.parametrize(
    ("given", "field", "says"),
    [
        ({"h_n_m_s": 0.0}, "h_n_m_s", "Give a value from 1e-08 to 1000."),
        ({"a_kg_m2": -1.0}, "a_kg_m2", "Give a value from 1e-11 to 10."),
        ({"t1_s": 0.0}, "t1_s", "or ∞ for a loop without integrator"),
        ({"t2_s": 1e-9}, "t2_s", "or 0 for a loop without lags"),
        ({"t2_s": math.inf}, "t2_s", "or 0 for a loop without lags"),
        ({"k_u_a_per_v": math.nan}, "k_u_a_per_v", "Give a value from 0.0001 to 100000."),
        ({"a_kg_m2": 1.0}, "a_kg_m2", "The nutation H/A would be 0.0014 rad/s"),
        ({"k_u_a_per_v": 9e4}, "k_alpha_v_per_rad", "The gain Kα·Ku·Km would be 5.4e+06 1/s"),
    ],
    ids=["momentum", "inertia", "t1", "t2-tiny", "t2-inf", "nan", "nutation", "gain"],
)
def test_what_no_loop_has_is_refused_at_its_field(given: dict[str, float], field: str, says: str) -> None:
    with pytest.raises(Invalid) as error:
        loop.changed(GVK_6, given)
    (found,) = error.value.problems
    assert found.column == field
    assert says in found.message.text


def test_everything_wrong_is_said_at_once() -> None:
    with pytest.raises(Invalid) as error:
        loop.changed(GVK_6, {"h_n_m_s": -1.0, "t1_s": -1.0})
    assert [item.column for item in error.value.problems] == ["h_n_m_s", "t1_s"]


@pytest.mark.parametrize("duration", [0.0, -1.0, 1e5, math.nan])
def test_a_length_that_makes_no_sense_is_refused(duration: float) -> None:
    with pytest.raises(Invalid) as error:
        loop.answer(GVK_6, duration)
    assert error.value.problems[0].column == "duration_s"


def test_any_loop_within_the_ranges_has_an_answer() -> None:
    rng = np.random.default_rng(4)
    codes = set()
    for _ in range(50):
        given = {
            name: float(np.exp(rng.uniform(*np.log(ends))))
            for name, ends in loop.RANGES.items()
            if rng.random() < 0.4
        }
        if rng.random() < 0.1:
            given["t1_s"] = math.inf
        if rng.random() < 0.1:
            given["t2_s"] = 0.0
        try:
            found = loop.answer(loop.changed(GVK_6, given))
        except Invalid:
            continue
        codes.add(found.verdict.code)
        json.dumps(as_json(found), allow_nan=False)
        drawn = loop.drawn_steps(found)
        assert len(drawn.t) <= 4000
        assert (found.margins is not None) == found.stable == all(pole.real < 0 for pole in found.poles)
    assert {"stable", "nutation", "integral-time", "gain"} <= codes


def test_a_chart_keeps_the_extremes_of_what_it_leaves_out() -> None:
    # 10 s of a nutation at 2800 rad/s: 71,000 samples at sixteen a period, drawn with a few hundred.
    found = loop.answer(replace(GVK_6, integral_time=3e-2), 10.0)
    drawn = loop.drawn_steps(found)
    fine = step_response(LoopDynamics(found.parameters), 10.0, 1e-4)
    assert len(drawn.t) < 4000
    # Other samples of the same curve: sixteen in a period miss a peak by 2 % of the nutation, 1e-3 of the whole.
    assert drawn.alpha.min() == pytest.approx(fine.alpha.min(), rel=1e-3)
    assert drawn.rate_x.max() == pytest.approx(fine.rate_x.max(), rel=1e-3)
    assert (np.diff(drawn.t) > 0).all()


def test_documents_hold_the_same_numbers_as_the_answer() -> None:
    found = loop.answer(GVK_6)
    document = as_json(found)
    assert document["parameters"] == {
        "h_n_m_s": 1.4e-3, "a_kg_m2": 5e-7, "k_alpha_v_per_rad": 6.0, "k_u_a_per_v": 3.0,
        "k_m_rad_per_s_per_a": 10.0, "t1_s": 1.5e-2, "t2_s": 1e-3,
    }  # fmt: skip
    assert document["gain_per_s"] == 180.0
    assert document["nutation_rad_per_s"] == pytest.approx(2800.0, rel=1e-15)
    worse = document["margins"]["worse"]
    assert worse["gain_db"] == pytest.approx(20 * math.log10(worse["gain_factor"]), rel=1e-12)
    assert worse["bandwidth_hz"] == pytest.approx(worse["bandwidth_rad_per_s"] / math.tau, rel=1e-12)
    assert worse["gain_factor"] == min(
        document["margins"][sign]["gain_factor"] for sign in ("positive", "negative")
    )
    assert document["step_response"]["measured_x_rad_per_s"] == found.steps.rate_x.tolist()
    assert document["step_response"]["t_s"][-1] == pytest.approx(0.1, rel=1e-12)
    omega = np.array(document["frequency_response"]["omega_rad_per_s"])
    assert (np.diff(omega) > 0).all()
    np.testing.assert_array_equal(omega, -omega[::-1])
    at = int(np.argmin(np.abs(omega - worse["gain_at_rad_per_s"])))
    # The margin's frequency is among those shown, and L is −1/factor there.
    assert document["frequency_response"]["loop_gain_db"][at] == pytest.approx(-worse["gain_db"], rel=1e-9)
    assert abs(document["frequency_response"]["loop_phase_deg"][at]) == pytest.approx(180.0, rel=1e-9)
    for table in COLUMNS:
        assert set(rows(found, table)[0]) == set(COLUMNS[table])


def test_a_loop_without_integrator_has_a_null_t1() -> None:
    document = as_json(loop.answer(loop.changed(GVK_6, {"t1_s": math.inf})))
    assert document["parameters"]["t1_s"] is None
    assert document["stable"]
    assert len(document["poles"]) == 4
