"""Coverage intervals from any number of draws in bounded memory: a histogram, and running moments.

`Histogram` counts draws in bins that are fixed by the first block. With c its median and s half the
distance between its 15.9 % and 84.1 % quantiles, the bins are equally wide in asinh((x − c)/s): about
s/2048 wide in the middle, in proportion to the distance far out, up to 11,000 s; what lies
beyond falls into the two end bins. The smallest and the largest draw are kept. So the distribution
function is exact at every edge, and a quantile is wrong by less than the width of its bin, which
`Histogram.resolution` tells; as it is interpolated within the bin, by far less where the density is smooth.

Coverage intervals, JCGM 101:2008, 7.7 (and 5.3, 7.6):

- probabilistically symmetric: from the (1 − p)/2 to the (1 + p)/2 quantile;
- shortest: the least q(α + p) − q(α) over all α, tried at every edge of a bin as lower end and as upper end.

`Moments` merges means and co-moments block by block (Chan, Golub & LeVeque, Algorithms for computing
the sample variance, Amer. Statist. 37, 1983, 242-247), which does not cancel.
"""

from typing import Final

import numpy as np

from solver.records import Array

PER_SPREAD: Final = 2048
"""Bins per s in the middle."""
_REACH: Final = 10.0
"""asinh of the outermost edge."""
_HALF: Final = int(_REACH * PER_SPREAD)
_QUARTILES: Final = (0.15865525393145707, 0.5, 0.8413447460685429)


class Histogram:
    """Distribution functions of p outputs.

    Parameters
    ----------
    first : (p, m) array
        The first block, which fixes the bins; it is not counted by this.
    """

    def __init__(self, first: Array) -> None:
        low, middle, high = np.quantile(first, _QUARTILES, axis=1)
        spread = (high - low) / 2
        # A distribution that is mostly one value still has a width; a constant has any.
        for other in (np.ptp(first, axis=1), np.abs(middle), np.ones(len(first))):
            spread = np.where(spread > 0, spread, other)
        self._middle, self._spread = middle[:, None], spread[:, None]
        self._counts = np.zeros((len(first), 2 * _HALF), np.int64)
        self._least, self._most = np.full(len(first), np.inf), np.full(len(first), -np.inf)

    @property
    def count(self) -> int:
        """Number of draws counted."""
        return int(self._counts[0].sum())

    def add(self, values: Array) -> None:
        """Count draws, (p, m)."""
        place = (values - self._middle) / self._spread
        np.arcsinh(place, out=place)
        place *= PER_SPREAD
        place += _HALF
        np.clip(place, 0, 2 * _HALF - 1, out=place)
        bins = place.astype(np.intp)
        for row, here in enumerate(bins):
            self._counts[row] += np.bincount(here, minlength=2 * _HALF)
        np.minimum(self._least, values.min(axis=1), out=self._least)
        np.maximum(self._most, values.max(axis=1), out=self._most)

    def quantiles(self, probabilities: Array) -> Array:
        """Quantiles of every output, (p, k), for `probabilities` (k,)."""
        return np.stack(
            [np.interp(probabilities, *self._distribution(row)) for row in range(len(self._counts))]
        )

    def symmetric(self, level: float) -> Array:
        """Probabilistically symmetric coverage intervals, (p, 2)."""
        return self.quantiles(np.array([1 - level, 1 + level]) / 2)

    def shortest(self, level: float) -> Array:
        """Shortest coverage intervals, (p, 2)."""
        return np.stack([self._shortest(row, level) for row in range(len(self._counts))])

    def densities(self, values: Array) -> Array:
        """Probability density at values (p, k), taken over 1 % of the probability around each, (p, k)."""
        found = np.empty_like(values)
        for row, at in enumerate(values):
            probability, edges = self._distribution(row)
            middle = np.interp(at, edges, probability)
            reach = np.minimum(0.01, 0.2 * np.minimum(middle, 1 - middle)) + 1.0 / probability.size
            ends = np.clip(np.stack((middle - reach, middle + reach)), 0.0, 1.0)
            low, high = np.interp(ends, probability, edges)
            with np.errstate(divide="ignore"):
                found[row] = (ends[1] - ends[0]) / (high - low)
        return found

    def resolution(self, values: Array) -> Array:
        """Width of the bins that hold values (p, k), (p, k): what quantiles are wrong by at most."""
        found = np.empty_like(values)
        for row, at in enumerate(values):
            _, edges = self._distribution(row)
            right = np.clip(np.searchsorted(edges, at), 1, len(edges) - 1)
            found[row] = edges[right] - edges[right - 1]
        return found

    def _distribution(self, row: int) -> tuple[Array, Array]:
        """Distribution function of one output and the edges where it takes these values, without empty ends."""
        counts = self._counts[row]
        used = np.flatnonzero(counts)
        first, last = int(used[0]), int(used[-1])
        steps = (np.arange(first, last + 2) - _HALF) / PER_SPREAD
        edges: Array = self._middle[row] + self._spread[row] * np.sinh(steps)
        edges[0], edges[-1] = self._least[row], self._most[row]
        np.clip(edges, self._least[row], self._most[row], out=edges)  # rounding at a bin's edge
        total = np.concatenate(([0], np.cumsum(counts[first : last + 1])))
        return total / total[-1], edges

    def _shortest(self, row: int, level: float) -> Array:
        probability, edges = self._distribution(row)
        lower = edges[probability <= 1 - level]
        upper = np.interp(probability[: len(lower)] + level, probability, edges)
        further = edges[probability >= level]
        nearer = np.interp(probability[-len(further) :] - level, probability, edges)
        low, high = np.concatenate((lower, nearer)), np.concatenate((upper, further))
        best = int(np.argmin(high - low))
        return np.array([low[best], high[best]])


class Moments:
    """Running mean and covariance of p outputs."""

    def __init__(self, outputs: int) -> None:
        self.count = 0
        self.mean = np.zeros(outputs)
        self._products = np.zeros((outputs, outputs))

    def add(self, values: Array) -> None:
        """Take in draws, (p, m)."""
        count = values.shape[1]
        mean = values.mean(axis=1)
        rest = values - mean[:, None]
        step, total = mean - self.mean, self.count + count
        # Not by matrix multiplication, whose threads may sum in another order.
        self._products += np.einsum("im,jm->ij", rest, rest)
        self._products += np.outer(step, step) * (self.count * count / total)
        self.mean += step * (count / total)
        self.count = total

    @property
    def covariance(self) -> Array:
        """Sample covariance, (p, p); NaN before the second draw."""
        if self.count < 2:
            return np.full_like(self._products, np.nan)
        return self._products / (self.count - 1)
