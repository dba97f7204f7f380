"""Gyros that age: the truth of an individual as a function of time and of its starts.

    truth(time, start) = at birth + drift·time + ageing + every jump up to that time + scatter of the start

with each ageing = change·(1 − exp(−time/T)).

Time is in seconds since the history's beginning; starts are numbered power-ups.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

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
class Ageing:
    """Some parameters settle exponentially by `changes`, with a time constant, s."""

    time_constant: float
    changes: Mapping[str, float]

    def until(self, time: float) -> dict[str, float]:
        """Change up to a time, s."""
        share = -np.expm1(-time / self.time_constant)
        return {name: float(change * share) for name, change in self.changes.items()}


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
    ageing
        What settles over the months.
    """

    serial: str
    kind: GyroType
    birth: Gyro
    seed: int
    drift: Mapping[str, float] = field(default_factory=dict)
    jumps: tuple[Jump, ...] = ()
    ageing: tuple[Ageing, ...] = ()

    def settled(self, time: float) -> Gyro:
        """Parameters at a time, s, without a start's scatter: what a history's trend should find."""
        gyro = self.birth.shifted({name: slope * time for name, slope in self.drift.items()})
        for settling in self.ageing:
            gyro = gyro.shifted(settling.until(time))
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


REPAIRED: Final = ("0419", 150 * DAY)
"""The gyro of the demonstration that is repaired, and when, s."""


def demonstration_fleet(seed: int) -> tuple[FleetGyro, ...]:
    """Six gyros of two types for a year, each with a story that a drift history should tell.

    0412 is steady, and checks the stand; 0417 drifts, its ωк towards a limit; 0419 is repaired
    (`REPAIRED`); 0423 jumps on day 210; D-031 ages exponentially; D-034 differs much from start to start.
    """
    dph = rad_per_s_from_deg_per_h
    restless = replace(DTG_4, start_scatter={name: 4 * u for name, u in DTG_4.start_scatter.items()})
    repair = Jump(REPAIRED[1], {"w0x": dph(0.3), "wg": dph(-0.2), "wk": dph(0.15)})
    jump = Jump(210 * DAY, {"wk": dph(0.6), "w0y": dph(-0.4)})
    fleet = (
        FleetGyro("0412", *_born(GVK_6, seed, 0)),
        FleetGyro(
            "0417", *_born(GVK_6, seed, 1),
            drift={"w0x": dph(0.6) / YEAR, "wg": dph(0.4) / YEAR, "wk": dph(0.25) / YEAR},
        ),
        FleetGyro(REPAIRED[0], *_born(GVK_6, seed, 2), jumps=(repair,)),
        FleetGyro("0423", *_born(GVK_6, seed, 3), jumps=(jump,)),
        FleetGyro("D-031", *_born(DTG_4, seed, 4), ageing=(Ageing(60 * DAY, {"w0y": dph(-1.5)}),)),
        FleetGyro("D-034", *_born(DTG_4, seed, 5)),
    )  # fmt: skip
    return (*fleet[:5], replace(fleet[5], kind=restless))


def _born(kind: GyroType, seed: int, number: int) -> tuple[GyroType, Gyro, int]:
    own = derived_seed(seed, Part.FLEET_SEED, number)
    return kind, draw_gyro(kind, own), own
