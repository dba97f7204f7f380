"""Linear least squares, single and in batches; it knows nothing of gyros.

`solve` factorises one problem, already whitened (unit variance of every row), by the singular value
decomposition of the column-scaled design: it gives the estimate, the covariance and the *gain*
``H`` with ``values = H @ right_side``, whose product with the noise is the estimate's error.
`estimate` gives only answer and covariance, by QR.

`solve_batch` takes many problems. With columns scaled to unit length, G is the normal matrix and
C = G⁻¹ the covariance in scaled parameters; the squared condition number of the design, κ², is at
most p·tr C. G is inverted in place by symmetric elimination on its Cholesky pivots (sweep operator),
all problems of a block at once. The normal equations lose about ε·κ²·‖q‖ of the scaled answer q; so
they are solved only for the difference from the first problem's answer, which problems of one batch
mostly share, with residuals from the design itself (as in iterative refinement). What remains,
ε·κ²·‖difference‖ + ε·κ·‖q‖, is compared with the smallest standard uncertainty, which in scaled
parameters is at least 1: where it is not below 1e-9, the step is repeated, and if that does not
help the problem is solved by an orthogonal factorisation.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.records import Array

AGREEMENT: Final = 1e-9
"""Largest difference between the fast and the orthogonal solution of a batch, in units of u."""
_SAFETY: Final = 10.0
_EPS: Final = float(np.finfo(np.float64).eps)
_BLOCK: Final = 256
"""Problems worked on at once: their 8×8 matrices fit the second-level cache."""
_DEFICIENT: Final = "a design has not full column rank"


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


def estimate(design: Array, right_side: Array) -> tuple[Array, Array]:
    """Solve one problem for its answer and covariance alone, as fast as one can be solved.

    QR of the scaled design with the right side as a further column: R and Qᵀ·y at once.

    Parameters
    ----------
    design : (m, p) array
        Rows of unit variance.
    right_side : (m,) array

    Returns
    -------
    values : (p,) array
    covariance : (p, p) array

    Raises
    ------
    numpy.linalg.LinAlgError
        When the design has not full column rank.
    """
    rows, columns = design.shape
    scale = column_scale(design)
    both = np.empty((rows, columns + 1))
    np.divide(design, scale, out=both[:, :columns])
    both[:, columns] = right_side
    triangle = np.asarray(np.linalg.qr(both, mode="r"))
    if rows < columns or np.abs(triangle.diagonal()[:columns]).min() <= rows * _EPS:
        raise np.linalg.LinAlgError(_DEFICIENT)
    # Not by scipy's LAPACK: its threads and numpy's would wait for each other's processors.
    root = np.asarray(np.linalg.inv(triangle[:columns, :columns]), np.float64)
    values = (root @ triangle[:columns, columns]) / scale
    root /= scale[:, None]
    return values, root @ root.T


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
        return _solve_shared(design, np.atleast_2d(right_side))
    count, rows, columns = design.shape
    values = np.empty((count, columns))
    covariance = np.empty((count, columns, columns))
    if not count:
        return values, covariance
    right_side = np.broadcast_to(right_side, (count, rows))
    start = _orthogonal(design[:1], right_side[:1])[0][0]
    for first in range(0, count, _BLOCK):
        part = slice(first, first + _BLOCK)
        _solve_block(design[part], right_side[part], start, values[part], covariance[part])
    return values, covariance


def _solve_shared(design: Array, right_sides: Array) -> tuple[Array, Array]:
    single = solve(design, right_sides[0])
    if not single.singular_values[-1] > len(design) * _EPS * single.singular_values[0]:
        raise np.linalg.LinAlgError(_DEFICIENT)
    values: Array = right_sides @ single.gain.T
    return values, np.broadcast_to(single.covariance, (len(values), *single.covariance.shape))


def _solve_block(design: Array, right_side: Array, start: Array, values: Array, covariance: Array) -> None:
    """Solve one block into `values` and `covariance`, beginning from `start` (p,)."""
    normal = np.ascontiguousarray((design.transpose(0, 2, 1) @ design).transpose(1, 2, 0))
    rest = right_side - design @ start
    answer = np.repeat(start[:, None], len(design), axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a deficient design is doubtful
        unscale = 1.0 / np.sqrt(np.einsum("iib->ib", normal))
        normal *= unscale[:, None] * unscale
        invert_symmetric(normal)
        variances = np.einsum("iib->ib", normal)
        # Scaled variances are at least 1; less is the rounding of a singular matrix.
        kappa = np.where(variances.min(axis=0) > 0.5, np.sqrt(len(start) * variances.sum(axis=0)), np.inf)
        for last in (False, True):
            difference = np.einsum("ijb,jb->ib", normal, np.vecmat(rest, design).T * unscale)
            answer += difference * unscale
            error = _SAFETY * _EPS * kappa * (kappa * _length(difference) + _length(answer / unscale))
            doubtful = ~(error < AGREEMENT)  # also where it is NaN
            if last or not doubtful.any():
                break
            rest = right_side - np.matvec(design, answer.T)
        normal *= unscale[:, None] * unscale
    values[:] = answer.T
    covariance[:] = normal.transpose(2, 0, 1)
    if doubtful.any():
        values[doubtful], covariance[doubtful] = _orthogonal(design[doubtful], right_side[doubtful])


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ib,ib->b", vectors, vectors)))


def invert_symmetric(stack: Array) -> None:
    """Invert symmetric positive definite matrices, (p, p, B), in place."""
    product = np.empty_like(stack)
    for k in range(len(stack)):
        pivot = stack[k, k].copy()
        row = stack[k].copy()
        column = row / pivot
        np.multiply(row[:, None], column, out=product)
        stack -= product
        stack[k] = stack[:, k] = column
        np.divide(-1.0, pivot, out=stack[k, k])
    np.negative(stack, out=stack)


def _orthogonal(design: Array, right_side: Array) -> tuple[Array, Array]:
    """Solve by QR of the scaled columns, (N, m, p)."""
    scale = np.sqrt(np.einsum("nmp,nmp->np", design, design))
    if not scale.all() or design.shape[1] < design.shape[2]:
        raise np.linalg.LinAlgError(_DEFICIENT)
    q, r = np.linalg.qr(design / scale[:, None, :])
    if np.abs(np.einsum("nii->ni", r)).min(initial=1.0) <= design.shape[1] * _EPS:
        raise np.linalg.LinAlgError(_DEFICIENT)
    root: Array = np.linalg.inv(r) / scale[:, :, None]
    values: Array = np.matvec(root, np.vecmat(right_side, q))
    return values, root @ root.transpose(0, 2, 1)
