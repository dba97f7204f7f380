"""What the Monte Carlo propagation gave, as JSON in laboratory units, beside the first-order intervals."""

import numpy as np

from app.exchange.json_values import Json, finite, message_json
from app.exchange.si import PARAMETER_UNITS, parameter_lab
from solver.errors import Message
from solver.propagation.budget import Budget
from solver.propagation.comparison import Comparison
from solver.propagation.monte_carlo import MonteCarlo
from solver.records import PARAMETERS, Array


def monte_carlo_json(values: Array, budget: Budget, found: MonteCarlo, compared: Comparison) -> Json:
    """Write both ways' intervals of every parameter, their distance and its tolerance, and the conclusion.

    Parameters
    ----------
    values : (8,) array
        The estimate.
    budget, found, compared
        First order, draws, and clause 8 of JCGM 101 on both; SI.
    """
    u = found.standard_uncertainties
    first_order = np.stack((values - budget.expanded, values + budget.expanded), axis=1)
    parameters: Json = {}
    for index, name in enumerate(PARAMETERS):

        def lab(value: float, name: str = name) -> float | None:
            return finite(parameter_lab(name, float(value)))

        parameters[name] = {
            "mean": lab(found.mean[index]),
            "standard_uncertainty": lab(u[index]),
            "expanded_uncertainty": lab(budget.expanded[index]),
            "first_order": [lab(end) for end in first_order[index]],
            "symmetric": [lab(end) for end in found.symmetric[index]],
            "shortest": [lab(end) for end in found.shortest[index]],
            "difference": lab(max(compared.low[index], compared.high[index])),
            "tolerance": lab(compared.tolerance[index]),
            "agrees": bool(compared.within[index]),
            "unit": PARAMETER_UNITS[name][0],
        }
    return {
        "trials": found.trials,
        "seed": found.seed,
        "level": found.level,
        "verdict": compared.verdict,
        "conclusion": message_json(compared.message),
        "parameters": parameters,
    }


def no_monte_carlo_json(trials: int | None, seed: int, why: Message) -> Json:
    """Write why no draws could be made."""
    return {
        "trials": trials,
        "seed": seed,
        "verdict": None,
        "conclusion": message_json(why),
        "parameters": {},
    }
