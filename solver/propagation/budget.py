"""The uncertainty budget of one estimate: which input gives how much of each parameter's u.

An estimator that is linear in the observation equations, ``q = H·right_side``, turns errors δz of
the inputs into δq = H·S·δz (`solver.inputs`), so C = H·S is what the GUM propagates
(`solver.propagation.uncertainty`). Inputs are gathered to lines; a line's own variance contains the
correlations within it, and what correlations between lines add or take away is a line of its own.

Residuals' scatter
    When nothing is stated about the noise, the scatter of the residuals measures it: one line, with
    the fit's degrees of freedom. It shows the currents' noise and, since they differ from position
    to position like noise, also the random errors of the certificate's angles; these two are then
    not counted again. Only where positions are repeated the angles keep their line: repeats share
    the error, so that averaging them removes less than the scatter makes believe. What is common to
    all positions does not scatter and always keeps its lines.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.inputs import SOURCES, Inputs
from solver.propagation.uncertainty import LEVEL, Propagated, linked, propagate
from solver.records import Array, UncertaintyBasis

SCATTER: Final = "scatter"
"""Line: scatter of the residuals."""
CORRELATION: Final = "correlation"
"""Line: what correlations between inputs of different lines add (positive) or take away."""
_SEEN_IN_SCATTER: Final = "currents"


@dataclass(frozen=True, slots=True)
class Budget:
    """Standard uncertainty of each parameter, and where it comes from.

    Attributes
    ----------
    basis
        ``given`` or ``scatter``: where the noise of the currents is known from.
    level : float
        Level of confidence of `coverage_factors` and `expanded`.
    lines : tuple of str
        Keys of `solver.inputs.SOURCES` in their order, only those that are uncertain; `SCATTER`
        first where the basis is the scatter; `CORRELATION` last where correlated inputs stand in
        different lines.
    standard : (lines, 8) array
        Standard uncertainty that each line alone gives each parameter; NaN for `CORRELATION`.
    shares : (lines, 8) array
        Of the variance, summing to 1 for each parameter; the share of `CORRELATION` may be negative.
    covariance : (8, 8) array
        Combined, of all lines.
    dof : (8,) array
        Effective degrees of freedom (Welch-Satterthwaite over groups of correlated inputs).
    coverage_factors, expanded : (8,) array
        k for `dof` at `level`, and U = k·u.
    dominating : tuple of (str or None)
        The line with the largest share of each parameter; None for one without uncertainty.

    NaN stands in the column of a parameter that the data do not determine.
    """

    basis: UncertaintyBasis
    level: float
    lines: tuple[str, ...]
    standard: Array
    shares: Array
    covariance: Array
    dof: Array
    coverage_factors: Array
    expanded: Array
    dominating: tuple[str | None, ...]

    @property
    def standard_uncertainties(self) -> Array:
        """Combined standard uncertainty of each parameter, (8,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))


def make_budget(
    gain: Array,
    inputs: Inputs,
    *,
    scatter: Array | None = None,
    scatter_dof: float = np.inf,
    level: float = LEVEL,
) -> Budget:
    """Make the budget of an estimate.

    Parameters
    ----------
    gain : (8, 2n) array
        H of the estimator, δq = H·δ(residuals); NaN in the rows of undetermined parameters.
    inputs
        The uncertain inputs around the estimate.
    scatter : (2n, 2n) array, optional
        Covariance of the residuals as their scatter tells it, (rad/s)²: the basis is then
        ``scatter``, and what it shows already is left out of the lines.
    scatter_dof : float
        Its degrees of freedom.
    level : float
        Level of confidence.
    """
    groups = None
    if scatter is not None:
        inputs, groups = _with_scatter(inputs, scatter, scatter_dof)
    sensitivity = gain @ inputs.sensitivity
    found = propagate(sensitivity, inputs.covariance, inputs.dof, groups)
    variance = np.diagonal(found.covariance)
    lines = tuple(line for line in (SCATTER, *SOURCES) if line in inputs.source)
    variances = _by_line(lines, inputs, sensitivity)
    crossing = variance - variances.sum(axis=0)
    standard = np.sqrt(np.maximum(variances, 0.0))
    if _is_crossed(inputs):
        lines = (*lines, CORRELATION)
        variances = np.vstack((variances, crossing))
        standard = np.vstack((standard, np.full(len(variance), np.nan)))
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = variances / variance
    factors = found.coverage_factors(level)
    return Budget(
        basis="given" if scatter is None else "scatter",
        level=level,
        lines=lines,
        standard=standard,
        shares=shares,
        covariance=found.covariance,
        dof=found.dof,
        coverage_factors=factors,
        expanded=factors * found.standard_uncertainties,
        dominating=_dominating(lines, standard, found),
    )


def _with_scatter(inputs: Inputs, scatter: Array, dof: float) -> tuple[Inputs, NDArray[np.int64]]:
    """Inputs with the residuals' own noise in place of what it shows, and their groups."""
    kept = inputs.source != _SEEN_IN_SCATTER
    if not _shared_angles(inputs):
        kept &= inputs.source != "angles"
    rows, count = len(scatter), int(kept.sum())
    covariance = np.zeros((rows + count, rows + count))
    covariance[:rows, :rows] = scatter
    covariance[rows:, rows:] = inputs.covariance[np.ix_(kept, kept)]
    groups = np.concatenate((np.full(rows, -1), linked(covariance[rows:, rows:])))
    return replace(
        inputs,
        source=np.concatenate((np.full(rows, SCATTER), inputs.source[kept])),
        sensitivity=np.hstack((np.eye(rows), inputs.sensitivity[:, kept])),
        covariance=covariance,
        dof=np.concatenate((np.full(rows, dof), inputs.dof[kept])),
    ), groups


def _shared_angles(inputs: Inputs) -> bool:
    """Whether any certified angle belongs to more than one measured position."""
    angles = inputs.sensitivity[:, inputs.source == "angles"]
    moved = (angles.reshape(len(angles) // 2, 2, -1) != 0).any(axis=1)
    return bool((moved.sum(axis=0) > 1).any())


def _by_line(lines: tuple[str, ...], inputs: Inputs, sensitivity: Array) -> Array:
    """Variance that each line alone gives each parameter, (lines, 8)."""
    variances = np.zeros((len(lines), len(sensitivity)))
    for row, line in enumerate(lines):
        here = inputs.source == line
        part = sensitivity[:, here]
        variances[row] = np.sum((part @ inputs.covariance[np.ix_(here, here)]) * part, axis=1)
    return variances


def _is_crossed(inputs: Inputs) -> bool:
    """Whether inputs of different lines are correlated."""
    apart = inputs.source[:, None] != inputs.source
    return bool((inputs.covariance[apart] != 0).any())


def _dominating(lines: tuple[str, ...], standard: Array, found: Propagated) -> tuple[str | None, ...]:
    known = found.standard_uncertainties > 0
    if not lines:
        return (None,) * len(known)
    largest = np.argmax(np.nan_to_num(standard, nan=-1.0), axis=0)
    return tuple(lines[line] if there else None for line, there in zip(largest, known, strict=True))
