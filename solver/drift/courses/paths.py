"""The trends a course may follow, each with its probability: what a forecast is made of.

Had the model of the trend been chosen and then taken for certain, a band would hold too seldom: a small slope or
curvature that the tests do not show moves a forecast by more than a constant's or a line's own uncertainty. So

*   the slope stays, with its uncertainty, significant or not: the band is exact under a constant and under a line;
*   the time constant is averaged over (J. A. Hoeting et al., Statist. Sci. 14 (1999) 382-417): each T, the line
    among them, is one path, linear in the rest, with the probability

        P(T | values) ∝ P(T)·χ²(T)^(−ν/2),

    the likelihood with level, steps and scatter at their best. P(T), before the values, is a tenth for the line; the
    rest is shared by the angle by which exp(−t/T), as these values see it, turns from one T to the next, which is
    Jeffreys' rule here.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.drift.courses.regression import LINE, Fit, believed
from solver.drift.courses.trend import Profile
from solver.records import Array

_LINE_BEFORE: Final = 0.1
"""Simulated: with more, slow ageing leaves the band too often; with less, it is too wide under a line."""
_NEGLIGIBLE: Final = 1e-3


@dataclass(frozen=True, slots=True)
class Path:
    """One trend of the last stretch.

    Attributes
    ----------
    probability : float
    time_constant : float or None
        T; infinite for a straight line, None where no trend can be told.
    coefficients, covariance : (p,) and (p, p) array
        Level and, with a trend, factor of the shape.
    tau2, scale : float
        The variance of a value is ``scale·(u² + tau2)``.
    dof : int
    origin : float
        Time where the shape begins: the line is ``t − origin``, ageing ``exp(−(t − origin)/T)``.
    """

    probability: float
    time_constant: float | None
    coefficients: Array
    covariance: Array
    tau2: float
    scale: float
    dof: int
    origin: float

    def columns(self, time: Array) -> Array:
        """The path's columns (m, p) at some times."""
        since = time - self.origin
        if self.time_constant is None:
            return np.ones((len(time), 1))
        grown = since if self.time_constant == LINE else np.exp(-since / self.time_constant)
        return np.stack((np.ones(len(time)), grown), axis=1)


def only(level: float, done: Fit) -> Path:
    """The one path of a course of which no trend can be told."""
    return Path(1.0, None, np.array([level]), done.covariance[:1, :1], done.tau2, done.scale, done.dof, 0.0)


def paths(found: Profile, tau2: float, bent: bool) -> tuple[Path, ...]:
    """Trends with their probabilities, in the units of the series.

    Parameters
    ----------
    found
        Time constants tried.
    tau2
        With which they were tried.
    bent
        Whether the course has bends: then the trend is a line.
    """
    chances = _probabilities(found)
    chances[:-1] *= 0.0 if bent else 1.0
    chances[chances < _NEGLIGIBLE * chances.max()] = 0.0
    chances /= chances.sum()
    return tuple(_path(found, place, tau2, float(chances[place])) for place in np.flatnonzero(chances))


def _path(found: Profile, place: np.intp, tau2: float, probability: float) -> Path:
    """One trend with its time constant held."""
    constant, dof = float(found.time_constant[place]), found.dof - 1
    factor, lean, u2 = found.factor[place], found.lean[place], found.length[place] ** -2.0
    scale = believed(float(found.squares - found.gain[place]), dof)
    covariance = np.array([[found.u_level**2 + lean**2 * u2, -lean * u2], [-lean * u2, u2]])
    return Path(
        probability=probability,
        time_constant=constant,
        coefficients=np.array([found.level - lean * factor, factor]),
        covariance=scale * covariance,
        tau2=tau2,
        scale=scale,
        dof=dof,
        origin=0.0 if constant == LINE else -1.0,
    )


def _probabilities(found: Profile) -> Array:
    """P(T | values) of each T of the profile, but a factor."""
    angle = np.concatenate(([0.0], found.angle, [0.0]))
    before = 0.5 * (angle[1:] + angle[:-1])
    before *= (1.0 - _LINE_BEFORE) / (before.sum() or 1.0)
    before[-1] += _LINE_BEFORE
    before[np.isinf(found.length)] = 0.0
    left = np.maximum(found.squares - found.gain, 1e-12 * max(found.squares, np.finfo(np.float64).tiny))
    chances: Array = before * (left / left.min()) ** (-0.5 * (found.dof - 1))
    return chances
