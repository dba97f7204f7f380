"""From rows in laboratory units to a result's JSON: the one way that jobs, commands and the demonstration solve."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from app.errors import Invalid, problem
from app.exchange.json_values import Json, dumps
from app.exchange.result import ResultMethod, calibration_json
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.si import observations
from app.exchange.uncertainties import common_uncertainty
from solver.calibrate import calibrate
from solver.errors import SolverError

Report = Callable[[float, str], None]


@dataclass(frozen=True, slots=True)
class Stated:
    """What is known beside currents and certificate; plain, in laboratory units.

    Attributes
    ----------
    uncertainties
        What all positions have in common (`app.exchange.uncertainties`).
    prior
        What the gyro is expected to be, with its source (`app.services.priors`); None when nothing is.
    trials
        Draws of the Monte Carlo propagation; 0 for none.
    seed
        Of its random numbers.
    """

    uncertainties: Mapping[str, Any] = field(default_factory=dict)
    prior: Mapping[str, Any] | None = None
    trials: int = 0
    seed: int = 0


NOTHING: Final = Stated()


def no_report(_fraction: float, _phase: str) -> None:
    """For whoever watches no progress."""


def solved(
    means: Sequence[MeansRow],
    certificate: Sequence[CertificateRow],
    latitude_deg: float,
    method: ResultMethod,
    stated: Stated = NOTHING,
    report: Report = no_report,
) -> Json:
    """A result as it is stored: JSON text, hashes, and the parameters laid out for the history.

    Raises
    ------
    Invalid
        Whatever is wrong with the input, and a calibration that cannot be given.
    """
    common = common_uncertainty(stated.uncertainties)
    try:
        calibration = calibrate(observations(means, certificate, latitude_deg), method, common)
    except SolverError as error:
        raise Invalid(problem(error.message.code, error.message.template, **error.message.values)) from error
    result = calibration_json(calibration, method)
    answers = [result[name] for name in ("least-squares", "paper")] if method == "both" else [result]
    return {
        "result": dumps(result),
        "input_hash": calibration.input_hash,
        "solver_version": calibration.solver_version,
        "parameters": [row for answer in answers for row in _history_rows(answer)],
    }


def _history_rows(answer: Json) -> list[Json]:
    return [
        {
            "method": answer["method"],
            "parameter": name,
            "value": entry["value"],
            "standard_uncertainty": entry["standard_uncertainty"],
            "coverage_factor": entry["coverage_factor"],
        }
        for name, entry in answer.get("parameters", {}).items()
    ]
