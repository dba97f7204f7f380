"""Linear least squares, single and in batches; it knows nothing of gyros.

`solve` factorises one problem, already whitened (unit variance of every row), by the singular value
decomposition of the column-scaled design: it gives the estimate, the covariance and the *gain*
``H`` with ``values = H @ right_side``, whose product with the noise is the estimate's error.

`solve_batch` takes many problems. With columns scaled to unit length, R the Cholesky factor of the
scaled normal matrix and C = (RᵀR)⁻¹, the squared condition number is at most p·tr C, and every
standard uncertainty is at least 1 in scaled units. One step of iterative refinement with the true
residual leaves an error of about (ε·κ²)²·‖q‖ + ε·κ·‖q‖ (Björck, Numerical Methods for Least Squares
Problems, 1996, sec. 2.9: corrected normal equations), which is compared with 1e-9; where it is not
below that, the problem is solved again by an orthogonal factorisation.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.records import Array

AGREEMENT: Final = 1e-9
"""Largest difference between the fast and the orthogonal solution of a batch, in units of u."""
_SAFETY: Final = 10.0
_EPS: Final = float(np.finfo(np.float64).eps)
_BLOCK_BYTES: Final = 1 << 19


@dataclass(frozen=True, slots=True)
class LinearSolution:
    """One solved problem.

    Attributes
    ----------
    values : (p,) array
    covariance : (p, p) array
        For rows of unit variance.
    gain : (p, m) array
        ``values = gain @ right_side``.
    singular_values : (p,) array
        Of the column-scaled design, largest first.
    singular_vectors : (p, p) array
        One per row, in scaled parameters.
    """

    values: Array
    covariance: Array
    gain: Array
    singular_values: Array
    singular_vectors: Array

    @property
    def condition(self) -> float:
        """Largest over smallest singular value; infinite for a singular design."""
        smallest = float(self.singular_values[-1])
        return float(self.singular_values[0]) / smallest if smallest > 0 else float("inf")


def column_scale(design: Array) -> Array:
    """Euclidean length of every column, (p,); 1 for a column of zeros."""
    lengths: Array = np.sqrt(np.einsum("ij,ij->j", design, design))
    lengths[lengths == 0] = 1.0
    return lengths


def solve(
    design: Array, right_side: Array, *, scale: Array | None = None, invisible: Array | None = None
) -> LinearSolution:
    """Solve ``design @ q ≈ right_side`` for rows of unit variance.

    Parameters
    ----------
    design : (m, p) array
    right_side : (m,) array
    scale : (p,) array, optional
        Length by which each column is divided; its own length when not given.
    invisible : (k, p) array, optional
        Directions of q that the data do not determine: the answer has no component along them
        (in scaled parameters), and the covariance covers the rest.
    """
    scale = column_scale(design) if scale is None else scale
    scaled = design / scale
    padded = scaled if scaled.shape[0] >= scaled.shape[1] else _pad(scaled)
    u, s, vh = np.linalg.svd(padded, full_matrices=False)
    spectrum = (s, vh)
    if invisible is not None and len(invisible):
        basis = complement(invisible * scale)
        u, s, vh = np.linalg.svd(scaled @ basis, full_matrices=False)
        vh = vh @ basis.T
    elif padded is not scaled:
        u = u[: len(scaled)]
    with np.errstate(divide="ignore"):
        root = (vh.T / s) / scale[:, None]
    gain = root @ u.T
    return LinearSolution(gain @ right_side, root @ root.T, gain, *spectrum)


def _pad(design: Array) -> Array:
    """Add rows of zeros until there are as many as columns, so that every singular vector is there."""
    rows, columns = design.shape
    return np.concatenate((design, np.zeros((columns - rows, columns))))


def complement(directions: Array) -> Array:
    """Orthonormal basis, (p, p − k), of what is orthogonal to `directions` (k, p)."""
    full, _ = np.linalg.qr(directions.T, mode="complete")
    return full[:, len(directions) :]


def solve_batch(design: Array, right_side: Array) -> tuple[Array, Array]:
    """Solve many problems whose rows have unit variance.

    Parameters
    ----------
    design : (N, m, p) or (m, p) array
        With (m, p) all problems share the design.
    right_side : (N, m) or (m,) array

    Returns
    -------
    values : (N, p) array
    covariance : (N, p, p) array
        A shared design gives the same covariance N times (a read-only view).

    Raises
    ------
    numpy.linalg.LinAlgError
        When a design has not full column rank.
    """
    if design.ndim == 2:
        shared: Array = _orthogonal(design[None], np.zeros((1, len(design))))[1][0]
        gain = shared @ design.T
        values: Array = np.atleast_2d(right_side) @ gain.T
        values += (np.atleast_2d(right_side) - values @ design.T) @ gain.T
        return values, np.broadcast_to(shared, (len(values), *shared.shape))
    count, rows, columns = design.shape
    values = np.empty((count, columns))
    covariance = np.empty((count, columns, columns))
    right_side = np.broadcast_to(right_side, (count, rows))
    block = max(1, _BLOCK_BYTES // (8 * rows * columns))
    for start in range(0, count, block):
        part = slice(start, start + block)
        values[part], covariance[part] = _solve_block(design[part], right_side[part])
    return values, covariance


def _solve_block(design: Array, right_side: Array) -> tuple[Array, Array]:
    transposed = design.transpose(0, 2, 1)
    normal = transposed @ design
    scale: Array = np.sqrt(np.einsum("nii->ni", normal))
    normal /= scale[:, :, None] * scale[:, None, :]
    try:
        covariance = np.asarray(np.linalg.inv(normal), np.float64)
    except np.linalg.LinAlgError:
        return _orthogonal(design, right_side)
    values: Array = np.zeros(scale.shape)
    rest = right_side
    for _ in range(2):
        slope = (transposed @ rest[:, :, None])[:, :, 0] / scale
        values += (covariance @ slope[:, :, None])[:, :, 0] / scale
        rest = right_side - (design @ values[:, :, None])[:, :, 0]
    length = np.sqrt(np.einsum("ni,ni->n", values * scale, values * scale))
    kappa_squared = scale.shape[1] * np.einsum("nii->n", covariance)
    first = _SAFETY * _EPS * kappa_squared
    doubtful = ~((first**2 + _SAFETY * _EPS * np.sqrt(np.abs(kappa_squared))) * length < AGREEMENT)
    covariance /= scale[:, :, None] * scale[:, None, :]
    if doubtful.any():
        values[doubtful], covariance[doubtful] = _orthogonal(design[doubtful], right_side[doubtful])
    return values, covariance


def _orthogonal(design: Array, right_side: Array) -> tuple[Array, Array]:
    """Solve by QR of the scaled columns, (N, m, p)."""
    scale = np.sqrt(np.einsum("nmp,nmp->np", design, design))
    if not scale.all():
        raise np.linalg.LinAlgError("a column of the design is zero")
    q, r = np.linalg.qr(design / scale[:, None, :])
    root: Array = np.linalg.inv(r) / scale[:, :, None]
    values: Array = (root @ (q.transpose(0, 2, 1) @ right_side[:, :, None]))[:, :, 0]
    return values, root @ root.transpose(0, 2, 1)
