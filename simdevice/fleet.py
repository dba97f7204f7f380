"""Gyros that age: the truth of an individual as a function of time and of its starts.

    truth(time, start) = at birth + drift·time + every jump up to that time + scatter of the start

Time is in seconds since the history's beginning; starts are numbered power-ups.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from simdevice.ammeter import Ammeter
from simdevice.bench import Bench
from simdevice.gyro import Gyro
from simdevice.scenarios import DTG_4, GVK_6, LABORATORY_AMMETER, GyroType, draw_gyro, scatter
from simdevice.stand import Stand
from simdevice.streams import Part, derived_seed, stream
from solver.units import rad_per_s_from_deg_per_h

DAY: Final = 86400.0
"""s."""
YEAR: Final = 365.0 * DAY
"""s."""


@dataclass(frozen=True, slots=True)
class Jump:
    """A step of some parameters at a moment, s, for good."""

    time: float
    changes: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class FleetGyro:
    """One gyro of a laboratory, with its whole life.

    Attributes
    ----------
    serial, kind
        Which gyro, of which type.
    birth
        Parameters at time 0, without a start's scatter.
    seed
        Of its starts and of its sessions' noise.
    drift
        Linear change, by parameter, SI per second.
    jumps
        Steps.
    """

    serial: str
    kind: GyroType
    birth: Gyro
    seed: int
    drift: Mapping[str, float] = field(default_factory=dict)
    jumps: tuple[Jump, ...] = ()

    def settled(self, time: float) -> Gyro:
        """Parameters at a time, s, without a start's scatter: what a history's trend should find."""
        gyro = self.birth.shifted({name: slope * time for name, slope in self.drift.items()})
        for jump in self.jumps:
            if jump.time <= time:
                gyro = gyro.shifted(jump.changes)
        return gyro

    def truth(self, time: float, start: int) -> Gyro:
        """Parameters at a time, s, in a numbered start (from 0): what a session measures."""
        return self.settled(time).shifted(
            scatter(stream(self.seed, Part.START, start), self.kind.start_scatter)
        )

    def bench(
        self,
        stand: Stand,
        time: float,
        start: int,
        session: int,
        ammeter: Ammeter = LABORATORY_AMMETER,
    ) -> Bench:
        """The bench of one session of this gyro; `session`, a number, gives it noise of its own."""
        return Bench(
            self.truth(time, start),
            stand,
            ammeter,
            self.kind.noise,
            seed=derived_seed(self.seed, Part.SESSION_SEED, session),
            start=start,
        )


def demonstration_fleet(seed: int) -> tuple[FleetGyro, ...]:
    """Six gyros of two types for a year: 0417 drifts, 0423 jumps on day 210, the others are steady."""
    dph = rad_per_s_from_deg_per_h
    lives: tuple[tuple[str, GyroType, dict[str, float], tuple[Jump, ...]], ...] = (
        ("0412", GVK_6, {}, ()),
        ("0417", GVK_6, {"w0x": dph(0.6) / YEAR, "wg": dph(0.4) / YEAR}, ()),
        ("0419", GVK_6, {}, ()),
        ("0423", GVK_6, {}, (Jump(210 * DAY, {"wk": dph(0.5), "w0y": dph(-0.4)}),)),
        ("D-031", DTG_4, {}, ()),
        ("D-034", DTG_4, {}, ()),
    )
    fleet = []
    for number, (serial, kind, drift, jumps) in enumerate(lives):
        own = derived_seed(seed, Part.FLEET_SEED, number)
        fleet.append(FleetGyro(serial, kind, draw_gyro(kind, own), own, drift, jumps))
    return tuple(fleet)
