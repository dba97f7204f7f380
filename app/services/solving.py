"""From rows in laboratory units to a result's JSON: the one way that jobs, commands and the demonstration solve."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from app.errors import Invalid, problem
from app.exchange.attitude import attitude_json
from app.exchange.distributions import monte_carlo_json, no_monte_carlo_json
from app.exchange.examination import diagnosis_json
from app.exchange.further_terms import model_json
from app.exchange.json_values import Json, dumps, message_json
from app.exchange.means import match
from app.exchange.parameters import Known
from app.exchange.plausible import another_unit
from app.exchange.prior import prior_si
from app.exchange.result import ResultMethod, calibration_json
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.si import observations
from app.exchange.uncertainties import common_uncertainty
from solver.blunders.diagnosis import diagnose
from solver.blunders.prior import Prior
from solver.calibrate import Calibration, calibrate
from solver.error_model import observation_equations
from solver.errors import SolverError
from solver.estimators.model_comparison import compare_models
from solver.estimators.stand_attitude import stand_attitude
from solver.propagation.distributions import compare_with_budget, propagate_distributions
from solver.records import Method

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
        Draws of the Monte Carlo propagation; 0 for none, None for as many as two digits of u need.
    seed
        Of its random numbers.
    """

    uncertainties: Mapping[str, Any] = field(default_factory=dict)
    prior: Mapping[str, Any] | None = None
    trials: int | None = 0
    seed: int = 0


FEWEST_TRIALS: Final = 10_000
"""With fewer draws the ends of a 95 % interval say nothing (JCGM 101, 7.2.2: many times 1/(1 − p))."""
TRIALS_FOR_TWO_DIGITS: Final = 1_000_000
"""From so many draws on they judge first order to two digits of u, with fewer to one (JCGM 101, 7.2.2)."""
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
    measured = observations(means, certificate, latitude_deg)
    try:
        calibration = calibrate(measured, method, common)
        diagnosis = diagnose(measured, common, _prior(stated))
        terms = compare_models(observation_equations(measured), measured, common)
    except SolverError as error:
        raise Invalid(problem(error.message.code, error.message.template, **error.message.values)) from error
    found = next(iter(calibration.solved.values()), None)
    attitude = None if found is None else attitude_json(stand_attitude(found))
    examined = {**diagnosis_json(diagnosis), "model": model_json(terms), "stand_attitude": attitude}
    drawn = _distributions(calibration, stated, report)
    further = {name: examined | drawn.get(name, {}) for name in calibration.answers}
    said = {"uncertainties": dict(stated.uncertainties), "prior": stated.prior}
    result = calibration_json(calibration, method, further, said)
    answers = [result[name] for name in ("least-squares", "paper")] if method == "both" else [result]
    about_input = [message_json(item) for item in (*match(means, certificate)[1], *another_unit(means))]
    for answer in answers:
        answer["warnings"] = about_input + answer.get("warnings", [])
    return {
        "result": dumps(result),
        "input_hash": calibration.input_hash,
        "solver_version": calibration.solver_version,
        "parameters": [row for answer in answers for row in _history_rows(answer)],
        "fit": _fit(answers[0]),
        "attitude": attitude,
    }


def _distributions(calibration: Calibration, stated: Stated, report: Report) -> dict[Method, Json]:
    """The Monte Carlo propagation of each method's estimate; why there is none where it cannot be made."""
    if stated.trials == 0:
        return {}
    digits = 2 if stated.trials is None or stated.trials >= TRIALS_FOR_TWO_DIGITS else 1
    told: dict[Method, Json] = {}
    for number, (name, solved) in enumerate(calibration.solved.items()):

        def step(fraction: float, number: int = number) -> None:
            report(0.1 + 0.9 * (number + fraction) / len(calibration.solved), "drawing")

        try:
            found = propagate_distributions(
                solved, trials=stated.trials, seed=stated.seed, digits=digits, report=step
            )
        except SolverError as error:
            told[name] = {"monte_carlo": no_monte_carlo_json(stated.trials, stated.seed, error.message)}
            continue
        budget = calibration.budget(name)
        if budget is not None:
            compared = compare_with_budget(solved, budget, found, digits=digits)
            told[name] = {"monte_carlo": monte_carlo_json(solved.values, budget, found, compared)}
    return told


def _prior(stated: Stated) -> Prior | None:
    if stated.prior is None:
        return None
    parameters = stated.prior["parameters"]
    return prior_si(
        {name: Known(item["value"], item["standard_uncertainty"]) for name, item in parameters.items()}
    )


def _fit(answer: Json) -> Json:
    """χ² of the residuals against the stated noise; None where none is stated."""
    fit = answer.get("fit") or {}
    return {"chi2": fit.get("chi2"), "fit_dof": fit.get("dof")}


def _history_rows(answer: Json) -> list[Json]:
    noise = next((line for line in answer.get("budget", ()) if line["code"] == "currents"), None)
    return [
        {
            "method": answer["method"],
            "parameter": name,
            "value": entry["value"],
            "standard_uncertainty": entry["standard_uncertainty"],
            "coverage_factor": entry["coverage_factor"],
            "u_noise": noise and noise["standard_uncertainties"].get(name),
        }
        for name, entry in answer.get("parameters", {}).items()
    ]
