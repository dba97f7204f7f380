"""Which course is told: its changes, its trend, its scatter, in the units of the series."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.drift.courses.grounds import find, linearised
from solver.drift.courses.paths import Path, only, paths
from solver.drift.courses.regression import LINE, Fit, Indices, Series, Structure, design, fit
from solver.drift.courses.steps import Ground
from solver.drift.courses.trend import Model, Profile, TrendTest, ageing_tests, profile, slope_test
from solver.records import Array

_STEPS: Final = 20
_AGREEMENT: Final = 1e-10
_FOR_A_SLOPE: Final = 3
"""Values that a slope needs beyond one for each level."""
_FOR_AGEING: Final = 6
"""Degrees of freedom of the constant from which ageing is thought of."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """A course in the units of the series.

    Attributes
    ----------
    structure, ground
        Changes, and on which ground they were found.
    model, time_constant
        Of the last stretch; None, `LINE` or T.
    columns : (n, p) array
        1, the shape, levels, bends and, for ageing, the derivative by T.
    done
        Their fit to the values that count.
    tests, paths
        By which the model was chosen, and what a forecast needs.
    """

    structure: Structure
    ground: Ground
    model: Model
    time_constant: float | None
    columns: Array
    done: Fit
    tests: tuple[TrendTest, ...]
    paths: tuple[Path, ...]

    @classmethod
    def constant(cls, series: Series, known: Structure) -> "Chosen":
        """No trend can be told."""
        columns = design(series.x, known, None)
        done = fit(series, columns)
        way = only(float(done.values[0]), done)
        return cls(
            known,
            Ground(series, lambda one: design(series.x, one, None), ()),
            "constant",
            None,
            columns,
            done,
            (),
            (way,),
        )

    @classmethod
    def by_tests(cls, series: Series, structure: Structure, ground: Ground, level: float) -> "Chosen":
        """The model that the tests choose, and the paths that a forecast needs."""
        short, kept = series.without(structure.outliers)
        found, tau2 = _profiled(series, short, kept, structure)
        aged = not structure.bends and found.dof >= _FOR_AGEING
        tests: tuple[TrendTest, ...] = (slope_test(found.squares, float(found.gain[-1]), found.dof),)
        tests += ageing_tests(found) if aged else ()
        share = level / 2.0 if aged else level  # two ways to name a trend where there is none
        model: Model = "linear" if tests[0].p_value <= share else "constant"
        constant = LINE if model == "linear" else None
        if aged and found.best != LINE and max(one.p_value for one in tests[1:]) <= share:
            model, constant = "exponential", found.best
        constant, columns = _columns(series, short, kept, structure, constant)
        done = fit(short, columns[kept])
        ways = paths(found, tau2, bent=not aged)
        return cls(structure, ground, model, constant, columns, done, tests, ways)


def _profiled(series: Series, short: Series, kept: Indices, structure: Structure) -> tuple[Profile, float]:
    """Trends tried with the weights of the better of line and ageing, and their τ²."""
    flat, line = (design(series.x, structure, one)[kept] for one in (None, LINE))
    tau2 = fit(short, line).tau2
    found = profile(short, flat, tau2)
    if structure.bends or found.best == LINE or found.dof < _FOR_AGEING:
        return found, tau2
    aged = fit(short, linearised(series.x, structure, found.best)[kept]).tau2
    return (found, tau2) if aged >= tau2 else (profile(short, flat, aged), aged)


def _columns(
    series: Series, short: Series, kept: Indices, structure: Structure, constant: float | None
) -> tuple[float | None, Array]:
    """The chosen model's time constant and columns; for ageing, last the derivative by its time constant.

    The time constant is known roughly: Gauss and Newton's steps take it to where the derivative has no part left.
    """
    columns = design(series.x, structure, constant)
    if constant is None or constant == LINE:
        return constant, columns
    for _ in range(_STEPS):
        amplitude = float(fit(short, columns[kept]).values[1])
        columns = linearised(series.x, structure, constant, amplitude)
        step = float(fit(short, columns[kept]).values[-1])
        constant = min(max(constant + step, 0.5 * constant), 2.0 * constant)
        if abs(step) <= _AGREEMENT * constant:
            break
        columns = design(series.x, structure, constant)
    return constant, columns


def choose(series: Series, known: Structure, level: float) -> Chosen:
    """Look for changes and choose the trend.

    Parameters
    ----------
    series
        Of one value or more.
    known
        With the breaks given.
    level : float
        Of the tests.
    """
    if not _may_have_trend(series, known):
        return Chosen.constant(series, known)
    structure, ground = find(series, known, level)
    return Chosen.by_tests(series, structure, ground, level)


def _may_have_trend(series: Series, known: Structure) -> bool:
    """Whether enough values at different times are left for a slope, stretch by stretch."""
    stretch = np.searchsorted(known.breaks, np.arange(len(series.x)), side="right")
    different = len(np.unique(np.stack((stretch, series.x)), axis=1).T) - len(known.breaks) - 1
    return different >= _FOR_A_SLOPE
