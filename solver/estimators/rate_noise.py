"""Noise of the residuals: whitening, covariance of all inputs, and the part no parameters explain.

The covariance of the residuals is V = S·Σ·Sᵀ over every uncertain input (`solver.inputs`): the
currents give K·ΣJ·Kᵀ on the diagonal, position by position, the certified angles a block for each
position and its repeats, and what is in common fills the whole matrix.

Without u(J) the residuals' scatter s² takes the place of the currents' noise, and of the random
errors of the angles, which scatter as well: they are not counted again, except where positions are
repeated (repeats share them, so that averaging removes less than the scatter makes believe). What is
in common does not scatter and is added.

Written as a square root, V = L·Lᵀ, the least χ² over all parameters is the square of

    L⁻¹·r − projection of it on the columns of L⁻¹·design,

the part of the residuals that no parameters explain. It has m − p degrees of freedom for every
estimator, since residuals of two of them differ by what parameters do explain.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.error_model import Equations, rate_covariance, scale_matrix
from solver.estimators.observability import Invisible, find_invisible, natural_scale
from solver.inputs import CommonUncertainty, Inputs, inputs_of
from solver.least_squares import estimate, solve
from solver.records import Array, Observations, UncertaintyBasis

INDEPENDENT: Final = ("currents", "angles")
"""Lines of the budget whose inputs differ from position to position."""
_SINGULAR: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Problem:
    """A session with what is stated of its uncertainty; without observations nothing but the currents'."""

    equations: Equations
    observations: Observations | None
    common: CommonUncertainty | None = None

    @property
    def only_currents(self) -> bool:
        """Whether nothing but the currents is stated to be uncertain."""
        at = self.observations
        if at is None:
            return True
        angles = at.u_alpha.any() or at.u_beta.any() or at.u_gamma.any()
        return not angles and (self.common is None or not self.common.standard.any())

    def inputs(self, values: Array) -> Inputs:
        """All stated inputs around `values` (8,)."""
        assert self.observations is not None
        return inputs_of(self.observations, values, self.common)


@dataclass(frozen=True, slots=True)
class Noise:
    """What is taken as the noise of the residuals.

    Attributes
    ----------
    basis
        Where it comes from.
    covariance : (2n, 2n) array
        V of all inputs, (rad/s)²; NaN when it is not known.
    visible : (2n, 2n) array
        Covariance by which residuals are judged: V, or the scatter alone.
    independent : (2n, 2n) array
        Without what all positions have in common: what more positions would lessen.
    rest : (2n,) array
        Part of the residuals that no parameters explain, whitened when the basis is ``given``.
    scatter : float
        Variance of the residuals taken from themselves, (rad/s)²; NaN when the basis is another.
    """

    basis: UncertaintyBasis
    covariance: Array
    visible: Array
    independent: Array
    rest: Array
    scatter: float = float("nan")


def invisible_in(problem: Problem, rows: Array | None = None) -> Invisible:
    """What the data do not determine, the certified angles' errors counted as noise of the currents.

    A misalignment δ that the certificate does not tell turns the vector of which Jx and Jy are two
    components, so the currents vary by δ times its length without the equations knowing why; K is not
    needed for that, only the largest excursion of the measured currents from their mean. At a pole
    this, and not u(J), is what makes the columns of K look independent.

    Parameters
    ----------
    rows
        As for `solver.estimators.observability.find_invisible`.
    """
    equations, at = problem.equations, problem.observations
    if at is None or equations.u_currents is None:
        return find_invisible(equations, rows)
    angle = np.sqrt((at.u_alpha**2 + at.u_beta**2 + at.u_gamma**2) / 3.0)
    if not angle.any():
        return find_invisible(equations, rows)
    currents = np.stack((at.jx, at.jy), axis=1)
    excursion = float(np.linalg.norm(currents - currents.mean(axis=0), axis=1).max())
    noise = np.hypot(equations.u_currents, (angle * excursion)[:, None])
    return find_invisible(replace(equations, u_currents=noise), rows)


def noise_of(problem: Problem, values: Array, dof: int, invisible: Invisible) -> Noise:
    """Noise of the residuals at `values` (8,) from what is stated, or from their scatter."""
    equations = problem.equations
    residuals = equations.residuals(values)
    size = len(residuals)
    unknown = np.full((size, size), np.nan)
    if invisible.parameters[:4].any():  # the rates' noise is K times that of the currents
        return Noise("none", unknown, unknown, unknown, residuals)
    if equations.u_currents is None:
        rest = inexplicable(equations.design, residuals, invisible)
        variance = float(rest @ rest) / dof if dof > 0 else np.nan
        return by_scatter(problem, values, variance, rest)
    whitening = whitening_of(values, equations.u_currents)
    if whitening is None:
        return Noise("none", unknown, unknown, unknown, residuals)
    if problem.only_currents:
        rest = inexplicable(whiten(whitening, equations.design), whiten(whitening, residuals), invisible)
        blocks = blocks_of(values, equations.u_currents)
        return Noise("given", blocks, blocks, blocks, rest)
    inputs = problem.inputs(values)
    whole = inputs.residual_covariance
    root = root_inverse(whole)
    rest = inexplicable(root @ equations.design, root @ residuals, invisible)
    return Noise("given", whole, whole, part_of(inputs, INDEPENDENT), rest)


def by_scatter(problem: Problem, values: Array, variance: float, rest: Array) -> Noise:
    """Noise of variance `variance` in every residual; basis ``none`` when it is NaN."""
    size = len(rest)
    visible = variance * np.eye(size)
    if np.isnan(variance):
        visible[:] = np.nan
        return Noise("none", visible, visible, visible, rest)
    if problem.only_currents:
        return Noise("scatter", visible, visible, visible, rest, variance)
    inputs = problem.inputs(values)
    repeated = problem.observations is not None and bool(problem.observations.repeat.any())
    seen = ("currents",) if repeated else INDEPENDENT
    others = tuple(line for line in np.unique(inputs.source) if line not in seen)
    independent = visible + part_of(inputs, ("angles",)) if repeated else visible
    return Noise("scatter", visible + part_of(inputs, others), visible, independent, rest, variance)


def part_of(inputs: Inputs, lines: tuple[str, ...]) -> Array:
    """Covariance of the residuals from some lines of the budget alone, (2n, 2n)."""
    here = np.isin(inputs.source, lines)
    sensitivity = inputs.sensitivity[:, here]
    return np.asarray(sensitivity @ inputs.covariance[np.ix_(here, here)] @ sensitivity.T)


def root_inverse(covariance: Array) -> Array:
    """L⁻¹ with V = L·Lᵀ, (m, m), rows scaled first so that units and sizes do not matter.

    Raises
    ------
    numpy.linalg.LinAlgError
        When V is not positive definite.
    """
    scale = np.sqrt(np.diagonal(covariance))
    lower = np.linalg.cholesky(covariance / np.outer(scale, scale))
    return np.asarray(np.linalg.inv(lower) / scale)


def whitening_of(values: Array, u_currents: Array) -> Array | None:
    """Turn rates of each position back into currents over their u; None where K is singular."""
    inverse = inverse_scale(values)
    return None if inverse is None else np.asarray(inverse / u_currents[:, :, None])


def inverse_scale(values: Array) -> Array | None:
    """K⁻¹, (2, 2), A·s/rad; None where K is singular."""
    if not is_regular(values):
        return None
    k = scale_matrix(values)
    determinant = k[0, 0] * k[1, 1] - k[0, 1] * k[1, 0]
    return np.asarray(np.array([[k[1, 1], -k[0, 1]], [-k[1, 0], k[0, 0]]]) / determinant)


def is_regular(values: Array) -> NDArray[np.bool_]:
    """Whether K of parameters (8, …) can be inverted without losing its digits, (…)."""
    kx, ky, kxy, kyx = values[:4]
    return np.asarray(np.abs(kx * ky - kxy * kyx) > _SINGULAR * (kx * kx + ky * ky + kxy * kxy + kyx * kyx))


def whiten(whitening: Array, rows: Array, *, transpose: bool = False) -> Array:
    """Apply each position's matrix, (n, 2, 2), to its two rows of a (2n,) or (2n, c) array."""
    blocks = whitening.transpose(0, 2, 1) if transpose else whitening
    return np.asarray((blocks @ rows.reshape(len(blocks), 2, -1)).reshape(rows.shape))


def blocks_of(values: Array, u_currents: Array) -> Array:
    """K·ΣJ·Kᵀ of every position on the diagonal, (2n, 2n)."""
    n = len(u_currents)
    blocks = np.zeros((n, 2, n, 2))
    blocks[np.arange(n), :, np.arange(n), :] = rate_covariance(values, u_currents)
    return blocks.reshape(2 * n, 2 * n)


def inexplicable(design: Array, residuals: Array, invisible: Invisible) -> Array:
    """Part of the residuals that no change of the parameters removes; all of it after least squares."""
    return residuals - design @ rough(design, residuals, invisible)


def rough(design: Array, right_side: Array, invisible: Invisible) -> Array:
    """Parameters that solve whitened equations, without more: to weight by, (8,)."""
    if not len(invisible.directions):
        return estimate(design, right_side)[0]
    scale = natural_scale(design)
    return solve(design, right_side, scale=scale, invisible=invisible.directions).values
