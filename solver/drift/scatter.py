"""Scatter beyond the known uncertainties: the variance τ² that values have in common.

``y_i = x_i·β + b_i + e_i`` with known ``e_i ~ N(0, u_i²)`` and a scatter ``b_i ~ N(0, τ²)`` to be estimated: with the
weights ``w_i = 1/(u_i² + τ²)`` the weighted sum of squares

    Q(τ²) = Σ w_i·(y_i − x_i·β̂(τ²))²        expects n − p,

so that τ² which makes it so is taken, 0 where already Q(0) ≤ n − p. For the mean alone, X = 1: R. C. Paule and
J. Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377-385; R. DerSimonian and R. Kacker, Contemp. Clin. Trials 28 (2007)
105-114, show that the moments need no assumption of a distribution. With equal u_i it is the analysis of variance:
τ² = s² − u².

Q falls with τ², and 1/Q grows and is concave (a harmonic mean of the u_i² + τ², minimised over β), exactly a line for
equal u_i: so Newton's steps are taken on 1/Q, from the left, and cannot pass the root.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from solver.errors import InputError, Message
from solver.records import Array

_STEPS: Final = 60
_AGREEMENT: Final = 1e-12
_NEGLIGIBLE: Final = 1e-12
"""Of the values' variance: a τ² below it is none."""
_EPS: Final = float(np.finfo(np.float64).eps)


def paule_mandel(values: ArrayLike, u: ArrayLike, design: ArrayLike | None = None) -> float:
    """Estimate τ², the variance of the values about a linear model beyond their own uncertainties.

    Parameters
    ----------
    values : (n,) array_like
        In any unit.
    u : (n,) array_like
        Known standard uncertainties, in the same unit; 0 where there is none.
    design : (n, p) array_like, optional
        Of full rank; a column of ones, the common mean, if not given.

    Returns
    -------
    float
        τ², in the square of the unit; 0 where the values scatter no more than their uncertainties explain, and
        where nothing is left to judge by, n ≤ p.

    Raises
    ------
    InputError
        When the lengths differ or a number is not finite.
    """
    y, spread = np.asarray(values, np.float64), np.asarray(u, np.float64)
    columns = np.ones((len(y), 1)) if design is None else np.asarray(design, np.float64)
    if spread.shape != y.shape or columns.ndim != 2 or len(columns) != len(y):
        raise InputError(_LENGTHS)
    if not (np.isfinite(y).all() and np.isfinite(spread).all() and np.isfinite(columns).all()):
        raise InputError(_NOT_FINITE)
    dof = len(y) - columns.shape[1]
    if dof < 1:
        return 0.0
    return _root(y, spread**2, columns, dof)


def _root(y: Array, known: Array, columns: Array, dof: int) -> float:
    """τ² with Q(τ²) = dof, or 0."""
    plain = _rest(y, np.ones(len(y)), columns)
    variance = float(plain @ plain) / dof
    if variance <= (_EPS * len(y) * float(np.abs(y).max())) ** 2:
        return 0.0
    if known.min() == known.max():
        return max(variance - float(known[0]), 0.0)
    # Where an u is 0, weights and Q may be infinite at τ² = 0: there the first step begins beside it.
    nothing = _NEGLIGIBLE * variance
    tau2 = 0.0 if known.min() > nothing else nothing
    for _ in range(_STEPS):
        weight = 1.0 / (known + tau2)
        rest = _rest(y, weight, columns)
        total = float(weight @ rest**2)
        if total <= dof * (1.0 + _AGREEMENT):
            break
        tau2 += (total / dof - 1.0) * total / float(weight**2 @ rest**2)
    return tau2 if tau2 > nothing else 0.0


def _rest(y: Array, weight: Array, columns: Array) -> Array:
    """What the weighted fit leaves of the values."""
    root = np.sqrt(weight)
    basis, _ = np.linalg.qr(columns * root[:, None])
    left: Array = y * root - basis @ (basis.T @ (y * root))
    return left / root


_LENGTHS = Message(
    "scatter-lengths", "Values, uncertainties and the rows of the design must be equally many."
)
_NOT_FINITE = Message("scatter-not-finite", "Scatter is estimated from finite values and uncertainties only.")
