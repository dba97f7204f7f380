from dataclasses import replace

import numpy as np
import pytest

from solver.propagation.comparison import compare
from solver.propagation.monte_carlo import run

U = np.array([2.0, 0.3])
SPREAD = np.array([1.959964, 1.959964]) * U
NAMES = ("first", "second")


@pytest.fixture(scope="module")
def found():
    return run(lambda rng, count: rng.standard_normal((count, 2)) * U, trials=1_000_000, seed=11)


def test_normal_outputs_agree(found):
    judged = compare(found, np.zeros(2), U, SPREAD, names=NAMES)
    assert judged.verdict == "agree"
    assert judged.within.all()
    assert not judged.open.any()
    np.testing.assert_allclose(judged.tolerance, [0.05, 0.005])
    assert judged.message.code == "first-order-confirmed"
    assert "agree" in judged.message.text
    assert "95 %" in judged.message.text


def test_a_shifted_output_is_named(found):
    judged = compare(found, np.array([0.0, 0.1]), U, SPREAD, names=NAMES)
    assert judged.verdict == "disagree"
    np.testing.assert_array_equal(judged.within, [True, False])
    np.testing.assert_allclose([judged.low[1], judged.high[1]], 0.1, atol=0.005)
    assert judged.message.code == "first-order-refuted"
    assert "second" in judged.message.text
    assert "first," not in judged.message.text
    assert f"{judged.message.values['worst']:.3g}" in judged.message.text


def test_too_few_draws_leave_it_open():
    few = run(lambda rng, count: rng.standard_normal((count, 2)) * U, trials=2_000, seed=11)
    judged = compare(few, np.zeros(2), U, SPREAD, digits=3, names=NAMES)
    assert judged.verdict == "open"
    assert judged.open.all()
    assert "2000 draws" in judged.message.text


def test_just_beyond_the_tolerance_is_open_and_surely_beyond_is_not(found):
    """An end moved by δ + 1 standard error may be sampling; by δ + 4 it is not."""
    error = found.errors[0, 1]
    for beyond, verdict in ((1.0, "open"), (4.0, "disagree")):
        moved = replace(
            found, symmetric=np.array([[-SPREAD[0], SPREAD[0] + 0.05 + beyond * error], [-0.588, 0.588]])
        )
        assert compare(moved, np.zeros(2), U, SPREAD, names=NAMES).verdict == verdict


def test_digits_are_counted_in_the_unit(found):
    """u = 0.3 of the second is 1.08e3 in thousandths of 0.2777…: 11·10², δ = 50 thousandths of it."""
    unit = np.array([1.0, 0.3 / 1080])
    judged = compare(found, np.zeros(2), U, SPREAD, names=NAMES, unit=unit)
    assert judged.tolerance[1] == pytest.approx(50 * 0.3 / 1080)


def test_fewer_digits_allow_more(found):
    moved = np.array([0.0, 0.03])
    assert compare(found, moved, U, SPREAD, names=NAMES).verdict == "disagree"
    assert compare(found, moved, U, SPREAD, names=NAMES, digits=1).verdict == "agree"
