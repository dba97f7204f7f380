"""Weighted regression of a history whose scatter is to be estimated: the columns of a course and one fit.

In the columns of `design` time is x, 0 at the last value and −1 at the first. What is told about the last stretch is
then a coefficient by itself: changes act backwards, on what lies before them,

    y(x) = a + b·s(x) − Σ_j c_j·[x before change j] + Σ_k d_k·(x_k − x)₊

with the level a and the slope b after the last change, the steps c_j up and the changes d_k of slope at x_k. The
shape s(x) is x, a line, or exp(−(x + 1)/T), ageing with the time constant T.

Variance of a value: u² + τ² (`solver.drift.scatter`). Where the values agree better than their u, τ² = 0 and all u²
are multiplied by their weighted mean square Q/(n − p) < 1, the square of Birge's ratio (R. T. Birge, Phys. Rev.
40 (1932) 207-227): for equal u the variance is in both cases s², which follows χ² with n − p degrees of freedom,
so that Student's factor holds exactly. A variance not allowed to fall below u² would make every interval too long
on the average. Only an agreement that chance gives in one of a thousand histories is not believed: then something is
wrong with the values, copied ones, say, and the factor stays where it has this probability.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver.drift.scatter import paule_mandel
from solver.records import Array

Indices = NDArray[np.intp]
LINE: Final = float("inf")
"""The time constant of a straight line: that of an ageing without end."""
_TOO_GOOD: Final = 1e-3


@dataclass(frozen=True, slots=True)
class Series:
    """A history in units of its own: x from −1 to 0 (all 0 where all have one time), values about 1.

    Attributes
    ----------
    x, y, known : (n,) array
        Time, value and variance of its uncertainty.
    """

    x: Array
    y: Array
    known: Array

    def without(self, outliers: tuple[int, ...]) -> tuple["Series", Indices]:
        """The values that count, and their indices."""
        mask = np.ones(len(self.x), np.bool_)
        mask[list(outliers)] = False
        kept = np.flatnonzero(mask)
        return Series(self.x[kept], self.y[kept], self.known[kept]), kept


@dataclass(frozen=True, slots=True)
class Structure:
    """Where a course breaks: indices of the first value after each change.

    Attributes
    ----------
    breaks, steps, bends : tuple of int
        Given moments and found changes, of level and of slope.
    outliers : tuple of int
        Values that do not count.
    """

    breaks: tuple[int, ...] = ()
    steps: tuple[int, ...] = ()
    bends: tuple[int, ...] = ()
    outliers: tuple[int, ...] = ()

    @property
    def levels(self) -> tuple[int, ...]:
        """Wherever the level may change, in the order of the columns of `design`."""
        return self.breaks + self.steps

    def without(self, kind: str, index: int) -> "Structure":
        """The same but one change or outlier."""
        old: tuple[int, ...] = getattr(self, kind)
        return replace(self, **{kind: tuple(one for one in old if one != index)})

    def beside(self, kind: str, index: int) -> "Structure":
        """One change or outlier more."""
        return replace(self, **{kind: tuple(sorted((*getattr(self, kind), index)))})


@dataclass(frozen=True, slots=True)
class Fit:
    """One weighted fit.

    Attributes
    ----------
    values, covariance : (p,) and (p, p) array
        The latter with `scale`.
    tau2 : float
        τ², 0 or more.
    scale : float
        By which the variances u² + τ² are to be multiplied: 1 if τ² > 0, else 1 or less, Birge's factor squared.
    dof : int
        n − p; 0 leaves the variances as known.
    root, basis, rest : (n,), (n, p) and (n,) array
        Square roots of the weights; an orthonormal basis of the weighted columns, and what it leaves of the
        weighted values.
    inverse : (p, p) array
        Of the triangle that makes the basis from the weighted columns.
    """

    values: Array
    covariance: Array
    tau2: float
    scale: float
    dof: int
    root: Array
    basis: Array
    rest: Array
    inverse: Array

    @property
    def squares(self) -> float:
        """Weighted sum of squares left."""
        return float(self.rest @ self.rest)

    def deviance(self, known: Array) -> float:
        """−2·ln of the likelihood, but a constant, with the variances `known` + τ², scaled."""
        variance = self.scale * (known + self.tau2)
        return float(np.sum(np.log(variance))) + self.squares / self.scale


def shape(x: Array, time_constant: float) -> Array:
    """s(x), a line for `LINE`."""
    if time_constant == LINE:
        return x
    aged: Array = np.exp(-(x + 1.0) / time_constant)
    return aged


def shapes(x: Array, constants: Array) -> Array:
    """s(x) of several time constants, (n, m)."""
    line = constants == LINE
    return np.where(line, x[:, None], np.exp(-(x[:, None] + 1.0) / constants))


def design(x: Array, structure: Structure, time_constant: float | None) -> Array:
    """Columns of a course: 1, the shape unless None, a step for each of `levels`, a bend for each of `bends`."""
    place = np.arange(len(x))
    columns = [np.ones(len(x))]
    if time_constant is not None:
        columns.append(shape(x, time_constant))
    columns += [np.where(place < index, -1.0, 0.0) for index in structure.levels]
    columns += [np.maximum(x[index - 1] - x, 0.0) for index in structure.bends]
    return np.stack(columns, axis=1)


def believed(squares: float, dof: int) -> float:
    """Mean square of `dof` degrees of freedom, not less than one of a thousand histories has by chance."""
    return max(squares, float(special.chdtri(dof, 1.0 - _TOO_GOOD))) / dof


def fit(series: Series, columns: Array, tau2: float | None = None) -> Fit:
    """Fit columns to a series, with τ² estimated unless it is given.

    Parameters
    ----------
    series
        Of n values.
    columns : (n, p) array
        Of full rank, n ≥ p.
    tau2
        Variance common to all values; also `scale` is then left at 1.
    """
    dof = len(series.y) - columns.shape[1]
    common = paule_mandel(series.y, np.sqrt(series.known), columns) if tau2 is None else tau2
    root = 1.0 / np.sqrt(series.known + common)
    basis, upper = np.linalg.qr(columns * root[:, None])
    seen = basis.T @ (series.y * root)
    rest = series.y * root - basis @ seen
    scale = min(1.0, believed(float(rest @ rest), dof)) if dof > 0 and tau2 is None else 1.0
    inverse = np.linalg.inv(upper)
    return Fit(inverse @ seen, scale * inverse @ inverse.T, common, scale, dof, root, basis, rest, inverse)
