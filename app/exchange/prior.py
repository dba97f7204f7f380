"""What a gyro is expected to be: from the laboratory's rows to the solver's prior."""

import math
from collections.abc import Mapping

import numpy as np

from app.exchange.parameters import Known, read_parameters
from app.exchange.problems import refuse
from app.exchange.si import parameter_si
from solver.blunders.prior import Prior
from solver.records import PARAMETERS


def read_prior(data: bytes, filename: str) -> dict[str, Known]:
    """Read a prior: parameters with standard uncertainties, as in a result.

    A parameter without a standard uncertainty says nothing that could be tested and is left out.

    Raises
    ------
    Invalid
        As `read_parameters`; or no parameter has a positive standard uncertainty.
    """
    known = {
        name: item for name, item in read_parameters(data, filename).items() if item.standard_uncertainty
    }
    if not known:
        raise refuse(
            "no-uncertainty",
            "No parameter has a standard uncertainty, so nothing can be judged by them. Write each as "
            '{"value": 2062.65, "standard_uncertainty": 100}.',
            file=filename,
            column="/parameters",
        )
    return known


def prior_si(known: Mapping[str, Known], source: str = "") -> Prior:
    """Turn expected parameters in laboratory units into the solver's prior."""
    values, u = np.full(len(PARAMETERS), math.nan), np.full(len(PARAMETERS), math.nan)
    for index, name in enumerate(PARAMETERS):
        item = known.get(name)
        if item is not None and item.standard_uncertainty:
            values[index] = parameter_si(name, item.value)
            u[index] = parameter_si(name, item.standard_uncertainty)
    return Prior(values, u, source=source)
