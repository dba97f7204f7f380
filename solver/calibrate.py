"""The façade: observations in, each method's estimate out, with what limits it and what is odd about it.

`calibrate` solves, `Calibration.budget` says where the uncertainty comes from. It checks the input
once; everything below trusts it. The same observations give the same bits.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from solver import __version__
from solver.error_model import Equations, observation_equations
from solver.errors import InputError, Message, NotConverged, SolverError
from solver.estimators.conclusion import Solved
from solver.estimators.estimation import least_squares, paper
from solver.estimators.generalised import generalised
from solver.estimators.robust import robust
from solver.inputs import CommonUncertainty
from solver.measurement_rule import about_fit, about_measurement
from solver.propagation.budget import Budget, make_budget
from solver.records import Estimate, Failure, Method, Observations

Asked = Literal["least-squares", "generalised", "robust", "paper", "both"]

_Solver = Callable[[Equations, Observations, CommonUncertainty | None], Solved]
_SOLVERS: Final[Mapping[Method, _Solver]] = {
    "least-squares": least_squares,
    "generalised": generalised,
    "robust": robust,
    "paper": paper,
}


@dataclass(frozen=True, slots=True)
class Calibration:
    """Each asked method's answer or failure.

    Attributes
    ----------
    input_hash, solver_version
        Of what went in, and of what solved it.
    observations
        As they went in.
    common
        What was stated of the uncertainty that all positions share.
    answers
        Estimate or failure, by method.
    solved
        What each estimate came from, by method.
    """

    input_hash: str
    solver_version: str
    observations: Observations
    common: CommonUncertainty | None
    answers: Mapping[Method, Estimate | Failure]
    solved: Mapping[Method, Solved] = field(default_factory=dict)

    @property
    def least_squares(self) -> Estimate | None:
        """The estimate by least squares; None when it was not asked."""
        found = self.answers.get("least-squares")
        return found if isinstance(found, Estimate) else None

    @property
    def paper(self) -> Estimate | Failure | None:
        """The paper's estimate, or why there is none; None when it was not asked."""
        return self.answers.get("paper")

    def budget(self, method: Method) -> Budget | None:
        """Where a method's uncertainty comes from; None where nobody knows it."""
        solved = self.solved.get(method)
        if solved is None or solved.estimate.uncertainty_basis == "none":
            return None
        at = solved.linearise()
        return make_budget(at.gain, at.inputs, scatter=at.scatter, scatter_dof=at.scatter_dof)


def calibrate(
    observations: Observations, method: Asked = "both", common: CommonUncertainty | None = None
) -> Calibration:
    """Find the eight parameters.

    Parameters
    ----------
    observations
        From `Observations.sorted_from`.
    method
        ``both`` gives least squares and the paper's method side by side.
    common
        Uncertainty of what all positions share.

    Returns
    -------
    Calibration
        With ``both``, a failure of the paper's method is a `Failure` among the answers.

    Raises
    ------
    InputError
        When there are no positions, rows are not sorted, or (``paper`` alone) a position is missing.
    NotConverged
        When the one method asked for does not converge.
    """
    _check(observations, method)
    equations = observation_equations(observations)
    asked: tuple[Method, ...] = ("least-squares", "paper") if method == "both" else (method,)
    answers: dict[Method, Estimate | Failure] = {}
    solved: dict[Method, Solved] = {}
    for one in asked:
        try:
            solved[one] = _complete(_SOLVERS[one](equations, observations, common), observations)
            answers[one] = solved[one].estimate
        except SolverError as error:
            if len(asked) == 1:
                raise
            iterations = error.iterations if isinstance(error, NotConverged) else None
            answers[one] = Failure(one, error.message, iterations)
    return Calibration(observations.input_hash(), __version__, observations, common, answers, solved)


def _check(observations: Observations, method: str) -> None:
    known = (*_SOLVERS, "both")
    if method not in known:
        raise InputError(
            Message(
                "bad-method",
                "There is no method “%(method)s”. Choose one of %(methods)s.",
                {"method": method, "methods": ", ".join(known)},
            )
        )
    if len(observations) == 0:
        raise InputError(Message("no-positions", "There is no measured position."))
    order = np.lexsort((observations.repeat, observations.psi, observations.theta))
    if not np.array_equal(order, np.arange(len(observations))):
        raise InputError(
            Message(
                "not-sorted", "The positions must be sorted by θ, ψ and repeat: use Observations.sorted_from."
            )
        )
    if not np.any(observations.jx) and not np.any(observations.jy):
        raise InputError(
            Message("no-currents", "All currents are zero. Check that the ammeter was connected.")
        )


def _complete(solved: Solved, observations: Observations) -> Solved:
    """Add the warnings that all methods share."""
    estimate = solved.estimate
    warnings = (*estimate.warnings, *about_measurement(observations), *about_fit(estimate, observations))
    return replace(solved, estimate=replace(estimate, warnings=warnings))
