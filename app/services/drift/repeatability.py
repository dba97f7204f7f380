"""How much a parameter scatters from session to session, and by what: the components for the study's document."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.exchange.json_values import Json
from app.services.drift.series import SeriesTable, seconds
from solver.drift.courses.course_records import Course
from solver.drift.repeatability.components import Component, Within
from solver.drift.repeatability.nested import nested_components
from solver.records import Array

FEWEST: Final = 3
"""Sessions below which nothing is said of their scatter."""


def repeatability(table: SeriesTable, parameter: str, course: Course, limit: float | None) -> Json:
    """Components of a parameter's variance: within a session, and between sessions, starts and days.

    What the course explains, steps, bends and a significant trend, is not scatter and is removed; wild
    values stay out.
    """
    places = table.determined(parameter)
    kept = np.ones(len(places), bool)
    kept[[item.index for item in course.outliers]] = False
    here = table.rows(places[kept])
    empty: Json = {
        "components": [], "together": None, "repeatability_limit": limit, "repeatability_verdict": "no-limit",
    }  # fmt: skip
    day = table["start_at"].astype("datetime64[D]")
    design = _explained(_together(seconds(table["measured_at"]), day)[places], course)[kept]
    if len(here) < FEWEST + design.shape[1]:
        return empty
    found = nested_components(
        here[f"{parameter}.value"],
        {"between-days": day[places][kept], "between-starts": here["start"]},
        _within(here, parameter),
        design=design,
    )
    between = found.together
    return {
        "components": [_row(item) for item in found.components], "together": _row(between),
        "repeatability_limit": limit, "repeatability_verdict": _verdict(between, limit),
    }  # fmt: skip


def _within(table: SeriesTable, parameter: str) -> Within | None:
    """What is known of each session's own scatter; None where a session does not tell."""
    noise = table[f"{parameter}.u_noise"]
    if not (np.isfinite(noise) & (noise > 0.0)).all():
        return None
    chi2, dof = table["chi2"], table["fit_dof"]
    fitted = np.isfinite(chi2) & np.isfinite(dof) & (dof > 0)
    return Within(noise, chi2, dof) if fitted.all() else Within(noise)


def _together(time: Array, day: NDArray[np.datetime64]) -> Array:
    """The mean time of each day's sessions, (n,): what drifts within hours counts as scatter.

    A trend over the hours of one day would take the only degree of freedom that tells two sessions of a day apart.
    """
    groups = np.unique(day, return_inverse=True)[1]
    return np.asarray((np.bincount(groups, time) / np.bincount(groups))[groups])


def _explained(time: Array, course: Course) -> Array:
    """Columns of what the course explains beside the mean, (n, p)."""
    scaled = (time - time[0]) / max(float(time[-1] - time[0]), 1.0)
    columns = []
    for change in course.changes:
        after = np.arange(len(time)) >= change.index
        if change.kind == "step":
            columns.append(after.astype(np.float64))
        else:
            columns.append(np.where(after, scaled - scaled[max(change.index - 1, 0)], 0.0))
    bent = any(change.kind == "bend" for change in course.changes)
    if course.model == "exponential" and course.time_constant is not None:
        columns.append(np.exp(-(time - course.origin) / course.time_constant))
    elif course.model == "linear" or bent:
        columns.append(scaled)
    return np.stack(columns, axis=1) if columns else np.empty((len(time), 0))


def _row(component: Component) -> Json:
    return {
        "source": component.source, "sd": component.sd, "low": component.low, "high": component.high,
        "dof": component.dof, "f": component.f, "dof_below": component.dof_below,
        "p_value": component.p_value, "confounded_with": list(component.confounded_with),
    }  # fmt: skip


def _verdict(together: Component, limit: float | None) -> str:
    """Against the type's limit: conforms when the whole interval lies below it, fails when it lies above."""
    if limit is None or together.sd is None:
        return "no-limit" if limit is None else "undetermined"
    if together.low is not None and together.low > limit:
        return "fails"
    return "conforms" if together.high is not None and together.high <= limit else "conditional"
