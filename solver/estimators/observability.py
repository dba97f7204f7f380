"""Which combinations of parameters the measured positions do not determine.

The measured currents stand in the design matrix, so their noise hides a loss of rank. At a pole,
for instance, K = 0, ω0 = 0, ωg = ωв solves every equation exactly, whatever was measured: only the
noise makes the columns of K independent of the others. Rank is therefore judged against the
singular values that the noise alone produces.

Write the design as [X Z] with X the four columns of currents and Z the four exact columns of
angles (ω0, ωg, ωк). Directions of Z that vanish to rounding are invisible. Project the rest of Z
out of X. Noise of the currents adds a random N to X with E[NᵀN] = D, known from u(J); with
D = F·Fᵀ and unit w, the direction v = F⁻ᵀ·w has E‖N·v‖² = 1, so the singular values s of X·F⁻ᵀ
count in units of noise: a direction that does not show in the true currents has s ≲ 1 (s² are the
generalised eigenvalues of (XᵀX, D), as in tests of identification with errors in variables).

Noise in the design also shrinks least squares along v, by about (m − p)/(m·s²) of the value over m
equations and p parameters, with a standard uncertainty of about 1/(s·√m) of it. A direction counts
as visible only when the shrinkage is neither above 2 % nor above two thirds of that uncertainty:
s ≥ max(7, 1.5·(m − p)/√m). Ordinary sessions have s of several hundred.

Without u(J) the noise of the currents follows from the scatter of the residuals, which is K times
it. When nothing is visible, m·s² is then distributed as F with 1 and m − p degrees of freedom, far
below its threshold 49·m. Where the right side vanishes with Z (exactly at a pole) so does every
residual, and the smallest singular value itself is the noise. Where no residual is left over to
show any scatter, the noise is taken as 1e-3 of the currents.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.error_model import Equations
from solver.errors import Message
from solver.records import PARAMETERS, Array
from solver.units import (
    deg_per_h_from_rad_per_s,
    deg_per_h_per_ma_from_scale,
    rad_per_s_from_deg_per_h,
)

CLEAR_OF_NOISE: Final = 7.0
"""Singular value, in units of what noise alone gives, from which on a direction is visible."""
_SHRUNK_BY_U: Final = 1.5
_UNTOLD_NOISE: Final = 1e-3
_ABSOLUTE_ROUNDS: Final = 30
_BLUNDERS: Final = 0.5
_MEDIAN_OF_NORMAL: Final = 0.6745
_ROUNDING: Final = 1e-10
_NO_PART: Final = 1e-8
_MENTIONED: Final = 1e-3
_MOST_MENTIONED: Final = 3
UNITS: Final = dict(zip(PARAMETERS, ("°/h/mA",) * 4 + ("°/h",) * 2 + ("°/h/g",) * 2, strict=True))


@dataclass(frozen=True, slots=True)
class Invisible:
    """What the data do not determine.

    Attributes
    ----------
    directions : (k, 8) array
        Changes of the parameters, SI, that change no residual by more than its noise; k may be 0.
        Each is scaled so that its largest part makes 1 °/h.
    shares : (k, 8) array
        The same, each part as its effect on the rates relative to the largest.
    parameters : (8,) bool array
        Parameters with a part in one of them.
    noise : (n, 2) array
        Noise of Jx and Jy by which this was judged, A; zero where only rounding is known.
    """

    directions: Array
    shares: Array
    parameters: NDArray[np.bool_]
    noise: Array


def natural_scale(design: Array) -> Array:
    """Lengths by which columns are compared, (8,): of the currents, and of a bias for every ω.

    A column of g-sensitive drift is not stretched to that length: where the specific force barely
    changes between the positions, that is a weakness of the design and shall show.
    """
    lengths: Array = np.sqrt(np.einsum("ij,ij->j", design, design))
    lengths[6:] = lengths[4:6]
    lengths[lengths == 0] = 1.0
    return lengths


def find_invisible(equations: Equations, rows: Array | None = None) -> Invisible:
    """Find the directions of the parameters that do not show in the measured currents.

    Parameters
    ----------
    equations
        Observation equations with the noise of the currents.
    rows : (r, 2n) array, optional
        Combinations of the equations that the method uses; all equations when not given.
    """
    scale = natural_scale(equations.design)
    noise, robust = equations.u_currents, None
    if noise is None:
        noise, robust = _scatter_of_currents(equations, scale)
    basis = None if rows is None else np.linalg.qr(rows.T)[0]
    scaled, target = equations.design / scale, equations.right_side
    if basis is not None:
        scaled, target = basis.T @ scaled, basis.T @ target
    hidden_angles, pseudo_inverse, currents, _ = _project(scaled, target)
    hidden = np.zeros((len(hidden_angles), 8))
    hidden[:, 4:] = hidden_angles
    in_currents = _hidden_currents(currents, noise, basis, scale)
    if robust is not None and len(in_currents):
        without_blunders = robust()
        if without_blunders[0, 0] < _BLUNDERS * noise[0, 0]:
            noise = without_blunders
            in_currents = _hidden_currents(currents, noise, basis, scale)
    completed = np.hstack((in_currents, -in_currents @ (pseudo_inverse @ scaled[:, :4]).T))
    shares = _sparse(np.concatenate((completed, hidden)))
    part = np.sqrt(np.sum(shares**2, axis=0)) > _NO_PART
    one = float(rad_per_s_from_deg_per_h(1.0)) * np.sqrt(len(equations.design) / 2)
    return Invisible(shares * (one / scale), shares, part, noise)


def _project(scaled: Array, target: Array) -> tuple[Array, Array, Array, Array]:
    """Split off the columns of angles.

    Returns directions of ω (k, 4) that vanish, the pseudo-inverse of the angles' columns (4, m),
    and the columns of currents (m, 4) and the right side (m,) with the angles' part removed.
    """
    q, r = np.linalg.qr(scaled[:, 4:])
    u, s, vh = _small_svd(r)
    seen = s > _ROUNDING
    u = q @ u[: len(r), seen]
    pseudo_inverse = (vh[seen].T / s[seen]) @ u.T
    currents = scaled[:, :4] - u @ (u.T @ scaled[:, :4])
    return vh[~seen], pseudo_inverse, currents, target - u @ (u.T @ target)


def _triangle(columns: Array) -> Array:
    return np.asarray(np.linalg.qr(columns, mode="r"))


def _small_svd(triangle: Array) -> tuple[Array, Array, Array]:
    """U, s, Vᵀ of a (k, 4) array with k ≤ 4, padded by rows of zeros to (4, 4)."""
    padded = np.zeros((4, 4))
    padded[: len(triangle)] = triangle
    u, s, vh = np.linalg.svd(padded)
    return u, s, vh


def _hidden_currents(currents: Array, noise: Array, basis: Array | None, scale: Array) -> Array:
    """Directions of the scaled K, (k, 4), whose currents do not stand out from noise or rounding."""
    _, s, w = _small_svd(_triangle(currents))
    rounded = w[s <= _ROUNDING]
    if not noise.any():
        return rounded
    unit = np.asarray(np.linalg.inv(np.linalg.cholesky(_noise_gram(noise, basis))) * scale[:4], np.float64)
    _, in_noise, w = _small_svd(_triangle(currents @ unit.T))
    count = len(currents)
    buried = w[in_noise < visible_from(count)]
    return buried @ unit if len(buried) >= len(rounded) else rounded


def visible_from(count: int) -> float:
    """Singular value, in units of what noise alone gives, from which on a direction shows in `count` equations."""
    return float(max(CLEAR_OF_NOISE, _SHRUNK_BY_U * (count - 8) / np.sqrt(count)))


def _noise_gram(noise: Array, basis: Array | None) -> Array:
    """D, (4, 4): expected NᵀN of the columns kx, ky, kxy, kyx, for the noise (n, 2) of Jx and Jy."""
    square = noise**2
    if basis is None:
        x, y = square.sum(axis=0)
        return np.diag([x, y, y, x])
    pairs = basis.reshape(len(noise), 2, -1)
    alike = pairs @ pairs.transpose(0, 2, 1)  # of the x and the y equation of one position
    jx, jy = np.einsum("pij,pc->cij", alike, square)
    gram = np.diag([jx[0, 0], jy[1, 1], jy[0, 0], jx[1, 1]])
    gram[0, 3] = gram[3, 0] = jx[0, 1]
    gram[1, 2] = gram[2, 1] = jy[0, 1]
    return gram


def _scatter_of_currents(equations: Equations, scale: Array) -> tuple[Array, Callable[[], Array] | None]:
    """Noise of the currents, A, (n, 2), that explains the residuals; zero where none can be seen.

    The second is a slower estimate which a few blunders do not spoil, where there is one: what a
    blunder hides is not for want of positions.
    """
    count = len(equations.design)
    _, _, currents, target = _project(equations.design / scale, equations.right_side)

    def alike(noise: float) -> Array:
        return np.full((count // 2, 2), noise)

    if np.linalg.norm(target) <= _ROUNDING * np.linalg.norm(equations.right_side):
        ampere = currents * scale[:4] / np.sqrt(count / 2)
        return alike(float(np.linalg.svd(ampere, compute_uv=False)[-1])), None
    freedom = count - len(PARAMETERS)
    if freedom <= 0:
        return alike(_UNTOLD_NOISE * float(np.linalg.norm(scale[:2])) / np.sqrt(count)), None
    scaled_k = np.linalg.lstsq(currents, target)[0]
    rest = target - currents @ scaled_k
    rate = float(np.sqrt((rest @ rest) / freedom))
    return alike(_as_current(rate, scaled_k / scale[:4])), lambda: alike(_robust_scatter(equations, scale))


def _as_current(rate: float, k: Array) -> float:
    return float(rate * np.sqrt(2.0 / (k @ k)))


def _robust_scatter(equations: Equations, scale: Array) -> float:
    """Noise of the currents from the least sum of absolute residuals (iterated weights) and their median."""
    scaled, right_side = equations.design / scale, equations.right_side
    weights = np.ones(len(right_side))
    for _ in range(_ABSOLUTE_ROUNDS):
        root = np.sqrt(weights)
        values = np.linalg.lstsq(scaled * root[:, None], right_side * root)[0]
        size = np.abs(right_side - scaled @ values)
        weights = 1.0 / np.maximum(size, 1e-3 * np.median(size) + np.finfo(float).tiny)
        weights /= weights.max()
    left_over = np.sort(size)[len(PARAMETERS) :]  # eight parameters bring eight residuals to zero
    return _as_current(float(np.median(left_over)) / _MEDIAN_OF_NORMAL, values[:4] / scale[:4])


def _sparse(directions: Array) -> Array:
    """Span the same with as many zeros as possible (Gauss-Jordan, full pivoting); largest part 1."""
    rows = directions.copy()
    for index in range(len(rows)):
        rest = np.abs(rows[index:])
        row, column = divmod(int(np.argmax(rest)), rest.shape[1])
        rows[[index, index + row]] = rows[[index + row, index]]
        rows[index] /= rows[index, column]
        others = np.arange(len(rows)) != index
        rows[others] -= rows[others, column, None] * rows[index]
    return rows / np.abs(rows).max(axis=1, keepdims=True) if len(rows) else rows


def unobservable(invisible: Invisible) -> Message:
    """Name the parameters and the combinations that stay invisible, in laboratory units."""
    chosen = list(zip(invisible.directions, invisible.shares, strict=True))[:_MOST_MENTIONED]
    combinations = [f"({_words(direction, share)})" for direction, share in chosen]
    more = len(invisible.directions) - len(combinations)
    values = {
        "parameters": names(invisible.parameters),
        "combinations": "; ".join(combinations),
    }
    if more:
        return Message(
            "unobservable",
            "Not determined by these positions: %(parameters)s. No residual would show a joint change by "
            "%(combinations)s, or by any multiple of it, above its noise, and so for %(more)d more "
            "combinations. Measure positions with other θ and ψ.",
            {**values, "more": more},
        )
    return Message(
        "unobservable",
        "Not determined by these positions: %(parameters)s. No residual would show a joint change by "
        "%(combinations)s, or by any multiple of it, above its noise. Measure positions with other θ and ψ; "
        "at a pole, where the Earth rate has no horizontal part, none would help.",
        values,
    )


def names(parameters: NDArray[np.bool_]) -> str:
    """Names of the marked parameters: ``kx, ky``."""
    return ", ".join(name for name, marked in zip(PARAMETERS, parameters, strict=True) if marked)


def _words(direction: Array, share: Array) -> str:
    parts = zip(PARAMETERS, lab_units(direction), np.abs(share), strict=True)
    return ", ".join(f"{name} {value:+.4g} {UNITS[name]}" for name, value, size in parts if size > _MENTIONED)


def lab_units(parameters: Array) -> Array:
    """Parameters from SI to °/h/mA, °/h and °/h/g, (8,)."""
    return np.concatenate(
        (deg_per_h_per_ma_from_scale(parameters[:4]), deg_per_h_from_rad_per_s(parameters[4:]))
    )
