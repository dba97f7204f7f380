"""Huber's estimator of a linear model, which a few blunders do not spoil; it knows nothing of gyros.

It minimises Σ ρ(rᵢ/s) with ρ quadratic up to k and linear beyond, so a blunder pulls with the force k
whatever its size. With k = 1.345 its efficiency for normal noise is 95 % of that of least squares
(P. J. Huber, Robust Statistics, 1981, ch. 7; Huber & Ronchetti, 2nd ed., 2009, ch. 7). The minimum
is found by least squares with the weights wᵢ = min(1, k·s/|rᵢ|), again and again: each round lowers
the sum, which is convex, so that the start does not matter. Where many equations lie beyond k the rounds
become slow; from then on Newton's steps with an exact search along them, which end after few,
since the sum is piecewise quadratic (K. Madsen, H. B. Nielsen, BIT 30, 1990, 682-699).

Where the scale s of the noise is not known, it is the median of |rᵢ|/√(1 − hᵢ) over 0.6745, consistent
for normal noise, with hᵢ the leverages: residuals are smaller than the noise by √(1 − hᵢ).

Uncertainty
    The asymptotic covariance with the factors for finite n is, for ψ = ρ', m = mean of ψ'(rᵢ/s)
    (Huber & Ronchetti, eq. (7.81) ff., the first of three forms)::

        K²·s²·[Σ ψ²/(n − p)]/m²·(XᵀX)⁻¹,   K = 1 + (p/n)·(1 − m)/m

    Its (XᵀX)⁻¹ takes every equation for equally informative, blundered or not. Here, with the
    weights' own gain H = (XᵀwX)⁻¹·Xᵀw, it is f·s²·H·Hᵀ, where

        f = K²·[Σ ψ²/(n − p)]/m²·(mean w)²/mean(w²)

    makes both the same where weights and equations have nothing to do with one another, while what
    a blundered equation would have told is counted as lost.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import special

from solver.errors import Message, NotConverged
from solver.records import Array

TUNING: Final = 1.345
"""k: efficiency of 95 % for normal noise."""
MOST_ROUNDS: Final = 300
TOLERANCE: Final = 1e-9
"""Change of the fitted values in one round, in units of the noise, that counts as none."""
_NORMAL_QUARTILE: Final = float(special.ndtri(0.75))
_WEIGHTED_ROUNDS: Final = 60
"""From here on the scale stays as it is, which makes the sum convex, and Newton's steps are taken."""
_RIDGE: Final = 1e-12
_ROUNDING: Final = 1e-12
_LAST_BITS: Final = 1e-3


@dataclass(frozen=True, slots=True)
class HuberFit:
    """One fitted model.

    Attributes
    ----------
    values : (p,) array
    weights : (m,) array
        Of the equations, 0 to 1.
    scale : float
        Standard deviation of the noise: as given, or from the median.
    variance_factor : float
        f: the covariance of the values is f·s²·H·Hᵀ; NaN without a degree of freedom.
    rounds : int
    """

    values: Array
    weights: Array
    scale: float
    variance_factor: float
    rounds: int


def huber(
    design: Array, right_side: Array, *, scale: float | None = None, leverages: Array | None = None
) -> HuberFit:
    """Fit ``design @ q ≈ right_side``.

    Parameters
    ----------
    design : (m, p) array
        Of full column rank.
    right_side : (m,) array
    scale : float, optional
        Standard deviation of the noise, where it is known.
    leverages : (m,) array, optional
        hᵢ by which residuals are made up for in the scale; those of `design` when not given.

    Raises
    ------
    NotConverged
        When the rounds do not end; with the values of each, (rounds, p).
    """
    floor = _ROUNDING * float(np.linalg.norm(right_side))
    basis = np.linalg.qr(design)[0]
    if leverages is None:
        leverages = np.einsum("ij,ij->i", basis, basis)
    lengths = np.linalg.norm(design, axis=0)
    scaled = design / lengths
    values = np.linalg.lstsq(scaled, right_side)[0]
    history = [values / lengths]
    spread = scale or 0.0
    for rounds in range(1, MOST_ROUNDS + 1):
        residuals = right_side - scaled @ values
        if scale is None and rounds <= _WEIGHTED_ROUNDS:
            spread = max(floor, median_scale(residuals, leverages))
        if rounds <= _WEIGHTED_ROUNDS:
            root = np.sqrt(weights_of(residuals / spread))
            step = np.linalg.lstsq(scaled * root[:, None], residuals * root)[0]
        else:
            step = spread * _newton(scaled, residuals / spread)
        values = values + step
        history.append(values / lengths)
        if float(np.linalg.norm(scaled @ step)) <= TOLERANCE * spread + _LAST_BITS * floor:
            standardised = (right_side - scaled @ values) / spread
            weights = weights_of(standardised)
            factor = variance_factor(standardised, weights, design.shape[1])
            return HuberFit(values / lengths, weights, spread, factor, rounds)
    raise NotConverged(
        Message(
            "not-converged",
            "The robust estimate did not settle in %(rounds)d rounds. So many equations contradict one another "
            "that no few blunders can be told from the rest: check positions, units and channels.",
            {"rounds": MOST_ROUNDS},
        ),
        np.array(history),
    )


def _newton(design: Array, residuals: Array) -> Array:
    """Newton's step for residuals in units of the noise, as far along it as the sum falls."""
    inside = design[np.abs(residuals) <= TUNING]
    curvature = inside.T @ inside + _RIDGE * np.eye(design.shape[1])
    step = np.linalg.solve(curvature, design.T @ np.clip(residuals, -TUNING, TUNING))
    change = design @ step

    def slope(length: float) -> float:
        return -float(change @ np.clip(residuals - length * change, -TUNING, TUNING))

    moving = change != 0.0
    corners = (residuals[moving, None] + [-TUNING, TUNING]) / change[moving, None]
    corners = np.concatenate(([0.0], np.sort(corners[corners > 0.0])))
    slopes = np.array([slope(corner) for corner in corners])  # rising, and linear between the corners
    after = int(np.argmax(slopes >= 0.0))
    if after == 0:
        return np.zeros_like(step)
    before, low, high = corners[after - 1], slopes[after - 1], slopes[after]
    return np.asarray(step * (before - low * (corners[after] - before) / (high - low)))


def weights_of(standardised: Array) -> Array:
    """Weights min(1, k/|r|)."""
    return np.asarray(TUNING / np.maximum(np.abs(standardised), TUNING))


def median_scale(residuals: Array, leverages: Array) -> float:
    """Standard deviation of normal noise from the median of the residuals' sizes; one blunder moves it little."""
    seen = leverages < 1.0 - 1e-9
    if not seen.any():
        return 0.0
    size = np.abs(residuals[seen]) / np.sqrt(1.0 - leverages[seen])
    return float(np.median(size)) / _NORMAL_QUARTILE


def variance_factor(standardised: Array, weights: Array, parameters: int) -> float:
    """The factor f for these residuals, in units of the noise."""
    return asymptotic_factor(standardised, parameters) * _like_equal(weights)


def asymptotic_factor(standardised: Array, parameters: int) -> float:
    """K²·[Σ ψ²/(n − p)]/m²: what multiplies s²·(XᵀX)⁻¹; NaN without a degree of freedom."""
    count = len(standardised)
    inside = float(np.mean(np.abs(standardised) <= TUNING))
    if count <= parameters or inside == 0.0:
        return float("nan")
    square = float(np.sum(np.clip(standardised, -TUNING, TUNING) ** 2)) / (count - parameters)
    correction = 1.0 + parameters / count * (1.0 - inside) / inside
    return correction**2 * square / inside**2


def normal_factor(weights: Array) -> float:
    """The factor f for normal noise of known scale, E ψ²/(E ψ')², about 1/0.95, for these weights."""
    inside = 2.0 * float(special.ndtr(TUNING)) - 1.0
    density = np.exp(-(TUNING**2) / 2.0) / np.sqrt(2.0 * np.pi)
    square = inside - 2.0 * TUNING * density + TUNING**2 * (1.0 - inside)
    return float(square / inside**2) * _like_equal(weights)


def _like_equal(weights: Array) -> float:
    """Mean of H·Hᵀ for equal weights over that for these."""
    return float(np.mean(weights) ** 2 / np.mean(weights**2))
