"""Simulated sessions with one blunder each, by the independent route of `tests.solver.sessions`.

A `Study` draws gyros of a type around its nominal values, as its prior says; each blunder changes what
was measured or what was written down, and says what a diagnosis must name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.blunders.diagnosis import Diagnosis, Finding
from solver.blunders.prior import Prior
from solver.records import Observations
from tests.solver.sessions import LAB, Setup, grid

Array = NDArray[np.float64]
Rng = np.random.Generator

NOMINAL = np.array([2062.65, 2062.65, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
"""The type's nominal values, lab units."""
SPREAD = np.array([0.05 * 2062.65, 0.05 * 2062.65, 10.0, 10.0, 1.0, 1.0, 5.0, 5.0])
"""Standard deviations of its gyros."""
ASKED = np.array([True, True, False, False, False, False, True, True])
"""What the prior of the study speaks of: scale factors and g-sensitive drifts."""


def prior(says: Array = ASKED) -> Prior:
    """The type's nominal values and spread, silent (NaN) on the rest."""
    silent = np.where(says, 1.0, np.nan)
    return Prior(NOMINAL * LAB * silent, SPREAD * LAB * silent)


@dataclass(frozen=True)
class Truth:
    """What a diagnosis must name: a code, rows as measured, and what else."""

    code: str
    places: tuple[tuple[float, float], ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """Circumstances: degrees, °/h, arcsec (1σ of the certificate's angles, which are true)."""

    misalignment: float = 60.0
    noise: float = 0.005
    latitude: float = 55.76
    positions: Array = field(default_factory=grid)
    u_given: bool = True

    def draw(self, rng: Rng) -> "Session":
        """One gyro on the stand, nothing wrong yet."""
        gyro = (NOMINAL + SPREAD * rng.standard_normal(8)) * LAB
        angles = np.radians(self.misalignment / 3600) * rng.standard_normal((len(self.positions), 3))
        return Session(self, gyro, self.positions, angles, rng)


@dataclass
class Session:
    """A session in the making: what is true, and how it is written down."""

    study: Study
    gyro: Array
    positions: Array
    angles: Array
    rng: Rng

    def currents(
        self, positions: Array | None = None, angles: Array | None = None, latitude: float | None = None
    ) -> Array:
        """Measured currents with noise, (n, 2), A, where the platform really is."""
        positions = self.positions if positions is None else positions
        setup = Setup(
            self.gyro,
            self.study.latitude if latitude is None else latitude,
            positions,
            noise=self.study.noise,
        )
        true = setup.currents(self.angles if angles is None else angles)
        return true + self.u * self.rng.standard_normal(true.shape)

    @property
    def u(self) -> float:
        """Standard uncertainty of each current: the noise by the type's nominal scale factor, A."""
        return self.study.noise * LAB[4] / float(NOMINAL[0] * LAB[0])

    def written(
        self, currents: Array, angles: Array | None = None, u: float | Array | None = None
    ) -> Observations:
        """What the solver is given."""
        alpha, beta, gamma = (self.angles if angles is None else angles).T
        u = np.broadcast_to(self.u if u is None else u, len(self.positions)) if self.study.u_given else None
        return Observations.sorted_from(
            theta=np.radians(self.positions[:, 0]), psi=np.radians(self.positions[:, 1]),
            alpha=alpha, beta=beta, gamma=gamma, jx=currents[:, 0], jy=currents[:, 1], u_jx=u, u_jy=u,
            latitude=float(np.radians(self.study.latitude)),
        )  # fmt: skip

    def place(self, row: int) -> tuple[float, float]:
        """Commanded position of a row, degrees."""
        return float(self.positions[row, 0]), float(self.positions[row, 1])


Made = tuple[Observations, Truth | None]


def good(session: Session) -> Made:
    return session.written(session.currents()), None


def outlier(session: Session) -> Made:
    """One current off by 6 to 30 u."""
    currents = session.currents()
    row, channel = session.rng.integers(len(currents)), session.rng.integers(2)
    currents[row, channel] += session.rng.choice([-1, 1]) * session.rng.uniform(6, 30) * session.u
    return session.written(currents), Truth("outlier", (session.place(row),))


def swapped(session: Session, *, twins: bool = False) -> Made:
    """Two positions exchanged, twins (θ+180°, ψ+180°) or not."""
    currents = session.currents()
    while True:
        one, other = session.rng.choice(len(currents), 2, replace=False)
        if twins == bool(np.all((session.positions[one] - session.positions[other]) % 360 == 180)):
            break
    currents[[one, other]] = currents[[other, one]]
    return session.written(currents), Truth("positions-swapped", (session.place(one), session.place(other)))


def twins_swapped(session: Session) -> Made:
    return swapped(session, twins=True)


def position_wrong(session: Session) -> Made:
    """θ or ψ off by 90, 180 or 270° at one position; the stand's certificate holds where it really is."""
    positions, angles = session.positions.copy(), session.angles.copy()
    row, axis = session.rng.integers(len(positions)), session.rng.integers(2)
    positions[row, axis] = (positions[row, axis] + session.rng.choice([90, 180, 270])) % 360
    there = np.flatnonzero((session.positions == positions[row]).all(axis=1))
    if len(there):
        angles[row] = session.angles[there[0]]
    actual = (float(positions[row, 0]), float(positions[row, 1]))
    return session.written(session.currents(positions, angles)), Truth(
        "position-wrong", (session.place(row),), {"actual": actual}
    )


def angle_unit(session: Session) -> Made:
    """Arcminutes or degrees read as arcseconds."""
    factor = float(session.rng.choice([60, 3600]))
    return session.written(session.currents(), session.angles / factor), Truth(
        "angle-unit", (), {"factor": factor}
    )


def stuck(session: Session) -> Made:
    """A channel that shows the same from a random position on (at least one reading is wrong)."""
    currents = session.currents()
    row, channel = session.rng.integers(len(currents) - 1), session.rng.integers(2)
    currents[row:, channel] = currents[row, channel]
    return session.written(currents), Truth("channel-stuck", (), {"channel": "xy"[channel]})


def stuck_with_noise(session: Session) -> Made:
    """The same, with the ammeter's noise on it, which hides the repetition."""
    currents = session.currents()
    row, channel = session.rng.integers(1, len(currents) - 1), session.rng.integers(2)
    currents[row:, channel] = currents[row - 1, channel] + session.u * session.rng.standard_normal(
        len(currents) - row
    )
    return session.written(currents), Truth("channel-stuck", (), {"channel": "xy"[channel]})


def saturated(session: Session) -> Made:
    """A channel clipped at 60 to 95 % of its largest current."""
    currents = session.currents()
    channel = session.rng.integers(2)
    limit = session.rng.uniform(0.6, 0.95) * np.abs(currents[:, channel]).max()
    currents[:, channel] = np.clip(currents[:, channel], -limit, limit)
    return session.written(currents), Truth("channel-saturated", (), {"channel": "xy"[channel]})


def warm_up(session: Session, course: Callable[[Array, Rng], Array]) -> Made:
    """Both biases drift by 0.1 °/h from the first to the last position, each in its own sense."""
    currents = session.currents()
    at = course(np.linspace(0, 1, len(currents)), session.rng)
    size = 0.1 * LAB[4] * session.rng.choice([-1, 1], 2)
    kx, ky, kxy, kyx = session.gyro[:4]
    drift = np.outer(at, size) @ np.linalg.inv(np.array([[kx, kxy], [kyx, ky]])).T
    return session.written(currents - drift), Truth("warm-up")


def warm_up_linear(session: Session) -> Made:
    return warm_up(session, lambda at, _: at)


def warm_up_exponential(session: Session) -> Made:
    """With a time constant of a tenth to a half of the session."""
    return warm_up(session, lambda at, rng: np.exp(-at / rng.uniform(0.1, 0.5)))


def channels_swapped(session: Session) -> Made:
    return session.written(session.currents()[:, ::-1]), Truth("channels-swapped")


def channel_sign(session: Session) -> Made:
    currents = session.currents()
    channel = session.rng.integers(2)
    currents[:, channel] *= -1
    return session.written(currents), Truth("channel-sign", (), {"channel": "xy"[channel]})


def reversed_axis(session: Session, axis: int) -> Made:
    """One angle counted the other way; the certificate belongs to where the platform really is."""
    positions = session.positions.copy()
    positions[:, axis] = -positions[:, axis] % 360
    there = [int(np.flatnonzero((session.positions == where).all(axis=1))[0]) for where in positions]
    currents = session.currents(positions, session.angles[there])
    return session.written(currents), Truth(("theta-reversed", "psi-reversed")[axis])


def psi_reversed(session: Session) -> Made:
    return reversed_axis(session, 1)


def theta_reversed(session: Session) -> Made:
    return reversed_axis(session, 0)


def psi_reversed_with_certificate(session: Session) -> Made:
    """The certificate's angles were measured with the same wrong sense of ψ."""
    positions = session.positions * [1, -1]
    return session.written(session.currents(positions)), Truth("psi-reversed")


def latitude_sign(session: Session) -> Made:
    return session.written(session.currents(latitude=-session.study.latitude)), Truth("latitude-sign")


def latitude_complement(session: Session) -> Made:
    latitude = np.copysign(90 - abs(session.study.latitude), session.study.latitude)
    return session.written(session.currents(latitude=float(latitude))), Truth("latitude-complement")


def current_unit(session: Session) -> Made:
    """A or µA read as mA; `u` was in the same unit."""
    factor = float(session.rng.choice([1e3, 1e-3]))
    return session.written(session.currents() / factor, u=session.u / factor), Truth(
        "current-unit", (), {"factor": factor}
    )


VISIBLE: Mapping[str, Callable[[Session], Made]] = {
    "outlier": outlier, "positions-swapped": swapped, "position-wrong": position_wrong, "angle-unit": angle_unit,
    "channel-stuck": stuck, "channel-stuck, with noise": stuck_with_noise, "channel-saturated": saturated,
    "warm-up, linear": warm_up_linear, "warm-up, exponential": warm_up_exponential,
}  # fmt: skip
INVISIBLE: Mapping[str, Callable[[Session], Made]] = {
    "channels-swapped": channels_swapped, "channel-sign": channel_sign, "psi-reversed": psi_reversed,
    "theta-reversed": theta_reversed, "latitude-sign": latitude_sign, "latitude-complement": latitude_complement,
    "current-unit": current_unit,
}  # fmt: skip


def names(finding: Finding, truth: Truth) -> bool:
    """Whether a finding says what is true, or names a class that holds it."""
    claims = [{"code": finding.code, "positions": finding.positions, **finding.details}]
    claims += finding.details.get("equivalents", ())
    return any(_says(claim, truth) for claim in claims)


def _says(claim: Mapping[str, Any], truth: Truth) -> bool:
    if claim["code"] != truth.code:
        return False
    if truth.places:
        said = {tuple(np.round(np.degrees(place[:2])) % 360) for place in claim["positions"]}
        if said != set(truth.places):
            return False
    for key, value in truth.details.items():
        said = claim[key]
        if key == "actual":
            if not np.allclose((np.degrees(said) - value + 180) % 360, 180):
                return False
        elif said != value:
            return False
    return True


def right(diagnosis: Diagnosis, truth: Truth) -> bool:
    """Whether the first finding names the truth, or its class."""
    return bool(diagnosis.findings) and names(diagnosis.findings[0], truth)


def at(study: Study, **changes: Any) -> Study:
    return replace(study, **changes)
