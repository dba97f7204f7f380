"""The ammeter's commands; currents in A on the wire.

========================= =====================================================================
``MEASure:CURRent?``      both currents now, each a mean of 0.1 s
``SENSe:RATE r``          samples per second
``ACQuire:COUNt n``       samples of an acquisition
``ACQuire:TAKE k``        which measurement at its place it is, from 0
``ACQuire:LABel n``       a number by which its user knows it
``INITiate``              begin to acquire where the stand is
``ACQuire:STATe?``        ``IDLE``, ``RUN`` or ``DONE``, label, samples there, 1 after an overload
``FETCh:BLOCk? i,n``      samples from i on, n at most, as a definite-length block
``ABORt``                 end the acquisition; what there is stays
========================= =====================================================================

A block's rows are four little-endian float64: index, time since the beginning in s, Jx, Jy. Rows may
be fetched while the acquisition runs, and more than once; beyond what is there the block is empty.
Settings have queries. INITiate is refused while the stand moves or stands between its positions; a
movement during an acquisition shows as an overload to its end.

STATus:OPERation: 16 acquiring. STATus:QUEStionable: 2 overload in the last acquisition or reading.
"""

from collections.abc import Sequence
from typing import Final

from simdevice.laboratory import Laboratory
from simdevice.scpi.errors import ScpiError
from simdevice.scpi.instrument import HangUp, block
from simdevice.scpi.tree import Command, Real, Whole

_ACQUIRING, _OVERLOAD = 16, 2
_MOST_SAMPLES: Final = 1_000_000
_LARGEST_LABEL: Final = 2**53


class AmmeterDevice:
    """The ammeter as an instrument (`simdevice.scpi.instrument.Device`)."""

    def __init__(self, laboratory: Laboratory, identity: str) -> None:
        self._laboratory = laboratory
        self.identity = identity
        self._last_reading_over = False
        self._take_defaults()

    @property
    def commands(self) -> Sequence[Command]:
        """As the module says."""
        return [
            Command("MEASure:CURRent?", self._read),
            *self._setting("SENSe:RATE", "_rate", Real(1.0, 20_000.0, "HZ")),
            *self._setting("ACQuire:COUNt", "_count", Whole(1, _MOST_SAMPLES)),
            *self._setting("ACQuire:TAKE", "_take", Whole(0, 2**31)),
            *self._setting("ACQuire:LABel", "_label", Whole(0, _LARGEST_LABEL)),
            Command("INITiate", self._initiate),
            Command("ACQuire:STATe?", self._state),
            Command("FETCh:BLOCk?", self._fetch, [Whole(0, _MOST_SAMPLES), Whole(1, _MOST_SAMPLES)]),
        ]

    def pending(self) -> float:
        """Seconds of wall clock to the end of an acquisition."""
        acquisition, clock = self._laboratory.acquisition, self._laboratory.clock
        if acquisition is None or not acquisition.running(now := clock.now()):
            return 0.0
        return clock.wall_seconds(acquisition.end - now)

    def operation(self) -> int:
        """See the module."""
        return _ACQUIRING * (self.pending() > 0)

    def questionable(self) -> int:
        """See the module."""
        return _OVERLOAD * (self._last_reading_over or self._overload())

    def reset(self) -> None:
        """Forget the acquisition; settings as at power-on."""
        self._laboratory.acquisition = None
        self._last_reading_over = False
        self._take_defaults()

    def abort(self) -> None:
        """End the acquisition; what there is stays."""
        if self._laboratory.acquisition is not None:
            self._laboratory.acquisition.stop(self._laboratory.clock.now())

    def _take_defaults(self) -> None:
        bench = self._laboratory.bench
        self._rate, self._count, self._take, self._label = bench.rate, bench.samples, 0, 0

    def _setting(self, header: str, name: str, kind: Real | Whole) -> tuple[Command, Command]:
        def write(value: float) -> None:
            setattr(self, name, value)

        def read() -> str:
            return f"{getattr(self, name):.16g}"

        return Command(header, write, [kind]), Command(header + "?", read)

    def _read(self) -> str:
        currents = self._laboratory.currents()
        self._last_reading_over = self._laboratory.at_limit(currents)
        return ",".join(f"{current:.9E}" for current in currents)

    def _initiate(self) -> None:
        if self.pending() > 0:
            raise ScpiError(-213, "an acquisition runs: ABORt it first")
        try:
            self._laboratory.acquire(self._label, self._take, self._count, self._rate)
        except ValueError as error:
            raise ScpiError(-221, str(error)) from None

    def _state(self) -> str:
        acquisition, now = self._laboratory.acquisition, self._laboratory.clock.now()
        if acquisition is None:
            return "IDLE,0,0,0"
        state = "RUN" if acquisition.running(now) else "DONE"
        return f"{state},{acquisition.label},{acquisition.available(now)},{acquisition.overloaded(now):d}"

    def _overload(self) -> bool:
        acquisition = self._laboratory.acquisition
        return acquisition is not None and acquisition.overloaded(self._laboratory.clock.now())

    def _fetch(self, first: int, most: int) -> bytes:
        acquisition = self._laboratory.acquisition
        if acquisition is None:
            raise ScpiError(-230, "nothing was acquired: INITiate first")
        last = min(first + most, acquisition.available(self._laboratory.clock.now()))
        answer = block(acquisition.rows[first:last].astype("<f8").tobytes())
        if first < last and self._laboratory.connection_breaks():
            raise HangUp(answer[: len(answer) // 2])
        return answer
