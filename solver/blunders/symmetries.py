"""Mistakes that the fit cannot see: they turn one possible gyro into another.

With the observation equations (paper, eqs. (10)-(15)), G = [[ωg, −ωк], [ωк, ωg]], n = (c, d) and
m = (a, b),

    K·J + ω0 + G·n = ωг·m + ωв·n,

a mistake is *invisible* when the equations written with the mistaken data are solved, to the last
digit, by other parameters. All such mistakes of the session as a whole:

channels-swapped
    J = P·J' with P the exchange: K' = K·P, so kx ↔ kxy and ky ↔ kyx.
channel-sign
    J = S·J' with S = diag(±1, ±1): K' = K·S. Of x: kx and kyx negated; of y: ky and kxy.
current-unit
    J = f·J': K' = f·K.
latitude-sign
    ωв = −ωв': K·J + ω0 + G·n = ωг·m − ωв'·n, so ωg' = ωg + 2·ωв', else the same.
latitude-complement
    ωг = t·ωг' and ωв = ωв'/t with t = tan φ', φ' the latitude as given: dividing by t,
    K' = K/t, ω0' = ω0/t, ωк' = ωк/t and ωg' − ωв' = (ωg − ωв)/t. At 45° nothing changes.

These hold for any angles, any misalignment and any positions: no measurement of the same kind
reveals them. Two more hold as far as the platform is not misaligned. Let Λ(θ, ψ) be the mistaken
orientation:

psi-reversed
    R₃(−ψ)·R₁(θ) = Q·R₃(ψ)·R₁(θ)·Q with Q = diag(−1, 1, 1), and north and up have no east part: a and
    c change sign, b and d do not. So kx, kxy, ω0x and ωк are negated.
theta-reversed
    R₃(ψ)·R₁(−θ) = Q·R₃(ψ)·R₁(θ)·Q with Q = diag(1, 1, −1): c and d change sign, a and b do not. So
    ωg' = 2·ωв − ωg and ωк' = −ωк.

A certified misalignment E stands to the left of A and does not follow these reflections; what it
leaves, of the order of its angle times the Earth rate, shows in χ². A further identity of that
kind, R₃(ψ+180°)·R₁(θ+180°) = diag(−1, 1, −1)·… , gives a, b, c, d themselves: (θ, ψ) and
(θ+180°, ψ+180°) are *twins*. Exchanging twins does nothing, and θ wrong by 180° is ψ wrong by 180°.

Equivalent under a prior: channel-sign of x and psi-reversed agree in kx and differ in kyx, kxy, ω0x
and ωк only by sign, so a prior around zero for these cannot tell them apart; theta-reversed and
latitude-sign give ωg of opposite sign, ωк of opposite sign: the same for a prior around zero.

Each map here takes the parameters fitted with the data as given to those fitted with the data put
right: ``q_right = matrix @ q_given + shift``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from solver.error_model import earth_rate
from solver.records import PARAMETERS, Array

UNIT_FACTORS: Final = (1e3, 1e-3)
"""By which currents must be multiplied that were A, or µA, and were read as mA."""
_NO_CHANGE: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Symmetry:
    """A mistake that no fit can see, as a map of the parameters, SI."""

    code: str
    matrix: Array
    shift: Array
    details: Mapping[str, Any] = field(default_factory=dict)

    def apply(self, values: Array, covariance: Array) -> tuple[Array, Array]:
        """Parameters and covariance with the data put right."""
        return self.matrix @ values + self.shift, self.matrix @ covariance @ self.matrix.T


def exact_symmetries(latitude: float) -> list[Symmetry]:
    """Every mistake that is invisible whatever the angles; those without effect here are left out."""
    none = np.zeros(len(PARAMETERS))
    swap = np.eye(8)[[2, 3, 0, 1, 4, 5, 6, 7]]
    found = [
        Symmetry("channels-swapped", swap, none),
        Symmetry("channel-sign", _scaled(kx=-1.0, kyx=-1.0), none, {"channel": "x"}),
        Symmetry("channel-sign", _scaled(ky=-1.0, kxy=-1.0), none, {"channel": "y"}),
        Symmetry("channel-sign", _scaled(kx=-1.0, ky=-1.0, kxy=-1.0, kyx=-1.0), none, {"channel": "xy"}),
    ]
    north, up = earth_rate(latitude)
    if abs(up) > _NO_CHANGE * north:
        found.append(Symmetry("latitude-sign", np.eye(8), _only(wg=-2.0 * up)))
    found.extend(_complement(north, up))
    found.extend(
        Symmetry("current-unit", _scaled(kx=1 / f, ky=1 / f, kxy=1 / f, kyx=1 / f), none, {"factor": f})
        for f in UNIT_FACTORS
    )
    return found


def _complement(north: float, up: float) -> list[Symmetry]:
    """Latitude ±(90° − |φ|): K, ω0, ωк and ωg − ωв times |ωв|/ωг; none at the equator, a pole or 45°."""
    size = abs(up)
    if min(size, north) < _NO_CHANGE * max(size, north) or abs(size - north) < _NO_CHANGE * north:
        return []
    t = size / north
    # ωв put right is ±ωг as given; ωg_right = ωв_right + t·(ωg − ωв).
    shift = np.sign(up) * north - t * up
    return [Symmetry("latitude-complement", t * np.eye(8), _only(wg=shift))]


def _scaled(**factors: float) -> Array:
    return np.diag([factors.get(name, 1.0) for name in PARAMETERS])


def _only(**values: float) -> Array:
    return np.array([values.get(name, 0.0) for name in PARAMETERS])


def approximate_symmetries(latitude: float) -> dict[str, Symmetry]:
    """ψ and θ counted the other way: exact for a platform that is not misaligned."""
    up = earth_rate(latitude)[1]
    return {
        "psi-reversed": Symmetry("psi-reversed", _scaled(kx=-1.0, kxy=-1.0, w0x=-1.0, wk=-1.0), _only()),
        "theta-reversed": Symmetry("theta-reversed", _scaled(wg=-1.0, wk=-1.0), _only(wg=2.0 * up)),
    }
