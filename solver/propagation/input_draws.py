"""Random draws of a session's uncertain inputs: JCGM 101:2008, clause 6.

They are the inputs of `solver.inputs`, each with its stated standard uncertainty, correlations and
degrees of freedom, and errors count the same way, true minus assumed::

    J   = (J₀ + δJ)·(1 + δgain) + δoffset
    Ã   = E(α₀ + δα + δα_common, …)·A(θ, ψ)·B(δlevel, δlevel, δazimuth)      by true rotations
    φ   = φ₀ + δφ,   nx, ny = (c, d)·(1 + δg)

Distributions: normal (6.4.7), or with ν degrees of freedom the scaled and shifted t (6.4.9), whose
standard deviation is u·√(ν/(ν − 2)); for ν ≤ 2 it has none, and only intervals mean anything.
Correlated inputs are drawn jointly, with one χ² for the group and the smallest ν in it, as
`solver.propagation.uncertainty` groups them. Repeats of a position share its angles.

Draws lie along the last axis: (rows, m), so that every operation runs over contiguous memory.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.current_noise import current_noise
from solver.error_model import scale_matrix
from solver.geometry import commanded
from solver.inputs import COMMON, CommonUncertainty
from solver.propagation.uncertainty import linked
from solver.records import Array, Observations

_ANGLES: Final = slice(COMMON.index("alpha"), COMMON.index("gamma") + 1)
_BASE: Final = slice(COMMON.index("level_1"), COMMON.index("azimuth") + 1)
_GAIN, _OFFSET = COMMON.index("gain_x"), COMMON.index("offset_x")
_LATITUDE, _GRAVITY = COMMON.index("latitude"), COMMON.index("gravity")
_TEMPERATURE: Final = COMMON.index("temperature")


@dataclass(frozen=True, slots=True)
class Errors:
    """Drawn errors of the inputs, true minus assumed.

    Attributes
    ----------
    currents : (2, n, m) array or None
        Of Jx and Jy, A; None when they are certain.
    angles : (3, n, m) array or None
        Of α, β, γ, the same for repeats of a position, rad; without what is common.
    common : (13, m) array
        In the order of `COMMON`; zero where certain.
    """

    currents: Array | None
    angles: Array | None
    common: Array


@dataclass(frozen=True, slots=True)
class Drawn:
    """What the observation equations are made of, in m draws.

    Attributes
    ----------
    features : (4, n, m) array
        Jx, Jy (A), and nx, ny (in units of the assumed g): the coefficients in the design.
    rates : (2, n, m) array
        Right sides of the x and y equations, rad/s.
    temperature : (m,) array
        Error of the temperature, K.
    """

    features: Array
    rates: Array
    temperature: Array


@dataclass(frozen=True, slots=True)
class InputDraws:
    """A session's uncertain inputs, ready to be drawn; make it with `input_draws`.

    `mixing` (2, 2) or `u_currents` (2, n) turn standard deviates into errors of the currents;
    `dof_currents` (2, n) are theirs, `dof_mixing` that of the scatter behind `mixing`. `place` (n,)
    numbers the distinct positions, to which `u_angles` (3, d) belong. `root` (13, r) turns r
    standard deviates into the common errors, each column of the group `group` (r,) with
    `dof_group`. `turned` (3, n, 3) is A(θ, ψ).
    """

    observations: Observations
    u_currents: Array | None
    dof_currents: Array
    mixing: Array | None
    dof_mixing: float
    place: NDArray[np.int64]
    u_angles: Array
    root: Array
    group: NDArray[np.int64]
    dof_group: Array
    uncertain: NDArray[np.bool_]
    turned: Array

    def errors(self, rng: np.random.Generator, count: int) -> Errors:
        """Draw the errors of all inputs."""
        n = len(self.observations)
        currents = angles = None
        if self.mixing is not None:
            deviates = rng.standard_normal((2, n, count))
            deviates *= _stretch(rng, self.dof_mixing, count)
            currents = np.einsum("ab,bnm->anm", self.mixing, deviates)
        elif self.u_currents is not None:
            currents = rng.standard_normal((2, n, count))
            for channel, row in np.argwhere(np.isfinite(self.dof_currents)):
                currents[channel, row] *= _stretch(rng, self.dof_currents[channel, row], count)
            currents *= self.u_currents[:, :, None]
        if self.u_angles.any():
            angles = rng.standard_normal((3, self.u_angles.shape[1], count))
            angles *= self.u_angles[:, :, None]
            if self.u_angles.shape[1] != n:
                angles = angles[:, self.place]
        deviates = rng.standard_normal((self.root.shape[1], count))
        for group in np.unique(self.group[np.isfinite(self.dof_group)]):
            members = self.group == group
            deviates[members] *= _stretch(rng, float(self.dof_group[members].min()), count)
        return Errors(currents, angles, self.root @ deviates)

    def apply(self, errors: Errors) -> Drawn:
        """Put errors into the inputs and recompute the observation equations."""
        at, common = self.observations, errors.common
        count = common.shape[1]
        features = np.empty((4, len(at), count))
        for channel, assumed in enumerate((at.jx, at.jy)):
            out = features[channel]
            out[:] = assumed[:, None]
            if errors.currents is not None:
                out += errors.currents[channel]
            if self.uncertain[_GAIN + channel]:
                out *= 1.0 + common[_GAIN + channel]
            if self.uncertain[_OFFSET + channel]:
                out += common[_OFFSET + channel]
        x, y = self._orientation(errors)
        latitude = at.latitude + common[_LATITUDE] if self.uncertain[_LATITUDE] else np.array([at.latitude])
        north, up = EARTH_RATE * np.cos(latitude), EARTH_RATE * np.sin(latitude)
        rates = np.empty((2, len(at), count))
        for channel, (a, c) in enumerate((x, y)):
            np.multiply(c, up, out=rates[channel])
            rates[channel] += a * north
            features[2 + channel] = c
        if self.uncertain[_GRAVITY]:
            features[2:] *= 1.0 + common[_GRAVITY]
        return Drawn(features, rates, common[_TEMPERATURE])

    def _orientation(self, errors: Errors) -> tuple[Array, Array]:
        """Components of north and up along the case axes: x = (a, c) and y = (b, d), each (2, n, m or 1)."""
        at, common = self.observations, errors.common
        if self.uncertain[_BASE].any():
            level, still = common[_BASE], np.eye(3)[:, 1:, None]
            columns = np.stack(
                (*_turned(still, level), _turned_third(still, level))
            )  # B's last two, (3, 2, m)
            flat = self.turned.reshape(-1, 3) @ columns.transpose(1, 0, 2)
        else:
            flat = (self.turned.reshape(-1, 3)[:, 1:].T)[:, :, None]
        vectors = flat.reshape(2, 3, len(at), -1).transpose(1, 0, 2, 3)
        angles = np.stack((at.alpha, at.beta, at.gamma))[:, :, None]
        if errors.angles is not None:
            angles = angles + errors.angles
        if self.uncertain[_ANGLES].any():
            angles = angles + common[_ANGLES, None, :]
        return _turned(vectors, angles)


def input_draws(
    observations: Observations,
    values: Array,
    common: CommonUncertainty | None = None,
    u_currents: Array | None = None,
    scatter: tuple[float, float] | None = None,
    inflation: float = 1.0,
    widening: Array | None = None,
) -> InputDraws:
    """Prepare the draws of a session's inputs.

    Parameters
    ----------
    observations
    values : (8,) array
        The estimate; it turns the residuals' scatter into noise of the currents.
    common
        None: nothing common is uncertain.
    u_currents : (n, 2) array, optional
        Noise of the mean currents, A, when `observations` does not tell it.
    scatter : (variance, dof), optional
        Variance of the residuals, (rad/s)², and its degrees of freedom: the noise is then drawn from
        it, jointly, and neither u(J) nor, unless positions are repeated, the random errors of the
        angles are (as in `solver.propagation.budget`).
    inflation : float
        Factor on u(J) and the random errors of the angles, the robust method's.
    widening : (n, 2) array, optional
        Factors on u(J) alone (`solver.estimators.estimated_weights`).
    """
    at = observations
    common = common or CommonUncertainty()
    dof_currents, noise = np.stack((at.dof_jx, at.dof_jy)), current_noise(at)
    if u_currents is None and noise is not None:
        u_currents, dof_currents = noise.u, np.ascontiguousarray(noise.dof.T)
    if u_currents is not None and widening is not None:
        u_currents = u_currents * widening
    _, first, place = np.unique(
        np.stack((at.theta, at.psi), axis=1), axis=0, return_index=True, return_inverse=True
    )
    u_angles = np.stack((at.u_alpha, at.u_beta, at.u_gamma))[:, first]
    mixing, dof_mixing = None, np.inf
    if scatter is not None:
        mixing, dof_mixing = np.linalg.inv(scale_matrix(values)) * np.sqrt(scatter[0]), scatter[1]
        if len(first) == len(at):
            u_angles = np.zeros_like(u_angles)
    uncertain = common.standard > 0
    root, group = _root(common.covariance)
    return InputDraws(
        observations=at,
        u_currents=None if u_currents is None else np.ascontiguousarray(inflation * u_currents.T),
        dof_currents=dof_currents,
        mixing=mixing,
        dof_mixing=dof_mixing,
        place=place.ravel(),
        u_angles=inflation * u_angles,
        root=root,
        group=group,
        dof_group=np.array([common.dof[uncertain & (linked(common.covariance) == g)].min() for g in group]),
        uncertain=uncertain,
        turned=np.ascontiguousarray(commanded(at.theta, at.psi).transpose(1, 0, 2)),
    )


def _root(covariance: Array) -> tuple[Array, NDArray[np.int64]]:
    """R with R·Rᵀ = `covariance`, which may be singular; a group of correlated inputs per block of columns."""
    label = linked(covariance)
    columns, groups = [np.empty((len(covariance), 0))], []
    for group in np.unique(label):
        members = np.flatnonzero(label == group)
        if not np.diagonal(covariance)[members].any():
            continue
        spread, vectors = np.linalg.eigh(covariance[np.ix_(members, members)])
        block = np.zeros((len(covariance), len(members)))
        block[members] = vectors * np.sqrt(np.maximum(spread, 0.0))
        columns.append(block)
        groups += [group] * len(members)
    return np.hstack(columns), np.array(groups, np.int64)


def _stretch(rng: np.random.Generator, dof: float, count: int) -> Array | float:
    """√(ν/χ²_ν), (m,), by which normal deviates become Student's t; 1 for infinite ν."""
    if not np.isfinite(dof):
        return 1.0
    return np.asarray(np.sqrt(dof / 2 / rng.standard_gamma(dof / 2, count)))


def _turned(vectors: Array, angles: Array) -> tuple[Array, Array]:
    """First two components of R₃(t₃)·R₂(t₂)·R₁(t₁) applied to vectors, (k, …) each.

    `vectors` (3, k, …), components first, and `angles` (3, …) broadcast.
    """
    (s1, s2, s3), (c1, c2, c3) = np.sin(angles), np.cos(angles)
    v1, v2, v3 = vectors
    t2 = v2 * c1
    t2 += v3 * s1
    t3 = v3 * c1
    t3 -= v2 * s1
    t1 = v1 * c2 - t3 * s2
    x = t1 * c3
    x += t2 * s3
    y = t2 * c3
    y -= t1 * s3
    return x, y


def _turned_third(vectors: Array, angles: Array) -> Array:
    """Third component of the same."""
    (s1, s2, _), (c1, c2, _) = np.sin(angles), np.cos(angles)
    v1, v2, v3 = vectors
    return np.asarray((v3 * c1 - v2 * s1) * c2 + v1 * s2)
