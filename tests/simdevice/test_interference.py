import math

import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.certificate import Position
from simdevice.interference import Interference, aliased

HERE, THERE = Position(0.0, 0.0), Position(0.0, 1.0)
T = np.arange(12000) / 200.0


def amplitude(values: np.ndarray, hz: float, t: np.ndarray = T) -> float:
    """Of a sine of that frequency, by least squares."""
    columns = np.column_stack([np.cos(2 * np.pi * hz * t), np.sin(2 * np.pi * hz * t)])
    return float(np.hypot(*np.linalg.lstsq(columns, values)[0]))


def test_mains_is_a_sine_at_50_hz_in_both_channels() -> None:
    jx, jy = Interference(mains=2e-8).currents(T, 1, HERE)
    assert jx.tobytes() == jy.tobytes()
    power = np.abs(np.fft.rfft(jx)) * 2 / len(T)
    # 50 Hz is a whole number of periods in 60 s: all of it is in one bin, the others hold roundings.
    assert np.argmax(power) / 60.0 == 50.0
    assert power.max() == pytest.approx(2e-8, rel=1e-9)
    assert np.sort(power)[-2] < 1e-9 * 2e-8


def test_phases_differ_from_record_to_record() -> None:
    interference = Interference(mains=1.0, ripple=1.0)
    firsts = {
        float(interference.currents(T[:1], *which)[axis, 0])
        for which in ((1, HERE), (1, THERE), (1, Position(0.0, 0.0, 1)), (2, HERE))
        for axis in range(2)
    }
    assert len(firsts) == 8
    # The phase of the mains is no business of the ripple's.
    both, mains, ripple = (
        item.currents(T[:5], 1, HERE)
        for item in (interference, Interference(mains=1.0), Interference(ripple=1.0))
    )
    np.testing.assert_allclose(both - mains, ripple, rtol=0, atol=1e-15)  # roundings of numbers up to 2


def test_phases_are_spread_over_the_turn() -> None:
    phases = np.array([
        np.arctan2(*Interference(ripple=1.0).currents(np.zeros(1), 1, Position(0.0, 0.0, repeat))[::-1, 0])
        for repeat in range(400)
    ])  # fmt: skip
    # Means of cos, sin, cos 2φ, sin 2φ of uniform phases have deviation 1/√800; four of them.
    for angle in (phases, 2 * phases):
        assert abs(np.cos(angle).mean()) < 4 / math.sqrt(800)
        assert abs(np.sin(angle).mean()) < 4 / math.sqrt(800)


def test_ripple_turns_with_the_rotor_and_shows_at_its_alias() -> None:
    interference = Interference(ripple=5e-8, spin=1570.0)
    jx, jy = interference.currents(T, 1, HERE)
    # 1570 rad/s is 249.873 Hz: 200 less in 200 samples per second.
    seen = 1570.0 / (2 * np.pi) - 200.0
    assert aliased(interference.ripple_frequency, 200.0) == pytest.approx(seen, rel=1e-13)
    power = np.abs(np.fft.rfft(jx))
    assert np.argmax(power) / 60.0 == pytest.approx(seen, abs=0.5 / 60.0)  # half a bin
    for current in (jx, jy):
        assert amplitude(current, seen) == pytest.approx(5e-8, rel=1e-9)
    assert np.hypot(jx, jy) == pytest.approx(5e-8, rel=1e-14)
    # Sampled fast enough it is at its own frequency, y a quarter turn behind x.
    fast = np.arange(2000) / 2000.0
    x, _ = interference.currents(fast, 1, HERE)
    assert amplitude(x, 1570.0 / (2 * np.pi), fast) == pytest.approx(5e-8, rel=1e-9)
    later = interference.currents(fast + np.pi / 2 / 1570.0, 1, HERE)[1]
    np.testing.assert_allclose(later, x, rtol=0, atol=1e-8 * 1e-12)  # phases of 1e3 rad, in roundings


@pytest.mark.parametrize(
    ("frequency", "rate", "seen"),
    [(50.0, 200.0, 50.0), (150.0, 200.0, 50.0), (249.9, 200.0, 49.9), (100.0, 200.0, 100.0)],
)
def test_aliases(frequency: float, rate: float, seen: float) -> None:
    assert aliased(frequency, rate) == pytest.approx(seen, rel=1e-12)


def test_jitter_moves_the_samples_by_its_deviation() -> None:
    moved = Interference(jitter=1e-4).instants(T, 1, HERE) - T
    low, high = chi2.ppf([1e-4, 1 - 1e-4], len(T))
    assert low < np.sum((moved / 1e-4) ** 2) < high
    assert Interference().instants(T, 1, HERE) is T
    whole = Interference(jitter=1e-4).instants(T, 1, HERE)
    assert Interference(jitter=1e-4).instants(T[:50], 1, HERE).tobytes() == whole[:50].tobytes()


def test_quiet_is_silent() -> None:
    assert Interference().quiet
    for loud in (Interference(mains=1.0), Interference(ripple=1.0), Interference(jitter=1.0)):
        assert not loud.quiet


@pytest.mark.parametrize("name", ["mains", "mains_frequency", "ripple", "spin", "jitter"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_what_cannot_be_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name.replace("_", " ")):
        Interference(**{name: value})
