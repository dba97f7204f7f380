"""Generalised least squares: weights from the whole covariance of all inputs.

V = S·Σ·Sᵀ of the residuals (`solver.estimators.rate_noise`) is dense, since what all positions have in common
correlates them. With V = L·Lᵀ the equations L⁻¹·design·q = L⁻¹·right_side have noise of unit
covariance, and ordinary least squares on them has the smallest variance of all linear unbiased
estimators (Aitken 1936). V depends on the parameters; it is taken twice at the latest ones, as the
weights of least squares are.
"""

from solver.error_model import Equations
from solver.errors import InputError, Message
from solver.estimators.conclusion import Solved, conclude
from solver.estimators.estimated_weights import widening_of
from solver.estimators.estimation import REWEIGHTING_ROUNDS
from solver.estimators.observability import natural_scale
from solver.estimators.rate_noise import Problem, inverse_scale, invisible_in, root_inverse, rough
from solver.inputs import CommonUncertainty
from solver.least_squares import solve
from solver.records import Observations


def generalised(
    equations: Equations, observations: Observations, common: CommonUncertainty | None = None
) -> Solved:
    """Generalised least squares over every position.

    Raises
    ------
    InputError
        When u(J) is not given: without it V is singular, and no weights follow from it.
    """
    if equations.u_currents is None:
        raise InputError(
            Message(
                "no-uncertainty",
                "Generalised least squares weighs by the uncertainty of every input, but that of the currents "
                "is not given. Give u(Jx) and u(Jy) for every position, or use least squares.",
            )
        )
    problem = Problem(equations, observations, common)
    invisible = invisible_in(problem)
    design, right_side, whitening = equations.design, equations.right_side, None
    for _ in range(REWEIGHTING_ROUNDS):
        values = rough(design, right_side, invisible)
        if inverse_scale(values) is None:
            break
        whitening = root_inverse(problem.inputs(values).residual_covariance)
        design, right_side = whitening @ equations.design, whitening @ equations.right_side
    solution = solve(design, right_side, scale=natural_scale(design), invisible=invisible.directions)
    gain = solution.gain if whitening is None else solution.gain @ whitening
    widening = widening_of(equations, solution.values, gain, whitening)
    return conclude("generalised", problem, solution.values, gain, solution, invisible, widening=widening)
