"""What a plan leaves open or hardly tells, in words."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.errors import Message
from solver.estimators.observability import UNITS, lab_units, names
from solver.least_squares import LinearSolution
from solver.records import PARAMETERS, Array
from solver.units import deg_per_h_from_rad_per_s, rad_per_s_from_deg_per_h

WEAK: Final = 100.0
"""Condition number from which on the weakest combination is named; good positions have 2 to 6."""
_PART: Final = 0.1


def undetermined(
    invisible: NDArray[np.bool_], rank: int, covariance: Array
) -> tuple[NDArray[np.bool_], int, tuple[Message, ...]]:
    """Parameters to leave blank, the rank, and the words for drifts vaguer than the Earth rate.

    The same judgement as of a measured session (`solver.estimators.estimation`): at θ = 0 alone, arcseconds of
    certified misalignment are all that the g-sensitive drifts show by.
    """
    variances = np.where(invisible, 0.0, np.diagonal(covariance))
    vague = variances > EARTH_RATE**2
    vague[:4] = False
    if not vague.any():
        return invisible.copy(), rank, ()
    kept = np.flatnonzero(~invisible[4:]) + 4
    spread = np.linalg.eigvalsh(covariance[np.ix_(kept, kept)])
    largest = deg_per_h_from_rad_per_s(float(np.sqrt(variances[vague].max())))
    words = Message(
        "unobservable",
        "Not determined by these positions: %(parameters)s. The standard uncertainty would be up to "
        "%(largest).3g °/h, more than the Earth rate by which the gyro is measured. Measure "
        "positions with other θ and ψ.",
        {"parameters": names(vague), "largest": largest},
    )
    return invisible | vague, rank - max(1, int(np.sum(spread > EARTH_RATE**2))), (words,)


def weak(solution: LinearSolution, scale: Array, count: int) -> Message:
    """Name the parameters that hardly show, and the combination that shows least, in laboratory units."""
    faint = solution.singular_vectors[solution.singular_values < solution.singular_values[0] / WEAK]
    part = np.abs(faint).max(axis=0) > _PART * np.abs(faint).max()
    weakest = faint[-1] / faint[-1][np.argmax(np.abs(faint[-1]))]
    one = float(rad_per_s_from_deg_per_h(1.0)) * count**0.5
    told = [
        f"{name} {value:+.4g} {UNITS[name]}"
        for name, value, size in zip(
            PARAMETERS, lab_units(weakest * one / scale), np.abs(weakest), strict=True
        )
        if size > _PART
    ]
    return Message(
        "weak",
        "Hardly determined by these positions: %(parameters)s. A joint change by (%(combination)s) shows "
        "%(factor).0f times less than the combination that shows best. Measure positions with other θ and ψ.",
        {
            "parameters": names(part),
            "combination": ", ".join(told),
            "factor": float(f"{solution.condition:.1e}"),
        },
    )
