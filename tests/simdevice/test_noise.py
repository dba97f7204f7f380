import math
from dataclasses import fields

import numpy as np
import pytest
from scipy.stats import chi2

from simdevice.noise import RateNoise

COEFFICIENTS = [item.name for item in fields(RateNoise)]


def test_sample_deviation_makes_the_integral_walk_by_n_root_t() -> None:
    # n samples of deviation s, each lasting 1/f, sum to an angle of deviation s·√n/f; after
    # t = n/f seconds that must be N·√t.
    noise = RateNoise(angle_random_walk=3e-7)
    f, n = 200.0, 12000
    assert noise.sample_std(f) * math.sqrt(n) / f == pytest.approx(3e-7 * math.sqrt(n / f), rel=1e-14)


@pytest.mark.parametrize("name", COEFFICIENTS)
@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf])
def test_an_impossible_coefficient_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name.replace("_", " ")):
        RateNoise(**{name: value})


def test_nothing_is_noisy_unless_asked_for() -> None:
    assert [getattr(RateNoise(), name) for name in COEFFICIENTS] == [0.0] * len(COEFFICIENTS)
    assert not RateNoise(1.0, turn_on=1.0).wanders
    assert RateNoise(bias_instability=1e-12).wanders
    assert RateNoise(rate_random_walk=1e-12).wanders
    assert not RateNoise().turn_on_offsets(1, 0).any()


def test_turn_on_offsets_are_drawn_per_start() -> None:
    noise = RateNoise(turn_on=2e-7)
    offsets = np.array([noise.turn_on_offsets(1, start) for start in range(500)])
    assert offsets[3].tolist() == noise.turn_on_offsets(1, 3).tolist() != noise.turn_on_offsets(2, 3).tolist()
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 500)
    squares = np.sum((offsets / 2e-7) ** 2, axis=0)
    assert ((low < squares) & (squares < high)).all()
    # x and y are independent: a correlation of 500 pairs has deviation 1/√500; four of them.
    assert abs(np.corrcoef(offsets.T)[0, 1]) < 4 / math.sqrt(500)
