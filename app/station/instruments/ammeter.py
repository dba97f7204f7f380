"""The driver of any two-channel ammeter that a station's file describes."""

import numpy as np

from app.errors import problem
from app.station.contracts import Acquisition, Array, Block, Currents, InstrumentFault
from app.station.instruments.description import AmmeterDescription
from app.station.instruments.dialogue import Dialogue


class DescribedAmmeter:
    """An ammeter behind a dialogue; implements `app.station.contracts.Ammeter`."""

    def __init__(self, description: AmmeterDescription) -> None:
        self._description = description
        self._dialogue = Dialogue(
            description.connection, description.identify, description.identity, description.errors
        )
        self._rate_hz: float | None = None

    def identify(self) -> str:
        """Who it says it is; raises `InstrumentFault` when that is not who the description names."""
        return self._dialogue.identify()

    def reading(self) -> Currents:
        """Both currents now, mA."""
        answers = self._dialogue.perform(self._description.reading)
        return Currents(answers.number("jx"), answers.number("jy"))

    def start(self, label: int, take: int, samples: int, rate_hz: float) -> None:
        """Begin to acquire `samples` at `rate_hz`. `take` counts the measurements at this place."""
        values = {
            "label": label,
            "take": take,
            "samples": samples,
            "rate_hz": rate_hz,
            "interval_s": 1.0 / rate_hz,
            "duration_s": samples / rate_hz,
        }
        with self._dialogue.lock:
            self._rate_hz = rate_hz
            self._dialogue.perform(self._description.start, values)

    def status(self) -> Acquisition:
        """How the acquisition stands; raises `InstrumentFault` for an error that it reports."""
        answers = self._dialogue.perform(self._description.status)
        return Acquisition(
            label=answers.count("label"),
            running=answers.flag("running"),
            samples=answers.count("samples") or 0,
            overload=answers.flag("overload"),
        )

    def fetch(self, first: int, most: int) -> Block:
        """Samples from `first` on, `most` at most.

        Raises
        ------
        InstrumentFault
            When the answer is not these samples, or nothing tells their times.
        """
        if most < 1:
            return Block(first, np.empty(0), np.empty(0), np.empty(0))
        values = {
            "first": first,
            "most": most,
            "last": first + most - 1,
            "first_from_one": first + 1,
            "last_from_one": first + most,
        }
        with self._dialogue.lock:
            columns = self._dialogue.perform(self._description.fetch, values).columns
        length = self._checked_length(columns, first, most)
        t_s = columns["t"] if "t" in columns else self._times(first, length)
        return Block(first, t_s, columns["jx"], columns["jy"])

    def stop(self) -> None:
        """Stop acquiring; what was acquired can still be fetched."""
        self._dialogue.perform(self._description.stop)

    def close(self) -> None:
        """Close the connection; the next command opens another."""
        self._dialogue.close()

    def _checked_length(self, columns: dict[str, Array], first: int, most: int) -> int:
        lengths = {len(column) for column in columns.values()}
        length = max(lengths)
        numbers = columns.get("index")
        numbered = numbers is None or np.array_equal(numbers, np.arange(first, first + length))
        if len(lengths) == 1 and length <= most and numbered:
            return length
        raise InstrumentFault(
            problem(
                "instrument-samples",
                "[%(name)s] was asked for %(most)d samples from number %(first)d and sent others. Check the "
                "command “fetch” in the station's file.",
                name=self._description.connection.name,
                first=first,
                most=most,
            )
        )

    def _times(self, first: int, length: int) -> Array:
        """Times of an ammeter that tells none: by the rate that this program asked for."""
        if self._rate_hz is None:
            raise InstrumentFault(
                problem(
                    "instrument-no-time",
                    "[%(name)s] does not tell the time of its samples, and they were begun before this program "
                    "was. Acquire anew.",
                    name=self._description.connection.name,
                )
            )
        return np.arange(first, first + length) / self._rate_hz
