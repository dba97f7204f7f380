"""Huber's estimate over every position: blunders in a few positions do not spoil it.

Each position's two equations are first turned into currents, by K⁻¹, and brought to unit variance by
the symmetric square root of what is stated for that position (u(J) and its certified angles), so that a
blunder in one channel stays in one equation. K is that of the previous estimate; three rounds. Without
u(J) all equations count alike and the noise follows from the median of the residuals (`solver.estimators.huber`).

What all positions have in common counts in that square root only as far as least squares cannot make
up for it by the parameters: otherwise an azimuth that nobody knows would excuse every blunder. It is
propagated by the weighted gain H with which ``q = H·right_side``; what differs from position to
position has its variance multiplied by f of `solver.estimators.huber`. With given uncertainties f is not taken to
be less than for normal noise of the stated size: few residuals inside their uncertainty are no proof
of smaller ones.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from solver.error_model import Equations
from solver.estimators.conclusion import Solved, fit_of, judge_residuals, report
from solver.estimators.estimated_weights import widened, widening_of
from solver.estimators.huber import HuberFit, huber, normal_factor
from solver.estimators.observability import Invisible, natural_scale
from solver.estimators.rate_noise import (
    INDEPENDENT,
    Noise,
    Problem,
    by_scatter,
    inexplicable,
    inverse_scale,
    invisible_in,
    noise_of,
    part_of,
    rough,
    whiten,
    whitening_of,
)
from solver.inputs import CommonUncertainty
from solver.least_squares import complement, solve
from solver.records import Array, Observations

ROUNDS: Final = 3
_ROUNDING: Final = 1e-10


def robust(
    equations: Equations, observations: Observations, common: CommonUncertainty | None = None
) -> Solved:
    """Huber's estimate; `Solved.weights` tells each equation's weight, x and y of each position.

    Raises
    ------
    NotConverged
        When the iterated weights do not settle.
    """
    problem = Problem(equations, observations, common)
    invisible = invisible_in(problem)
    values = rough(equations.design, equations.right_side, invisible)
    whitening = None
    for _ in range(ROUNDS):
        latest = position_whitening(problem, values)
        if latest is None and whitening is not None:
            break
        whitening = latest
        design = equations.design if whitening is None else whiten(whitening, equations.design)
        right_side = equations.right_side if whitening is None else whiten(whitening, equations.right_side)
        fit = _fit(design, right_side, invisible, None if whitening is None else 1.0)
        values = fit.values
        if whitening is None:
            break
    root = np.sqrt(fit.weights)
    design, right_side = design * root[:, None], right_side * root
    solution = solve(design, right_side, scale=natural_scale(design), invisible=invisible.directions)
    gain = solution.gain * root
    gain = gain if whitening is None else whiten(whitening, gain.T, transpose=True).T
    dof = gain.shape[1] - 8 + len(invisible.directions)
    noise, factor = _noise(problem, fit, dof, invisible)
    widening = widening_of(equations, values, gain, whitening)
    wide = widened(noise, equations, values, widening)
    inflated = replace(wide, covariance=wide.covariance + (factor - 1.0) * wide.independent)
    judged = judge_residuals(problem, values, gain, noise, dof, apart=True)
    quality = fit_of(noise, dof, solution, with_spectrum=True)
    estimate = report("robust", problem, values, gain, inflated, judged, quality, invisible)
    weights = fit.weights.reshape(-1, 2)
    return Solved(estimate, problem, gain, values, noise.scatter, factor**0.5, weights, widening)


def position_whitening(problem: Problem, values: Array) -> Array | None:
    """Matrices (n, 2, 2) that bring each position's residuals to currents of unit variance; None without u(J)."""
    u = problem.equations.u_currents
    inverse = inverse_scale(values)
    if u is None or inverse is None:
        return None
    if problem.only_currents:
        return whitening_of(values, u)
    inputs = problem.inputs(values)
    common = tuple(line for line in np.unique(inputs.source) if line not in INDEPENDENT)
    blocks = _diagonal(part_of(inputs, INDEPENDENT)) + _diagonal(_shown(problem, part_of(inputs, common)))
    spread, axes = np.linalg.eigh(inverse @ blocks @ inverse.T)
    return np.asarray((axes / np.sqrt(spread)[:, None, :]) @ axes.transpose(0, 2, 1) @ inverse)


def _diagonal(covariance: Array) -> Array:
    """Blocks of each position, (n, 2, 2)."""
    n = len(covariance) // 2
    return covariance.reshape(n, 2, n, 2)[np.arange(n), :, np.arange(n), :]


def _shown(problem: Problem, covariance: Array) -> Array:
    """Covariance of the residuals that is left after least squares, (2n, 2n)."""
    q, r = np.linalg.qr(problem.equations.design / natural_scale(problem.equations.design))
    seen = q[:, np.abs(np.diagonal(r)) > _ROUNDING]
    left = np.eye(len(q)) - seen @ seen.T
    return np.asarray(left @ covariance @ left)


def _fit(design: Array, right_side: Array, invisible: Invisible, scale: float | None) -> HuberFit:
    """Fit whitened equations in the parameters that show."""
    if not len(invisible.directions):
        return huber(design, right_side, scale=scale)
    lengths = natural_scale(design)
    basis = complement(invisible.directions * lengths) / lengths[:, None]
    fit = huber(design @ basis, right_side, scale=scale)
    return replace(fit, values=basis @ fit.values)


def _noise(problem: Problem, fit: HuberFit, dof: int, invisible: Invisible) -> tuple[Noise, float]:
    """Noise of the residuals, and f; without u(J) by the median instead of the mean square."""
    noise = noise_of(problem, fit.values, dof, invisible)
    if noise.basis == "none":
        return noise, 1.0
    if noise.basis == "given":
        return noise, float(np.fmax(fit.variance_factor, normal_factor(fit.weights)))
    equations = problem.equations
    rest = inexplicable(equations.design, equations.residuals(fit.values), invisible)
    return by_scatter(problem, fit.values, fit.scale**2, rest), fit.variance_factor
