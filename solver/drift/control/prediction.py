"""Where the next value will be, when what it is judged by was itself estimated from few values.

A baseline of n values with the own uncertainty u_typ left V = τ² + u_typ² for the variance of a value, with ν degrees
of freedom. Seen from there the true one is ``ν·V/χ²_ν`` (JCGM 101, 6.4.9.2, argues so), but not below what is known:
τ_k² = max(0, ν·V/χ²_k − u_typ²) with the weights p_k of χ²_k. A statistic in control, that contains τ² `share` times
and beside it the variance `known`, is then outside ±d with the probability::

    P(d) = Σ_k p_k·2·Φ(−d/√(share·τ_k² + known))

With u_typ = known = 0 this is Student's distribution: a prediction interval, and its rate is exact. Known variances in
it make the rate smaller than stated, not larger: where they dominate, few values say little about τ².
The sum is Gauss and Legendre's over ln χ², up to where τ_k² gets 0; the rest is one term.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy import interpolate, special

from solver.records import Array

_NODES: Final = 64
_CUT: Final = 1e-10
"""Probability of a χ² outside the range of the sum, on each side."""
_GRID: Final = 65
"""Bounds are solved for at so many variances, and interpolated between them."""
_HALVINGS: Final = 48
_TINY: Final = 1e-300


@dataclass(frozen=True, slots=True)
class Prediction:
    """The τ² that a baseline leaves possible. Build it with `Prediction.of`.

    Attributes
    ----------
    variance : (k,) array
        τ_k².
    weight : (k,) array
        Their probabilities; they sum to 1.
    """

    variance: Array
    weight: Array

    @classmethod
    def of(cls, typical: float, dof: float, known: float) -> "Prediction":
        """From the variance V of a value of the baseline, its degrees of freedom ν and the part u_typ² known of it."""
        half = dof / 2.0
        least, most = (
            2.0 * float(inverse(half, _CUT)) for inverse in (special.gammaincinv, special.gammainccinv)
        )
        end = min(most, dof * typical / known) if known > 0.0 else most
        least = least if least < end else end / 2.0
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        span = (np.log(end) - np.log(least)) / 2.0
        # ln(χ²/ν), near 0 where there are many degrees of freedom; the density relative to that at 0 loses no digits.
        log = np.log(least / dof) + span * (nodes + 1.0)
        density = np.exp(half * (log - np.expm1(log)) + half * (np.log(half) - 1.0) - special.gammaln(half))
        variance = np.append(np.maximum(typical * np.exp(-log) - known, 0.0), 0.0)
        weight = np.append(span * weights * density, special.gammaincc(half, end / 2.0))
        used = weight > 0.0 if end < most else np.arange(_NODES + 1) < _NODES
        return cls(variance[used], weight[used] / weight[used].sum())

    def bound(self, width: float, share: ArrayLike, known: ArrayLike) -> Array:
        """Distance d from the centre with P(d) = 2·Φ(−width), (…).

        Parameters
        ----------
        width
            In standard deviations, 3 for 0.27 %.
        share, known : (…) array_like
            Of τ² and beside it, in the variance of each statistic.
        """
        parts = np.asarray(share, np.float64)
        # d² has the scale of the variance: only known/share matters.
        ratio = np.asarray(known, np.float64) / parts
        different = np.unique(ratio)
        if len(different) <= _GRID:
            return np.sqrt(parts) * self._solved(width, different)[np.searchsorted(different, ratio)]
        root = np.sqrt(different[[0, -1]])
        grid = np.square(np.linspace(root[0], root[1], _GRID))
        squared = interpolate.PchipInterpolator(np.sqrt(grid), np.square(self._solved(width, grid)))
        return np.sqrt(parts * squared(np.clip(np.sqrt(ratio), *root)))

    def _solved(self, width: float, ratio: Array) -> Array:
        """The distance for each ratio, (r,), by halving its logarithm."""
        sd = np.sqrt(self.variance + ratio[:, None])
        low, high = np.log(width * sd.min(axis=1)), np.log(width * sd.max(axis=1))
        aim = special.ndtr(-width)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            outside = special.ndtr(-np.exp(middle)[:, None] / sd) @ self.weight > aim
            low, high = np.where(outside, middle, low), np.where(outside, high, middle)
        return np.asarray(np.exp((low + high) / 2.0))

    def standardised(self, apart: Array, share: ArrayLike, known: ArrayLike) -> Array:
        """Standard normal z of what is `apart` from the centre, (n,): beyond ±w exactly outside ±bound(w)."""
        sd = np.sqrt(
            np.multiply.outer(np.broadcast_to(share, apart.shape), self.variance)
            + np.broadcast_to(known, apart.shape)[:, None]
        )
        tail = special.ndtr(-np.abs(apart)[:, None] / sd) @ self.weight
        # Beyond a probability of 1e-300, z = 37, nothing is told apart.
        return np.asarray(-np.sign(apart) * special.ndtri(np.maximum(tail, _TINY)))
