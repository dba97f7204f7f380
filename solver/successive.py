"""The paper's method: successive approximations over two rows of positions.

It uses θ = 0 (row 1) and θ = 90° (row 2), each with ψ₁…ψ₄ = 0, 90, 180, 270°. Write Δₖ for
"position ψ₁ minus ψ₃" (k = 1) and "ψ₂ minus ψ₄" (k = 2), the row as upper index, and

    rx = ωг·a + ωв·c,   ry = ωг·b + ωв·d

for the right sides of the observation equations (`solver.error_model`). Differences remove ω0:

    Kx·ΔJx  + Kxy·ΔJy = Δrx − ωg·Δc + ωк·Δd                                     (i)
    Kyx·ΔJx + Ky·ΔJy  = Δry − ωк·Δc − ωg·Δd                                     (ii)

Given ωg and ωк, row 1 with k = 1, 2 is two 2×2 systems: paper, eqs. (18), (19). Given K, take from
row 2 the two combinations that a rotation by 90° in ψ suggests, (ii)₂ − (i)₁ and (i)₂ + (ii)₁, with

    C1 = Δ₂²d − Δ₁²c,   C2 = Δ₂²c + Δ₁²d
    R1 = Δ₂²ry − Δ₁²rx + (Kx·Δ₁²Jx + Kxy·Δ₁²Jy) − (Kyx·Δ₂²Jx + Ky·Δ₂²Jy) = C1·ωg + C2·ωк
    R2 = Δ₂²rx + Δ₁²ry − (Kyx·Δ₁²Jx + Ky·Δ₁²Jy) − (Kx·Δ₂²Jx + Kxy·Δ₂²Jy) = C2·ωg − C1·ωк

    ωg = (C1·R1 + C2·R2)/(C1² + C2²),   ωк = (C2·R1 − C1·R2)/(C1² + C2²)        (22), (23)

and begin again; the start is ωg = ωк = 0. ω0x and ω0y are then the mean residuals (25).

Every step is linear in the observation equations with coefficients that do not depend on the
currents. The limit therefore solves the 8×8 system ``L·design·q = L·right_side`` with the constant
matrix L of `combination`; its differential gives the uncertainty: δq = −(L·design)⁻¹·L·(K·δJ).

Misprints of the paper, corrected here:

- (18), third and fourth equation: from (15) the quadrature term on the right is −ωк·Δc, not +ωк·Δc.
- (24): the corrections Δω₃ and Δω₄ are exchanged between their definitions and their use, and carry
  the sign of the line above.
- (23): the term 2·ωв·C1·C2 in ωк cancels when derived from (22).
- special cases of (14) at ψ = 0: the sign inside d₁₁ contradicts (14).
- (25) averages over sixteen positions while the text defines eight for the method: here it is the
  mean over every measured position.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.error_model import Equations
from solver.errors import InputError, Message, NotConverged, SolverError
from solver.records import Array, Observations
from solver.units import deg_from_rad, rad_per_s_from_deg_per_h

TOLERANCE: Final = 1e-12
"""Relative change of an unknown in one round that counts as none."""
MOST_ROUNDS: Final = 100
_SAME_ANGLE: Final = 1e-9
_SMALLEST_RATE: Final = float(rad_per_s_from_deg_per_h(1e-3))
_SMALLEST_SCALE: Final = 1e-3

Round = tuple[float, ...]
"""Kx, Ky, Kxy, Kyx, ωg, ωк."""


def position_weights(observations: Observations) -> tuple[Array, Array]:
    """Weights that average the repeats of a position.

    Returns
    -------
    method : (8, n) array
        Row for each position of the method: θ = 0 with ψ = 0, 90, 180, 270°, then θ = 90°.
    mean : (n,) array
        Weights of the mean over all distinct measured positions.

    Raises
    ------
    InputError
        When a position of the method was not measured; the message names it.
    """
    theta, psi = (_quarter_turns(angle) for angle in (observations.theta, observations.psi))
    same = _close(theta[:, None], theta) & _close(psi[:, None], psi)
    repeats = same.sum(axis=1)
    mean = 1.0 / repeats
    rows, missing = [], []
    for want_theta in (0, 1):
        for want_psi in (0, 1, 2, 3):
            here = _close(theta, want_theta) & _close(psi, want_psi)
            if not here.any():
                missing.append(f"({90 * want_theta}°, {90 * want_psi}°)")
            rows.append(here / max(1, int(here.sum())))
    if missing:
        raise InputError(
            Message(
                "positions-missing",
                "The paper's method needs θ = 0 and 90° with ψ = 0, 90, 180 and 270°; not measured: "
                "%(positions)s. Measure them, or use least squares, which takes any positions.",
                {"positions": ", ".join(missing)},
            )
        )
    return np.array(rows), mean / mean.sum()


def _quarter_turns(angle: Array) -> Array:
    return deg_from_rad(angle) / 90.0


def _close(left: Array, right: Array | int) -> NDArray[np.bool_]:
    """Equal up to rounding, whole turns apart or not; both in quarter turns."""
    apart = np.abs(left - right) % 4.0
    return np.minimum(apart, 4.0 - apart) < _SAME_ANGLE


def combination(method: Array, mean: Array) -> Array:
    """L, (8, 2n): the constant combinations of the observation equations that the limit solves.

    Rows: (i) and (ii) of row 1 for k = 1, 2; the two combinations of row 2; the means of x and y.
    """
    n = len(mean)
    x, y = np.zeros((n, 2 * n)), np.zeros((n, 2 * n))
    x[np.arange(n), 2 * np.arange(n)] = 1.0
    y[np.arange(n), 2 * np.arange(n) + 1] = 1.0
    first, second = (rows[:2] - rows[2:] for rows in (method[:4], method[4:]))
    return np.concatenate(
        (
            first @ x,
            first @ y,
            [second[1] @ y - second[0] @ x, second[1] @ x + second[0] @ y],
            [mean @ x, mean @ y],
        )
    )


def successive_approximations(
    equations: Equations,
    method: Array,
    mean: Array,
    *,
    tolerance: float = TOLERANCE,
    rounds: int = MOST_ROUNDS,
) -> tuple[Array, Array]:
    """Run the iteration.

    Parameters
    ----------
    equations
        Of the whole session.
    method, mean
        From `position_weights`.

    Returns
    -------
    values : (8,) array
    history : (rounds, 8) array
        Approximations λ = 1, 2, …; NaN for ω0 before the last one.

    Raises
    ------
    NotConverged
        With the history so far.
    SolverError
        When the currents of row 1 do not change with ψ, so that K cannot be found.
    """
    columns = np.column_stack((equations.design[::2, [0, 2, 6]], equations.design[1::2, 6]))
    columns = np.column_stack((columns, equations.right_side[::2], equations.right_side[1::2]))
    at = method @ columns  # Jx, Jy, c, d, rx, ry at the eight positions
    row_1, row_2 = at[:2] - at[2:4], at[4:6] - at[6:8]
    history: list[Round] = [(float("nan"),) * 4 + (0.0, 0.0)]
    for _ in range(rounds):
        previous = history[-1]
        scales = _scale_factors(row_1, previous[4], previous[5])
        latest = (*scales, *_g_sensitive(row_2, scales))
        history.append(latest)
        if _unchanged(previous, latest, tolerance):
            break
        if not all(np.isfinite(latest)):
            raise _diverged(history)
    else:
        raise _diverged(history)
    table = _table(history)
    rest = equations.residuals(np.where(np.isnan(table[-1]), 0.0, table[-1]))
    table[-1, 4:6] = mean @ rest.reshape(-1, 2)
    return table[-1].copy(), table


def _scale_factors(row_1: Array, wg: float, wk: float) -> tuple[float, float, float, float]:
    """(i) and (ii) of row 1 for K: paper, eqs. (18), (19)."""
    (jx1, jy1, c1, d1, rx1, ry1), (jx2, jy2, c2, d2, rx2, ry2) = row_1.tolist()
    determinant = jx1 * jy2 - jx2 * jy1
    if determinant == 0:
        raise SolverError(
            Message(
                "currents-constant",
                "The currents at θ = 0 do not change with ψ as a gyro's do, so the scale factors cannot be "
                "found. Check the recorded currents; near a pole the method does not apply.",
            )
        )
    x1, x2 = rx1 - wg * c1 + wk * d1, rx2 - wg * c2 + wk * d2
    y1, y2 = ry1 - wk * c1 - wg * d1, ry2 - wk * c2 - wg * d2
    kx, kxy = (x1 * jy2 - x2 * jy1) / determinant, (jx1 * x2 - jx2 * x1) / determinant
    kyx, ky = (y1 * jy2 - y2 * jy1) / determinant, (jx1 * y2 - jx2 * y1) / determinant
    return kx, ky, kxy, kyx


def _g_sensitive(row_2: Array, scales: tuple[float, float, float, float]) -> tuple[float, float]:
    """Row 2 for ωg and ωк: paper, eqs. (20)-(23)."""
    (jx1, jy1, c1, d1, rx1, ry1), (jx2, jy2, c2, d2, rx2, ry2) = row_2.tolist()
    kx, ky, kxy, kyx = scales
    cc1, cc2 = d2 - c1, c2 + d1
    r1 = ry2 - rx1 + (kx * jx1 + kxy * jy1) - (kyx * jx2 + ky * jy2)
    r2 = rx2 + ry1 - (kyx * jx1 + ky * jy1) - (kx * jx2 + kxy * jy2)
    square = cc1 * cc1 + cc2 * cc2
    return (cc1 * r1 + cc2 * r2) / square, (cc2 * r1 - cc1 * r2) / square


def _unchanged(previous: Round, latest: Round, tolerance: float) -> bool:
    least = (_SMALLEST_SCALE * abs(latest[0]),) * 4 + (_SMALLEST_RATE,) * 2
    return all(
        abs(new - old) <= tolerance * max(abs(new), floor)
        for old, new, floor in zip(previous, latest, least, strict=True)
    )


def _table(history: list[Round]) -> Array:
    """Approximations λ = 1, 2, … as (rounds, 8) in the order of `PARAMETERS`; the start is left out."""
    rounds = np.array(history[1:]).reshape(-1, 6)
    table = np.full((len(rounds), 8), np.nan)
    table[:, [0, 1, 2, 3, 6, 7]] = rounds
    return table


def _diverged(history: list[Round]) -> NotConverged:
    return NotConverged(
        Message(
            "not-converged",
            "The successive approximations did not converge in %(rounds)d rounds. Check the currents and the "
            "misalignments for a blunder; least squares needs no approximations.",
            {"rounds": len(history) - 1},
        ),
        _table(history),
    )
