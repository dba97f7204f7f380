"""A command carried out: its exchanges in one go, then the instrument's own list of errors read."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from app.errors import problem
from app.station.contracts import Array, InstrumentFault, InstrumentLost
from app.station.instruments.exchanges import Columns, Command, Exchange, NotUnderstood, Value
from app.station.instruments.visa import Connection, Instrument, Unanswered

_MOST_ERRORS: Final = 50
_SHOWN: Final = 120


@dataclass(frozen=True, slots=True)
class Errors:
    """How an instrument tells its errors.

    Attributes
    ----------
    ask
        Answers `code` or `text` or both, one error at a time, the oldest first.
    none
        Matches the `code` (the `text` where there is no code) that says that there is none.
    """

    ask: Exchange
    none: re.Pattern[str]


@dataclass(frozen=True, slots=True)
class Answers:
    """Values of a command's answers by name: single ones, and columns (n,)."""

    values: dict[str, Value] = field(default_factory=dict)
    columns: dict[str, Array] = field(default_factory=dict)

    def number(self, name: str) -> float:
        """A value that is a number, whichever way the instrument tells it."""
        if name in self.columns:
            return float(self.columns[name][0])
        value = self.values[name]
        assert isinstance(value, int | float)
        return float(value)

    def flag(self, name: str) -> bool:
        """A value that is a flag."""
        return self.values[name] is True

    def count(self, name: str) -> int | None:
        """A value that counts, or None when the instrument keeps none."""
        value = self.values.get(name)
        return value if isinstance(value, int) else None


class Dialogue:
    """Speaks with one instrument as its description says; several threads may use it.

    Every new connection begins with the question who is there: behind an address may stand another
    instrument than an hour ago.

    Parameters
    ----------
    connection
        How it is reached.
    identify
        Asks who it is; gives `identity`.
    identity
        What matches the whole answer.
    errors
        How it tells errors; None when it cannot.
    """

    def __init__(
        self, connection: Connection, identify: Command, identity: re.Pattern[str], errors: Errors | None
    ) -> None:
        self._instrument = Instrument(connection)
        self._identify = identify
        self._identity = identity
        self._errors = errors
        self.lock = self._instrument.lock

    def identify(self) -> str:
        """Who it says it is.

        Raises
        ------
        InstrumentFault
            When that is not who the description names.
        InstrumentLost
            When it does not answer.
        """
        with self.lock:
            return self._introduced() if self._instrument.closed else self._asked_identity()

    def perform(self, command: Command, values: Mapping[str, float] | None = None) -> Answers:
        """Carry out a command and read the instrument's errors.

        Raises
        ------
        InstrumentFault
            When the instrument reports an error, or answers what is not understood.
        InstrumentLost
            When the connection broke or nothing was answered.
        """
        with self.lock:
            answers = self.ask(command, values)
            errors = self.reported()
            if errors:
                raise self.fault(errors, command.exchanges[-1].text(values or {}))
            return answers

    def ask(self, command: Command, values: Mapping[str, float] | None = None) -> Answers:
        """Carry out a command and leave the instrument's errors unread; raises as `perform` otherwise."""
        with self.lock:
            if self._instrument.closed:
                self._introduced()
            return self._exchanged(command, values or {})

    def reported(self) -> list[str]:
        """Errors that the instrument reports now, the oldest first; it forgets them on being asked."""
        found: list[str] = []
        if self._errors is None:
            return found
        with self.lock:
            while len(found) < _MOST_ERRORS:
                answers = Answers()
                self._exchange(self._errors.ask, {}, answers)
                words = [str(answers.values[name]) for name in ("code", "text") if name in answers.values]
                if self._errors.none.fullmatch(words[0]):
                    break
                found.append(" ".join(words))
        return found

    def fault(self, errors: list[str], text: str) -> InstrumentFault:
        """What to raise for errors that the instrument reports after `text` was sent."""
        return InstrumentFault(
            problem(
                "instrument-error",
                "[%(name)s] reports after %(sent)s: %(errors)s. See the instrument's manual.",
                sent=text,
                errors="; ".join(errors),
                **self._place,
            )
        )

    def close(self) -> None:
        """Close the connection; the next command opens another."""
        self._instrument.close()

    def _introduced(self) -> str:
        self._instrument.open()
        try:
            return self._asked_identity()
        except InstrumentFault:
            self.close()
            raise

    def _asked_identity(self) -> str:
        identity = str(self._exchanged(self._identify, {}).values["identity"])
        if not self._identity.fullmatch(identity):
            raise InstrumentFault(
                problem(
                    "instrument-other",
                    "[%(name)s] at %(address)s says that it is “%(identity)s”, where “%(expected)s” is expected. "
                    "Connect the right instrument, or correct its address or identity in the station's file.",
                    identity=identity[:_SHOWN],
                    expected=self._identity.pattern,
                    **self._place,
                )
            )
        return identity

    def _exchanged(self, command: Command, values: Mapping[str, float]) -> Answers:
        answers = Answers(values=dict(command.assumed))
        for exchange in command.exchanges:
            try:
                self._exchange(exchange, values, answers)
            except Unanswered as silence:
                raise self._why_silent(exchange.text(values), silence) from silence
        return answers

    def _exchange(self, exchange: Exchange, values: Mapping[str, float], answers: Answers) -> None:
        text, answer = exchange.text(values), exchange.answer
        try:
            if answer is None:
                self._instrument.write(text)
            elif not isinstance(answer, Columns):
                answers.values.update(answer.values(self._instrument.ask(text)))
            elif answer.element is None:
                answers.columns.update(answer.of_text(self._instrument.ask(text)))
            else:
                answers.columns.update(answer.of_block(self._instrument.ask_block(text)))
        except NotUnderstood as error:
            # What comes next could be the rest of this answer.
            self.close()
            raise InstrumentFault(
                problem(
                    "instrument-unclear",
                    "[%(name)s] at %(address)s answered %(sent)s by “%(got)s”, which does not fit the answer in "
                    "the station's file. Correct the description, or check the instrument.",
                    sent=text,
                    got=str(error)[:_SHOWN],
                    **self._place,
                )
            ) from error

    def _why_silent(self, text: str, silence: Unanswered) -> InstrumentFault | InstrumentLost:
        """An instrument that refuses a question answers nothing to it, but tells why when it is asked."""
        try:
            errors = self.reported()
        except (InstrumentFault, InstrumentLost):
            errors = []
        self.close()
        return self.fault(errors, text) if errors else silence

    @property
    def _place(self) -> dict[str, Any]:
        connection = self._instrument.connection
        return {"name": connection.name, "address": connection.address}
