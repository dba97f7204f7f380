"""Least squares and the paper's method, with their uncertainty, from the observation equations.

Both estimators are linear in the observation equations, ``q = H·right_side``; for the paper's method
the gain H is the implicit differentiation of its limit (`solver.successive`). `solver.estimators.conclusion`
gives every such estimator its covariance and judges its residuals.
"""

from typing import Final

from solver import successive
from solver.error_model import Equations
from solver.errors import NotConverged, SolverError
from solver.estimators.conclusion import Linearised, Solved, conclude
from solver.estimators.estimated_weights import widening_of
from solver.estimators.observability import natural_scale, unobservable
from solver.estimators.rate_noise import Problem, invisible_in, rough, whiten, whitening_of
from solver.inputs import CommonUncertainty
from solver.least_squares import solve
from solver.records import Observations

__all__ = ["REWEIGHTING_ROUNDS", "Linearised", "Solved", "least_squares", "paper"]

REWEIGHTING_ROUNDS: Final = 2


def least_squares(
    equations: Equations, observations: Observations | None, common: CommonUncertainty | None = None
) -> Solved:
    """Least squares over every position, weighted by u(J) where it is given.

    Certificate angles and what is in common count for the uncertainty, not for the weights
    (`solver.estimators.generalised` weighs by all).
    """
    problem = Problem(equations, observations, common)
    invisible = invisible_in(problem)
    design, right_side, whitening = equations.design, equations.right_side, None
    if equations.u_currents is not None:
        for _ in range(REWEIGHTING_ROUNDS):
            latest = whitening_of(rough(design, right_side, invisible), equations.u_currents)
            if latest is None:
                break
            whitening = latest
            design = whiten(whitening, equations.design)
            right_side = whiten(whitening, equations.right_side)
    solution = solve(design, right_side, scale=natural_scale(design), invisible=invisible.directions)
    gain = solution.gain if whitening is None else whiten(whitening, solution.gain.T, transpose=True).T
    widening = widening_of(equations, solution.values, gain, whitening)
    return conclude("least-squares", problem, solution.values, gain, solution, invisible, widening=widening)


def paper(
    equations: Equations, observations: Observations, common: CommonUncertainty | None = None
) -> Solved:
    """The paper's successive approximations.

    Raises
    ------
    InputError
        When a position of the method was not measured.
    NotConverged
        When the iteration does not end, with its history; code ``unobservable`` when the positions
        do not determine the parameters.
    """
    method, mean = successive.position_weights(observations)
    rows = successive.combination(method, mean)
    problem = Problem(equations, observations, common)
    invisible = invisible_in(problem, rows)
    try:
        values, history = successive.successive_approximations(equations, method, mean)
    except SolverError as error:
        if not invisible.parameters.any():
            raise
        iterations = error.iterations if isinstance(error, NotConverged) else None
        raise NotConverged(unobservable(invisible), iterations) from error
    solution = solve(
        rows @ equations.design,
        rows @ equations.right_side,
        scale=natural_scale(equations.design),
        invisible=invisible.directions,
    )
    return conclude("paper", problem, values, solution.gain @ rows, solution, invisible, history=history)
