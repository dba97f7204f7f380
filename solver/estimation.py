"""The two methods' estimates with their uncertainty, from the observation equations.

Both estimators are linear in the observation equations, ``q = H·right_side``, with the noise of the
rates ε = K·δJ, of covariance R (block by block K·ΣJ·Kᵀ). So δq = H·ε, which for the paper's method
is the implicit differentiation of its limit (`solver.successive`), and u follows from H·R·Hᵀ.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver import successive
from solver.constants import EARTH_RATE
from solver.error_model import Equations, rate_covariance, scale_matrix
from solver.errors import Message, NotConverged, SolverError
from solver.fit_quality import judge
from solver.least_squares import LinearSolution, estimate, solve
from solver.observability import Invisible, find_invisible, names, natural_scale, unobservable
from solver.records import Array, Estimate, Fit, Method, Observations, UncertaintyBasis
from solver.units import deg_per_h_from_rad_per_s

REWEIGHTING_ROUNDS: Final = 2
_SINGULAR: Final = 1e-6
_ROUNDING: Final = 1e-12


@dataclass(frozen=True, slots=True)
class Noise:
    """What is taken as the noise of the residuals.

    Attributes
    ----------
    basis
        Where it comes from.
    covariance : (2n, 2n) array
        R, (rad/s)²; NaN when it is not known.
    rest : (2n,) array
        Part of the residuals that no parameters explain, whitened when the basis is ``given``.
    """

    basis: UncertaintyBasis
    covariance: Array
    rest: Array


def least_squares_estimate(equations: Equations) -> Estimate:
    """Least squares over every position, weighted by u(J) where it is given."""
    invisible = find_invisible(equations)
    design, right_side, whitening = equations.design, equations.right_side, None
    if equations.u_currents is not None:
        for _ in range(REWEIGHTING_ROUNDS):
            latest = _whitening(_rough(design, right_side, invisible), equations.u_currents)
            if latest is None:
                break
            whitening = latest
            design = _whiten(whitening, equations.design)
            right_side = _whiten(whitening, equations.right_side)
    solution = solve(design, right_side, scale=natural_scale(design), invisible=invisible.directions)
    gain = solution.gain if whitening is None else _whiten(whitening, solution.gain.T, transpose=True).T
    return _estimate("least-squares", equations, solution.values, gain, solution, invisible, None)


def _rough(design: Array, right_side: Array, invisible: Invisible) -> Array:
    """Parameters to weight by, (8,)."""
    if not len(invisible.directions):
        return estimate(design, right_side)[0]
    scale = natural_scale(design)
    return solve(design, right_side, scale=scale, invisible=invisible.directions).values


def paper_estimate(equations: Equations, observations: Observations) -> Estimate:
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
    invisible = find_invisible(equations, rows)
    try:
        values, history = successive.successive_approximations(equations, method, mean)
    except SolverError as error:
        if not invisible.parameters.any():
            raise
        iterations = error.iterations if isinstance(error, NotConverged) else None
        raise NotConverged(unobservable(invisible), iterations) from error
    system = rows @ equations.design
    solution = solve(
        system,
        rows @ equations.right_side,
        scale=natural_scale(equations.design),
        invisible=invisible.directions,
    )
    return _estimate("paper", equations, values, solution.gain @ rows, solution, invisible, history)


def _whitening(values: Array, u_currents: Array) -> Array | None:
    """Turn rates of each position back into currents over their u; None where K is singular."""
    k = scale_matrix(values)
    determinant = k[0, 0] * k[1, 1] - k[0, 1] * k[1, 0]
    if not abs(determinant) > _SINGULAR * float(np.sum(k * k)):
        return None
    inverse = np.array([[k[1, 1], -k[0, 1]], [-k[1, 0], k[0, 0]]]) / determinant
    return np.asarray(inverse / u_currents[:, :, None])


def _whiten(whitening: Array, rows: Array, *, transpose: bool = False) -> Array:
    """Apply each position's matrix to its two rows of a (2n,) or (2n, c) array."""
    blocks = whitening.transpose(0, 2, 1) if transpose else whitening
    return np.asarray((blocks @ rows.reshape(len(blocks), 2, -1)).reshape(rows.shape))


def _noise(equations: Equations, values: Array, residuals: Array, dof: int, invisible: Invisible) -> Noise:
    """Noise of the rates, from u(J) or from the part of the residuals that no parameters explain."""
    n = len(residuals) // 2
    if invisible.parameters[:4].any():  # the rates' noise is K times that of the currents
        return Noise("none", np.full((2 * n, 2 * n), np.nan), residuals)
    if equations.u_currents is not None:
        whitening = _whitening(values, equations.u_currents)
        if whitening is None:
            return Noise("none", np.full((2 * n, 2 * n), np.nan), residuals)
        rest = _inexplicable(_whiten(whitening, equations.design), _whiten(whitening, residuals), invisible)
        return Noise("given", _blocks(values, equations.u_currents), rest)
    rest = _inexplicable(equations.design, residuals, invisible)
    variance = float(rest @ rest) / dof if dof > 0 else np.nan
    return Noise("scatter" if dof > 0 else "none", variance * np.eye(2 * n), rest)


def _blocks(values: Array, u_currents: Array) -> Array:
    """K·ΣJ·Kᵀ of every position on the diagonal, (2n, 2n)."""
    n = len(u_currents)
    blocks = np.zeros((n, 2, n, 2))
    blocks[np.arange(n), :, np.arange(n), :] = rate_covariance(values, u_currents)
    return blocks.reshape(2 * n, 2 * n)


def _inexplicable(design: Array, residuals: Array, invisible: Invisible) -> Array:
    """Part of the residuals that no change of the parameters removes; all of it after least squares."""
    return residuals - design @ _rough(design, residuals, invisible)


def _estimate(
    method: Method,
    equations: Equations,
    values: Array,
    gain: Array,
    solution: LinearSolution,
    invisible: Invisible,
    history: Array | None,
) -> Estimate:
    residuals = equations.residuals(values)
    dof = len(residuals) - 8 + len(invisible.directions)
    noise = _noise(equations, values, residuals, dof, invisible)
    covariance = gain @ noise.covariance @ gain.T
    covariance = (covariance + covariance.T) / 2
    standardised = np.full(len(residuals), np.nan)
    outliers = np.zeros(len(residuals), dtype=np.bool_)
    if noise.basis == "given" or (noise.basis == "scatter" and not _only_rounding(noise.rest, equations)):
        sensitivity = np.eye(len(residuals)) - equations.design @ gain
        freedom = None if noise.basis == "given" else dof
        judged = judge(residuals, sensitivity, noise.covariance, freedom)
        standardised, outliers = judged.standardised, judged.outliers
    judged_by = covariance
    if noise.basis == "none":
        judged_by = gain @ _blocks(values, invisible.noise) @ gain.T
    blank, rank, warnings = _undetermined(invisible, judged_by)
    values = np.where(blank, np.nan, values)
    covariance[blank] = covariance[:, blank] = np.nan
    chi2 = float(noise.rest @ noise.rest) if noise.basis == "given" else None
    return Estimate(
        method=method,
        values=values,
        covariance=covariance,
        uncertainty_basis=noise.basis,
        residuals=residuals.reshape(-1, 2),
        standardised=standardised.reshape(-1, 2),
        outliers=outliers.reshape(-1, 2),
        fit=Fit(
            chi2=chi2,
            dof=dof,
            p_value=None if chi2 is None or dof < 1 else float(special.chdtrc(dof, chi2)),
            rank=rank,
            condition=solution.condition,
            singular_values=None if method == "paper" else solution.singular_values,
            singular_vectors=None if method == "paper" else solution.singular_vectors,
        ),
        iterations=history,
        warnings=warnings,
    )


def _only_rounding(rest: Array, equations: Equations) -> bool:
    """Residuals so small that they are rounding, whose pattern says nothing."""
    return bool(np.linalg.norm(rest) <= _ROUNDING * np.linalg.norm(equations.right_side))


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
