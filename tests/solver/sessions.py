"""Simulated sessions for the tests, by an independent route.

Orientations come from scipy's `Rotation` (a vector is turned backwards by each angle instead of the
frame forwards), currents from Earth rate and gravity as vectors; nothing of `solver.geometry` or
`solver.error_model` takes part.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from solver.records import PARAMETERS, Observations

Array = NDArray[np.float64]

DEG_PER_H = np.pi / 180 / 3600
"""One °/h in rad/s."""
PER_MA = DEG_PER_H * 1000
"""One °/h/mA in rad/(s·A)."""
LAB = np.array([PER_MA] * 4 + [DEG_PER_H] * 4)
"""One laboratory unit of each parameter, SI."""
GYRO = dict(zip(PARAMETERS, (2062.65, 2041.0, 10.3, -8.25, 1.5, -0.8, 6.0, 2.0), strict=True))
"""An ordinary gyro, lab units."""


def truth(**changes: float) -> Array:
    """Parameters of `GYRO` with changes, SI."""
    return np.array(list({**GYRO, **changes}.values())) * LAB


def grid(thetas: tuple[float, ...] = (0, 90, 180, 270), psis: tuple[float, ...] = (0, 90, 180, 270)) -> Array:
    """Every θ with every ψ, degrees, (n, 2)."""
    return np.array([(theta, psi) for theta in thetas for psi in psis], dtype=float)


def to_case(angles: Array, misalignment: Array) -> Array:
    """Matrices that take geographic components to case components, (n, 3, 3)."""
    theta, psi = angles.T
    alpha, beta, gamma = misalignment.T

    def back(axis: int, angle: Array) -> Rotation:
        return Rotation.from_rotvec(-angle[:, None] * np.eye(3)[axis])

    turn = back(2, gamma) * back(1, beta) * back(0, alpha) * back(2, psi) * back(0, theta)
    return np.asarray(turn.as_matrix())


@dataclass(frozen=True)
class Setup:
    """A session's circumstances; angles in degrees, misalignment in arcsec, noise in °/h."""

    parameters: Array = field(default_factory=truth)
    latitude: float = 55.7558
    positions: Array = field(default_factory=grid)
    misalignment: float = 20.0
    noise: float = 0.0
    u_given: bool = False
    repeats: int = 1

    def currents(self, misalignment: Array) -> Array:
        """Noise-free currents, A, (n, 2); `misalignment` (n, 3) in rad."""
        turn = to_case(np.radians(self.positions), misalignment)
        phi = np.radians(self.latitude)
        earth = turn @ (7.292115e-5 * np.array([0.0, np.cos(phi), np.sin(phi)]))
        up = turn @ np.array([0.0, 0.0, 1.0])
        kx, ky, kxy, kyx, w0x, w0y, wg, wk = self.parameters
        drift_x = w0x + wg * up[:, 0] - wk * up[:, 1]
        drift_y = w0y + wk * up[:, 0] + wg * up[:, 1]
        rates = earth[:, :2] - np.column_stack((drift_x, drift_y))
        return rates @ np.linalg.inv(np.array([[kx, kxy], [kyx, ky]])).T

    @property
    def u_current(self) -> float:
        """Standard deviation of the currents' noise, A."""
        return self.noise * DEG_PER_H / abs(float(self.parameters[0]))

    def observe(self, rng: np.random.Generator) -> Observations:
        """One session with its own misalignments and noise; rows in the order of `positions`."""
        n = len(self.positions)
        misalignment = np.radians(self.misalignment / 3600) * rng.standard_normal((n, 3))
        noise_free = self.currents(misalignment)
        rows = np.tile(np.arange(n), self.repeats)
        currents = noise_free[rows] + self.u_current * rng.standard_normal((len(rows), 2))
        u = np.full(len(rows), self.u_current) if self.u_given else None
        alpha, beta, gamma = misalignment[rows].T
        return Observations.sorted_from(
            theta=np.radians(self.positions[rows, 0]),
            psi=np.radians(self.positions[rows, 1]),
            repeat=np.repeat(np.arange(self.repeats), n),
            alpha=alpha, beta=beta, gamma=gamma,
            jx=currents[:, 0], jy=currents[:, 1], u_jx=u, u_jy=u,
            duration=np.full(len(rows), 60.0), rate=np.full(len(rows), 200.0),
            latitude=float(np.radians(self.latitude)),
        )  # fmt: skip
