"""Thousands of sessions at once: the same positions, other currents and perhaps other angles.

The results are those of `solver.estimators.estimation.least_squares` with the same rounds of weighting: values to
1e-9 of u, and NaN for what a session does not determine. `solver.estimators.block` explains how. A session whose
conditioning is too poor for that way, or in which the noise might hide a parameter, goes the single
way.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from solver.current_noise import moderated
from solver.error_model import Equations, design_matrix, earth_rate
from solver.estimators.block import BLOCK, JX, JY, ONE, RX, RY, C, D, Sound, solve_block
from solver.estimators.estimated_weights import widened_block
from solver.estimators.estimation import least_squares
from solver.geometry import Elements, commanded
from solver.records import Array


@dataclass(frozen=True, slots=True)
class BatchSolution:
    """Weighted least squares of N sessions.

    Attributes
    ----------
    values : (N, 8) array
        In the order of `PARAMETERS`; NaN for what a session does not determine.
    covariance : (N, 8, 8) array
        From u(J), or without it from each session's own scatter.
    chi2 : (N,) array
        Weighted sum of squared residuals; without u(J) the plain one, (rad/s)².
    alone : (N,) bool array
        Sessions that had to go the single way.
    """

    values: Array
    covariance: Array
    chi2: Array
    alone: Sound

    @property
    def standard_uncertainties(self) -> Array:
        """Square roots of the covariances' diagonals, (N, 8)."""
        return np.asarray(np.sqrt(np.einsum("nii->ni", self.covariance)))


@dataclass(frozen=True, slots=True)
class Stand:
    """Positions that the sessions share.

    Attributes
    ----------
    theta, psi : (n,) array
        Commanded angles, rad.
    latitude : float
        rad.
    """

    theta: Array
    psi: Array
    latitude: float

    def block(self, angles: Array, jx: Array, jy: Array) -> Array:
        """Make the z of `solver.estimators.block`, (7, n, B).

        Parameters
        ----------
        angles : (n, 3) or (B, n, 3) array
            Certified α, β, γ, rad: of all sessions, or of each.
        jx, jy : (B, n) array
            Mean currents, A.
        """
        a, b, c, d = elements_of_batch(self.theta, self.psi, np.ascontiguousarray(angles.T))
        north, up = earth_rate(self.latitude)
        z: Array = np.empty((7, jx.shape[1], jx.shape[0]))
        z[JX], z[JY], z[ONE] = jx.T, jy.T, 1.0
        shape = (len(self.theta), -1)
        for row, part in ((C, c), (D, d), (RX, north * a + up * c), (RY, north * b + up * d)):
            z[row] = part.reshape(shape)
        return z


def elements_of_batch(theta: Array, psi: Array, angles: Array) -> tuple[Array, Array, Array, Array]:
    """a, b, c, d of (14) for angles (3, n) or (3, n, B), (n,) or (n, B): the product E·A written out."""
    turned = commanded(theta, psi).transpose(1, 2, 0)
    turned = turned.reshape(3, 3, *turned.shape[2:], *(1,) * (angles.ndim - 2))
    sin_a, sin_b, sin_c = np.sin(angles)
    cos_a, cos_b, cos_c = np.cos(angles)
    both, other = sin_b * sin_a, sin_b * cos_a
    x = (cos_c * cos_b, cos_c * both + sin_c * cos_a, sin_c * sin_a - cos_c * other)
    y = (-sin_c * cos_b, cos_c * cos_a - sin_c * both, cos_c * sin_a + sin_c * other)

    def along(row: tuple[Array, Array, Array], column: int) -> Array:
        sides = zip(row, turned[:, column], strict=True)
        return np.asarray(sum(part * side for part, side in sides))

    return along(x, 1), along(y, 1), along(x, 2), along(y, 2)


def solve_sessions(
    stand: Stand,
    angles: Array,
    jx: Array,
    jy: Array,
    u_jx: Array | None = None,
    u_jy: Array | None = None,
    dof_jx: Array | float = np.inf,
    dof_jy: Array | float = np.inf,
) -> BatchSolution:
    """Solve every session by least squares, as `solver.estimators.estimation.least_squares` does one.

    Parameters
    ----------
    stand
    angles : (n, 3) or (N, n, 3) array
        Certified α, β, γ, rad.
    jx, jy : (N, n) array
        Mean currents, A.
    u_jx, u_jy : (n,) or (N, n) array, optional
        Their standard uncertainties, A; without them all equations count alike.
    dof_jx, dof_jy : (n,) or (N, n) array or float
        Degrees of freedom of the standard uncertainties, which are moderated by them (`solver.current_noise`).
    """
    count = len(jx)
    if u_jx is not None and u_jy is not None:
        u_jx, dof_jx = moderated(u_jx, np.asarray(dof_jx))
        u_jy, dof_jy = moderated(u_jy, np.asarray(dof_jy))
    values, chi2 = np.empty((count, 8)), np.empty(count)
    covariance, alone = np.empty((count, 8, 8)), np.empty(count, dtype=np.bool_)
    for part in _blocks(count):
        z = stand.block(angles[part] if angles.ndim == 3 else angles, jx[part], jy[part])
        u = dof = None
        if u_jx is not None and u_jy is not None:
            u = (_of_block(u_jx, part, jx), _of_block(u_jy, part, jx))
            dof = (_of_block(np.asarray(dof_jx), part, jx), _of_block(np.asarray(dof_jy), part, jx))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # such sessions go alone
            solved = solve_block(z, u)
            if u is not None and dof is not None and (np.isfinite(dof[0]).any() or np.isfinite(dof[1]).any()):
                solved.covariance[:] = widened_block(
                    design_matrix(_elements(z), z[JX].T, z[JY].T), u, dof, solved.values, solved.covariance
                )
        values[part], chi2[part], alone[part] = solved.values.T, solved.square, ~solved.sound
        covariance[part] = solved.covariance.transpose(2, 0, 1)
        for row in np.flatnonzero(~solved.sound):
            estimate = least_squares(_equations(z, u, dof, int(row)), None).estimate
            index = part.start + int(row)
            values[index], covariance[index] = estimate.values, estimate.covariance
            chi2[index] = np.sum(estimate.residuals**2) if u is None else (estimate.fit.chi2 or np.nan)
    return BatchSolution(values, covariance, chi2, alone)


def _blocks(count: int) -> Iterator[slice]:
    return (slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK))


def _of_block(u: Array, part: slice, like: Array) -> Array:
    """Uncertainties of a block, (n, B), or (n, 1) where all sessions share them."""
    if u.ndim == 1:
        return np.broadcast_to(u, like.shape[1])[:, None]
    return np.ascontiguousarray(u[part].T)


def _equations(
    z: Array, u: tuple[Array, Array] | None, dof: tuple[Array, Array] | None, column: int
) -> Equations:
    """The observation equations of one session of a block."""
    one = z[:, :, column, None]
    design = design_matrix(_elements(one), one[JX].T, one[JY].T)[0]
    right_side = np.stack((one[RX], one[RY]), axis=1).ravel()
    return Equations(design, right_side, _of_session(u, column), _of_session(dof, column))


def _of_session(pair: tuple[Array, Array] | None, column: int) -> Array | None:
    """What belongs to the currents of one session of a block, (n, 2)."""
    if pair is None:
        return None
    return np.stack([one[:, column if one.shape[1] > 1 else 0] for one in pair], axis=-1)


def _elements(z: Array) -> Elements:
    """Elements of a block for the design, which takes c and d alone; (B, n) each."""
    c, d = z[C].T, z[D].T
    return Elements(c, c, c, d, d)
