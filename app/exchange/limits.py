"""What limits a result, as JSON in laboratory units: the budget of its uncertainty, expanded uncertainties."""

from collections.abc import Sequence
from typing import Any, Final

from app.exchange.json_values import Json, finite
from app.exchange.si import parameter_lab
from solver.propagation.budget import Budget
from solver.records import PARAMETERS, Array

SOURCE_NAMES: Final = {
    "scatter": "scatter of the residuals",
    "currents": "noise of the mean currents",
    "angles": "certified angles, position by position",
    "ammeter-gain": "gain of the ammeter",
    "ammeter-offset": "offset of the ammeter",
    "angles-common": "certified angles, in common",
    "level": "level of the base",
    "azimuth": "azimuth of the base",
    "latitude": "latitude",
    "gravity": "gravity",
    "temperature": "temperature",
    "correlation": "correlations between these",
}
"""Lines of a budget in words."""


def budget_json(budget: Budget | None) -> list[Json]:
    """Write each line: its part of every parameter's variance, and its standard uncertainty alone.

    A line `correlation` has no standard uncertainty of its own; its shares may be negative.
    """
    if budget is None:
        return []
    lines = zip(budget.lines, budget.shares, budget.standard, strict=True)
    return [
        {
            "code": line,
            "source": SOURCE_NAMES[line],
            "shares": {name: finite(share) for name, share in zip(PARAMETERS, shares, strict=True)},
            "standard_uncertainties": in_lab(standard),
        }
        for line, shares, standard in lines
    ]


def expanded_json(budget: Budget | None) -> dict[str, Json]:
    """Write effective degrees of freedom, k, U and the dominating line of every parameter, by name.

    Infinite degrees of freedom are null.
    """
    if budget is None:
        nothing: Json = {
            "dof": None,
            "coverage_factor": None,
            "expanded_uncertainty": None,
            "dominated_by": None,
        }
        return {name: dict(nothing) for name in PARAMETERS}
    expanded = in_lab(budget.expanded)
    return {
        name: {
            "dof": finite(budget.dof[index]),
            "coverage_factor": finite(budget.coverage_factors[index]),
            "expanded_uncertainty": expanded[name],
            "dominated_by": budget.dominating[index],
        }
        for index, name in enumerate(PARAMETERS)
    }


def in_lab(values: Sequence[float] | Array) -> dict[str, Any]:
    """Write eight values of the parameters by name, in laboratory units."""
    return {
        name: finite(parameter_lab(name, float(value)))
        for name, value in zip(PARAMETERS, values, strict=True)
    }
