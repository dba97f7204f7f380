"""The fit of hypotheses: eight parameters to a session put right, in the currents' own space, many at once.

The residuals of the observation equations, taken back to currents by K⁻¹, are what was measured
minus what a gyro of those parameters would give; they are whitened by

    V = ΣJ + K⁻¹·V'·K⁻ᵀ,

ΣJ the currents' noise and V' the rates' covariance of every other uncertain input
(`solver.inputs`). Without given u(J) all rates are taken as equally uncertain by `UNTOLD`, and
only ratios of sums of squares mean anything. A current that a hypothesis disbelieves has a nearly infinite
variance and is replaced by the one that the fit predicts, so that it does not stand in the design.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.error_model import design_matrix
from solver.geometry import Elements
from solver.inputs import CommonUncertainty, inputs_of
from solver.records import PARAMETERS, Array, Observations

UNTOLD: Final = 1e-4 * EARTH_RATE
"""Unit of the sums of squares when u(J) is not given, rad/s."""
_COUNT: Final = len(PARAMETERS)
_ROUNDS_WITHOUT: Final = 4
_DISBELIEVED: Final = 1e5
_NO_RANK: Final = 1e-9
_SINGULAR: Final = 1e-6
_CLEAR: Final = 1e-3
_RIDGE: Final = 1e-13
_ROUNDING: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Fitted:
    """A fitted hypothesis.

    Attributes
    ----------
    values : (8,) array
    drift : (2,) or (0,) array
        Sizes of the drift of ω0x and ω0y along its course, rad/s.
    covariance : (8, 8) array
        Without u(J): for rates uncertain by `UNTOLD`.
    known : (8,) bool array
        Parameters that the data determine.
    squares
        Sum of squares of the whitened residuals.
    dof
    rest : (2n,) array
        Whitened residuals.
    span : (2n, rank) array
        Orthonormal basis of the whitened design.
    whitening : (2n, 2n) or (n, 2, 2) array
        By which residuals in currents are whitened, as a whole or position by position.
    """

    values: Array
    drift: Array
    covariance: Array
    known: NDArray[np.bool_]
    squares: float
    dof: int
    rest: Array
    span: Array
    whitening: Array


@dataclass(frozen=True, slots=True)
class Data:
    """Sessions put right, N of them.

    Attributes
    ----------
    x : (N, n, 5) array
        Regressors of `solver.blunders.current_model`.
    currents : (N, n, 2) array
    u : (N, n, 2) array or None
    missing : (N, n, 2) bool array
        Currents that are not believed.
    course : (N, n) array
        Time course of a drift of both biases, of free size for each; zeros for none.
    """

    x: Array
    currents: Array
    u: Array | None
    missing: NDArray[np.bool_]
    course: Array


def other_inputs(
    observations: Observations, parameters: Array, common: CommonUncertainty | None
) -> Array | None:
    """V', (2n, 2n): what is uncertain besides the currents; None for nothing."""
    at = observations
    nothing = common is None or not common.standard.any()
    if nothing and not (at.u_alpha.any() or at.u_beta.any() or at.u_gamma.any()):
        return None
    inputs = inputs_of(observations, parameters, common)
    others = inputs.source != "currents"
    part = inputs.sensitivity[:, others]
    return np.asarray(part @ inputs.covariance[np.ix_(others, others)] @ part.T)


def rough(data: Data) -> Array:
    """Parameters to begin from where each channel alone does not give them, (N, 8); NaN where both do not.

    The observation equations by plain least squares, without those of missing currents: the channels help
    each other through ωg and ωк.
    """
    count, n, _ = data.x.shape
    right_side = (EARTH_RATE * data.x[..., :2]).reshape(count, 2 * n, 1)
    both = np.concatenate((_design(data.x, data.currents), right_side), axis=-1)
    both *= ~data.missing.reshape(count, 2 * n, 1)
    solved = _solve(both)
    return np.where((solved.sharp > _CLEAR)[:, None], solved.values, np.nan)


def fit(data: Data, start: Array, others: Array | None, rounds: int = 2) -> list[Fitted | None]:
    """Fit every session put right; None where the scale factors become singular.

    Parameters
    ----------
    data
    start : (N, 8) array
        Parameters to begin from, finite.
    others : (2n, 2n) array, optional
        V'.
    rounds
        Of reweighting, where no current is missing.
    """
    count, n, _ = data.x.shape
    values, alive = start.copy(), np.ones(count, dtype=np.bool_)
    right_side = (EARTH_RATE * data.x[..., :2]).reshape(count, 2 * n, 1)
    currents, some = data.currents, data.missing.any()
    drift = data.course.any()
    extra = np.kron(data.course[..., None], np.eye(2)) if drift else np.zeros((count, 2 * n, 0))
    rounds = _ROUNDS_WITHOUT if some else rounds
    for left in reversed(range(rounds)):
        inverse, usable = _inverse(values)
        alive &= usable
        design = _design(data.x, currents)
        if some:
            residuals = right_side[..., 0] - np.matvec(design, values)
            change = np.matvec(inverse[:, None], residuals.reshape(count, n, 2))
            currents = np.where(data.missing, currents + change, currents)
            design = _design(data.x, currents)
        whitening = _whitening(data, inverse, others)
        both = np.concatenate((design, extra, right_side), axis=-1).reshape(count, n, 2, -1)
        whitened = _apply(whitening, inverse[:, None] @ both)
        if left:  # to reweight by, normal equations are good enough
            values = np.where(alive[:, None], _quickly(whitened)[:, :_COUNT], start)
    solved = _solve(whitened)
    gone = data.missing.sum(axis=(1, 2))
    return [
        _one(solved, whitening, index, int(gone[index]), bool(data.course[index].any()))
        if alive[index]
        else None
        for index in range(count)
    ]


@dataclass(frozen=True, slots=True)
class _Solved:
    values: Array
    root: Array
    rest: Array
    span: Array
    seen: NDArray[np.bool_]
    vh: Array
    scale: Array
    sharp: Array
    """Smallest over largest singular value."""


def _one(solved: _Solved, whitening: Array, index: int, gone: int, drift: bool) -> Fitted:
    seen, scale, root = solved.seen[index], solved.scale[index], solved.root[index, :_COUNT]
    hidden = (solved.vh[index][~seen] / scale)[:, :_COUNT] * scale[:_COUNT]
    rest = solved.rest[index]
    return Fitted(
        values=solved.values[index, :_COUNT],
        drift=solved.values[index, _COUNT:] if drift else np.zeros(0),
        covariance=root @ root.T,
        known=~(np.abs(hidden) > _NO_RANK).any(axis=0),
        squares=float(rest @ rest),
        dof=len(rest) - gone - int(seen.sum()),
        rest=rest,
        span=solved.span[index][:, seen],
        whitening=whitening[index],
    )


def _design(x: Array, currents: Array) -> Array:
    c, d = x[..., 3], x[..., 4]
    return design_matrix(Elements(c, c, c, d, d), currents[..., 0], currents[..., 1])


def _inverse(values: Array) -> tuple[Array, NDArray[np.bool_]]:
    """K⁻¹ (N, 2, 2), and where it is usable."""
    kx, ky, kxy, kyx = values[:, :4].T
    determinant = kx * ky - kxy * kyx
    usable = np.abs(determinant) > _SINGULAR * np.sum(values[:, :4] ** 2, axis=1)
    over = np.where(usable, determinant, 1.0)
    inverse = np.stack((ky / over, -kxy / over, -kyx / over, kx / over), axis=1)
    return inverse.reshape(-1, 2, 2), usable


def _whitening(data: Data, inverse: Array, others: Array | None) -> Array:
    """W with Wᵀ·W = V⁻¹: (N, n, 2, 2) where positions are independent, else (N, 2n, 2n)."""
    count, n, _ = data.x.shape
    blown = np.where(data.missing, _DISBELIEVED, 1.0)
    if data.u is None:  # V = K⁻¹·K⁻ᵀ, whose root needs no factorisation
        return np.asarray(np.linalg.inv(inverse)[:, None] / (UNTOLD * blown[..., None, :]))
    if others is None:
        return np.asarray((1.0 / (data.u * blown))[..., None] * np.eye(2))
    left = (inverse[:, None] @ others.reshape(n, 2, -1)).reshape(count, 2 * n, 2 * n)
    covariance = (inverse[:, None] @ np.swapaxes(left, 1, 2).reshape(count, n, 2, -1)).reshape(left.shape)
    covariance = (covariance + np.swapaxes(covariance, 1, 2)) / 2
    diagonal = np.arange(2 * n)
    covariance[:, diagonal, diagonal] += data.u.reshape(count, -1) ** 2
    covariance[:, diagonal, diagonal] *= blown.reshape(count, -1) ** 2
    return _root_of_inverse(covariance)


def _root_of_inverse(covariance: Array) -> Array:
    """W with Wᵀ·W = V⁻¹; where V is singular to rounding, with its smallest eigenvalues raised to that."""
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(covariance)
        raised = np.maximum(values, _ROUNDING * values[:, -1:])
        return np.asarray(np.swapaxes(vectors, 1, 2) / np.sqrt(raised)[..., None])


def _apply(whitening: Array, blocks: Array) -> Array:
    """Whiten (N, n, 2, c) into (N, 2n, c)."""
    count, n, _, columns = blocks.shape
    if whitening.ndim == 4:
        return np.asarray((whitening @ blocks).reshape(count, 2 * n, columns))
    return np.asarray(whitening @ blocks.reshape(count, 2 * n, columns))


def _quickly(both: Array) -> Array:
    """Least squares by normal equations of scaled columns, with a little ridge where they are singular."""
    products = np.swapaxes(both, 1, 2) @ both
    scale = np.sqrt(np.einsum("nii->ni", products))[:, :-1]
    scale = np.where(scale == 0, 1.0, scale)
    normal = products[:, :-1, :-1] / (scale[:, :, None] * scale[:, None, :]) + _RIDGE * np.eye(scale.shape[1])
    return np.asarray(np.linalg.solve(normal, (products[:, :-1, -1] / scale)[..., None])[..., 0] / scale)


def _solve(both: Array) -> _Solved:
    design, right_side = both[..., :-1], both[..., -1]
    scale = np.sqrt(np.einsum("nij,nij->nj", design, design))
    scale = np.where(scale == 0, 1.0, scale)
    u, s, vh = np.linalg.svd(design / scale[:, None, :], full_matrices=False)
    seen = s > _NO_RANK * s[:, :1]
    over = np.where(seen, 1.0 / np.where(seen, s, 1.0), 0.0)
    root = np.swapaxes(vh, 1, 2) * over[:, None, :] / scale[..., None]
    values = np.matvec(root, np.vecmat(right_side, u))
    return _Solved(
        values, root, right_side - np.matvec(design, values), u, seen, vh, scale, s[:, -1] / s[:, 0]
    )
