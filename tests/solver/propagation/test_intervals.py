import numpy as np
import pytest
from scipy import optimize, stats

from solver.propagation.intervals import PER_SPREAD, Histogram, Moments

LEVELS = (0.5, 0.6827, 0.95, 0.99)


def filled(values):
    """A histogram of (p, m) values taken in by blocks of 10,000."""
    histogram = Histogram(values[:, :10_000])
    for first in range(0, values.shape[1], 10_000):
        histogram.add(values[:, first : first + 10_000])
    return histogram


@pytest.fixture
def draws(rng):
    """Normal, exponential, t with heavy tails, far from zero and narrow, uniform, (5, 50,000)."""
    m = 50_000
    return np.stack((
        rng.standard_normal(m), rng.standard_exponential(m), rng.standard_t(1.5, m),
        1e6 + 1e-3 * rng.standard_normal(m), rng.random(m),
    ))  # fmt: skip


def test_quantiles_are_exact_within_the_stated_resolution(draws):
    histogram = filled(draws)
    probabilities = np.linspace(0.001, 0.999, 500)
    found = histogram.quantiles(probabilities)
    # the distribution function is exact at every edge: the exact quantile lies in the same bin, or
    # between the bins that hold the neighbouring draws
    exact = np.quantile(draws, probabilities, axis=1, method="inverted_cdf").T
    exact_next = np.quantile(draws, probabilities + 1 / draws.shape[1], axis=1, method="inverted_cdf").T
    width = histogram.resolution(found)
    assert (found >= exact - width).all()
    assert (found <= exact_next + width).all()


def test_quantiles_of_smooth_densities_are_far_better_than_a_bin(draws):
    found = filled(draws).quantiles(np.array([0.025, 0.5, 0.975]))
    exact = np.quantile(draws, [0.025, 0.5, 0.975], axis=1).T
    spread = np.diff(np.quantile(draws, [0.16, 0.84], axis=1), axis=0).T / 2
    # a bin is s/2048·√(1 + 4) at 2 s; draws at random in it: a tenth of the sampling error s·√(pq/m)/f ≈ 0.012 s
    assert (np.abs(found - exact) < 0.0012 * spread).all()


def test_bins_are_as_narrow_as_stated(rng):
    values = rng.standard_normal((1, 100_000))
    histogram = filled(values)
    at = np.array([[0.0, 2.0]])
    # cosh(asinh(x))/2048, and s of the first block is 1 within 3 %
    np.testing.assert_allclose(
        histogram.resolution(at), [[1 / PER_SPREAD, np.sqrt(5) / PER_SPREAD]], rtol=0.03
    )


def test_extremes_are_kept(rng):
    values = rng.standard_normal((1, 30_000))
    values[0, 25_000:25_002] = -1e9, 1e12  # far beyond the outermost edge
    histogram = filled(values)
    np.testing.assert_array_equal(histogram.quantiles(np.array([0.0, 1.0])), [[-1e9, 1e12]])
    assert histogram.count == 30_000
    assert histogram.symmetric(0.95)[0] == pytest.approx([-1.96, 1.96], abs=0.06)  # 4·√(pq/m)/f, sampling


@pytest.mark.parametrize("level", LEVELS)
def test_symmetric_interval_of_known_quantiles(level):
    """Draws that are the quantiles themselves: no sampling error."""
    probability = (np.arange(100_000) + 0.5) / 100_000
    for distribution in (stats.norm(), stats.expon(), stats.chi2(3)):
        values = distribution.ppf(np.random.default_rng(1).permutation(probability))[None, :]
        found = filled(values).symmetric(level)[0]
        expected = distribution.interval(level)
        # half a step of the probability, and a bin
        tolerance = 1e-5 / distribution.pdf(expected) + 3e-3 * distribution.std()
        assert (np.abs(found - expected) < tolerance).all()


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize(
    "distribution", [stats.expon(), stats.chi2(3), stats.chi2(8)], ids=("exponential", "chi2-3", "chi2-8")
)
def test_shortest_interval_of_skewed_distributions(distribution, level):
    """Its ends have equal density (5.3.4, note), or it begins at the mode at the edge."""
    probability = (np.arange(200_000) + 0.5) / 200_000
    values = distribution.ppf(np.random.default_rng(1).permutation(probability))[None, :]
    low, high = filled(values).shortest(level)[0]

    def length(alpha):
        return distribution.ppf(alpha + level) - distribution.ppf(alpha)

    best = optimize.minimize_scalar(length, bounds=(0, 1 - level), method="bounded", options={"xatol": 1e-9})
    least = min(best.fun, length(0.0))
    assert distribution.cdf(high) - distribution.cdf(low) == pytest.approx(
        level, abs=2e-3
    )  # two bins' probability
    assert high - low == pytest.approx(least, abs=5e-3 * distribution.std())  # two bins
    assert high - low < np.diff(distribution.interval(level))[0]


def test_a_constant_output_has_an_interval_of_no_length():
    values = np.full((2, 5_000), 3.0)
    values[1] = 0.0
    histogram = filled(values)
    np.testing.assert_array_equal(histogram.symmetric(0.95), [[3, 3], [0, 0]])
    np.testing.assert_array_equal(histogram.shortest(0.95), [[3, 3], [0, 0]])


def test_density_at_the_ends(rng):
    values = rng.standard_normal((1, 400_000))
    histogram = filled(values)
    ends = histogram.symmetric(0.95)
    # averaged over ±0.5 % of probability, which holds 4000 draws: 1.6 %; and the curvature over it
    np.testing.assert_allclose(histogram.densities(ends)[0], stats.norm.pdf(1.96), rtol=0.06)


def test_moments_by_blocks_are_those_of_all_at_once(draws):
    moments = Moments(len(draws))
    for first in range(0, draws.shape[1], 7_001):
        moments.add(draws[:, first : first + 7_001])
    np.testing.assert_allclose(moments.mean, draws.mean(axis=1), rtol=1e-12)  # rounding
    scale = np.sqrt(np.outer(*2 * [np.var(draws, axis=1)]))
    # the fourth output is 1e9 of its standard deviation away from zero, where ε/1e-9 is lost by any formula
    assert (np.abs(moments.covariance - np.cov(draws)) < 1e-6 * scale).all()
    assert moments.count == draws.shape[1]


def test_moments_far_from_zero_do_not_cancel(rng):
    values = rng.standard_normal((1, 100_000))
    moments = Moments(1)
    for part in np.split(values + 1e8, 100, axis=1):
        moments.add(part)
    # values themselves are rounded by 1e8·ε ≈ 1e-8; the textbook formula would lose everything (1e16·ε ≈ 2)
    assert moments.covariance[0, 0] == pytest.approx(np.var(values, ddof=1), rel=1e-6)


def test_no_covariance_of_one_draw():
    moments = Moments(2)
    moments.add(np.ones((2, 1)))
    assert np.isnan(moments.covariance).all()
