"""The stand: where the gyro's case really is, and what it therefore feels.

Everything is a finite rotation of a body, composed in the order in which a person would turn it.
From "case axes along geographic axes" (ξ east, η north, ζ up) the case is turned

1. with the base, about ξ, then the turned η, then the turned ζ, by the base's angles;
2. with the frame, about the (now tilted) first axis by θ;
3. with the platform, about the third axis that it carries by ψ;
4. by the platform's true misalignment, about its own axes one, two, three in turn.

Each turn is about an axis that the previous ones have carried along: intrinsic rotations, which
scipy writes with capital letters. Their product takes case components to geographic ones, and its
inverse takes the Earth's rate and the specific force to the case.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simdevice.certificate import Certificate, Position, as_printed, certify
from solver.constants import EARTH_RATE

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """A two-axis stand with fixed positions.

    Attributes
    ----------
    latitude
        rad, south negative.
    certificate
        What the laboratory knows.
    base
        True level about east, level about north, and azimuth of the base, rad.
    seed
        Draws how the truth deviates from the certificate; a property of the stand, the same for
        every session on it.
    """

    latitude: float
    certificate: Certificate
    base: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= np.pi / 2:
            raise ValueError("The stand's latitude must lie between −90° and 90°.")
        if not np.isfinite(self.base).all():
            raise ValueError("The base's angles must be finite numbers.")

    def misalignment(self, position: Position) -> Array:
        """True α, β, γ of the platform at a position, (3,), rad: certified angle and deviation."""
        row = self.certificate.row_of(position)
        angles: Array = self.certificate.angles[row] + self.certificate.deviation(position, self.seed)
        return angles

    def felt(self, positions: Sequence[Position]) -> tuple[Array, Array]:
        """What the case feels at rest in each position.

        Returns
        -------
        rate : (n, 3) array
            Earth rate along the case axes, rad/s.
        specific_force : (n, 3) array
            Along the case axes, g: +1 on an axis that points up.
        """
        earth = EARTH_RATE * np.array([0.0, np.cos(self.latitude), np.sin(self.latitude)])
        up = np.array([0.0, 0.0, 1.0])
        on_base = Rotation.from_euler("XYZ", self.base).apply([earth, up], inverse=True)
        # One position at a time: the last bit of a batch's sines depends on the batch, and a
        # record must not depend on the positions beside it.
        felt = np.array([self._platform(position).apply(on_base, inverse=True) for position in positions])
        return felt[:, 0], felt[:, 1]

    def recertified(self, seed: int) -> "Stand":
        """The same stand with the certificate of a new measurement of the same true orientations.

        The new certificate states the same uncertainties and errs by a deviation of its own; the
        truth stays, but for the milliarcsecond to which certificates are printed.
        """
        old = self.certificate
        positions = [Position(theta, psi) for theta, psi in zip(old.theta, old.psi, strict=True)]
        certified = [self.misalignment(position) - old.deviation(position, seed) for position in positions]
        certificate = certify(
            old.theta,
            old.psi,
            as_printed(np.array(certified)),
            u_random=old.u_random,
            u_systematic=old.u_systematic,
        )
        return replace(self, certificate=certificate, seed=seed)

    def _platform(self, position: Position) -> Rotation:
        """Steps 2 to 4: takes the case's components to those along the base's axes."""
        axes = Rotation.from_euler("XZ", (position.theta, position.psi))
        return axes * Rotation.from_euler("XYZ", self.misalignment(position))
