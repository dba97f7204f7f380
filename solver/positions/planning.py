"""Observability before measuring: what a list of positions will tell, and which positions tell most.

A gyro of nominal parameters would show known currents at each position (`solver.error_model.currents`),
so the design matrix of (10)-(15), its rank and the weighted least-squares gain H are known before
anything is measured. With S·Σ·Sᵀ the covariance that all uncertain inputs give the residuals
(`solver.inputs`), the parameters will have the covariance H·S·Σ·Sᵀ·Hᵀ. Nominal biases do
not change what is learned of K: they add multiples of their own columns to those of the currents.
Nominal g-sensitive drifts do: each channel's currents then follow gravity, which K is learned from too.

The uncertainty of a mean current falls with the root of the measuring time down to a floor. Under a
fixed total time, more positions mean less time at each, and more of it spent on moving.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.error_model import currents, observation_equations, scale_matrix
from solver.errors import InputError, Message
from solver.estimators.observability import find_invisible, natural_scale, unobservable
from solver.geometry import Elements, case_orientation, elements
from solver.inputs import CommonUncertainty, inputs_of
from solver.least_squares import solve
from solver.measurement_rule import LEAST_DURATION, RULE_TOLERANCE
from solver.positions.plan_words import WEAK, undetermined, weak
from solver.propagation.budget import Budget, make_budget
from solver.records import Array, Observations

FEWEST: Final = 4
"""Positions that give as many equations as there are parameters."""


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Noise of a mean current over the time t it is measured: u² = white²/t + floor².

    Attributes
    ----------
    white : float
        A·√s.
    floor : float
        A; what no longer measuring takes away.
    """

    white: float
    floor: float = 0.0

    def __post_init__(self) -> None:
        if not (0 <= self.white < np.inf and 0 <= self.floor < np.inf and self.white + self.floor > 0):
            raise InputError(
                Message("bad-noise", "The noise must be finite and not negative, and not zero altogether.")
            )

    def u(self, duration: float) -> float:
        """Standard uncertainty of a mean over `duration` seconds, A."""
        return float(np.hypot(self.white / duration**0.5, self.floor))


@dataclass(frozen=True, slots=True)
class Places:
    """Positions of a stand with their certified misalignment, (n,) each, rad; a repeat stands there again.

    `u_alpha`, `u_beta`, `u_gamma` are standard uncertainties, zero where none is stated.
    """

    theta: Array
    psi: Array
    alpha: Array
    beta: Array
    gamma: Array
    u_alpha: Array
    u_beta: Array
    u_gamma: Array

    def __len__(self) -> int:
        """Number of positions, repeats counted."""
        return len(self.theta)

    @classmethod
    def nominal(cls, theta: Array, psi: Array) -> "Places":
        """Positions whose misalignment is taken as zero and as known."""
        none = np.zeros(len(theta))
        return cls(theta, psi, *[none] * 6)

    def chosen(self, rows: Sequence[int] | NDArray[np.int64]) -> "Places":
        """Some of them, in the order of `rows`; a row may stand there several times."""
        picked = np.asarray(rows, np.int64)
        return Places(*(getattr(self, name)[picked] for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class Circumstances:
    """What is to be measured, and where.

    Attributes
    ----------
    parameters : (8,) array
        Nominal, SI, in the order of `PARAMETERS`; K must not be singular.
    latitude : float
        rad, south negative.
    noise
    common
        Uncertainty of what all positions share.
    """

    parameters: Array
    latitude: float
    noise: NoiseModel
    common: CommonUncertainty = field(default_factory=CommonUncertainty)

    def __post_init__(self) -> None:
        if not np.isfinite(self.parameters).all() or abs(np.linalg.det(scale_matrix(self.parameters))) == 0:
            raise InputError(
                Message("bad-nominal", "The nominal scale factors must be finite, and Kx·Ky must differ from "
                        "Kxy·Kyx: otherwise no current answers a rate.")
            )  # fmt: skip
        if not abs(self.latitude) <= np.pi / 2:
            raise InputError(Message("bad-latitude", "The latitude must lie between −90° and 90°."))

    def currents(self, places: Places) -> tuple[Array, Array]:
        """What the gyro would show at these places, A."""
        return currents(self.parameters, elements_at(places), self.latitude)

    def whitening(self, duration: float) -> Array:
        """Turns a position's two rates into currents over their uncertainty, (2, 2)."""
        return np.asarray(np.linalg.inv(scale_matrix(self.parameters)) / self.noise.u(duration), np.float64)


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a list of positions will tell.

    Attributes
    ----------
    duration : float
        Of the measurement at each position, s.
    budget : Budget
        Standard and expanded uncertainties and what they come from; NaN for parameters that are
        not determined.
    rank : int
        Combinations of the parameters that will stand out from the noise.
    condition : float
        Of the scaled and weighted design matrix.
    undetermined : (8,) bool array
    warnings
        What is not determined, in words; that the measurements are shorter than the method asks.
    """

    duration: float
    budget: Budget
    rank: int
    condition: float
    undetermined: NDArray[np.bool_]
    warnings: tuple[Message, ...]

    @property
    def covariance(self) -> Array:
        """Of the parameters, SI, (8, 8)."""
        return self.budget.covariance

    @property
    def u(self) -> Array:
        """Standard uncertainties of the parameters, SI, (8,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)), np.float64)


def duration_at(total: float, moving: float, count: int) -> float:
    """Measuring time at each of `count` positions in a total time, s, `moving` of it spent at each.

    Raises
    ------
    InputError
        When nothing is left to measure in.
    """
    duration = total / count - moving
    if not (np.isfinite(total) and moving >= 0 and duration > 0):
        raise InputError(
            Message("no-time", "In %(total).4g s there is no time to measure at %(count)d positions when getting "
                    "to each takes %(moving).4g s. Give more time, or fewer positions.",
                    {"total": total, "count": count, "moving": moving})
        )  # fmt: skip
    return duration


def below_method(duration: float) -> bool:
    """Whether a measurement is shorter than the method asks."""
    return duration < LEAST_DURATION * (1 - RULE_TOLERANCE)


def predict(places: Places, duration: float, at: Circumstances) -> Prediction:
    """Predict the uncertainty of every parameter from a list of positions.

    Parameters
    ----------
    places
        At least one position; a repeat stands there again.
    duration
        Measuring time at each, s.
    at

    Raises
    ------
    InputError
        Without a position.
    """
    if not len(places):
        raise InputError(Message("no-positions", "A plan needs at least one position."))
    observations = _as_observed(places, duration, at)
    equations = observation_equations(observations)
    invisible = find_invisible(equations)
    whitening = at.whitening(duration)
    design = whitened(whitening, equations.design)
    right_side = whitened(whitening, equations.right_side[:, None])[:, 0]
    solution = solve(design, right_side, scale=natural_scale(design), invisible=invisible.directions)
    gain = (solution.gain.reshape(-1, len(places), 2) @ whitening).reshape(len(solution.gain), -1)
    inputs = inputs_of(observations, at.parameters, at.common)
    effect = gain @ inputs.sensitivity
    blank, rank, warnings = undetermined(
        invisible.parameters, 8 - len(invisible.directions), effect @ inputs.covariance @ effect.T
    )
    if invisible.parameters.any():
        warnings = (unobservable(invisible), *warnings)
    elif not blank.any() and solution.condition > WEAK:
        warnings = (weak(solution, natural_scale(equations.design), len(places)),)
    if below_method(duration):
        warnings += (
            Message("below-method", "Each position is measured for %(duration).3g s; the method asks for "
                    "%(least).3g s.", {"duration": duration, "least": LEAST_DURATION}),
        )  # fmt: skip
    gain[blank] = np.nan
    budget = make_budget(gain, inputs)
    return Prediction(duration, budget, rank, solution.condition, blank, warnings)


def whitened(whitening: Array, rows: Array) -> Array:
    """Turn the rates of each position, rows of a (2n, c) array, back into currents over their u."""
    return np.asarray((whitening @ rows.reshape(-1, 2, rows.shape[1])).reshape(rows.shape))


def _as_observed(places: Places, duration: float, at: Circumstances) -> Observations:
    """The session as it would be measured without any error."""
    jx, jy = at.currents(places)
    u = np.full(len(places), at.noise.u(duration))
    return Observations.sorted_from(
        theta=places.theta, psi=places.psi, alpha=places.alpha, beta=places.beta, gamma=places.gamma,
        u_alpha=places.u_alpha, u_beta=places.u_beta, u_gamma=places.u_gamma,
        jx=jx, jy=jy, u_jx=u, u_jy=u, latitude=at.latitude, duration=np.full(len(places), duration),
    )  # fmt: skip


def elements_at(places: Places) -> Elements:
    """Elements of (14) at each place, (n,)."""
    return elements(case_orientation(places.theta, places.psi, places.alpha, places.beta, places.gamma))
