"""Monte Carlo of an estimate of the gyro's parameters, on the inputs of its budget.

First order propagates the covariance of the inputs around one point; here the inputs are drawn,
orientations rotated truly and the parameters solved for, with the weights that the estimate had
(`solver.propagation.input_draws`, `solver.propagation.draw_solutions`). The weights stay: they are part of
how the estimate was made.
For the robust method these are Huber's, with the inputs' uncertainty widened as its own is.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from solver import successive
from solver.errors import InputError, Message
from solver.estimators.conclusion import Solved
from solver.estimators.rate_noise import root_inverse, whitening_of
from solver.estimators.robust import position_whitening
from solver.propagation.budget import Budget, make_budget
from solver.propagation.comparison import Comparison, compare
from solver.propagation.draw_solutions import SessionModel, session_model
from solver.propagation.monte_carlo import MOST_TRIALS, TRIALS, MonteCarlo, run
from solver.propagation.uncertainty import LEVEL
from solver.records import PARAMETERS, Array
from solver.units import rad_per_s_from_deg_per_h, scale_from_deg_per_h_per_ma

DISPLAY_UNITS: Array = np.array(
    [float(scale_from_deg_per_h_per_ma(1.0))] * 4 + [float(rad_per_s_from_deg_per_h(1.0))] * 4
)
"""Units in which the digits of u are counted, °/h/mA and °/h, SI."""
_NO_VARIANCE: Final = 1e-12


def propagate_distributions(
    solved: Solved,
    *,
    trials: int | None = TRIALS,
    seed: int = 0,
    level: float = LEVEL,
    digits: int = 2,
    tighten: float = 1.0,
    most: int = MOST_TRIALS,
    report: Callable[[float], None] | None = None,
) -> MonteCarlo:
    """Monte Carlo of one method's estimate; parameters as of `solver.propagation.monte_carlo.run`.

    Raises
    ------
    InputError
        When nothing is known of the uncertainty, or a parameter is not determined.
    """
    return run(
        model_of(solved),
        trials=trials,
        seed=seed,
        level=level,
        digits=digits,
        unit=DISPLAY_UNITS,
        tighten=tighten,
        most=most,
        report=report,
    )


def compare_with_budget(solved: Solved, budget: Budget, found: MonteCarlo, *, digits: int = 2) -> Comparison:
    """Clause 8 of JCGM 101 for an estimate: its budget, at `found.level`, against its Monte Carlo."""
    return compare(
        found,
        solved.values,
        budget.standard_uncertainties,
        budget.expanded,
        digits=digits,
        unit=DISPLAY_UNITS,
        names=PARAMETERS,
        by_t=_by_t(solved),
    )


def _by_t(solved: Solved) -> Array:
    """First order's u with the standard deviations of the inputs' t-distributions, (8,)."""
    at = solved.linearise()
    wider = _wider(at.inputs.dof)
    inputs = replace(at.inputs, covariance=at.inputs.covariance * np.outer(wider, wider))
    scatter = None if at.scatter is None else at.scatter * _wider(np.array([at.scatter_dof])) ** 2
    return make_budget(at.gain, inputs, scatter=scatter, scatter_dof=at.scatter_dof).standard_uncertainties


def _wider(dof: Array) -> Array:
    """√(ν/(ν − 2)), next to infinite from two degrees of freedom down."""
    return np.asarray(1.0 / np.sqrt(np.maximum(1.0 - 2.0 / dof, _NO_VARIANCE)))


def model_of(solved: Solved) -> SessionModel:
    """The model that repeats an estimate for drawn inputs.

    Raises
    ------
    InputError
        When nothing is known of the uncertainty, or a parameter is not determined.
    """
    estimate, problem, values = solved.estimate, solved.problem, solved.values
    if estimate.uncertainty_basis == "none" or problem.observations is None:
        raise InputError(
            Message("monte-carlo-no-uncertainty", "A Monte Carlo evaluation needs to know how uncertain the currents "
                    "are, but neither u(Jx) and u(Jy) nor enough positions to tell it from the scatter "
                    "are given.")
        )  # fmt: skip
    determined = np.where(np.isnan(estimate.values), np.nan, values)
    scatter = None
    if estimate.uncertainty_basis == "scatter":
        scatter = (solved.inflation**2 * solved.scatter, float(estimate.fit.dof))
    rows = whitening = None
    if estimate.method == "paper":
        rows = successive.combination(*successive.position_weights(problem.observations))
    else:
        whitening = _weights(solved)
    return session_model(
        problem.observations,
        determined,
        common=problem.common,
        scatter=scatter,
        inflation=solved.inflation,
        widening=solved.widening,
        whitening=whitening,
        rows=rows,
    )


def _weights(solved: Solved) -> Array | None:
    """W of the estimate, by position or whole; None for equal weights."""
    problem, values = solved.problem, solved.values
    u = problem.equations.u_currents
    if solved.estimate.method == "generalised":
        return root_inverse(problem.inputs(values).residual_covariance)
    if solved.weights is None:
        return None if u is None else whitening_of(values, u)
    whitening = position_whitening(problem, values)
    by_position = np.broadcast_to(np.eye(2), (len(solved.weights), 2, 2)) if whitening is None else whitening
    return np.asarray(np.sqrt(solved.weights)[:, :, None] * by_position)
