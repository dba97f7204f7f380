"""A calibration as JSON in laboratory units: what the API, the command and the pages give out."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from app.exchange.current_noise import current_noise_json
from app.exchange.examination import angle_deg
from app.exchange.json_values import Json, finite, message_json
from app.exchange.limits import budget_json, expanded_json, in_lab
from app.exchange.si import PARAMETER_UNITS, covariance_lab, parameter_lab
from solver import units
from solver.calibrate import Asked, Calibration
from solver.propagation.budget import Budget
from solver.records import PARAMETERS, Array, Estimate, Failure, Fit, Method, Observations

ResultMethod = Asked


def calibration_json(
    calibration: Calibration,
    method: ResultMethod,
    further: Mapping[Method, Json] | None = None,
    stated: Json | None = None,
) -> Json:
    """Write a calibration as JSON: parameters, covariance, residuals, fit, iterations, budget, warnings.

    Parameters
    ----------
    calibration
        What the solver answered; it must hold the method asked for.
    method
        One method gives its result at the top level. ``both`` gives each under its own name,
        whole, so that a reader of one needs nothing from outside it.
    further
        What else is known of a method's answer, by method: what tests and draws tell.
    stated
        What was known beside currents and certificate; it stands at the top level.

    Returns
    -------
    dict
        Only what JSON knows: a value that is unknown or not finite is None. A method that gave no
        estimate has ``error`` instead of its numbers, with the rounds it went through.
    """
    more = further or {}
    told = {} if stated is None else {"stated": stated}
    if method != "both":
        return {**_one(calibration, method), **more.get(method, {}), **told}
    names: tuple[Method, ...] = ("paper", "least-squares")
    return {
        "method": "both",
        "solver_version": calibration.solver_version,
        "input_hash": calibration.input_hash,
        **{name: {**_one(calibration, name), **more.get(name, {})} for name in names},
        **told,
    }


def _one(calibration: Calibration, method: Method) -> Json:
    answer = calibration.answers.get(method)
    if answer is None:
        raise ValueError(f"this calibration has no answer of the method {method}")
    head = {
        "method": method,
        "solver_version": calibration.solver_version,
        "input_hash": calibration.input_hash,
    }
    if isinstance(answer, Failure):
        return {**head, "error": message_json(answer.message), "iterations": _iterations(answer.iterations)}
    solved = calibration.solved.get(method)
    noise = current_noise_json(calibration.observations, None if solved is None else solved.widening)
    return {**head, **_estimate(answer, calibration.observations, calibration.budget(method)), **noise}


def _estimate(estimate: Estimate, observations: Observations, budget: Budget | None) -> Json:
    parameters = parameters_json(estimate.values, estimate.standard_uncertainties)
    expanded = expanded_json(budget)
    return {
        "parameters": {name: {**entry, **expanded[name]} for name, entry in parameters.items()},
        "covariance": [[finite(cell) for cell in row] for row in covariance_lab(estimate.covariance)],
        "uncertainty_basis": estimate.uncertainty_basis,
        "residuals": _residuals(estimate, observations),
        "fit": _fit(estimate.fit),
        "iterations": _iterations(estimate.iterations),
        "budget": budget_json(budget),
        "warnings": [message_json(warning) for warning in estimate.warnings],
    }


def parameters_json(values: Sequence[float] | Array, uncertainties: Sequence[float] | Array | None) -> Json:
    """Write parameters by name, with standard uncertainty, in both units.

    Parameters
    ----------
    values, uncertainties
        SI, in the order of `solver.records.PARAMETERS`; NaN where undetermined.
    """
    known = [math.nan] * len(PARAMETERS) if uncertainties is None else uncertainties
    return {
        name: {
            "value": finite(parameter_lab(name, float(value))),
            "standard_uncertainty": finite(parameter_lab(name, float(u))),
            "unit": PARAMETER_UNITS[name][0],
            "value_si": finite(value),
            "unit_si": PARAMETER_UNITS[name][1],
        }
        for name, value, u in zip(PARAMETERS, values, known, strict=True)
    }


def _residuals(estimate: Estimate, observations: Observations) -> list[Json]:
    rates = units.deg_per_h_from_rad_per_s(estimate.residuals)
    return [
        {
            "theta_deg": angle_deg(theta),
            "psi_deg": angle_deg(psi),
            "repeat": int(repeat),
            "x_deg_per_h": finite(rate[0]),
            "y_deg_per_h": finite(rate[1]),
            "standardised_x": finite(standardised[0]),
            "standardised_y": finite(standardised[1]),
            "outlier_x": bool(outlier[0]),
            "outlier_y": bool(outlier[1]),
        }
        for theta, psi, repeat, rate, standardised, outlier in zip(
            observations.theta,
            observations.psi,
            observations.repeat,
            rates,
            estimate.standardised,
            estimate.outliers,
            strict=True,
        )
    ]


def _fit(fit: Fit) -> Json:
    return {
        "chi2": finite(fit.chi2),
        "dof": int(fit.dof),
        "p_value": finite(fit.p_value),
        "rank": int(fit.rank),
        "condition": finite(fit.condition),
    }


def _iterations(rounds: Array | None) -> list[Json]:
    """The paper's approximations, one object per round; none for least squares."""
    if rounds is None:
        return []
    return [in_lab(row) for row in np.asarray(rounds)]
