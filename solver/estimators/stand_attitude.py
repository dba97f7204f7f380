"""How the stand's base stands, from the residuals of one session: azimuth and level about north.

Write the equations (10)-(15) of the paper as complex numbers, x + i·y, with A = a + i·b and n = c + i·d
the north and the upward direction along the case axes, X the eastward one (Ã₁₁ + i·Ã₂₁), K∘J the rates of the
torquers, g = ωg + i·ωк, N and V the Earth's rate along north and up::

    K∘J + ω0 = N·A + (V − g)·n                                                        (10), (11)

A base turned by B (`solver.geometry`) mixes the columns X, A, n of Ã = E·A·B, whatever E and A are. The
equations are solved with the certificate's columns, so a small turn leaves ``rates(turned) − rates(assumed)``:

- about the vertical, ε₃:  N·X·ε₃;
- about north, ε₂:         −(V − g)·X·ε₂;
- about east, ε₁:          A' = A·cos ε₁ − n·sin ε₁,  n' = n·cos ε₁ + A·sin ε₁, at any size.

X is e^(−iψ) at the commanded angles, A and n are X times i·cos θ and i·sin θ. The design matrix knows J, 1, c
and d but not X, which over the sixteen positions is orthogonal to them but for the certified angles, so that the
first two change no parameter and stay in the residuals. These show ``X·(N·ε₃ − (V − g)·ε₂)``: the two turns are
told apart only by ωк in one session, but by different ωg in sessions of several gyros. Hence each is estimated as
if the other were zero, with the correlation of the two estimates. With s the derivative of the residuals by a
turn, L·Lᵀ = K·ΣJ·Kᵀ, and P the projection that takes off whatever L⁻¹·design explains, weighted least squares::

    ε = −(L⁻¹s)ᵀ·P·L⁻¹r / ‖P·L⁻¹s‖²,    u = 1/‖P·L⁻¹s‖,    r₂₃ = (P·L⁻¹s₂)·(P·L⁻¹s₃)·u₂·u₃

A turn about east leaves no residual at all. With m = N/(N·cos ε₁ + (V − g)·sin ε₁) the turned equation times m is ::

    m·(K∘J + ω0) = N·A + (V − g')·n,    V − g' = m·((V − g)·cos ε₁ − N·sin ε₁)

an equation of the same form: a gyro with m∘K, m·ω0 and g' in place of its own shows the same currents
in every position, whichever are measured and by whatever method they are solved. To first order::

    δK = −(V − g)/N∘K·ε₁,    δω0 = −(V − g)/N·ω0·ε₁,    δg = (N + (V − g)²/N)·ε₁

Without u(J) the scatter of what is left gives u, with two degrees of freedom fewer. In the design the
currents are those of the fitted parameters: noise in them would make the invisible seem visible.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.constants import EARTH_RATE
from solver.error_model import design_matrix, earth_rate, right_side
from solver.estimators.batch import Stand
from solver.estimators.conclusion import Solved
from solver.estimators.rate_noise import is_regular, part_of
from solver.geometry import Elements, case_orientation, elements
from solver.records import Array

_ANGLES: Final = ("angles", "angles-common")
_VISIBLE: Final = 1e-3
"""Of the Earth rate: what a turn by 1 rad must leave in an equation. Less comes of arcminutes in certified angles."""
_RANK: Final = 1e-9


@dataclass(frozen=True, slots=True)
class StandAttitude:
    """The base's turn against the certificate, as one session's residuals tell it.

    Attributes
    ----------
    level_north, azimuth : float
        ε₂ and ε₃ of `solver.geometry.base`, rad: each as if the other were zero. NaN where the positions
        do not show it.
    u_level_north, u_azimuth : float
        Standard uncertainties from the currents' noise, rad.
    correlation : float
        Of the two, from the currents' noise.
    u_certificate : (2,) array
        Standard uncertainties of `level_north` and `azimuth` from the certificate's stated angles, rad: an
        error that all sessions by this certificate share.
    dof : float
        Degrees of freedom of `u_level_north` and `u_azimuth`; infinite where u(J) is given.
    level_east : (8,) array
        Change of the estimated parameters, in the order of `PARAMETERS`, per rad of a turn about east (ε₁),
        which leaves no residuals. NaN for parameters that are not determined.
    """

    level_north: float
    u_level_north: float
    azimuth: float
    u_azimuth: float
    correlation: float
    u_certificate: Array
    dof: float
    level_east: Array


@dataclass(frozen=True, slots=True)
class Turns:
    """Both turns of some sessions, by their noise alone.

    Attributes
    ----------
    value, u : (..., 2) array
        Level about north and azimuth, each as if the other were zero, rad.
    correlation : (...) array
        Of the two.
    gain : (..., 2n, 2) array
        ``value = gainᵀ @ residuals``.
    """

    value: Array
    u: Array
    correlation: Array
    gain: Array


def stand_attitude(solved: Solved) -> StandAttitude | None:
    """Estimate the base's attitude from a solved session; None where its noise is not known.

    Parameters
    ----------
    solved
        By any method: what parameters explain is taken off the residuals anyway.
    """
    at, values = solved.problem.observations, solved.values
    if at is None or solved.estimate.uncertainty_basis == "none" or not is_regular(values):
        return None
    orientation = case_orientation(at.theta, at.psi, at.alpha, at.beta, at.gamma)
    u_currents = solved.problem.equations.u_currents
    residuals = solved.estimate.residuals.ravel()
    found = _turns(orientation, values, at.latitude, u_currents, residuals)
    u, dof = found.u, np.inf
    if u_currents is None:
        dof, scale = _scatter(found, residuals, solved.estimate.fit.dof)
        u = u * scale
    stated = part_of(solved.linearise().inputs, _ANGLES)
    blank = np.isnan(solved.estimate.values)
    return StandAttitude(
        level_north=float(found.value[0]),
        u_level_north=float(u[0]),
        azimuth=float(found.value[1]),
        u_azimuth=float(u[1]),
        correlation=float(found.correlation),
        u_certificate=np.sqrt(np.einsum("mk,mn,nk->k", found.gain, stated, found.gain)),
        dof=dof,
        level_east=np.where(blank, np.nan, level_east_signature(values, at.latitude)),
    )


def turns_of_sessions(
    stand: Stand, angles: Array, currents: tuple[Array, Array], u_currents: tuple[Array, Array], values: Array
) -> Turns:
    """Estimate both turns of N sessions of the same positions at once.

    Parameters
    ----------
    stand, angles
        As for `solver.estimators.batch.solve_sessions`.
    currents, u_currents : two of (N, n) array
        Mean Jx and Jy and their standard uncertainties, A.
    values : (N, 8) array
        Parameters, solved.
    """
    orientation = case_orientation(stand.theta, stand.psi, *np.moveaxis(angles, -1, 0))
    here = elements(orientation)
    design = design_matrix(here, *currents)
    residuals = right_side(here, *earth_rate(stand.latitude)) - np.einsum("sij,sj->si", design, values)
    spread = np.stack(np.broadcast_arrays(*u_currents, currents[0])[:2], axis=-1)
    return _turns(orientation, values, stand.latitude, spread, residuals)


def level_east_signature(parameters: Array, latitude: float) -> Array:
    """Change of the parameters (..., 8) per rad of a turn of the base about east, (..., 8).

    NaN at a pole, where east has no meaning.
    """
    north, up = earth_rate(latitude)
    if abs(north) < _RANK * EARTH_RATE:
        return np.full(np.shape(parameters), np.nan)
    kx, ky, kxy, kyx, w0x, w0y, wg, wk = np.moveaxis(parameters, -1, 0)
    rest = up - (wg + 1j * wk)
    factor = -rest / north
    by_jx, by_jy, bias = (factor * (x + 1j * y) for x, y in ((kx, kyx), (kxy, ky), (w0x, w0y)))
    specific = north + rest**2 / north
    return np.stack(
        (by_jx.real, by_jy.imag, by_jy.real, by_jx.imag, bias.real, bias.imag, specific.real, specific.imag),
        axis=-1,
    )


def _turns(
    orientation: Array, values: Array, latitude: float, u_currents: Array | None, residuals: Array
) -> Turns:
    """Both turns by weighted least squares; leading axes are sessions. Without u(J) `u` is that of unit noise.

    Parameters
    ----------
    orientation : (..., n, 3, 3) array
    values : (..., 8) array
    u_currents : (..., n, 2) array or None
    residuals : (..., 2n) array
    """
    here = elements(orientation)
    inverse = np.linalg.inv(np.stack((values[..., [0, 2]], values[..., [3, 1]]), axis=-2))[..., None, :, :]
    if u_currents is None:
        whitening = np.broadcast_to(np.eye(2), (*here.c.shape, 2, 2))
    else:
        whitening = inverse / u_currents[..., :, None]
    design = _by_position(_exact_design(here, values, inverse, latitude))
    turning = _sensitivity(orientation, values, latitude)
    seen = _remaining(_flat(whitening @ design), _flat(whitening @ turning))
    normal = seen.swapaxes(-1, -2) @ seen
    length = np.sqrt(np.einsum("...ii->...i", normal))
    least = _VISIBLE * EARTH_RATE * np.sqrt(np.einsum("...nij,...nij->...", whitening, whitening))
    with np.errstate(divide="ignore"):
        u = np.where(length > least[..., None], 1.0 / length, np.nan)
    gain = -_flat(whitening.swapaxes(-1, -2) @ _by_position(seen)) * (u**2)[..., None, :]
    return Turns(
        value=np.einsum("...mk,...m->...k", gain, residuals),
        u=u,
        correlation=normal[..., 0, 1] * u[..., 0] * u[..., 1],
        gain=gain,
    )


def _exact_design(here: Elements, values: Array, inverse: Array, latitude: float) -> Array:
    """Design with the currents that the parameters would give: noise in them would show the invisible."""
    rates = right_side(here, *earth_rate(latitude))
    none = np.zeros_like(here.c)
    drifts = np.einsum("...ij,...j->...i", design_matrix(here, none, none), values)
    exact = np.einsum("...ij,...j->...i", inverse, (rates - drifts).reshape(*here.c.shape, 2))
    return design_matrix(here, exact[..., 0], exact[..., 1])


def _sensitivity(orientation: Array, values: Array, latitude: float) -> Array:
    """Derivative of each position's residuals by both turns, (..., n, 2, 2)."""
    north, up = earth_rate(latitude)
    east = orientation[..., 0, 0] + 1j * orientation[..., 1, 0]
    rest = up - (values[..., 6] + 1j * values[..., 7])[..., None]
    turning = np.stack((-rest * east, north * east), axis=-1)
    return np.stack((turning.real, turning.imag), axis=-2)


def _by_position(rows: Array) -> Array:
    """(..., 2n, k) to (..., n, 2, k)."""
    return rows.reshape(*rows.shape[:-2], rows.shape[-2] // 2, 2, rows.shape[-1])


def _flat(rows: Array) -> Array:
    """(..., n, 2, k) to (..., 2n, k)."""
    return rows.reshape(*rows.shape[:-3], 2 * rows.shape[-3], rows.shape[-1])


def _remaining(design: Array, columns: Array) -> Array:
    """What is left of `columns` (..., m, k) once `design` (..., m, 8) has explained its part."""
    scale = np.sqrt(np.einsum("...ij,...ij->...j", design, design))
    scaled = design / np.where(scale > 0.0, scale, 1.0)[..., None, :]
    basis, spectrum, _ = np.linalg.svd(scaled, full_matrices=False)
    basis = basis * (spectrum > _RANK * spectrum[..., :1])[..., None, :]
    return np.asarray(columns - basis @ (basis.swapaxes(-1, -2) @ columns))


def _scatter(found: Turns, residuals: Array, dof: int) -> tuple[float, float]:
    """Degrees of freedom and standard deviation of what is left when both turns are taken off as well."""
    visible = found.gain[:, np.isfinite(found.u)]
    answer, _, rank, _ = np.linalg.lstsq(visible, residuals, rcond=_VISIBLE)
    rest = residuals - visible @ answer
    freedom = float(dof - int(rank))
    return freedom, float(np.sqrt(rest @ rest / freedom)) if freedom > 0 else np.nan
