"""The inputs' uncertainty: how an error of any input shows in the residuals.

To first order an error δz of the inputs changes the residuals by S·δz and, through an estimator
``q = H·right_side`` of the observation equations, the parameters by ``δq = H·S·δz``. The columns of
S are derivatives of the residuals (right side minus left side of (10)-(15)) by

- the mean currents of each position: −K (paper, eqs. (10)-(15));
- the certified misalignment α, β, γ of each position, through Ã = E·A·B (paper, eqs. (8), (9));
- what all positions of a session have in common, `COMMON`: gain and offset of the ammeter, the
  systematic part of the certificate's angles, the base's level and azimuth, latitude, gravity, and
  the temperature at which the gyro was measured.

An error counts as *true minus assumed*.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.current_noise import CurrentNoise, current_noise
from solver.error_model import design_matrix, earth_rate, right_side, scale_matrix
from solver.errors import InputError, Message
from solver.geometry import case_orientation, elements
from solver.records import PARAMETERS, Array, Observations

COMMON: Final = (
    "gain_x", "gain_y", "offset_x", "offset_y", "alpha", "beta", "gamma",
    "level_1", "level_2", "azimuth", "latitude", "gravity", "temperature",
)  # fmt: skip
"""What all positions of a session share: relative gain, offset in A, angles in rad, relative gravity, K."""

SOURCES: Final[Mapping[str, tuple[str, ...]]] = {
    "currents": (),
    "angles": (),
    "ammeter-gain": ("gain_x", "gain_y"),
    "ammeter-offset": ("offset_x", "offset_y"),
    "angles-common": ("alpha", "beta", "gamma"),
    "level": ("level_1", "level_2"),
    "azimuth": ("azimuth",),
    "latitude": ("latitude",),
    "gravity": ("gravity",),
    "temperature": ("temperature",),
}
"""Lines of the budget, in their order, with the common inputs that each one gathers."""

_TOLERANCE: Final = 1e-9


def _none() -> Array:
    return np.zeros(len(COMMON))


def _infinite() -> Array:
    return np.full(len(COMMON), np.inf)


@dataclass(frozen=True, slots=True)
class CommonUncertainty:
    """Uncertainty of what all positions of a session share.

    Attributes
    ----------
    standard : (13,) array
        Standard uncertainties in the order of `COMMON`.
    correlation : (13, 13) array
        Their correlation coefficients.
    dof : (13,) array
        Degrees of freedom of each standard uncertainty.
    temperature_coefficients : (8,) array
        Change of each parameter per kelvin, in the order of `PARAMETERS`.
    """

    standard: Array = field(default_factory=_none)
    correlation: Array = field(default_factory=lambda: np.eye(len(COMMON)))
    dof: Array = field(default_factory=_infinite)
    temperature_coefficients: Array = field(default_factory=lambda: np.zeros(len(PARAMETERS)))

    @classmethod
    def of(
        cls,
        standard: Mapping[str, float],
        *,
        correlation: Mapping[tuple[str, str], float] | None = None,
        dof: Mapping[str, float] | None = None,
        temperature_coefficients: Mapping[str, float] | None = None,
    ) -> "CommonUncertainty":
        """Gather from names; what is not named is zero, uncorrelated, of infinite degrees of freedom.

        Raises
        ------
        InputError
            When a name is unknown, a standard uncertainty negative or not finite, a correlation
            coefficient beyond ±1, or the correlations contradict one another.
        """
        u, freedom, correlated = _none(), _infinite(), np.eye(len(COMMON))
        for name, value in standard.items():
            u[_index(name)] = value
        for name, value in (dof or {}).items():
            freedom[_index(name)] = value
        for (one, other), value in (correlation or {}).items():
            i, j = _index(one), _index(other)
            correlated[i, j] = correlated[j, i] = value
        coefficients = np.zeros(len(PARAMETERS))
        for name, value in (temperature_coefficients or {}).items():
            coefficients[PARAMETERS.index(name)] = value
        _check(u, correlated, freedom)
        return cls(u, correlated, freedom, coefficients)

    @property
    def covariance(self) -> Array:
        """Covariance in the order of `COMMON`, (13, 13)."""
        return np.asarray(self.correlation * np.outer(self.standard, self.standard))


def _index(name: str) -> int:
    if name not in COMMON:
        raise InputError(
            Message("unknown-input", "There is no input “%(name)s”. Choose from %(names)s.",
                    {"name": name, "names": ", ".join(COMMON)})
        )  # fmt: skip
    return COMMON.index(name)


def _check(u: Array, correlation: Array, dof: Array) -> None:
    for row, name in enumerate(COMMON):
        if not (np.isfinite(u[row]) and u[row] >= 0 and dof[row] > 0):
            raise InputError(
                Message("bad-uncertainty", "The standard uncertainty of %(name)s must be finite and not negative, "
                        "its degrees of freedom positive.", {"name": name})
            )  # fmt: skip
    if not (np.abs(correlation) <= 1).all() or np.linalg.eigvalsh(correlation)[0] < -_TOLERANCE:
        raise InputError(
            Message("bad-correlation", "The correlation coefficients contradict one another: no inputs can be "
                    "correlated like that. Each lies between −1 and 1.")
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Inputs:
    """Every uncertain input of a session, with its effect on the residuals.

    Attributes
    ----------
    source : (s,) array of str
        Line of the budget, a key of `SOURCES`, that each input belongs to.
    sensitivity : (2n, s) array
        S: derivative of the residuals by each input.
    covariance : (s, s) array
        Of the inputs.
    dof : (s,) array
        Degrees of freedom of each input's standard uncertainty.
    """

    source: NDArray[np.str_]
    sensitivity: Array
    covariance: Array
    dof: Array

    @property
    def residual_covariance(self) -> Array:
        """S·Σ·Sᵀ, (2n, 2n), (rad/s)²."""
        whole = self.sensitivity @ self.covariance @ self.sensitivity.T
        return (whole + whole.T) / 2


def inputs_of(
    observations: Observations,
    parameters: Array,
    common: CommonUncertainty | None = None,
    u_currents: Array | None = None,
) -> Inputs:
    """Gather the uncertain inputs of a session around given parameters; those without uncertainty are left out.

    Parameters
    ----------
    observations
    parameters : (8,) array
    common
        None: nothing common is uncertain.
    u_currents : (n, 2) array, optional
        Noise of the mean currents, A, when `observations` does not tell it; without either, the
        currents are left out.
    """
    at = observations
    source: list[str] = []
    columns, variances, dof = [], [], []

    def add(lines: list[str], sensitivity: Array, u: Array, freedom: Array) -> None:
        source.extend(lines)
        columns.append(sensitivity)
        variances.append(u**2)
        dof.append(freedom)

    noise = current_noise(at)
    if u_currents is not None:
        noise = CurrentNoise(u_currents, np.stack((at.dof_jx, at.dof_jy), axis=1))
    if noise is not None:
        lines = ["currents"] * noise.u.size
        add(lines, by_currents(len(at), parameters), noise.u.ravel(), noise.dof.ravel())
    if at.u_alpha.any() or at.u_beta.any() or at.u_gamma.any():
        sensitivity, u = _angles(at, parameters)
        add(["angles"] * len(u), sensitivity, u, np.full(len(u), np.inf))
    shared = common is not None and bool(common.standard.any())
    if common is not None and shared:
        add([_line(name) for name in COMMON], by_common(at, parameters, common), common.standard, common.dof)
    if not source:
        return Inputs(np.array([], dtype=str), np.zeros((2 * len(at), 0)), np.zeros((0, 0)), np.zeros(0))
    every = np.concatenate(variances)
    covariance = np.diag(every)
    if common is not None and shared:
        covariance[-len(COMMON) :, -len(COMMON) :] = common.covariance
    used = every > 0
    return Inputs(
        np.array(source)[used],
        np.hstack(columns)[:, used],
        covariance[np.ix_(used, used)],
        np.concatenate(dof)[used],
    )


def _line(name: str) -> str:
    """Line of the budget that a common input belongs to."""
    return next(line for line, members in SOURCES.items() if name in members)


def by_currents(count: int, parameters: Array) -> Array:
    """Derivative of the residuals by the currents, (2n, 2n): −K for every position."""
    return np.asarray(np.kron(np.eye(count), -scale_matrix(parameters)), np.float64)


def by_angles(observations: Observations, parameters: Array) -> Array:
    """Derivative of each position's two residuals by its α, β, γ, (n, 2, 3)."""
    return _by_angles(observations, _orientation(observations), parameters)


def _orientation(observations: Observations) -> Array:
    at = observations
    return case_orientation(at.theta, at.psi, at.alpha, at.beta, at.gamma)


def _by_angles(observations: Observations, orientation: Array, parameters: Array) -> Array:
    """The same from Ã: a turn about v changes every column w of Ã by −v × w.

    v is R₃·R₂·e₁ for α, R₃·e₂ for β and e₃ for γ.
    """
    beta, gamma = observations.beta, observations.gamma
    none, one = np.zeros_like(beta), np.ones_like(beta)
    about = np.array(
        [
            [np.cos(beta) * np.cos(gamma), -np.cos(beta) * np.sin(gamma), np.sin(beta)],
            [np.sin(gamma), np.cos(gamma), none],
            [none, none, one],
        ]
    )
    north, up = orientation[..., 1].T, orientation[..., 2].T
    changes = [
        _by_columns(_minus_cross(v, north), _minus_cross(v, up), observations.latitude, parameters)
        for v in about
    ]
    return np.stack(changes, axis=-1)


def _minus_cross(v: Array, w: Array) -> tuple[Array, Array]:
    """First two components of −v × w; v and w are (3, n)."""
    return v[2] * w[1] - v[1] * w[2], v[0] * w[2] - v[2] * w[0]


def _by_columns(
    north: tuple[Array, Array], up: tuple[Array, Array], latitude: float, parameters: Array
) -> Array:
    """Change of the residuals, (n, 2), when a, b change by `north` and c, d by `up`."""
    horizontal, vertical = earth_rate(latitude)
    wg, wk = parameters[6:]
    x = horizontal * north[0] + (vertical - wg) * up[0] + wk * up[1]
    y = horizontal * north[1] + (vertical - wg) * up[1] - wk * up[0]
    return np.stack((x, y), axis=-1)


def by_common(observations: Observations, parameters: Array, common: CommonUncertainty) -> Array:
    """Derivative of the residuals by what is in common, (2n, 13), in the order of `COMMON`."""
    at = observations
    orientation = _orientation(at)
    here = elements(orientation)
    design = design_matrix(here, at.jx, at.jy)
    k = scale_matrix(parameters)
    columns = np.zeros((2 * len(at), len(COMMON)))
    for channel, current in enumerate((at.jx, at.jy)):
        columns[:, channel] = -np.outer(current, k[:, channel]).ravel()
        columns[:, 2 + channel] = -np.tile(k[:, channel], len(at))
    columns[:, 4:7] = _by_angles(at, orientation, parameters).reshape(-1, 3)
    columns[:, 7:10] = _by_base(at, orientation, parameters)
    north, up = earth_rate(at.latitude)
    columns[:, 10] = right_side(here, -up, north)
    columns[:, 11] = -design[:, 6:] @ parameters[6:]
    columns[:, 12] = -design @ common.temperature_coefficients
    return columns


def _by_base(observations: Observations, orientation: Array, parameters: Array) -> Array:
    """Derivative by level and azimuth, (2n, 3): a turn of the base about eₖ changes Ã·w by −Ã·(eₖ × w)."""
    east, north, up = ((column[:, 0], column[:, 1]) for column in np.moveaxis(orientation, -1, 0))
    none = np.zeros(len(observations))
    nothing = (none, none)
    changes = (((-up[0], -up[1]), north), (nothing, (-east[0], -east[1])), (east, nothing))
    return np.stack(
        [
            _by_columns(of_north, of_up, observations.latitude, parameters).ravel()
            for of_north, of_up in changes
        ],
        axis=-1,
    )


def _angles(observations: Observations, parameters: Array) -> tuple[Array, Array]:
    """Columns for α, β, γ of each distinct position, and their standard uncertainties: repeats share them."""
    at = observations
    places = np.stack((at.theta, at.psi), axis=1)
    _, first, place = np.unique(places, axis=0, return_index=True, return_inverse=True)
    derivative = by_angles(observations, parameters)
    columns = np.zeros((len(at), 2, len(first), 3))
    columns[np.arange(len(at)), :, place.ravel(), :] = derivative
    u = np.stack((at.u_alpha, at.u_beta, at.u_gamma), axis=1)[first]
    return columns.reshape(2 * len(at), -1), u.ravel()
