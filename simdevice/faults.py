"""Faults on request: what goes wrong with a record or with the stand, and where.

A fault is written ``KIND[@THETA/PSI][!]``, angles in degrees: ``stuck-x@90/180`` hits the first
take of that place, ``saturation@0/90!`` every take, ``spike`` one place drawn from the seed. A
take is `Position.repeat`: 0 is the first measurement of a place.

What a fault does to a record is a pure function of the record, and where in the record it strikes
is drawn from a stream of the fault's kind, place and take.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simdevice.ammeter import Ammeter
from simdevice.certificate import Certificate, Position
from simdevice.streams import Part, stream
from solver.units import deg_from_rad, rad_from_deg

Array = NDArray[np.float64]


class Kind(StrEnum):
    """What goes wrong."""

    DROPPED = "dropped"
    """Samples are missing: a gap in the record's times."""
    STUCK_X = "stuck-x"
    """From some sample on the x channel repeats one reading."""
    STUCK_Y = "stuck-y"
    """The same of the y channel."""
    SPIKE = "spike"
    """One reading of one channel is far off."""
    SATURATION = "saturation"
    """One channel is at its limit for part of the record."""
    WRONG_POSITION = "wrong-position"
    """The stand says it is there and stands 90° further about ψ."""
    INTERRUPTED = "interrupted"
    """The record ends early."""
    STALL = "stall"
    """The stand stops on its way."""
    LOST_REFERENCE = "lost-reference"
    """The stand no longer knows its zero and must be homed."""
    EMERGENCY_STOP = "emergency-stop"
    """Somebody presses the stand's emergency stop."""


OF_RECORD: Final = (
    Kind.DROPPED, Kind.STUCK_X, Kind.STUCK_Y, Kind.SPIKE, Kind.SATURATION, Kind.WRONG_POSITION, Kind.INTERRUPTED,
)  # fmt: skip
"""Kinds that a record of currents can have."""
OF_STAND: Final = (Kind.STALL, Kind.WRONG_POSITION, Kind.LOST_REFERENCE, Kind.EMERGENCY_STOP)
"""Kinds that the stand can have."""

# Keys of random streams, so part of every record with a fault: never renumber.
_NUMBERS: Final = {
    Kind.DROPPED: 1, Kind.STUCK_X: 2, Kind.STUCK_Y: 3, Kind.SPIKE: 4, Kind.SATURATION: 5,
    Kind.WRONG_POSITION: 6, Kind.INTERRUPTED: 7, Kind.STALL: 8, Kind.LOST_REFERENCE: 9,
    Kind.EMERGENCY_STOP: 10,
}  # fmt: skip

LEAST_SAMPLES: Final = 20
"""A record shorter than this has no room for a fault with a before and an after."""
WRONG_BY: Final = np.pi / 2
"""How much further about ψ a wrong position stands, rad."""

_FORM: Final = re.compile(r"(?P<kind>[^@!]+)(?:@(?P<theta>[^/@!]+)/(?P<psi>[^/@!]+))?(?P<every>!)?")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault.

    Attributes
    ----------
    kind
        What goes wrong.
    theta, psi
        Where, rad; None for a place that the seed draws (`located`).
    every
        Whether it hits every take, or the first alone, so that measuring again repairs it.
    """

    kind: Kind
    theta: float | None = None
    psi: float | None = None
    every: bool = False

    def __post_init__(self) -> None:
        if (self.theta is None) != (self.psi is None):
            raise ValueError("A fault's place needs both θ and ψ, or neither.")

    @property
    def position(self) -> Position | None:
        """First take of the place; None where no place is said."""
        return None if self.theta is None or self.psi is None else Position(self.theta, self.psi)

    def hits(self, position: Position) -> bool:
        """Whether it strikes this take of this place; one without a place strikes nowhere."""
        place = self.position
        return place is not None and place.place == position.place and (self.every or position.repeat == 0)

    def __str__(self) -> str:
        place = self.position
        where = "" if place is None else f"@{_degrees(place.theta)}/{_degrees(place.psi)}"
        return f"{self.kind}{where}{'!' if self.every else ''}"


def parse(text: str, kinds: Sequence[Kind] = tuple(Kind)) -> Fault:
    """Read ``KIND[@THETA/PSI][!]``, angles in degrees; `str` of the result is the text again.

    Parameters
    ----------
    text
        As a person writes it.
    kinds
        What is allowed here.

    Raises
    ------
    ValueError
        Names the form, or the kinds that there are.
    """
    found = _FORM.fullmatch(text.strip())
    if not found:
        raise ValueError(f"“{text}” is no fault; write KIND@THETA/PSI or KIND alone, such as spike@90/180.")
    name = found["kind"].strip()
    if name not in {kind.value for kind in kinds}:
        raise ValueError(f"There is no fault {name} here. There are: {', '.join(kinds)}.")
    angles: list[float | None] = [None, None]
    if found["theta"] is not None:
        try:
            angles = [rad_from_deg(float(found[axis])) for axis in ("theta", "psi")]
        except ValueError:
            raise ValueError(f"“{text}”: write the place in degrees, such as {name}@90/180.") from None
        if not np.isfinite([angle for angle in angles if angle is not None]).all():
            raise ValueError(f"“{text}”: the place's angles must be finite numbers.")
    return Fault(Kind(name), angles[0], angles[1], every=found["every"] is not None)


def located(faults: Sequence[Fault], certificate: Certificate, seed: int) -> tuple[Fault, ...]:
    """The same faults, each with a place.

    A fault without one gets a place of the certificate that no fault before it has, as long as there
    is one; a wrong position gets one whose neighbour the certificate covers. A further fault at the
    end moves none before it.

    Raises
    ------
    ValueError
        When the certificate does not cover a place that is named, or where a wrong position stands.
    """
    positions = [
        Position(t, p) for t, p in zip(certificate.theta.tolist(), certificate.psi.tolist(), strict=True)
    ]
    taken: set[tuple[int, int]] = set()
    found: list[Fault] = []
    for fault in faults:
        if fault.position is None:
            free = [item for item in positions if _possible(fault.kind, item, certificate)]
            free = [item for item in free if item.place not in taken] or free
            if not free:
                raise ValueError("No place of the certificate has another one 90° further about ψ.")
            number = sum(other.kind is fault.kind for other in found)
            drawn = stream(seed, Part.FAULT_PLACE, _NUMBERS[fault.kind], number).integers(len(free))
            fault = replace(fault, theta=free[drawn].theta, psi=free[drawn].psi)
        place = fault.position
        assert place is not None
        certificate.row_of(place)
        if fault.kind is Kind.WRONG_POSITION:
            certificate.row_of(wrong(place))
        taken.add(place.place)
        found.append(fault)
    return tuple(found)


def wrong(position: Position) -> Position:
    """Where a stand that indexed to a wrong position stands."""
    return replace(position, psi=position.psi + WRONG_BY)


def _possible(kind: Kind, position: Position, certificate: Certificate) -> bool:
    return kind is not Kind.WRONG_POSITION or wrong(position).place in certificate.places


def _degrees(angle: float) -> str:
    return f"{round(deg_from_rad(angle), 9):.12g}"


def afflicted(
    samples: Array, kinds: Sequence[Kind], position: Position, seed: int, nominal: int, ammeter: Ammeter
) -> Array:
    """A record's samples with faults.

    Parameters
    ----------
    samples : (3, n) array
        Rows t, jx, jy of the beginning of a record; left as they are.
    kinds
        What strikes it; those that are no business of the samples are ignored.
    position, seed
        Draw where in the record, and how.
    nominal
        Samples of the whole record: what strikes does not depend on how much of it is asked for.
    ammeter
        What read it: limits and steps.

    Returns
    -------
    (3, m) array
        m ≤ n.
    """
    samples = samples.copy()
    kept = np.ones(samples.shape[1], dtype=np.bool_)
    for kind in sorted(set(kinds), key=_NUMBERS.__getitem__):
        draw = stream(seed, Part.FAULT, _NUMBERS[kind], *position.key)
        if kind is Kind.DROPPED:
            first = int(draw.uniform(0.2, 0.7) * nominal)
            kept[first : first + max(2, int(draw.uniform(0.01, 0.05) * nominal))] = False
        elif kind is Kind.INTERRUPTED:
            kept[int(draw.uniform(0.2, 0.8) * nominal) :] = False
        elif kind in (Kind.STUCK_X, Kind.STUCK_Y):
            _stick(samples[1 + (kind is Kind.STUCK_Y)], int(draw.uniform(0.1, 0.6) * nominal))
        elif kind is Kind.SPIKE:
            _spike(samples, draw, nominal, ammeter)
        elif kind is Kind.SATURATION:
            _saturate(samples, draw, nominal, ammeter)
    return samples[:, kept]


def _stick(readings: Array, first: int) -> None:
    readings[first:] = readings[first : first + 1]


def _spike(samples: Array, draw: np.random.Generator, nominal: int, ammeter: Ammeter) -> None:
    """One reading off by 5 to 20 times the largest reading of the first quarter, either way."""
    number = int(draw.integers(2))
    height = draw.uniform(5.0, 20.0) * draw.choice([-1.0, 1.0])
    first = int(draw.uniform(0.25, 0.9) * nominal)
    readings = samples[1 + number]
    size = float(np.abs(readings[: nominal // 4]).max(initial=0.0))
    if first < len(readings):
        readings[first] = ammeter.channels[number].shown(readings[first] + height * size)


def _saturate(samples: Array, draw: np.random.Generator, nominal: int, ammeter: Ammeter) -> None:
    """One channel at the limit that its readings are nearer to, for 10 to 30 % of the record."""
    number = int(draw.integers(2))
    first = int(draw.uniform(0.1, 0.6) * nominal)
    last = first + int(draw.uniform(0.1, 0.3) * nominal)
    readings = samples[1 + number]
    sign = -1.0 if readings[0] < 0 else 1.0
    readings[first:last] = sign * ammeter.channels[number].top


def refuse_impossible(faults: Sequence[Fault], samples: int, ammeter: Ammeter) -> None:
    """Refuse faults that records of this length, read by this ammeter, cannot have."""
    for fault in faults:
        if fault.kind not in OF_RECORD:
            raise ValueError(
                f"{fault}: this befalls the stand, not a record. Records: {', '.join(OF_RECORD)}."
            )
        if fault.kind is Kind.SATURATION and not np.isfinite([c.top for c in ammeter.channels]).all():
            raise ValueError(f"{fault}: this ammeter has no limit, so it cannot be at it.")
    if faults and samples < LEAST_SAMPLES:
        raise ValueError(f"A record of {samples} samples is too short for a fault: it needs {LEAST_SAMPLES}.")
