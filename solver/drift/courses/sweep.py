"""A change of level or of slope, or a wild value, tried at every date at once.

All dates at once
    Beside a fitted course with orthonormal weighted columns Q and weighted remainder r of ν degrees of freedom, a
    change at date k adds one column a_k: 1 from value k on (a step), x − x_{k−1} from there on (a bend), or value
    k alone (a wild value). What it takes from the sum of squares is ``(a_k·r)²/‖a_k − QQᵀa_k‖²``, and all three
    products are sums from k to the end, so that n dates cost n operations. F = t² of the added column has 1 and ν
    − 1 degrees of freedom.

How often the largest of them is large by chance
    With z_k the added column without what Q has of it, of unit length, ``F_k`` exceeds a bound where the angle of
    r and z_k has ``cos² > c² = F/(F + ν − 1)``, and without a change the direction of r is uniform on the sphere
    of ν dimensions. So each single event has the probability of the F test, and two neighbouring ones, φ apart,
    add

        P(F_{k+1} > F, F_k ≤ F) = (2/π)·∫₀^{φ/2} (1 − c²/cos²θ)^{(ν−2)/2} dθ,        cos φ = |z_k·z_{k+1}|,

    (the plane of the two sees a radius R with P(R > ρ) = (1 − ρ²)^{(ν−2)/2} and a uniform direction), their sum
    bounds the probability that the largest exceeds it from above: K. J. Worsley, Biometrika 69 (1982) 297-302 and
    Technometrics 25 (1983) 35-42; in the limit of a dense path it is H. Hotelling's tube, Amer. J. Math. 61
    (1939) 440-460. It needs no table, and holds for any times, weights, breaks and changes found before.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy import special

from solver.drift.courses.regression import Indices, Series, Structure, fit
from solver.records import Array

Kind = Literal["steps", "bends", "outliers"]
SHORTEST: Final[Mapping[Kind, int]] = {"steps": 3, "bends": 6}
"""Values on either side of a change."""
_ROUNDING: Final = 1e-4
"""Weighted mean square below which residuals are rounding alone, whose pattern says nothing."""
_VISIBLE: Final = 1e-9
_ANGLES: Final = 256


@dataclass(frozen=True, slots=True)
class Sweep:
    """One kind of change at every date where it is possible.

    Attributes
    ----------
    kind
        Of change.
    index : (m,) int array
        First value after the change, or the wild value.
    gain : (m,) array
        What it takes from the weighted sum of squares.
    angle : (m - 1,) array
        Between neighbouring dates' columns, rad, at most π/2.
    squares, dof
        Weighted sum of squares without it, and its degrees of freedom ν.
    """

    kind: Kind
    index: Indices
    gain: Array
    angle: Array
    squares: float
    dof: int

    @property
    def best(self) -> int:
        """Place in `index` where the gain is largest."""
        return int(np.argmax(self.gain))

    def p_value(self, gain: float) -> float:
        """Bound of the probability that the largest of all gains is at least so large without any change."""
        if len(self.index) == 0:
            return 0.0
        return chain_probability(self.angle, f_ratio(gain, self.squares, self.dof), self.dof)

    def dates(self) -> Array:
        """Probability of each date given that there is one change, all dates being equally likely before, (m,).

        The likelihood with level, size and scatter at their best for each date: (RSS_k/RSS)^(−ν/2).
        """
        chance = np.exp(-0.5 * self.dof * np.log(self._left(self.gain)) - self.likelihood)
        return np.asarray(chance / chance.sum())

    @property
    def likelihood(self) -> float:
        """Logarithm of that of the best date, but a constant."""
        return float(np.max(-0.5 * self.dof * np.log(self._left(self.gain))))

    def _left(self, gain: Array) -> Array:
        """Sum of squares with a change, not less than rounding makes."""
        return np.asarray(np.maximum(self.squares - gain, _ROUNDING * max(self.dof - 1, 1)))


def f_ratio(gain: float, squares: float, dof: int) -> float:
    """F of one more column, 1 and dof − 1 degrees of freedom."""
    left = max(squares - gain, _ROUNDING * (dof - 1))
    return gain * (dof - 1) / left


def chain_probability(angle: Array, f: float, dof: int) -> float:
    """Bound of P(max F > f) over a chain of columns, each `angle` (m − 1,) from the one before it; ν ≥ 2."""
    single = float(special.fdtrc(1, dof - 1, f))
    if len(angle) == 0:
        return single
    c2 = f / (f + dof - 1)
    theta = np.linspace(0.0, np.arccos(np.sqrt(c2)), _ANGLES)
    height = np.maximum(1.0 - c2 / np.cos(theta) ** 2, 0.0) ** (0.5 * (dof - 2))
    area = np.concatenate(([0.0], np.cumsum(0.5 * (height[1:] + height[:-1]) * np.diff(theta))))
    return min(1.0, single + float(2.0 / np.pi * np.sum(np.interp(0.5 * angle, theta, area))))


@dataclass(frozen=True, slots=True)
class Remainder:
    """What a fitted course leaves, in which changes are looked for.

    Attributes
    ----------
    series
        The m values that count.
    structure
        What is in the course already.
    kept : (m,) int array
        Their indices among all.
    root, basis, rest : (m,), (m, p) and (m,) array
        As `solver.drift.courses.regression.Fit`.
    """

    series: Series
    structure: Structure
    kept: Indices
    root: Array
    basis: Array
    rest: Array

    @classmethod
    def of(
        cls, series: Series, columns: Array, structure: Structure, tau2: float | None = None
    ) -> "Remainder":
        """Fit `columns` (n, p) to the values that count, with τ² estimated unless given."""
        short, kept = series.without(structure.outliers)
        done = fit(short, columns[kept], tau2)
        return cls(short, structure, kept, done.root, done.basis, done.rest)

    @property
    def dof(self) -> int:
        """ν, m − p."""
        return int(len(self.rest) - self.basis.shape[1])

    def sweep(self, kind: Kind) -> Sweep:
        """One kind of change at every date."""
        place = self._places(kind)
        if kind == "outliers":
            leverage = np.einsum("ij,ij->i", self.basis, self.basis)[place]
            length, product = 1.0 - leverage, self.rest[place]
            # Any two single values are as good as perpendicular: Bonferroni's sum.
            return self._made(kind, place, length, product, np.zeros(0), _VISIBLE)
        moment = self._moments(place, kind)
        length = moment.length - np.einsum("ij,ij->i", moment.seen, moment.seen)
        cross = moment.cross - np.einsum("ij,ij->i", moment.seen[:-1], moment.seen[1:])
        return self._made(kind, place, length, moment.product, cross, _VISIBLE * moment.length)

    def _made(
        self, kind: Kind, place: Indices, length: Array, product: Array, cross: Array, least: Array | float
    ) -> Sweep:
        visible = length > least
        gain = np.where(visible, product**2 / np.where(visible, length, 1.0), 0.0)
        if kind == "outliers":
            angle = np.full(max(len(place) - 1, 0), 0.5 * np.pi)
        else:
            unit = np.sqrt(np.where(visible, length, np.inf))
            angle = np.arccos(np.clip(np.abs(cross) / (unit[:-1] * unit[1:]), 0.0, 1.0))
        return Sweep(kind, self.kept[place], gain, angle, float(self.rest @ self.rest), self.dof)

    def _places(self, kind: Kind) -> Indices:
        """Where, among the values that count, a change of this kind may be."""
        count = len(self.kept)
        if kind == "outliers":
            return np.arange(count)
        x = self.series.x
        free = np.concatenate(([False], np.diff(x) > 0.0))
        least = SHORTEST[kind]
        free[:least] = free[max(count - least + 1, 0) :] = False
        taken = self.structure.levels if kind == "steps" else self.structure.bends
        for place in np.searchsorted(self.kept, taken):
            free[max(place - least + 1, 0) : place + least] = False
        return np.flatnonzero(free)

    def _moments(self, place: Indices, kind: Kind) -> "_Moments":
        """Sums from each date to the end of the products of its column with itself, its neighbour, Q and r."""
        weight, seen, product = self.root**2, self.root[:, None] * self.basis, self.root * self.rest
        level = _Moments(
            _from(weight)[place], _from(weight)[place][1:], _from(seen)[place], _from(product)[place]
        )
        if kind == "steps":
            return level
        x = self.series.x
        kink, first, second = x[place - 1], _from(weight * x)[place], _from(weight * x**2)[place]
        return _Moments(
            second - 2.0 * kink * first + kink**2 * level.length,
            second[1:] - (kink[:-1] + kink[1:]) * first[1:] + kink[:-1] * kink[1:] * level.length[1:],
            _from(seen * x[:, None])[place] - kink[:, None] * level.seen,
            _from(product * x)[place] - kink * level.product,
        )


@dataclass(frozen=True, slots=True)
class _Moments:
    """Of columns at m dates: squared length (m,), product with the next (m − 1,), with Q (m, p) and r (m,)."""

    length: Array
    cross: Array
    seen: Array
    product: Array


def _from(terms: Array) -> Array:
    """Sums from each row to the last."""
    sums: Array = np.cumsum(terms[::-1], axis=0)[::-1]
    return sums
