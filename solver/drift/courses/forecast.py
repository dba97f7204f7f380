"""Where a course leads: a band for values to come, and when it leaves the limits.

A new value at t lies at ``course(t) + b + e``. On one path (`paths`) with ν degrees of freedom,

    (y − ŷ(t))/√(x(t)·C·x(t)ᵀ + s²·(τ² + τ_w² + u_new²))        follows Student's distribution,

with the shapes x(t), the covariance C of level and slope, and the scale s² of the variances; over the paths it is the
mixture with their probabilities, whose quantiles are the ends of the band. Without τ², τ_w² and u_new it is the band of
the course itself.

The course's own band also gives the time at which it reaches a limit L: the times t at which L lies in the band
are those at which ``course(t) = L`` is not rejected, hence a confidence set for that time (E. C. Fieller, J. R.
Statist. Soc. B 16 (1954) 175-185). It begins where the outer edge of the band reaches L, and ends where the inner
one does, if ever.
"""

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from solver.drift.courses.course_records import Course
from solver.records import Array

PROBABILITY: Final = 0.95
_ROUNDS: Final = 60
_CLOSE: Final = 1e-6
"""Of the spread: how near a quantile has to be."""
_NEGLIGIBLE: Final = 1e-7
"""Probability of a path that moves no quantile to the digits of an uncertainty."""
_MOMENTS: Final = 200


@dataclass(frozen=True, slots=True)
class Band:
    """What is to be expected at some times.

    Attributes
    ----------
    probability : float
        Of each value to lie within, by itself.
    time, value, low, high : (m,) array
        Time, s; the course; the ends of the band. The latter infinite where nothing is known of the scatter: one
        value only.
    """

    probability: float
    time: Array
    value: Array
    low: Array
    high: Array


@dataclass(frozen=True, slots=True)
class Leaving:
    """When a course leaves its limits.

    Attributes
    ----------
    side, limit
        ``low`` or ``high``, and the limit there.
    date : float
        When the course reaches it, s; the time of the last value where it is outside already.
    earliest, latest : float or None
        Ends of the interval that holds this time with the probability asked for; None where it has no end before
        the time looked at. A time of the last value means that it may have been earlier.
    probability : float
    """

    side: Literal["low", "high"]
    limit: float
    date: float
    earliest: float
    latest: float | None
    probability: float


def predict(
    course: Course, times: ArrayLike, u_new: ArrayLike = 0.0, probability: float = PROBABILITY
) -> Band:
    """Band for values to come.

    Parameters
    ----------
    course
        From `solver.drift.courses.course.describe`.
    times : (m,) array_like
        After the last value, s.
    u_new : float or (m,) array_like
        Standard uncertainty of the noise of the values to come, in the quantity's unit.
    probability : float
        Of each value to lie within the band.
    """
    time = np.atleast_1d(np.asarray(times, np.float64))
    noise = np.broadcast_to(np.asarray(u_new, np.float64), time.shape)
    return _band(course, time, noise**2 + course.within**2, probability)


def leaves(
    course: Course, low: float | None, high: float | None, until: float, probability: float = PROBABILITY
) -> Leaving | None:
    """When the course leaves the limits; None if it does not until then.

    A course without a significant trend leads nowhere: only where it is outside already does it leave.

    Parameters
    ----------
    course
        From `solver.drift.courses.course.describe`.
    low, high : float or None
        Limits, in the quantity's unit.
    until : float
        How far to look, s.
    probability : float
        Of the interval from earliest to latest.
    """
    end = course.last if course.model == "constant" else max(until, course.last)
    time = np.linspace(course.last, end, _MOMENTS)
    band = _band(course, time, None, probability)
    found = []
    if high is not None:
        found.append(
            _crossing("high", high, time, band.value - high, band.high - high, band.low - high, probability)
        )
    if low is not None:
        found.append(
            _crossing("low", low, time, low - band.value, low - band.low, low - band.high, probability)
        )
    return min((one for one in found if one is not None), key=lambda one: one.date, default=None)


def _crossing(
    side: Literal["low", "high"],
    limit: float,
    time: Array,
    over: Array,
    outer: Array,
    inner: Array,
    probability: float,
) -> Leaving | None:
    """When the course and both edges of its band pass a limit; each as its excess over it."""
    date = _first(time, over)
    if date is None:
        return None
    earliest = _first(time, outer)
    return Leaving(
        side, limit, date, date if earliest is None else earliest, _first(time, inner), probability
    )


def _first(time: Array, excess: Array) -> float | None:
    """First time at which an excess is not negative, between two by a straight line."""
    reached = np.flatnonzero(excess >= 0.0)
    if len(reached) == 0:
        return None
    after = int(reached[0])
    if after == 0:
        return float(time[0])
    below, above = excess[after - 1], excess[after]
    return float(time[after - 1] + (time[after] - time[after - 1]) * below / (below - above))


def _band(course: Course, time: Array, noise2: Array | None, probability: float) -> Band:
    """With τ² and the noise of new values, or, without noise, the band of the course."""
    paths = [one for one in course.paths if one.probability > _NEGLIGIBLE]
    chance = np.array([one.probability for one in paths])[:, None]
    chance /= chance.sum()
    middle, spread = np.empty((2, len(paths), len(time)))
    for place, one in enumerate(paths):
        columns = one.columns(time)
        middle[place] = columns @ one.coefficients
        variance = np.einsum("ij,jk,ik->i", columns, one.covariance, columns)
        own = 0.0 if noise2 is None else one.scale * (one.tau2 + noise2)
        spread[place] = np.sqrt(np.maximum(variance, 0.0) + own)
    dof = course.paths[0].dof
    value = np.sum(chance * middle, axis=0)
    if dof < 1:
        return Band(probability, time, value, np.full_like(value, -np.inf), np.full_like(value, np.inf))
    tail = 0.5 * (1.0 - probability)
    low, high = (_quantile(one, chance, middle, spread, dof) for one in (tail, 1.0 - tail))
    return Band(probability, time, value, low, high)


def _quantile(order: float, chance: Array, middle: Array, spread: Array, dof: int) -> Array:
    """Of the mixture of Student's distributions, (m,): Newton's method, halving where it leaves the bracket."""
    own = middle + float(special.stdtrit(dof, order)) * spread
    if len(middle) == 1:
        return np.asarray(own[0])
    below, above = own.min(axis=0), own.max(axis=0)
    at = np.clip(np.sum(chance * own, axis=0), below, above)
    peak = math.exp(math.lgamma(0.5 * dof + 0.5) - math.lgamma(0.5 * dof)) / math.sqrt(math.pi * dof)
    close = _CLOSE * spread.min(axis=0)
    for _ in range(_ROUNDS):
        z = (at - middle) / spread
        excess = np.sum(chance * special.stdtr(dof, z), axis=0) - order
        density = np.sum(chance / spread * peak * (1.0 + z * z / dof) ** (-0.5 * (dof + 1)), axis=0)
        below, above = np.where(excess < 0.0, at, below), np.where(excess < 0.0, above, at)
        with np.errstate(divide="ignore", over="ignore"):
            step = at - excess / density
        following = np.where((step > below) & (step < above), step, 0.5 * (below + above))
        done = np.abs(following - at) <= close
        at = following
        if done.all():
            break
    return np.asarray(at)
