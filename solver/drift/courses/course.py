"""What a quantity did and does: its steps and bends, its trend since then, its scatter.

`describe` fits one course to the whole history, ``value_i = course(t_i) + b_i + e_i`` with e_i ~ N(0, u_i²) known and
b_i ~ N(0, τ²) estimated (`regression`); the values of one start are one, their mean (`solver.drift.start_means`).
Changes are found and dated by `steps`, on two grounds: a straight line with steps and bends, and exponential ageing
with steps; where they differ, Schwarz's criterion decides (G. Schwarz, Ann. Statist. 6 (1978) 461-464), each date
counted as a parameter. At a given
break, a repair, say, the level may change without being found: it is fitted there always, and tested as any
coefficient. The trend after the last change is chosen by the tests of `trend`; steps do not change
the slope, so that values before them tell of it too.

For a forecast the choice does not matter: `paths` holds the line and ageing with many time constants with their
probabilities, the slope kept where it is not significant (`solver.drift.courses.forecast`).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy import special

from solver.drift.courses.choice import Chosen, choose
from solver.drift.courses.course_records import Change, Course, Outlier
from solver.drift.courses.frame import Frame, framed
from solver.drift.courses.regression import LINE, Series, Structure
from solver.drift.courses.sweep import Kind
from solver.drift.history import History
from solver.drift.start_means import StartMeans, start_means
from solver.errors import InputError, Message
from solver.records import Array

__all__ = ["LEVEL", "Change", "Course", "Outlier", "describe"]
LEVEL: Final = 0.01
"""Probability of finding a change, a wild value or a trend in a history that has none, each."""


def describe(history: History, breaks: Sequence[float] = (), level: float = LEVEL) -> Course:
    """Describe a history.

    Parameters
    ----------
    history
        One value or more.
    breaks
        Times of known events, s: a value measured at that very time comes after it.
    level : float
        Probability of finding a change where there is none, in the whole history; the same for a wild value and
        for a trend.

    Raises
    ------
    InputError
        When the history is empty.
    """
    if len(history) == 0:
        raise InputError(_EMPTY)
    means = start_means(history)
    course = _described(means.history, breaks, level)
    return course if len(means.history) == len(history) else _of_values(course, means, history)


def _described(history: History, breaks: Sequence[float], level: float) -> Course:
    """Of values that are independent."""
    frame, series = framed(history)
    given = np.searchsorted(history.time, np.asarray(sorted(breaks), np.float64), side="left")
    known = Structure(breaks=tuple(int(one) for one in np.unique(given) if 0 < one < len(history)))
    return _told(history, frame, choose(series, known, level), series, level)


def _of_values(course: Course, means: StartMeans, history: History) -> Course:
    """The course of the starts as one of their values: a change comes with the first value of a start."""

    def changed(one: Change) -> Change:
        index = int(means.first[one.index])
        dates = tuple((int(means.first[date]), chance) for date, chance in one.dates)
        time, before = float(history.time[index]), float(history.time[max(index - 1, 0)])
        return replace(one, index=index, time=time, before=before, dates=dates)

    wild = {one.index: one for one in course.outliers}
    return replace(
        course,
        changes=tuple(changed(one) for one in course.changes),
        outliers=tuple(
            replace(wild[start], index=index, time=float(history.time[index]))
            for index, start in enumerate(means.member.tolist())
            if start in wild
        ),
        since=int(means.first[course.since]),
        since_time=float(history.time[means.first[course.since]]),
        count=int(np.sum((means.member >= course.since) & ~np.isin(means.member, list(wild)))),
        fitted=course.fitted[means.member],
        u_fitted=course.u_fitted[means.member],
        within=means.within,
    )


def _told(history: History, frame: Frame, chosen: Chosen, series: Series, level: float) -> Course:
    """In the units of the history."""
    done, structure = chosen.done, chosen.structure
    _, kept = series.without(structure.outliers)
    fitted = frame.centre + frame.unit * (chosen.columns @ done.values)
    spread = np.einsum("ij,jk,ik->i", chosen.columns, done.covariance, chosen.columns)
    u_fitted = frame.unit * np.sqrt(np.maximum(spread, 0.0))
    since = max(structure.levels + structure.bends, default=0)
    origin, coefficients, covariance = _coefficients(frame, chosen)
    slope, u_slope, slope_p = _slope(frame, chosen)
    return Course(
        level=level,
        changes=_changes(history, frame, chosen),
        outliers=_outliers(history, frame, chosen, fitted, u_fitted),
        model=chosen.model,
        since=since,
        since_time=float(history.time[since]),
        count=int(np.sum(kept >= since)),
        origin=origin,
        coefficients=coefficients,
        covariance=covariance,
        slope=slope,
        u_slope=u_slope,
        slope_p=slope_p,
        scatter=frame.unit * float(np.sqrt(done.tau2)),
        agreement=done.scale,
        dof=done.dof,
        tests=chosen.tests,
        fitted=fitted,
        u_fitted=u_fitted,
        paths=tuple(frame.path(one) for one in chosen.paths),
        last=frame.last,
        within=0.0,
    )


def _coefficients(frame: Frame, chosen: Chosen) -> tuple[float, Array, Array]:
    """Time that they refer to, coefficients and covariance of the last stretch."""
    done = chosen.done
    if chosen.model == "constant":
        which, factors, origin = [0], [frame.unit], frame.last
    elif chosen.model == "linear":
        which, factors, origin = [0, 1], [frame.unit, frame.unit / frame.span], frame.last
    else:
        which, factors, origin = [0, 1, -1], [frame.unit, frame.unit, frame.span], frame.last - frame.span
    factor = np.array(factors)
    coefficients = done.values[which] * factor
    if chosen.model == "exponential" and chosen.time_constant is not None:
        coefficients[2] = chosen.time_constant * frame.span
    coefficients[0] += frame.centre
    return origin, coefficients, done.covariance[np.ix_(which, which)] * np.outer(factor, factor)


def _slope(frame: Frame, chosen: Chosen) -> tuple[float, float, float]:
    """At the last value: slope, its uncertainty and p, significant or not; 0, 0 and 1 where none can be told."""
    per_time, done, constant = frame.unit / frame.span, chosen.done, chosen.time_constant
    if chosen.model == "exponential" and constant is not None:
        left = float(np.exp(-1.0 / constant)) / constant
        amplitude = float(done.values[1])
        gradient = np.array([-left, -amplitude * left * (1.0 / constant - 1.0) / constant])
        slope = -amplitude * left
        u = float(np.sqrt(gradient @ done.covariance[np.ix_([1, -1], [1, -1])] @ gradient))
        return slope * per_time, u * per_time, _two_sided(slope, u, done.dof)
    line = next((one for one in chosen.paths if one.time_constant == LINE), None)
    if line is None or not chosen.tests:
        return 0.0, 0.0, 1.0
    slope, u = float(line.coefficients[1]), float(np.sqrt(line.covariance[1, 1]))
    return slope * per_time, u * per_time, chosen.tests[0].p_value


def _changes(history: History, frame: Frame, chosen: Chosen) -> tuple[Change, ...]:
    structure, done = chosen.structure, chosen.done
    first = 1 if chosen.time_constant is None else 2
    places: list[tuple[Kind | None, int]] = [(None, one) for one in structure.breaks]
    places += [("steps", one) for one in structure.steps] + [("bends", one) for one in structure.bends]
    told = []
    for column, (kind, index) in enumerate(places, start=first):
        size, u = float(done.values[column]), float(np.sqrt(done.covariance[column, column]))
        p_value = _two_sided(size, u, done.dof)
        dates: tuple[tuple[int, float], ...] = ((index, 1.0),)
        if kind is not None:
            found = chosen.ground.judged(structure, kind, index)
            p_value, dates = found.p_value, found.dates
        factor = frame.unit / (frame.span if kind == "bends" else 1.0)
        told.append(
            Change(
                kind="bend" if kind == "bends" else "step",
                index=index,
                time=float(history.time[index]),
                before=float(history.time[index - 1]),
                size=factor * size,
                u=factor * u,
                p_value=p_value,
                dates=dates,
                at_break=index in structure.breaks,
            )
        )
    return tuple(sorted(told, key=lambda one: (one.index, one.kind)))


def _outliers(
    history: History, frame: Frame, chosen: Chosen, fitted: Array, u_fitted: Array
) -> tuple[Outlier, ...]:
    told = []
    for index in chosen.structure.outliers:
        own = chosen.done.scale * (history.u[index] ** 2 + frame.unit**2 * chosen.done.tau2)
        wild = chosen.ground.judged(chosen.structure, "outliers", index)
        told.append(
            Outlier(
                index=index,
                time=float(history.time[index]),
                size=float(history.value[index] - fitted[index]),
                u=float(np.sqrt(own + u_fitted[index] ** 2)),
                p_value=wild.p_value,
            )
        )
    return tuple(told)


def _two_sided(size: float, u: float, dof: int) -> float:
    """Probability of an estimate at least so far from 0, in units of its u, by Student's distribution."""
    return (
        float(2.0 * special.stdtr(dof, -abs(size) / u))
        if dof > 0
        else float(2.0 * special.ndtr(-abs(size) / u))
    )


_EMPTY = Message("history-empty", "There is no value to describe a course by.")
