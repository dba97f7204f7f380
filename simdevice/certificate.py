"""Positions of the stand, and the certificate that says how far each is from its commanded angles."""

from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simdevice.streams import Part, stream
from solver.units import ARCSEC_PER_DEG, arcsec_from_rad, deg_from_rad, rad_from_arcsec

Array = NDArray[np.float64]

_KEYS_PER_DEG = ARCSEC_PER_DEG * 1000.0
_KEYS_PER_TURN = round(360.0 * _KEYS_PER_DEG)
_CERTIFIED_DECIMALS = 3
"""Certificates are printed to a milliarcsecond; what is printed is what holds."""

ANGLE_SPREAD: Final = rad_from_arcsec(15.0)
U_RANDOM: Final = rad_from_arcsec(0.5)
U_SYSTEMATIC: Final = rad_from_arcsec(0.3)
"""A good stand: standard deviation of its angles, and how well its certificate knows them, rad."""


def _angle_key(angle: float) -> int:
    """An angle, rad, in whole milliarcseconds in [0, 360°): equal for equal orientations, below 2³²."""
    return round(deg_from_rad(angle) * _KEYS_PER_DEG) % _KEYS_PER_TURN


@dataclass(frozen=True, slots=True)
class Position:
    """One measurement's place: commanded angles, rad, and which repeat of them it is."""

    theta: float
    psi: float
    repeat: int = 0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.theta) and np.isfinite(self.psi)):
            raise ValueError("A position's angles must be finite numbers.")
        if self.repeat < 0:
            raise ValueError(f"The repeat is {self.repeat}: repeats count from 0.")

    @property
    def place(self) -> tuple[int, int]:
        """θ and ψ in whole milliarcseconds: names the place in every stream's key."""
        return _angle_key(self.theta), _angle_key(self.psi)

    @property
    def key(self) -> tuple[int, int, int]:
        """`place` and the repeat."""
        return *self.place, self.repeat


def sixteen_positions(repeats: int = 1) -> tuple[Position, ...]:
    """θ and ψ each 0, 90, 180, 270°, θ outer, ψ inner; then the same again for each repeat."""
    quarters = [quarter * np.pi / 2 for quarter in range(4)]
    return tuple(
        Position(theta, psi, repeat)
        for repeat, theta, psi in product(range(repeats), quarters, quarters)
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """What the laboratory knows of its stand's orientations. Build it with `certify`.

    Attributes
    ----------
    theta, psi : (n,) arrays
        Commanded angles, rad; every place once.
    angles : (n, 3) array
        Certified misalignment α, β, γ, rad.
    u_random : (n, 3) array
        Standard uncertainty of `angles` that is independent from place to place, rad.
    u_systematic : (3,) array
        Standard uncertainty of α, β, γ that all places have in common, rad.
    """

    theta: Array
    psi: Array
    angles: Array
    u_random: Array
    u_systematic: Array

    @property
    def places(self) -> tuple[tuple[int, int], ...]:
        """`Position.place` of every row."""
        return tuple(
            (_angle_key(theta), _angle_key(psi))
            for theta, psi in zip(self.theta.tolist(), self.psi.tolist(), strict=True)
        )

    def row_of(self, position: Position) -> int:
        """Row of a position's place.

        Raises
        ------
        ValueError
            When the certificate does not cover it.
        """
        try:
            return self.places.index(position.place)
        except ValueError:
            raise ValueError(
                f"The certificate has no position θ = {deg_from_rad(position.theta):g}°, "
                f"ψ = {deg_from_rad(position.psi):g}°."
            ) from None

    def deviation(self, position: Position, seed: int) -> Array:
        """Truth minus certified angle at a place, (3,), rad, drawn from the uncertainties.

        The common part is the same at every place, and both are the same for every repeat: the
        stand returns to where it was, only the certificate is wrong about where that is.
        """
        common = stream(seed, Part.MISALIGNMENT_COMMON).standard_normal(3)
        own = stream(seed, Part.MISALIGNMENT, *position.place).standard_normal(3)
        deviation: Array = self.u_systematic * common + self.u_random[self.row_of(position)] * own
        return deviation


def certify(
    theta: ArrayLike,
    psi: ArrayLike,
    angles: ArrayLike = 0.0,
    *,
    u_random: ArrayLike = 0.0,
    u_systematic: ArrayLike = 0.0,
) -> Certificate:
    """A checked certificate.

    Parameters
    ----------
    theta, psi
        (n,), rad.
    angles, u_random
        (n, 3) or anything that broadcasts to it, rad; 0 is perfect, and perfectly known.
    u_systematic
        (3,) or one number, rad.

    Raises
    ------
    ValueError
        When shapes do not fit, values are not finite, an uncertainty is negative, or a place
        occurs twice.
    """
    theta, psi = (np.atleast_1d(np.asarray(angle, dtype=np.float64)) for angle in (theta, psi))
    if theta.ndim != 1 or theta.shape != psi.shape:
        raise ValueError("A certificate needs as many ψ as θ, one of each per position.")
    certificate = Certificate(
        theta=theta,
        psi=psi,
        angles=np.broadcast_to(np.asarray(angles, dtype=np.float64), (len(theta), 3)),
        u_random=np.broadcast_to(np.asarray(u_random, dtype=np.float64), (len(theta), 3)),
        u_systematic=np.broadcast_to(np.asarray(u_systematic, dtype=np.float64), (3,)),
    )
    for values in (theta, psi, certificate.angles, certificate.u_random, certificate.u_systematic):
        if not np.isfinite(values).all():
            raise ValueError("A certificate's values must be finite numbers.")
    if (certificate.u_random < 0).any() or (certificate.u_systematic < 0).any():
        raise ValueError("A certificate's uncertainties must not be negative.")
    if len(set(certificate.places)) < len(theta):
        raise ValueError("A certificate must name each position once.")
    return certificate


def draw_certificate(
    seed: int,
    positions: tuple[Position, ...] | None = None,
    *,
    spread: float = ANGLE_SPREAD,
    u_random: ArrayLike = U_RANDOM,
    u_systematic: ArrayLike = U_SYSTEMATIC,
) -> Certificate:
    """A plausible certificate: angles of tens of arcseconds, normally distributed.

    Parameters
    ----------
    seed
        Each place's angles depend on it and on the place alone.
    positions
        Default: the sixteen. Repeats of a place count once.
    spread
        Standard deviation of each angle, rad.
    u_random, u_systematic
        Standard uncertainties to state, rad; shapes as for `certify`.
    """
    places = {position.place: position for position in positions or sixteen_positions()}
    angles = [stream(seed, Part.CERTIFIED_ANGLES, *place).normal(0.0, spread, 3) for place in places]
    return certify(
        [position.theta for position in places.values()],
        [position.psi for position in places.values()],
        as_printed(np.array(angles)),
        u_random=u_random,
        u_systematic=u_systematic,
    )


def as_printed(angles: Array) -> Array:
    """Angles, rad, rounded to the whole milliarcseconds of a printed certificate."""
    return rad_from_arcsec(np.round(arcsec_from_rad(angles), _CERTIFIED_DECIMALS))
