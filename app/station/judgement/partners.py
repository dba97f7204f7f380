"""Partners 180° apart: what a wrong position shows before the session is solved.

With the torquers' matrix K and the paper's elements, eq. (14), the currents of a position satisfy, eqs. (4), (10),

    K·J = ωг·(a, b) + ωв·(c, d) − ω0 − G·(c, d) − ωн·e·(c, d),    G = [[ωg, −ωк], [ωк, ωg]]

At the commanded angles the orientation is R₃(ψ)·R₁(θ), eq. (7). Its first two rows, (a, c) and (b, d), are
combinations cos ψ, sin ψ of the rows of R₁(θ), so they change their sign when ψ turns by 180°, and e = cos θ does not
change. Everything above but ω0 is linear in a, b, c, d, so of the sum of partners only

    K·(J(θ, ψ) + J(θ, ψ + 180°)) = −2·ω0

remains, with ωн too: the same for every pair of the session, whatever θ. (At fixed θ only ψ does this: with θ, e and
what the spin axis shares with the vertical change.)

The certified angles α, β, γ turn the case by a small rotation of the angle ε ≤ √(α² + β² + γ²), which moves every unit
vector by at most ε. The rate on the case is moved by at most Ω·ε, the specific force by ε, the product e·(c, d) by
2ε. So a sum of partners, and hence a difference of sums, is off by

    |K·δ(J + J')| ≤ 2ε·(Ω + g),    g = √(ωg² + ωк²) + 2·|ωн|

(twice that for a difference of sums). At 60″, Ω + g = 21 °/h and K = 2063 °/h/mA this is 6 nA.

A stand that stands 90° or 180° off in one position changes the sum by the difference of the current there and where
it should be: √2 or 2 times the part of the current that ψ turns. Nothing shows where that part is nothing (the gyro
feels the same at every ψ, and the mistake does no harm), nor when both partners are exchanged or off alike.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.station.contracts import Currents, Place
from solver.constants import EARTH_RATE
from solver.errors import Message
from solver.units import deg_per_h_from_rad_per_s, rad_from_arcsec

_NA_PER_MA: Final = 1e6
_TURN_DEG: Final = 360.0
_PER_DEG: Final = 1000
"""Angles are told apart to a thousandth of a degree."""
_FEWEST: Final = 3


@dataclass(frozen=True, slots=True)
class OddPair:
    """A pair of partners whose sum is not that of the others.

    Attributes
    ----------
    places
        Both; which of them is wrong the sum does not tell.
    difference
        Of its sum from the median of the others'.
    """

    places: tuple[Place, Place]
    difference: Currents

    @property
    def size_na(self) -> float:
        """The larger difference of both channels, nA."""
        return max(abs(value) for value in self.difference) * _NA_PER_MA

    @property
    def message(self) -> Message:
        """A sentence, as a template with its values."""
        (theta, psi), (_, opposite) = self.places
        return Message(
            "partner",
            "θ %(theta).6g°, ψ %(psi).6g° and %(opposite).6g°: the sum of the currents differs by %(size).0f nA from "
            "that of the other pairs. One of the two was measured in another position, or something disturbed it. "
            "Measure both again.",
            {"theta": theta, "psi": psi, "opposite": opposite, "size": self.size_na},
        )


def partner_of(place: Place) -> Place:
    """The place half a turn of ψ further, ψ in [0°, 360°)."""
    return Place(place.theta_deg, (place.psi_deg + _TURN_DEG / 2) % _TURN_DEG)


def odd_pairs(means: Mapping[Place, Currents], tolerance_na: float) -> tuple[OddPair, ...]:
    """Pairs whose sum differs from the median of the others' by more than the tolerance, the worst first.

    Parameters
    ----------
    means
        Mean currents, mA, of the places measured so far.
    tolerance_na
        What noise, drift and certified angles (`by_angles_na`) may do to a difference of sums, nA.

    Returns
    -------
    tuple
        Empty as long as there are fewer than three pairs. The worst pair is named and taken out before the next
        one is judged, since it stands in the median of the others.
    """
    sums = dict(_sums(means))
    found: list[OddPair] = []
    while len(sums) >= _FEWEST:
        worst = max((_compared(pair, sums) for pair in sums), key=lambda odd: odd.size_na)
        if worst.size_na <= tolerance_na:
            break
        found.append(worst)
        del sums[worst.places]
    return tuple(found)


def without_comparison(means: Mapping[Place, Currents]) -> tuple[Place, ...]:
    """Places that `odd_pairs` says nothing of: those without a partner, and all while there are too few pairs."""
    pairs = dict(_sums(means))
    seen = {place for pair in pairs for place in pair} if len(pairs) >= _FEWEST else set()
    return tuple(place for place in means if place not in seen)


def by_angles_na(angle_arcsec: float, scale_deg_per_h_per_ma: float, g_drift_deg_per_h: float = 0.0) -> float:
    """What certified angles do to a difference of sums at most, nA.

    Parameters
    ----------
    angle_arcsec
        Largest certified rotation √(α² + β² + γ²) of a position.
    scale_deg_per_h_per_ma
        Smallest scale factor of the gyro.
    g_drift_deg_per_h
        √(ωg² + ωк²) + 2·|ωн|.
    """
    earth = deg_per_h_from_rad_per_s(EARTH_RATE)
    rate = 4.0 * rad_from_arcsec(angle_arcsec) * (earth + g_drift_deg_per_h)
    return rate / abs(scale_deg_per_h_per_ma) * _NA_PER_MA


def _sums(means: Mapping[Place, Currents]) -> Iterable[tuple[tuple[Place, Place], Currents]]:
    by_key = {_key(place): place for place in means}
    for place in means:
        other = by_key.get(_key(partner_of(place)))
        if other is not None and _key(place) < _key(other):
            one, two = means[place], means[other]
            yield (place, other), Currents(one.jx_ma + two.jx_ma, one.jy_ma + two.jy_ma)


def _key(place: Place) -> tuple[int, int]:
    turn = round(_TURN_DEG * _PER_DEG)
    return round(place.theta_deg * _PER_DEG) % turn, round(place.psi_deg * _PER_DEG) % turn


def _compared(pair: tuple[Place, Place], sums: Mapping[tuple[Place, Place], Currents]) -> OddPair:
    others: Sequence[Currents] = [value for key, value in sums.items() if key != pair]
    x, y = np.median(np.array(others), axis=0).tolist()
    own = sums[pair]
    return OddPair(pair, Currents(own.jx_ma - x, own.jy_ma - y))
