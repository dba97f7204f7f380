"""The currents as linear functions of the known orientation: a fast fit for many hypotheses.

Solved for the currents, the observation equations (paper, eqs. (10)-(15)) read

    J = K⁻¹·(ωг·m + ωв·n) − K⁻¹·ω0 − K⁻¹·G·n,      m = (a, b), n = (c, d),

so each channel's current is linear in five regressors without error, x = (ωг·a + ωв·c,
ωг·b + ωв·d, 1, c, d). The ten coefficients B of both channels hold the eight parameters and two
relations between them (G has two elements, not four), which a fast comparison may leave out. A
hypothesis about a few positions changes a few rows: a change of low rank of the 5×5 normal
matrices, so that hundreds of hypotheses cost one batch. The scale factors need not be
determined: at a pole the fit loses rank, and nothing else happens.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.error_model import earth_rate
from solver.geometry import Elements, case_orientation, elements
from solver.records import Array, Observations

REGRESSORS: Final = 5
_NO_RANK: Final = 1e-7
_NULL: Final = 1e-9
_VISIBLE: Final = 7.0


def regressors(observations: Observations) -> Array:
    """X of every position, rates in units of the Earth's, (n, 5)."""
    at = observations
    here = elements(case_orientation(at.theta, at.psi, at.alpha, at.beta, at.gamma))
    return regressors_at(here, at.latitude)


def regressors_at(here: Elements, latitude: float) -> Array:
    """X for given orientation elements (...,), (..., 5)."""
    north, up = (rate / EARTH_RATE for rate in earth_rate(latitude))
    a, b, c, d, _ = here
    return np.stack((north * a + up * c, north * b + up * d, np.ones_like(a), c, d), axis=-1)


@dataclass(frozen=True, slots=True)
class Solutions:
    """Fits of `CurrentModel.solve`.

    Attributes
    ----------
    squares : (N,) array
    dof : (N,) int array
    start : (N, 8) array
        The eight parameters nearest to the ten coefficients; NaN where the scale factors do not show.
    rest : (N, n, 2) array
        Measured minus fitted currents.
    """

    squares: Array
    dof: NDArray[np.int64]
    start: Array
    rest: Array


@dataclass(frozen=True, slots=True)
class CurrentModel:
    """One session's regression.

    Attributes
    ----------
    rows : (n, r) array
        Regressors in an orthonormal basis of what they span.
    basis : (5, r) array
        ``rows = x @ basis``.
    currents : (n, 2) array
        Jx, Jy, A.
    weights : (n, 2) array
        1/u², 1/A²; zero for a current that is not believed.
    """

    rows: Array
    basis: Array
    currents: Array
    weights: Array

    @classmethod
    def of(cls, x: Array, currents: Array, weights: Array) -> "CurrentModel":
        """Set up from regressors (n, 5), currents (n, 2) and weights (n, 2)."""
        _, s, vh = np.linalg.svd(x, full_matrices=False)
        seen = s > _NO_RANK * s[0]
        basis = vh[seen].T / s[seen]
        return cls(x @ basis, basis, currents, weights)

    def solve(self, x: Array, currents: Array, weights: Array, *, told: bool) -> "Solutions":
        """Fit many sets of the same positions, each with its own regressors, currents and weights.

        Parameters
        ----------
        x : (N, n, 5) array
        currents, weights : (N, n, 2) array
        told
            The weights are those of the noise; otherwise it is taken from the residuals.
        """
        rows = x @ self.basis
        weighted = rows[:, None] * np.swapaxes(weights, 1, 2)[..., None]
        values, vectors = np.linalg.eigh(np.swapaxes(weighted, -1, -2) @ rows[:, None])
        seen = values > _NULL * np.maximum(values[..., -1:], np.finfo(float).tiny)
        root = np.where(seen[..., None, :], vectors / np.sqrt(np.where(seen, values, 1.0))[..., None, :], 0.0)
        right = np.einsum("ncpi,npc->nci", weighted, currents)
        coefficients = np.matvec(root, np.vecmat(right, root))
        rest = currents - rows @ np.swapaxes(coefficients, 1, 2)
        squares = np.sum(weights * rest**2, axis=1)
        rank = seen.sum(axis=-1)
        freedom = np.sum(weights > 0, axis=1) - rank
        start = np.full((len(x), 8), np.nan)
        if self.basis.shape[1] == REGRESSORS:
            noise = np.ones_like(squares) if told else squares / np.maximum(freedom, 1)
            spread = np.sum((self.basis[:2] @ root) ** 2, axis=-1).max(axis=-1) * noise
            start = _start(coefficients @ self.basis.T, spread.max(axis=1), (rank == REGRESSORS).all(axis=1))
        return Solutions(squares.sum(axis=1), freedom.sum(axis=1), start, rest)

    def replaced(self, index: NDArray[np.int64], x: Array) -> Array:
        """Sum of squares with other regressors at some rows, for each hypothesis, (N,).

        Parameters
        ----------
        index : (N, k) int array
        x : (N, k, 5) array
        """
        normal, right, square = self._moments()
        new, old = x @ self.basis, self.rows[index]
        w, j = self.weights[index], self.currents[index]
        change = np.einsum("nkc,nki,nkj->ncij", w, new, new) - np.einsum("nkc,nki,nkj->ncij", w, old, old)
        moved = np.einsum("nkc,nki->nci", w * j, new - old)
        return _squares(normal + change, right + moved, square)

    def whole(self, x: Array) -> Array:
        """Sum of squares with other regressors at all rows, x (N, n, 5), for each hypothesis, (N,)."""
        _, _, square = self._moments()
        new = x @ self.basis
        normal = np.einsum("pc,npi,npj->ncij", self.weights, new, new)
        right = np.einsum("pc,npi->nci", self.weights * self.currents, new)
        return _squares(normal, right, square)

    def _moments(self) -> tuple[Array, Array, Array]:
        """Normal matrices (2, r, r), right sides (2, r) and squares (2,) of both channels."""
        normal = np.einsum("pc,pi,pj->cij", self.weights, self.rows, self.rows)
        right = (self.weights * self.currents).T @ self.rows
        return normal, right, np.sum(self.weights * self.currents**2, axis=0)


def _squares(normal: Array, right: Array, square: Array) -> Array:
    """Sums of squares (N,) from normal matrices (N, 2, r, r), by solving; a little ridge where singular."""
    size = np.einsum("...ii->...", normal)[..., None, None]
    ridge = (_NULL**1.5 * size) * np.eye(normal.shape[-1])
    solved = np.linalg.solve(normal + ridge, right[..., None])[..., 0]
    return np.asarray(np.sum(np.maximum(square - np.sum(right * solved, axis=-1), 0.0), axis=-1))


def _start(b: Array, spread: Array, determined: NDArray[np.bool_]) -> Array:
    """Parameters (N, 8) from coefficients b (N, 2, 5); NaN where K⁻¹ is not clear of its variance `spread`."""
    m = b[..., :2]
    least = np.linalg.svd(m, compute_uv=False)[:, -1]
    clear = determined & (least > np.maximum(_VISIBLE * np.sqrt(spread), _NULL * np.abs(b).max(axis=(1, 2))))
    start = np.full((len(b), 8), np.nan)
    if clear.any():
        k = np.linalg.inv(m[clear]) * EARTH_RATE
        bias, g = -np.matvec(k, b[clear, :, 2]), -k @ b[clear, :, 3:]
        start[clear, :4] = np.stack((k[:, 0, 0], k[:, 1, 1], k[:, 0, 1], k[:, 1, 0]), axis=1)
        start[clear, 4:6] = bias
        start[clear, 6] = (g[:, 0, 0] + g[:, 1, 1]) / 2
        start[clear, 7] = (g[:, 1, 0] - g[:, 0, 1]) / 2
    return start
