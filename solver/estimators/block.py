"""Least squares of a block of sessions, all weightings from sums that are formed once.

A whitened equation is the combination (g₀, g₁) of the x and y equations of one position, with g a row
of K⁻¹, over the u of that channel's current (`solver.estimators.rate_noise`); unweighted, g = (1, 0) and (0, 1).
Write v = (Jx, Jy, 1) and collect the parameters (kx, kxy, ω0x) and (kyx, ky, ω0y) that v multiplies as
the rows of P. Then the equation of either channel reads

    y·v + ωg·(g₀c + g₁d) + ωк·(g₁c − g₀d) = g₀rx + g₁ry,      y = g·P

with rx, ry the right sides, and the two channels share nothing but ωg and ωк. Eliminating y needs
sums over positions, weighted by 1/u², that do not depend on g: with z = (v, c, d, rx, ry) they are

    S = Σ v·vᵀ,   R = S⁻¹·Σ v·(c, d, rx, ry),   Q = Σ (c, d)·(c, d, rx, ry)ᵀ less what v explains

so that a round of weighting costs two unknowns: with F = (g₀R_c + g₁R_d, g₁R_c − g₀R_d), 3×2,

    M·(ωg, ωк) = h,   y = g₀R_rx + g₁R_ry − F·(ωg, ωк),   P = K·Y

where M and h are the same combinations of Q, summed over both channels. The covariance of (Y, ωg, ωк)
is that of a bordered system: S⁻¹ + F·M⁻¹·F'ᵀ, −F·M⁻¹, M⁻¹.

Rounding of such normal equations is about ε·κ² of the answer, κ² being at most 8·Σ Nᵢᵢ·Cᵢᵢ with N the
normal matrix and C its inverse. The weights need K to 5e-10 of itself. The answer is that of the last
weighting, corrected by the gradient of residuals that are formed from the equations themselves (as in
`solver.least_squares`): what remains is ε·κ·(κ·‖correction‖ + ‖answer‖), in columns of unit length,
and is compared with 1e-9 of the smallest uncertainty. Numbers are kept as (…, sessions), so that a
block's fit the cache.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.constants import EARTH_RATE
from solver.estimators.estimation import REWEIGHTING_ROUNDS
from solver.estimators.observability import visible_from
from solver.estimators.rate_noise import is_regular
from solver.least_squares import AGREEMENT, invert_symmetric
from solver.records import Array

BLOCK: Final = 1024
"""Sessions worked on at once."""
_EPS: Final = float(np.finfo(np.float64).eps)
_SAFETY: Final = 10.0
_WEIGHTS: Final = 5e-10
"""Relative error of K that the weights may have."""
_ORDER: Final = [0, 4, 1, 3, 2, 5, 6, 7]
"""Where kx, ky, kxy, kyx, ω0x, ω0y, ωg, ωк stand among kx, kxy, ω0x, kyx, ky, ω0y, ωg, ωк."""
_ROWS: Final = [0, 2, 4, 3, 1, 5]
"""Where P's entries stand among the parameters."""

JX, JY, ONE, C, D, RX, RY = range(7)
"""Rows of z."""

Sound = NDArray[np.bool_]


class Sums(NamedTuple):
    """Of one channel: diagonal of N for v, and (c, d) squared; S⁻¹ (3, 3, B), R (3, 4, B), Q (2, 4, B)."""

    lengths: Array
    squares: Array
    inverse: Array
    explained: Array
    left: Array


@dataclass(frozen=True, slots=True)
class Solved:
    """Values (8, B), covariance (8, 8, B), weighted sum of squares (B,), and which of them hold (B,)."""

    values: Array
    covariance: Array
    square: Array
    sound: Sound


def solve_block(z: Array, u: tuple[Array, Array] | None) -> Solved:
    """Solve a block, reweighting twice.

    Parameters
    ----------
    z : (7, n, B) array
        Jx, Jy, 1, c, d, rx and ry of every position: currents, elements, right sides.
    u : two of (n, B) or (n, 1) arrays, optional
        Standard uncertainties of Jx and Jy, A; without them every equation counts alike.
    """
    count = 2 * z.shape[1]
    alike = sums_of(z, None)
    plain = Weighted((alike, alike), np.eye(2)[:, :, None])
    values = plain.values()
    sound = _SAFETY * _EPS * plain.kappa() ** 2 < _WEIGHTS
    if u is None:
        return _unweighted(z, plain, values, sound)
    sound &= _visible(plain, np.sum(u[0] ** 2, axis=0), np.sum(u[1] ** 2, axis=0), count)
    sums = (sums_of(z, u[0]), sums_of(z, u[1]))
    for last in range(REWEIGHTING_ROUNDS):
        weighted = Weighted(sums, inverse_scales(values))
        sound &= is_regular(values)
        if last < REWEIGHTING_ROUNDS - 1:
            values = weighted.values()
    values, square, precise = corrected(z, weighted, values, u)
    covariance = weighted.covariance()
    sound &= precise & _clear(covariance)
    return Solved(values, covariance, square, sound)


def _unweighted(z: Array, plain: "Weighted", values: Array, sound: Sound) -> Solved:
    count = 2 * z.shape[1]
    values, square, _ = corrected(z, plain, values, None)
    variance = square / max(0, count - 8)
    values, square, precise = corrected(z, plain, values, None, np.sqrt(variance))
    noise = variance * count / np.einsum("kb,kb->b", values[:4], values[:4])
    covariance = variance * plain.covariance()
    sound &= precise & _visible(plain, noise, noise, count) & _clear(covariance)
    return Solved(values, covariance, square, sound)


def sums_of(z: Array, u: Array | None) -> Sums:
    """Sums over the positions for one channel of uncertainty u (n, B) or (n, 1)."""
    sums = np.einsum("ipb,jpb->ijb", z[:5] if u is None else z[:5] / (u * u), z)
    inverse = sums[:3, :3].copy()
    invert_symmetric(inverse)
    explained = np.einsum("ijb,jkb->ikb", inverse, sums[:3, 3:])
    left = sums[3:, 3:] - np.einsum("jib,jkb->ikb", sums[:3, 3:5], explained)
    return Sums(np.einsum("iib->ib", sums[:3, :3]), sums[3:, 3:5], inverse, explained, left)


def inverse_scales(values: Array) -> Array:
    """K⁻¹ of values (8, B), (2, 2, B)."""
    kx, ky, kxy, kyx = values[:4]
    return np.asarray(np.array([[ky, -kxy], [-kyx, kx]]) / (kx * ky - kxy * kyx))


def _pair(g: Array, first: Array, second: Array) -> Array:
    """Combinations that ωg and ωк multiply, of what belongs to c and to d, stacked."""
    return np.stack((g[0] * first + g[1] * second, g[1] * first - g[0] * second))


class Weighted:
    """A block with its weights: M⁻¹ (2, 2, B), F (2, 2, 3, B) as channel, ωg or ωк, v; g (2, 2, B or 1)."""

    def __init__(self, sums: tuple[Sums, Sums], g: Array) -> None:
        self.sums, self.g = sums, g
        halves = [_pair(row, one.left[0], one.left[1]) for row, one in zip(g, sums, strict=True)]
        matrix = sum(_pair(row, half[:, 0], half[:, 1]) for row, half in zip(g, halves, strict=True))
        (one_one, one_two), (_, two_two) = np.asarray(matrix)
        determinant = one_one * two_two - one_two * one_two
        self.inverse = np.array([[two_two, -one_two], [-one_two, one_one]]) / determinant
        self.right = np.asarray(
            sum(row[0] * half[:, 2] + row[1] * half[:, 3] for row, half in zip(g, halves, strict=True))
        )
        self.explained = np.stack(
            [_pair(row, one.explained[:, 0], one.explained[:, 1]) for row, one in zip(g, sums, strict=True)]
        )

    def values(self) -> Array:
        """Answer of the normal equations, (8, B)."""
        w = np.einsum("ijb,jb->ib", self.inverse, self.right)
        y = [
            row[0] * one.explained[:, 2] + row[1] * one.explained[:, 3] - np.einsum("wvb,wb->vb", f, w)
            for row, one, f in zip(self.g, self.sums, self.explained, strict=True)
        ]
        return self.parameters(np.stack(y), w)

    def parameters(self, y: Array, w: Array) -> Array:
        """(8, B) from Y (2, 3, B) and ωg, ωк (2, B): P = K·Y."""
        joined = np.einsum("rcb,cvb->rvb", self.scales(), y).reshape(6, -1)
        return np.concatenate((joined, w))[_ORDER]

    def turned(self, values: Array) -> Array:
        """Y = g·P of values (8, B), (2, 3, B)."""
        return np.asarray(np.einsum("crb,rvb->cvb", self.g, values[_ROWS].reshape(2, 3, -1)))

    def scales(self) -> Array:
        """K, the inverse of g, (2, 2, B or 1)."""
        (a, b), (c, d) = self.g
        return np.asarray(np.array([[d, -b], [-c, a]]) / (a * d - b * c))

    def variances(self) -> tuple[Array, Array]:
        """Diagonal of C for Y, (2, 3, B), and for ωg, ωк, (2, B)."""
        spread = np.einsum("cwvb,wxb->cxvb", self.explained, self.inverse)
        own = np.stack([np.einsum("iib->ib", one.inverse) for one in self.sums])
        return own + np.einsum("cxvb,cxvb->cvb", spread, self.explained), np.einsum("iib->ib", self.inverse)

    def lengths(self) -> tuple[Array, Array]:
        """Diagonal of N, squared lengths of the columns: for Y (2, 3, B) and for ωg, ωк (2, B)."""
        own = np.stack([one.lengths for one in self.sums])
        square = sum(
            np.einsum("iib->ib", _pair(row, *_pair(row, *one.squares).swapaxes(0, 1)))
            for row, one in zip(self.g, self.sums, strict=True)
        )
        return own, np.asarray(square)

    def kappa(self) -> Array:
        """Bound on the condition of the design with columns of unit length, (B,); infinite where singular."""
        (c_y, c_w), (n_y, n_w) = self.variances(), self.lengths()
        scaled = np.concatenate(((c_y * n_y).reshape(6, -1), c_w * n_w))
        # Scaled variances are at least 1; less is the rounding of a singular matrix.
        return np.where(scaled.min(axis=0) > 0.5, np.sqrt(8 * scaled.sum(axis=0)), np.inf)

    def covariance(self) -> Array:
        """C for the parameters in their order, (8, 8, B)."""
        sessions = self.inverse.shape[-1]
        scales = self.scales()
        whole = np.empty((8, 8, sessions))
        # F in P's rows: K·F, then S⁻¹ of both channels between K and Kᵀ, bordered.
        border = np.einsum("rcb,cwvb->rvwb", scales, self.explained).reshape(6, 2, -1)
        spread = np.einsum("iwb,wxb->ixb", border, self.inverse)
        whole[6:, 6:] = self.inverse
        whole[:6, 6:] = -spread
        whole[6:, :6] = -spread.swapaxes(0, 1)
        own = np.einsum("rcb,scb,cvwb->rvswb", scales, scales, np.stack([one.inverse for one in self.sums]))
        whole[:6, :6] = own.reshape(6, 6, -1) + np.einsum("ixb,jxb->ijb", spread, border)
        return whole[np.ix_(_ORDER, _ORDER)]


def corrected(
    z: Array, weighted: Weighted, values: Array, u: tuple[Array, Array] | None, unit: Array | float = 1.0
) -> tuple[Array, Array, Sound]:
    """Values corrected by the gradient of their residuals, weighted sum of squares, and whether 1e-9 u is kept.

    `unit` is the standard deviation of an equation's noise.
    """
    y = weighted.turned(values)
    square, right, steps, fall = np.zeros(()), np.zeros(()), [], np.zeros(())
    for channel, (row, one) in enumerate(zip(weighted.g, weighted.sums, strict=True)):
        w = _pair(row, values[6], values[7])
        factors = np.concatenate((-y[channel], -w, np.broadcast_to(row, w.shape)))
        rest = np.einsum("ipb,ib->pb", z, factors)
        scaled = rest if u is None else rest / (u[channel] * u[channel])
        square = square + np.einsum("pb,pb->b", rest, scaled)
        slope = np.einsum("ipb,pb->ib", z[:5], scaled)
        steps.append(np.einsum("ijb,jb->ib", one.inverse, slope[:3]))
        fall = fall + np.einsum("vb,vb->b", steps[-1], slope[:3])
        right = right + _pair(row, slope[3], slope[4])
        right -= np.einsum("wvb,vb->wb", weighted.explained[channel], slope[:3])
    w_step = np.einsum("ijb,jb->ib", weighted.inverse, right)
    y_step = np.stack(steps) - np.einsum("cwvb,wb->cvb", weighted.explained, w_step)
    fall += np.einsum("wb,wb->b", w_step, right)
    kappa, lengths = weighted.kappa(), weighted.lengths()
    error = kappa * _length(lengths, y_step, w_step) + _length(lengths, y, values[6:])
    answer = values + weighted.parameters(y_step, w_step)
    return answer, square - fall, _SAFETY * _EPS * kappa * error < AGREEMENT * unit


def _length(lengths: tuple[Array, Array], y: Array, w: Array) -> Array:
    """Length of (Y, ωg, ωк) with columns of unit length, (B,)."""
    n_y, n_w = lengths
    return np.asarray(np.sqrt(np.einsum("cvb,cvb->b", n_y * y, y) + np.einsum("wb,wb->b", n_w * w, w)))


def _visible(plain: Weighted, x: Array, y: Array, count: int) -> Sound:
    """Whether every direction of K certainly stands out from noise of sums of squares x, y: tr(D·C) is small."""
    kx, kxy, kyx, ky = plain.variances()[0][:, :2].reshape(4, -1)
    return np.asarray(visible_from(count) ** 2 * (x * (kx + kyx) + y * (ky + kxy)) < 1.0)


def _clear(covariance: Array) -> Sound:
    """Whether no drift is vaguer than the Earth rate, (B,)."""
    return np.asarray((np.einsum("iib->ib", covariance)[4:] < EARTH_RATE**2).all(axis=0))
