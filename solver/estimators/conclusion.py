"""From any linear estimator to its reported estimate: covariance, residuals judged, χ², what is blank.

An estimator ``q = H·right_side`` of the observation equations turns errors of the inputs into
δq = H·S·δz (`solver.inputs`), so its covariance is H·V·Hᵀ with V the covariance of the residuals by
all inputs (`solver.estimators.rate_noise`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver.constants import EARTH_RATE
from solver.errors import Message
from solver.estimators.estimated_weights import widened
from solver.estimators.fit_quality import Scatter, judge
from solver.estimators.observability import Invisible, names, unobservable
from solver.estimators.rate_noise import INDEPENDENT, Noise, Problem, blocks_of, noise_of
from solver.inputs import Inputs
from solver.least_squares import LinearSolution
from solver.records import Array, Estimate, Fit, Method, UncertaintyBasis
from solver.units import deg_per_h_from_rad_per_s

_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class Linearised:
    """An estimator around its estimate: what a budget and a propagation of distributions start from.

    Attributes
    ----------
    gain : (8, 2n) array
        H: δq = H·δ(residuals); NaN in the rows of parameters that the data do not determine.
    inputs
        The uncertain inputs around `values`, u(J) times `Solved.widening`. For the robust method the covariance
        of what differs from position to position is multiplied by the square of `inflation`.
    values : (8,) array
        Parameters around which all is linearised; finite also where the estimate is blank.
    basis
        Of the estimate. With ``none`` nothing can be propagated.
    scatter : (2n, 2n) array or None
        With the basis ``scatter``, the covariance that the residuals themselves tell, (rad/s)².
    scatter_dof : int
        Its degrees of freedom.
    inflation : float
        By how much the robust method's standard uncertainty exceeds that of weights known beforehand; 1 for others.
    """

    gain: Array
    inputs: Inputs
    values: Array
    basis: UncertaintyBasis
    scatter: Array | None
    scatter_dof: int
    inflation: float = 1.0


@dataclass(frozen=True, slots=True)
class Solved:
    """A method's estimate with what it came from.

    Attributes
    ----------
    estimate
        To be reported.
    problem
        What was solved.
    gain : (8, 2n) array
        H of the method.
    values : (8,) array
        Finite also where the estimate is blank.
    scatter : float
        Variance of the residuals, (rad/s)², where the basis is ``scatter``.
    inflation : float
        See `Linearised`.
    weights : (n, 2) array or None
        Weight of each whitened equation in the robust method, 0 to 1.
    widening : (n, 2) array or None
        Factors on u(J) that allow for weights by estimates of it (`solver.estimators.estimated_weights`).
    """

    estimate: Estimate
    problem: Problem
    gain: Array
    values: Array
    scatter: float
    inflation: float = 1.0
    weights: Array | None = None
    widening: Array | None = None

    def linearise(self) -> Linearised:
        """Gather the estimator's gain and inputs."""
        estimate, inputs = self.estimate, self.problem.inputs(self.values)
        if self.inflation != 1.0:
            factor = np.where(np.isin(inputs.source, INDEPENDENT), self.inflation, 1.0)
            inputs = replace(inputs, covariance=inputs.covariance * np.outer(factor, factor))
        if self.widening is not None:
            factor = np.ones(len(inputs.source))
            factor[inputs.source == "currents"] = self.widening.ravel()
            inputs = replace(inputs, covariance=inputs.covariance * np.outer(factor, factor))
        by_scatter = estimate.uncertainty_basis == "scatter"
        variance = self.inflation**2 * self.scatter
        return Linearised(
            gain=np.where(np.isnan(estimate.values)[:, None], np.nan, self.gain),
            inputs=inputs,
            values=self.values,
            basis=estimate.uncertainty_basis,
            scatter=variance * np.eye(self.gain.shape[1]) if by_scatter else None,
            scatter_dof=estimate.fit.dof,
            inflation=self.inflation,
        )


def conclude(
    method: Method,
    problem: Problem,
    values: Array,
    gain: Array,
    solution: LinearSolution,
    invisible: Invisible,
    *,
    history: Array | None = None,
    widening: Array | None = None,
) -> Solved:
    """Report an estimator's answer.

    Parameters
    ----------
    values : (8,) array
        Its answer.
    gain : (8, 2n) array
        Its gain.
    solution
        Spectrum of the system it solves.
    invisible
        What the data do not determine.
    history : (rounds, 8) array, optional
        Its approximations.
    widening : (n, 2) array, optional
        See `Solved`.
    """
    dof = gain.shape[1] - 8 + len(invisible.directions)
    noise = noise_of(problem, values, dof, invisible)
    judged = judge_residuals(problem, values, gain, noise, dof)
    fit = fit_of(noise, dof, solution, with_spectrum=method != "paper")
    wide = widened(noise, problem.equations, values, widening)
    estimate = report(method, problem, values, gain, wide, judged, fit, invisible)
    return Solved(
        replace(estimate, iterations=history), problem, gain, values, noise.scatter, widening=widening
    )


def judge_residuals(
    problem: Problem, values: Array, gain: Array, noise: Noise, dof: int, *, apart: bool = False
) -> Scatter:
    """Standardise the residuals and mark outliers; nothing where their noise is unknown or only rounding.

    `apart`: the scatter is not the mean square of these residuals, so that blunders are not in it.
    """
    equations = problem.equations
    size = gain.shape[1]
    known = noise.basis == "given" or (noise.basis == "scatter" and not only_rounding(noise.rest, problem))
    if not known:
        return Scatter(np.full(size, np.nan), np.zeros(size, dtype=np.bool_))
    sensitivity = np.eye(size) - equations.design @ gain
    freedom = None if noise.basis == "given" else dof
    return judge(equations.residuals(values), sensitivity, noise.visible, freedom, apart=apart)


def fit_of(noise: Noise, dof: int, solution: LinearSolution, *, with_spectrum: bool) -> Fit:
    """χ² of what no parameters explain, and how well the system is conditioned; the rank comes with `report`."""
    chi2 = float(noise.rest @ noise.rest) if noise.basis == "given" else None
    return Fit(
        chi2=chi2,
        dof=dof,
        p_value=None if chi2 is None or dof < 1 else float(special.chdtrc(dof, chi2)),
        rank=0,
        condition=solution.condition,
        singular_values=solution.singular_values if with_spectrum else None,
        singular_vectors=solution.singular_vectors if with_spectrum else None,
    )


def report(
    method: Method,
    problem: Problem,
    values: Array,
    gain: Array,
    noise: Noise,
    judged: Scatter,
    fit: Fit,
    invisible: Invisible,
) -> Estimate:
    """Leave blank what is not determined, and put the estimate together."""
    covariance = gain @ noise.covariance @ gain.T
    covariance = (covariance + covariance.T) / 2
    judged_by = covariance
    if noise.basis == "none":
        judged_by = gain @ blocks_of(values, invisible.noise) @ gain.T
    elif noise.independent is not noise.covariance:
        judged_by = gain @ noise.independent @ gain.T
    blank, rank, warnings = _undetermined(invisible, judged_by)
    covariance[blank] = covariance[:, blank] = np.nan
    return Estimate(
        method=method,
        values=np.where(blank, np.nan, values),
        covariance=covariance,
        uncertainty_basis=noise.basis,
        residuals=problem.equations.residuals(values).reshape(-1, 2),
        standardised=judged.standardised.reshape(-1, 2),
        outliers=judged.outliers.reshape(-1, 2),
        fit=replace(fit, rank=rank),
        iterations=None,
        warnings=warnings,
    )


def only_rounding(rest: Array, problem: Problem) -> bool:
    """Residuals so small that they are rounding, whose pattern says nothing."""
    return bool(np.linalg.norm(rest) <= _ROUNDING * np.linalg.norm(problem.equations.right_side))


def _undetermined(
    invisible: Invisible, covariance: Array
) -> tuple[NDArray[np.bool_], int, tuple[Message, ...]]:
    """Parameters to leave blank, the rank, and the warnings that name them.

    Besides what is invisible, a drift whose standard uncertainty exceeds the Earth rate, the very
    thing it is measured with, is not determined: at θ = 0 alone, arcseconds of certified
    misalignment are all that the g-sensitive drifts show by.
    """
    blank = invisible.parameters.copy()
    rank = 8 - len(invisible.directions)
    warnings: tuple[Message, ...] = (unobservable(invisible),) if blank.any() else ()
    variances = np.where(blank, 0.0, np.nan_to_num(np.diagonal(covariance)))
    vague = variances > EARTH_RATE**2
    vague[:4] = False
    if vague.any():
        kept = np.flatnonzero(~blank[4:]) + 4
        spread = np.linalg.eigvalsh(covariance[np.ix_(kept, kept)])
        rank -= max(1, int(np.sum(spread > EARTH_RATE**2)))
        largest = deg_per_h_from_rad_per_s(float(np.sqrt(variances[vague].max())))
        warnings += (
            Message(
                "unobservable",
                "Not determined by these positions: %(parameters)s. The standard uncertainty would be up to "
                "%(largest).3g °/h, more than the Earth rate by which the gyro is measured. Measure "
                "positions with other θ and ψ.",
                {"parameters": names(vague), "largest": largest},
            ),
        )
    return blank | vague, rank, warnings
