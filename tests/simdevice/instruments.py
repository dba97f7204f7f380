"""Both simulated instruments on a clock that the test sets, and what they are told and answer."""

from dataclasses import replace

import numpy as np

from simdevice.ammeter_device import AmmeterDevice
from simdevice.clock import Clock
from simdevice.faults import parse
from simdevice.laboratory import Laboratory
from simdevice.scenarios import scenario
from simdevice.scpi.instrument import Instrument
from simdevice.stand_device import StandDevice


class Hands:
    """A clock's hands: they move when they are told."""

    def __init__(self) -> None:
        self.at = 0.0

    def read(self) -> float:
        return self.at


def told(instrument: Instrument, message: str) -> str:
    """The answer to one message of an instrument that need not be waited for."""
    return told_raw(instrument, message).decode("ascii").removesuffix("\n")


def told_raw(instrument: Instrument, message: str) -> bytes:
    steps = instrument.respond(message.encode("ascii"))
    try:
        pause = next(steps)
    except StopIteration as end:
        return end.value
    raise AssertionError(f"{message} would wait {pause} s")


class Bench:
    """Stand and ammeter of a laboratory whose time the test moves."""

    def __init__(self, name="gvk-6", seed=7, faults=(), **changes) -> None:
        self.hands = Hands()
        self.bench = replace(scenario(name).bench(seed), **changes)
        clock = Clock(0.0, wall=self.hands.read, steady=self.hands.read)
        self.laboratory = Laboratory(self.bench, clock, [parse(text) for text in faults])
        self.stand = Instrument(StandDevice(self.laboratory, "Driftbook,SIM-STAND,7,1.0"))
        self.ammeter = Instrument(AmmeterDevice(self.laboratory, "Driftbook,SIM-AMMETER,7,1.0"))

    def wait(self, seconds: float) -> None:
        self.hands.at += seconds

    def moved(self, theta_deg: float, psi_deg: float) -> None:
        """Home if need be, and go there."""
        if told(self.stand, "AXIS:REF?") == "0":
            told(self.stand, "AXIS:HOME")
            self.wait(60)
        told(self.stand, f"AXIS:POS {theta_deg},{psi_deg}")
        self.wait(60)

    def acquired(self, count: int, take: int = 0) -> np.ndarray:
        """Acquire where the stand is, and fetch all there is."""
        assert told(self.ammeter, f"ACQ:COUN {count};TAKE {take};:INIT;:SYST:ERR?") == '0,"No error"'
        self.wait(count / self.bench.rate)
        return rows(told_raw(self.ammeter, f"FETC:BLOC? 0,{count}"))


def rows(answer: bytes) -> np.ndarray:
    """Rows of a definite-length block with its line feed: (n, 4)."""
    digits = int(answer[1:2])
    length = int(answer[2 : 2 + digits])
    contents = answer[2 + digits :]
    assert answer[:1] == b"#"
    assert contents[length:] == b"\n"
    return np.frombuffer(contents[:length], "<f8").reshape(-1, 4)
