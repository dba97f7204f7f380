"""Error model of the gyro and the observation equations of one position.

Parameters ``q`` stand in the order of `solver.records.PARAMETERS`. At a position with currents
(Jx, Jy) and orientation elements a, b, c, d (paper, eqs. (10)-(15))::

    Kx·Jx  + Kxy·Jy + ω0x + ωg·c − ωк·d = ωг·a + ωв·c          x
    Kyx·Jx + Ky·Jy  + ω0y + ωк·c + ωg·d = ωг·b + ωв·d          y

Both are linear in q: ``design @ q = right_side``. Rows are interleaved: x and y of the first
position, x and y of the second, … Residual is always right side minus left side, so that its
derivative by q is ``−design`` and by the currents of its position ``−K`` with
K = [[Kx, Kxy], [Kyx, Ky]].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solver.constants import EARTH_RATE
from solver.current_noise import current_noise
from solver.geometry import Elements, elements_of
from solver.records import Array, Observations


@dataclass(frozen=True, slots=True)
class Equations:
    """The observation equations of a session.

    Attributes
    ----------
    design : (2n, 8) array
        Coefficients of the parameters; the measured currents stand in its first four columns.
    right_side : (2n,) array
        Earth rate along the case axes, rad/s.
    u_currents : (n, 2) array or None
        Standard uncertainties of Jx and Jy to weigh by, A (`solver.current_noise`).
    dof_currents : (n, 2) array or None
        Their degrees of freedom; None: they are known.
    """

    design: Array
    right_side: Array
    u_currents: Array | None
    dof_currents: Array | None = None

    def residuals(self, parameters: Array) -> Array:
        """Right side minus left side, (2n,), rad/s."""
        return self.right_side - self.design @ parameters


def observation_equations(observations: Observations) -> Equations:
    """Set up (10)-(15) for every measured position."""
    at = elements_of(observations)
    noise = current_noise(observations)
    return Equations(
        design=design_matrix(at, observations.jx, observations.jy),
        right_side=right_side(at, *earth_rate(observations.latitude)),
        u_currents=None if noise is None else noise.u,
        dof_currents=None if noise is None else noise.dof,
    )


def earth_rate(latitude: float) -> tuple[float, float]:
    """Horizontal (north) and vertical (up) part of the Earth rate, rad/s; `latitude` in rad."""
    return EARTH_RATE * float(np.cos(latitude)), EARTH_RATE * float(np.sin(latitude))


def design_matrix(at: Elements, jx: Array, jy: Array) -> Array:
    """Coefficients of the eight parameters, (..., 2n, 8).

    Parameters
    ----------
    at
        Orientation elements, (n,) each or (..., n).
    jx, jy : (..., n) array
        Currents, A; leading axes make a batch.
    """
    shape = np.broadcast_shapes(jx.shape, at.c.shape)
    design = np.zeros((*shape, 2, 8))
    design[..., 0, 0] = design[..., 1, 3] = jx
    design[..., 0, 2] = design[..., 1, 1] = jy
    design[..., 0, 4] = design[..., 1, 5] = 1.0
    design[..., 0, 6] = design[..., 1, 7] = at.c
    design[..., 1, 6] = at.d
    design[..., 0, 7] = -at.d
    return design.reshape(*shape[:-1], 2 * shape[-1], 8)


def right_side(at: Elements, north: float, up: float) -> Array:
    """Earth rate along the case axes x and y, (..., 2n), rad/s."""
    rates = np.stack((north * at.a + up * at.c, north * at.b + up * at.d), axis=-1)
    return rates.reshape(*rates.shape[:-2], -1)


def drift(
    parameters: Array,
    force: tuple[ArrayLike, ArrayLike, ArrayLike],
    wn: float = 0.0,
    deflection: tuple[float, float] = (0.0, 0.0),
    restraint: tuple[float, float] = (0.0, 0.0),
) -> tuple[Array, Array]:
    """Drift rates ωpx and ωpy of the full model: paper, eq. (3).

    Parameters
    ----------
    parameters : (8,) array
        Of them ``w0x w0y wg wk`` are used.
    force
        Specific force nx, ny, nz along the case axes, in units of g.
    wn
        g²-sensitive drift, rad/s per g².
    deflection
        Rotor's deflection α_r, β_r against the case, rad; zero in rate mode with an integrating loop.
    restraint
        ωτ and ωΔf, 1/s: damping and detuning.
    """
    w0x, w0y, wg, wk = parameters[4:]
    nx, ny, nz = (np.asarray(component, dtype=np.float64) for component in force)
    (alpha_r, beta_r), (w_tau, w_df) = deflection, restraint
    x = w0x - w_tau * alpha_r + w_df * beta_r + wg * nx - wk * ny + wn * nx * nz
    y = w0y - w_tau * beta_r - w_df * alpha_r + wk * nx + wg * ny + wn * ny * nz
    return x, y


def scale_matrix(parameters: Array) -> Array:
    """K = [[Kx, Kxy], [Kyx, Ky]], rad/(s·A)."""
    kx, ky, kxy, kyx = parameters[:4]
    return np.array([[kx, kxy], [kyx, ky]])


def currents(parameters: Array, at: Elements, latitude: float, wn: float = 0.0) -> tuple[Array, Array]:
    """Steady torquer currents of a gyro with given parameters: (10)-(15) solved for Jx, Jy, A."""
    drift_x, drift_y = drift(parameters, (at.c, at.d, at.e), wn)
    rates = right_side(at, *earth_rate(latitude)).reshape(*at.c.shape, 2)
    left = rates - np.stack((drift_x, drift_y), axis=-1)
    measured = np.asarray(np.linalg.solve(scale_matrix(parameters), left[..., None]), np.float64)[..., 0]
    return measured[..., 0], measured[..., 1]


def rate_covariance(parameters: Array, u_currents: Array) -> Array:
    """Covariance K·ΣJ·Kᵀ that the currents' noise gives a position's two residuals, (n, 2, 2)."""
    gain = scale_matrix(parameters) * u_currents[:, None, :]
    return gain @ gain.transpose(0, 2, 1)
