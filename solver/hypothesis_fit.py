"""The fit of one hypothesis: eight parameters to a session put right, in the currents' own space.

The residuals of the observation equations, taken back to currents by K⁻¹, are what was measured
minus what a gyro of those parameters would give; they are whitened by

    V = ΣJ + K⁻¹·V'·K⁻ᵀ,

ΣJ the currents' noise and V' the rates' covariance of every other uncertain input
(`solver.inputs`). Without given u(J) all rates are taken as equally uncertain by `UNTOLD`, and
only ratios of sums of squares mean anything. A current that a hypothesis disbelieves has an infinite
variance and is replaced by the one that the fit predicts, so that it does not stand in the design.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.error_model import observation_equations, scale_matrix
from solver.inputs import CommonUncertainty, inputs_of
from solver.records import PARAMETERS, Array, Observations

UNTOLD: Final = 1e-4 * EARTH_RATE
"""Unit of the sums of squares when u(J) is not given, rad/s."""
_ROUNDS: Final = 2
_ROUNDS_WITHOUT: Final = 4
_DISBELIEVED: Final = 1e5
_NO_RANK: Final = 1e-9
_SINGULAR: Final = 1e-6


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
    whitening : (2n, 2n) array
        By which residuals in currents are whitened.
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


def fit(
    observations: Observations,
    start: Array,
    others: Array | None,
    missing: NDArray[np.bool_] | None = None,
    course: Array | None = None,
) -> Fitted | None:
    """Fit a session put right; None where the scale factors become singular.

    Parameters
    ----------
    observations
    start : (8,) array
        Parameters to begin from.
    others : (2n, 2n) array, optional
        V'.
    missing : (n, 2) bool array, optional
        Currents that are not believed.
    course : (n,) array, optional
        Time course of a drift of both biases, of free size for each.
    """
    values = start
    told = observations.u_jx is not None and observations.u_jy is not None
    extra = None if course is None else np.kron(course[:, None], np.eye(2))
    fitted = None
    for _ in range(_ROUNDS if missing is None else _ROUNDS_WITHOUT):
        inverse = _inverse(values)
        if inverse is None:
            return None
        equations = observation_equations(observations)
        if missing is not None:
            observations = _filled(observations, inverse, equations.residuals(values), missing)
            equations = observation_equations(observations)
        columns = equations.design if extra is None else np.hstack((equations.design, extra))
        whitening = _whitening(observations, inverse, others, missing, told=told)
        both = np.column_stack((columns, equations.right_side))
        whitened = whitening @ (inverse @ both.reshape(len(observations), 2, -1)).reshape(both.shape)
        fitted = _solve(whitened[:, :-1], whitened[:, -1], whitening, missing)
        values = fitted.values
    return fitted


def _inverse(values: Array) -> Array | None:
    k = scale_matrix(values)
    determinant = k[0, 0] * k[1, 1] - k[0, 1] * k[1, 0]
    if not abs(determinant) > _SINGULAR * float(np.sum(k * k)):
        return None
    return np.asarray(np.array([[k[1, 1], -k[0, 1]], [-k[1, 0], k[0, 0]]]) / determinant)


def _filled(
    observations: Observations, inverse: Array, residuals: Array, missing: NDArray[np.bool_]
) -> Observations:
    """Put what the parameters predict in place of the missing currents."""
    change = residuals.reshape(-1, 2) @ inverse.T
    return replace(
        observations,
        jx=observations.jx + np.where(missing[:, 0], change[:, 0], 0.0),
        jy=observations.jy + np.where(missing[:, 1], change[:, 1], 0.0),
    )


def _whitening(
    observations: Observations,
    inverse: Array,
    others: Array | None,
    missing: NDArray[np.bool_] | None,
    *,
    told: bool,
) -> Array:
    """W with Wᵀ·W = V⁻¹, (2n, 2n)."""
    n = len(observations)
    blown = np.ones(2 * n) if missing is None else np.where(missing.ravel(), _DISBELIEVED, 1.0)
    noise = np.zeros(2 * n)
    if told and observations.u_jx is not None and observations.u_jy is not None:
        noise = np.stack((observations.u_jx, observations.u_jy), axis=1).ravel()
        if others is None:
            return np.diag(1.0 / (noise * blown))
    rates = UNTOLD**2 * np.eye(2 * n) if not told else np.zeros((2 * n, 2 * n))
    if told and others is not None:
        rates = others
    left = (inverse @ rates.reshape(n, 2, -1)).reshape(2 * n, 2 * n)
    covariance = (inverse @ left.T.reshape(n, 2, -1)).reshape(2 * n, 2 * n)
    covariance[np.diag_indices(2 * n)] += noise**2
    covariance[np.diag_indices(2 * n)] *= blown**2
    return np.asarray(np.linalg.inv(np.linalg.cholesky((covariance + covariance.T) / 2)), np.float64)


def _solve(design: Array, right_side: Array, whitening: Array, missing: NDArray[np.bool_] | None) -> Fitted:
    scale = np.sqrt(np.einsum("ij,ij->j", design, design))
    scale[scale == 0] = 1.0
    u, s, vh = np.linalg.svd(design / scale, full_matrices=False)
    seen = s > _NO_RANK * s[0]
    u, root = u[:, seen], (vh[seen].T / s[seen]) / scale[:, None]
    values = root @ (u.T @ right_side)
    rest = right_side - design @ values
    count = len(PARAMETERS)
    hidden = (vh[~seen] / scale)[:, :count] * scale[:count]
    known = ~(np.abs(hidden) > _NO_RANK).any(axis=0)
    gone = 0 if missing is None else int(missing.sum())
    return Fitted(
        values=values[:count],
        drift=values[count:],
        covariance=(root @ root.T)[:count, :count],
        known=known,
        squares=float(rest @ rest),
        dof=len(right_side) - gone - int(seen.sum()),
        rest=rest,
        span=u,
        whitening=whitening,
    )
