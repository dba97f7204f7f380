"""Simulated sessions whose certificate, ammeter, base and latitude are wrong by their stated uncertainty.

By the same independent route as `tests.solver.sessions`: the true orientation and latitude make the
currents, the certificate tells other ones.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from solver.inputs import CommonUncertainty
from solver.records import Observations
from tests.solver.sessions import Array, Setup, to_case

ARCSEC = np.pi / 180 / 3600
EARTH = 7.292115e-5


@dataclass(frozen=True)
class Uncertain:
    """A set-up, with standard uncertainties: of the angles in arcsec, of the common terms as in the solver."""

    setup: Setup = field(default_factory=lambda: Setup(noise=0.005, u_given=True))
    angles: float = 60.0
    shared: dict[str, float] = field(default_factory=dict)

    @property
    def common(self) -> CommonUncertainty:
        return CommonUncertainty.of(self.shared)

    def observe(self, rng: np.random.Generator) -> Observations:
        setup = self.setup
        n = len(setup.positions)
        certified = setup.misalignment * ARCSEC * rng.standard_normal((n, 3))
        error = {name: u * rng.standard_normal() for name, u in self.shared.items()}
        common = np.array([error.get(name, 0.0) for name in ("alpha", "beta", "gamma")])
        true = certified + self.angles * ARCSEC * rng.standard_normal((n, 3)) + common
        rates = self._rates(true, error)
        kx, ky, kxy, kyx = setup.parameters[:4]
        currents = rates @ np.linalg.inv(np.array([[kx, kxy], [kyx, ky]])).T
        rows = np.tile(np.arange(n), setup.repeats)
        read = currents[rows] + setup.u_current * rng.standard_normal((len(rows), 2))
        # True minus assumed: the true current is the reading times one plus the gain's error, plus the offset's.
        gain = 1 + np.array([error.get("gain_x", 0.0), error.get("gain_y", 0.0)])
        read = (read - np.array([error.get("offset_x", 0.0), error.get("offset_y", 0.0)])) / gain
        u = np.full(len(rows), setup.u_current) if setup.u_given else None
        stated = np.full(len(rows), self.angles * ARCSEC)
        return Observations.sorted_from(
            theta=np.radians(setup.positions[rows, 0]), psi=np.radians(setup.positions[rows, 1]),
            repeat=np.repeat(np.arange(setup.repeats), n),
            alpha=certified[rows, 0], beta=certified[rows, 1], gamma=certified[rows, 2],
            jx=read[:, 0], jy=read[:, 1], u_jx=u, u_jy=u,
            u_alpha=stated, u_beta=stated, u_gamma=stated,
            latitude=float(np.radians(setup.latitude)),
        )  # fmt: skip

    def _rates(self, misalignment: Array, error: dict[str, float]) -> Array:
        """What the currents must balance, rad/s, (n, 2), with base, latitude and gravity as they truly are."""
        turn = to_case(np.radians(self.setup.positions), misalignment)
        for axis, name in enumerate(("level_1", "level_2", "azimuth")):
            turn = turn @ Rotation.from_rotvec(-error.get(name, 0.0) * np.eye(3)[axis]).as_matrix()
        phi = np.radians(self.setup.latitude) + error.get("latitude", 0.0)
        earth = turn @ (EARTH * np.array([0.0, np.cos(phi), np.sin(phi)]))
        up = (1 + error.get("gravity", 0.0)) * turn @ np.array([0.0, 0.0, 1.0])
        w0x, w0y, wg, wk = self.setup.parameters[4:]
        drift = np.column_stack((w0x + wg * up[:, 0] - wk * up[:, 1], w0y + wk * up[:, 0] + wg * up[:, 1]))
        return np.asarray(earth[:, :2] - drift)


def without_u(observations: Observations) -> Observations:
    """The same session with nothing told of the currents' noise."""
    return replace(observations, u_jx=None, u_jy=None)
