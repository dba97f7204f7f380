"""What a gyro is expected to be: from the laboratory's rows to the solver's prior."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from app.exchange.json_text import load_object
from app.exchange.parameters import Known, read_parameters
from app.exchange.problems import refuse
from app.exchange.si import parameter_si
from solver.blunders.prior import Prior
from solver.records import PARAMETERS

_CHANGE: Final = {"k": 0.01, "w0": 1.0, "w": 1.0}
"""How far a gyro may have changed since its last calibration (standard deviation): 1 % of the larger scale
factor for a K, 1 °/h for a fixed drift, which differs from start to start, 1 °/h/g for a g-sensitive one.
Far more than a sound gyro changes, far less than any blunder that only an expectation shows."""


def read_prior(data: bytes, filename: str) -> dict[str, Known]:
    """Read a prior: parameters with standard uncertainties.

    A parameter without a standard uncertainty says nothing that could be tested and is left out. The result of a
    calibration (``solver_version`` tells it) says what the gyro was, not what it is: it is `widened`.

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
    return widened(known) if "solver_version" in load_object(data, filename) else known


def widened(known: Mapping[str, Known]) -> dict[str, Known]:
    """Expect of a gyro what its last calibration found, give or take what a gyro changes meanwhile."""
    scale = max((abs(known[name].value) for name in ("kx", "ky") if name in known), default=0.0)
    return {
        name: Known(item.value, math.hypot(item.standard_uncertainty or 0.0, _change(name, scale)))
        for name, item in known.items()
    }


def _change(name: str, scale: float) -> float:
    if name.startswith("k"):
        return _CHANGE["k"] * scale
    return _CHANGE["w0" if name.startswith("w0") else "w"]


def prior_si(known: Mapping[str, Known], source: str = "") -> Prior:
    """Turn expected parameters in laboratory units into the solver's prior."""
    values, u = np.full(len(PARAMETERS), math.nan), np.full(len(PARAMETERS), math.nan)
    for index, name in enumerate(PARAMETERS):
        item = known.get(name)
        if item is not None and item.standard_uncertainty:
            values[index] = parameter_si(name, item.value)
            u[index] = parameter_si(name, item.standard_uncertainty)
    return Prior(values, u, source=source)
