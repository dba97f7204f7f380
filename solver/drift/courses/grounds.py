"""On which ground changes are looked for: a straight line, or exponential ageing.

A curve of ageing tried on a line shows bends that are none, a step early in the history tried on a curve looks
like fast ageing. So where a line leaves changes, or a curve fits better, both are searched and the sum of misfit
and parameters decides, Schwarz's criterion ``−2·ln L + p·ln n`` (Ann. Statist. 6 (1978) 461-464), each date and
time constant being a parameter.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from solver.drift.courses import trend
from solver.drift.courses.regression import LINE, Series, Structure, design, fit, shapes
from solver.drift.courses.steps import CHANGES, Ground
from solver.records import Array

_DOUBT: Final = 2.0 * float(np.log(100.0))
"""Of each bend: that ageing is gradual is thought a hundred times likelier before."""
_WORTH_A_LOOK: Final = 0.1
"""p of ageing against a line from which a ground of ageing is tried."""


def find(series: Series, known: Structure, level: float) -> tuple[Structure, Ground]:
    """Changes and wild values, and the ground on which they stand.

    Parameters
    ----------
    series
        Of n values, for which a trend can be fitted.
    known
        With the breaks given.
    level : float
        Of the tests.
    """
    line = Ground(series, lambda one: design(series.x, one, LINE))
    ageing = Ground(series, lambda one: linearised(series.x, one, _time_constant(series, one)), ("steps",))
    on_line = line.search(known, level)
    tried = [(on_line, line)]
    plain = replace(on_line, bends=())
    if _looks_aged(series, plain):
        tried.append((ageing.search(plain, level), ageing))
    if plain != known and _looks_aged(series, known):
        tried.append((known, ageing))
    return min(tried, key=lambda one: _criterion(one[1], one[0]))


def linearised(x: Array, structure: Structure, time_constant: float, amplitude: float = 1.0) -> Array:
    """Columns of `design` and, for ageing, last the derivative by T of ``amplitude·exp(−(x + 1)/T)``."""
    columns = design(x, structure, time_constant)
    if time_constant == LINE:
        return columns
    slope = amplitude * shapes(x, np.array([time_constant])) * (x[:, None] + 1.0) / time_constant**2
    return np.concatenate((columns, slope), axis=1)


def _criterion(ground: Ground, structure: Structure) -> float:
    """Schwarz's criterion, and what is thought of bends before.

    On a line without bends the slope is kept out of caution: a constant with the same steps is tried as well, so
    that one step, its size and its date cost as much as ageing. A wild value costs two parameters and counts as met.
    """
    tried = [ground.columns(structure)]
    if ground.kinds == CHANGES and not structure.bends:
        tried.append(design(ground.series.x, structure, None))
    kept, rows = ground.series.without(structure.outliers)
    dates = len(structure.steps + structure.bends) + 2 * len(structure.outliers)
    found = []
    for columns in tried:
        done = fit(kept, columns[rows])
        wild = done.scale * (ground.series.known[list(structure.outliers)] + done.tau2)
        misfit = done.deviance(kept.known) + float(np.sum(np.log(wild)))
        found.append(misfit + (columns.shape[1] + dates) * float(np.log(len(ground.series.x))))
    return float(min(found)) + _DOUBT * len(structure.bends)


def _profile(series: Series, structure: Structure) -> trend.Profile:
    kept, rows = series.without(structure.outliers)
    line, flat = (design(series.x, structure, one)[rows] for one in (LINE, None))
    return trend.profile(kept, flat, fit(kept, line).tau2, closely=False)


def _time_constant(series: Series, structure: Structure) -> float:
    """The best of the grid: changes do not depend on its last digits."""
    return _profile(series, structure).best


def _looks_aged(series: Series, structure: Structure) -> bool:
    return trend.ageing_tests(_profile(series, structure))[1].p_value < _WORTH_A_LOOK
