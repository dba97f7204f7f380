"""Constant, straight line or exponential ageing: fitted, and told apart by F-tests.

    constant       y = A
    linear         y = A + b·t
    exponential    y = A + B·exp(−t/T),        T → ∞ being the line

For a given T the last is linear, so that T is found on a line: least squares over T (variable projection, G. H.
Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432), first on a grid, then between its neighbours.

Tests, all with the weights of the fullest model, of which ν degrees of freedom are left:

linear against constant
    F = Δχ²/(χ²/ν), 1 and ν degrees of freedom.
exponential against constant
    F = (Δχ²/2)/(χ²/ν). Without ageing T means nothing, and F does not follow Fisher's distribution: p is the
    probability that the best of all T takes so much, bounded along the path of the columns exp(−t/T) as for changes
    (`solver.drift.courses.sweep`), which is H. Hotelling's own case, Amer. J. Math. 61 (1939) 440-460.
exponential against linear
    F = Δχ²/(χ²/ν), 1 and ν degrees of freedom. T is on one side of T = ∞ only, so that where there is a slope p is up
    to twice too large, never too small.

The exponential is chosen if both its tests are significant, else the line if its test is, each at half the level
asked for: a trend of either kind is then named by chance at that level.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy import optimize, special

from solver.drift.courses.regression import LINE, Fit, Series, fit, shapes
from solver.drift.courses.sweep import chain_probability, f_ratio
from solver.records import Array

Model = Literal["constant", "linear", "exponential"]
_LONGEST: Final = 3.0
"""Time constant, of the history's length, beyond which ageing is a line."""
_SHORTEST: Final = 0.02
_GRID: Final = 24
_VISIBLE: Final = 1e-20
"""Of a column's square: less of it beside the other columns is rounding."""
_AGREEMENT: Final = 1e-3
"""Of ln T; what is left of it goes in the last steps of the fit."""


@dataclass(frozen=True, slots=True)
class TrendTest:
    """One model against a simpler one.

    Attributes
    ----------
    model, against
        The fuller and the simpler one.
    f : float
        Ratio of mean squares.
    dof : (int, int)
        Of its numerator and denominator.
    p_value : float
        Probability of so large an F if the simpler model is true.
    """

    model: Model
    against: Model
    f: float
    dof: tuple[int, int]
    p_value: float


@dataclass(frozen=True, slots=True)
class Profile:
    """Trends of many time constants beside the same other columns.

    Attributes
    ----------
    time_constant : (m,) array
        In units of the history's length, rising; the last is `LINE`.
    gain : (m,) array
        What the shape takes from the weighted sum of squares of a constant.
    angle : (m − 1,) array
        Between neighbouring shapes, rad.
    squares, dof
        Weighted sum of squares with the constant alone, and its degrees of freedom.
    factor, length, lean : (m,) array
        Factor of the shape, the length of its column without what the others have of it, and how much the level
        takes of the shape's column: a unit more of the factor is so much less of the level.
    level, u_level : float
        With the constant alone.
    best, best_gain
        Time constant that takes most away, and how much.
    """

    time_constant: Array
    gain: Array
    angle: Array
    squares: float
    dof: int
    factor: Array
    length: Array
    lean: Array
    level: float
    u_level: float
    best: float
    best_gain: float


def profile(series: Series, columns: Array, tau2: float, *, closely: bool = True) -> Profile:
    """Try all time constants.

    Parameters
    ----------
    series
        Of n values.
    columns : (n, p) array
        What stands beside the trend: 1, steps and bends.
    tau2
        For the weights.
    closely
        Whether the best time constant is sought between those of the grid too.
    """
    flat = fit(series, columns, tau2)
    grid = _grid(series.x)
    shapes = _Shapes.of(series, flat, grid)
    top = int(np.argmax(shapes.gain))
    best, best_gain = float(grid[top]), float(shapes.gain[top])
    if closely and top < len(grid) - 1:
        beside = np.log(grid[max(top - 1, 0)]), np.log(min(grid[top + 1], 1.2 * _LONGEST))
        found = optimize.minimize_scalar(
            lambda one: -float(_Shapes.of(series, flat, np.exp([one])).gain[0]),
            bounds=beside,
            method="bounded",
            options={"xatol": _AGREEMENT},
        )
        if -found.fun > best_gain:
            best, best_gain = float(np.exp(found.x)), -float(found.fun)
    return Profile(
        time_constant=grid,
        gain=shapes.gain,
        angle=shapes.angle,
        squares=flat.squares,
        dof=len(series.y) - columns.shape[1],
        factor=shapes.product / shapes.length,
        length=shapes.length,
        lean=shapes.lean,
        level=float(flat.values[0]),
        u_level=float(np.sqrt(flat.covariance[0, 0])),
        best=best,
        best_gain=best_gain,
    )


@dataclass(frozen=True, slots=True)
class _Shapes:
    """Columns of several time constants without what the others have of them.

    Unit vectors (n, m), their lengths, their products with the remainder, and what the level takes of them.
    """

    unit: Array
    length: Array
    product: Array
    lean: Array

    @classmethod
    def of(cls, series: Series, flat: Fit, constants: Array) -> "_Shapes":
        weighted = shapes(series.x, constants) * flat.root[:, None]
        seen = flat.basis.T @ weighted
        left = weighted - flat.basis @ seen
        square, whole = np.einsum("ij,ij->j", left, left), np.einsum("ij,ij->j", weighted, weighted)
        length = np.where(square > _VISIBLE * whole, np.sqrt(square), np.inf)
        unit = left / length
        return cls(unit, length, flat.rest @ unit, (flat.inverse @ seen)[0])

    @property
    def gain(self) -> Array:
        return self.product**2

    @property
    def angle(self) -> Array:
        """Between neighbours, rad."""
        cosine = np.einsum("ij,ij->j", self.unit[:, :-1], self.unit[:, 1:])
        seen = np.isfinite(self.length)
        angle: Array = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
        return np.where(seen[:-1] & seen[1:], angle, 0.0)


def _grid(x: Array) -> Array:
    """Time constants from two typical intervals of the values to three lengths of the history, and the line."""
    gaps = np.diff(x)
    shortest = max(2.0 * float(np.median(gaps[gaps > 0.0])), _SHORTEST)
    return np.append(np.geomspace(min(shortest, 0.5), _LONGEST, _GRID), LINE)


def slope_test(squares: float, gain: float, dof: int) -> TrendTest:
    """A line against a constant that leaves `squares` with `dof`, of which the slope takes `gain`."""
    f = f_ratio(gain, squares, dof)
    return TrendTest("linear", "constant", f, (1, dof - 1), float(special.fdtrc(1, dof - 1, f)))


def ageing_tests(found: Profile) -> tuple[TrendTest, TrendTest]:
    """Exponential against constant and against linear."""
    left = max(found.squares - found.best_gain, 0.0)
    both = f_ratio(found.best_gain, found.squares, found.dof)
    dof = found.dof - 2
    chance = chain_probability(found.angle, both, found.dof)
    scaled = both * dof / (found.dof - 1)
    more = max(found.best_gain - float(found.gain[-1]), 0.0)
    f = f_ratio(more, left + more, dof + 1)
    return (
        TrendTest("exponential", "constant", 0.5 * scaled, (2, dof), chance),
        TrendTest("exponential", "linear", f, (1, dof), float(special.fdtrc(1, dof, f))),
    )
