"""A laboratory over years: many gyros, several stands that may move, every session's means at once.

Gyros age, jump and scatter from start to start as in `simdevice.fleet`. A stand has its own history: moves of
its base, and certificates that replace one another. Sessions come as columns of mean currents, drawn
directly: thousands take seconds. They are those of `simdevice.means.mean_currents` on a bench with white rate
noise and an ideal ammeter, from streams of their own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simdevice.ammeter import Ammeter
from simdevice.bench import Bench
from simdevice.certificate import Position, draw_certificate, sixteen_positions
from simdevice.fleet import YEAR, FleetGyro
from simdevice.noise import RateNoise
from simdevice.scenarios import GVK_6, MOSCOW, GyroType, draw_gyro
from simdevice.stand import Stand
from simdevice.streams import Part, derived_seed, stream
from solver.units import rad_per_s_from_deg_per_h

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

RECORD: Final = 60.0
"""Length of the records that means stand for, s."""
NOISE: Final = rad_per_s_from_deg_per_h(0.005)
"""Rate noise of a mean over `RECORD`, rad/s."""
START_SCATTER: Final = rad_per_s_from_deg_per_h(0.02)
"""Of both biases from start to start, rad/s."""

LABORATORY_GYRO: Final = replace(
    GVK_6,
    name="laboratory",
    start_scatter={"w0x": START_SCATTER, "w0y": START_SCATTER},
    noise=RateNoise(angle_random_walk=NOISE * np.sqrt(RECORD)),
)
"""GVK-6 with a noise of 0.005 °/h per position and biases that scatter by 0.02 °/h from start to start."""


@dataclass(frozen=True, slots=True)
class Move:
    """At a moment, s, the base turns for good: about east, about north, about the vertical, rad."""

    time: float
    turn: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Recertification:
    """At a moment, s, the stand gets a new certificate, which errs by a deviation of its own."""

    time: float
    seed: int


@dataclass(frozen=True, slots=True, eq=False)
class LivingStand:
    """A stand and what becomes of it.

    Attributes
    ----------
    birth
        At time 0.
    moves, recertifications
        In the order of time.
    """

    birth: Stand
    moves: tuple[Move, ...] = ()
    recertifications: tuple[Recertification, ...] = ()

    def at(self, time: float) -> Stand:
        """The stand at a time, s, with the certificate that is valid then."""
        now = self.birth
        for item in self.recertifications:
            if item.time <= time:
                now = now.recertified(item.seed)
        turns = [self.birth.base, *(move.turn for move in self.moves if move.time <= time)]
        east, north, azimuth = np.sum(turns, axis=0).tolist()
        return replace(now, base=(east, north, azimuth))

    def certificate(self, time: float) -> int:
        """Number of the certificate that is valid at a time, from 0."""
        return sum(item.time <= time for item in self.recertifications)

    def state(self, time: float) -> tuple[int, int]:
        """Number of the certificate and of the moves so far: equal states, equal stand."""
        return self.certificate(time), sum(move.time <= time for move in self.moves)


@dataclass(frozen=True, slots=True)
class Visit:
    """One session: when, s, which gyro on which stand, in which of the gyro's starts."""

    time: float
    gyro: int
    stand: int
    start: int


@dataclass(frozen=True, slots=True, eq=False)
class Means:
    """Mean currents of N sessions of the same n positions.

    Attributes
    ----------
    theta, psi : (n,) array
        rad.
    angles : (N, n, 3) array
        Certified α, β, γ of each session's certificate, rad.
    jx, jy, u_jx, u_jy : (N, n) array
        A.
    """

    theta: Array
    psi: Array
    angles: Array
    jx: Array
    jy: Array
    u_jx: Array
    u_jy: Array


@dataclass(frozen=True, slots=True, eq=False)
class LaboratoryLife:
    """A laboratory's sessions and all that is true of them.

    Attributes
    ----------
    gyros, stands
    visits
        In the order of time.
    seed
        Of the sessions' noise.
    positions
        That every session measures.
    """

    gyros: tuple[FleetGyro, ...]
    stands: tuple[LivingStand, ...]
    visits: tuple[Visit, ...]
    seed: int
    positions: tuple[Position, ...] = field(default_factory=sixteen_positions)

    def truth(self, visit: Visit) -> Array:
        """The eight parameters as they are in a session, (8,)."""
        return self.gyros[visit.gyro].truth(visit.time, visit.start).values

    def bench(self, number: int) -> Bench:
        """The bench of the session of that number."""
        visit = self.visits[number]
        gyro = self.gyros[visit.gyro]
        return Bench(
            gyro.truth(visit.time, visit.start),
            self.stands[visit.stand].at(visit.time),
            Ammeter(),
            RateNoise(gyro.kind.noise.angle_random_walk),
            duration=RECORD,
            seed=derived_seed(self.seed, Part.SESSION_SEED, number),
            start=visit.start,
        )

    def means(self, noise: float = 1.0) -> Means:
        """Mean currents of every session; `noise` multiplies their noise, not its stated size."""
        count = len(self.visits), len(self.positions)
        angles, (jx, jy, u_jx, u_jy) = np.empty((*count, 3)), np.empty((4, *count))
        felt: dict[tuple[int, int, int], tuple[Array, Array, Array]] = {}
        for row, visit in enumerate(self.visits):
            living, gyro = self.stands[visit.stand], self.gyros[visit.gyro]
            key = visit.stand, *living.state(visit.time)
            if key not in felt:
                stand = living.at(visit.time)
                rows = [stand.certificate.row_of(position) for position in self.positions]
                felt[key] = (*stand.felt(self.positions), stand.certificate.angles[rows])
            rate, force, angles[row] = felt[key]
            std = gyro.kind.noise.angle_random_walk / np.sqrt(RECORD)
            errors = std * stream(self.seed, Part.LIFE_NOISE, row).standard_normal((2, count[1]))
            now = gyro.truth(visit.time, visit.start)
            drifts = now.drift(force)
            rates = (rate[:, axis] - drifts[axis] + noise * errors[axis] for axis in range(2))
            jx[row], jy[row] = now.currents_for(*rates)
            per_rate = now.currents_for(np.array([1.0, 0.0]), np.array([0.0, 1.0]))
            u_jx[row], u_jy[row] = (std * float(np.hypot(*one)) for one in per_rate)
        theta, psi = np.array([(position.theta, position.psi) for position in self.positions]).T
        return Means(theta, psi, angles, jx, jy, u_jx, u_jy)


def draw_laboratory(
    seed: int,
    *,
    gyros: int = 20,
    stands: int = 3,
    years: float = 5.0,
    kind: GyroType = LABORATORY_GYRO,
    moves: Mapping[int, Sequence[Move]] | None = None,
    recertifications: Mapping[int, Sequence[Recertification]] | None = None,
) -> LaboratoryLife:
    """A laboratory in which nothing changes but by what is asked: gyros visit monthly, each its own stand.

    Parameters
    ----------
    seed
        Draws gyros, certificates and what is false in them, the days of the visits, starts, noise.
    gyros, stands, years
        How many; gyro i is measured on stand i modulo the number of stands, in a start of its own each time.
    kind
        Type of all gyros.
    moves, recertifications
        By number of the stand.
    """
    fleet = []
    for number in range(gyros):
        own = derived_seed(seed, Part.FLEET_SEED, number)
        fleet.append(FleetGyro(f"G{number + 1:02d}", kind, draw_gyro(kind, own), own))
    living = []
    for number in range(stands):
        own = derived_seed(seed, Part.STAND_SEED, number)
        birth = Stand(MOSCOW, draw_certificate(own), seed=own)
        living.append(
            LivingStand(
                birth, tuple((moves or {}).get(number, ())), tuple((recertifications or {}).get(number, ()))
            )
        )
    months = round(12 * years)
    days = stream(seed, Part.LIFE_DATES).uniform(0.0, 1.0, (months, gyros))
    times = (np.arange(months)[:, None] + days) * (YEAR / 12)
    visits = [
        Visit(float(times[month, gyro]), gyro, gyro % stands, month)
        for month in range(months)
        for gyro in range(gyros)
    ]
    visits.sort(key=lambda visit: visit.time)
    return LaboratoryLife(tuple(fleet), tuple(living), tuple(visits), seed)
