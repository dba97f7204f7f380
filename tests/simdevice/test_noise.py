import math

import pytest

from simdevice.noise import RateNoise


def test_sample_deviation_makes_the_integral_walk_by_n_root_t() -> None:
    # n samples of deviation s, each lasting 1/f, sum to an angle of deviation s·√n/f; after
    # t = n/f seconds that must be N·√t.
    noise = RateNoise(angle_random_walk=3e-7)
    f, n = 200.0, 12000
    assert noise.sample_std(f) * math.sqrt(n) / f == pytest.approx(3e-7 * math.sqrt(n / f), rel=1e-14)


@pytest.mark.parametrize("walk", [-1e-9, math.nan, math.inf])
def test_an_impossible_coefficient_is_refused(walk: float) -> None:
    with pytest.raises(ValueError, match="angle random walk"):
        RateNoise(angle_random_walk=walk)
