"""A device of nothing but settings, to see how any device is talked to."""

from simdevice.scpi.instrument import HangUp, Instrument, block
from simdevice.scpi.tree import Command, Real, Switch, Whole


class Lamp:
    """A lamp that takes `left` seconds to reach its brightness."""

    identity = "House,LAMP,1,1.0"

    def __init__(self) -> None:
        self.brightness, self.on, self.colour = 0.0, False, 1
        self.left = 0.0
        self.conditions = [0, 0]

    @property
    def commands(self):
        return [
            Command("LIGHt:BRIGhtness", self._set_brightness, [Real(0.0, 100.0, "LX")]),
            Command("LIGHt:BRIGhtness?", lambda: f"{self.brightness:g}"),
            Command("LIGHt[:SOURce]:STATe", lambda on: setattr(self, "on", on), [Switch()]),
            Command("LIGHt[:SOURce]:STATe?", lambda: str(int(self.on))),
            Command("LIGHt:MIX", self._mix, [Whole(1, 9), Real(0.0, 1.0)]),
            Command("LIGHt:COLour?", lambda: str(self.colour)),
            Command("DATA?", lambda: block(b"a;\n\x00\xff")),
            Command("BREak?", self._break),
            Command("FAIL", lambda: 1 / 0),
        ]

    def pending(self) -> float:
        return self.left

    def operation(self) -> int:
        return self.conditions[0]

    def questionable(self) -> int:
        return self.conditions[1]

    def reset(self) -> None:
        self.brightness, self.on = 0.0, False

    def abort(self) -> None:
        self.left = 0.0

    def _set_brightness(self, value: float) -> None:
        self.brightness = value

    def _mix(self, colour: int, share: float) -> None:
        self.colour = colour

    def _break(self) -> bytes:
        raise HangUp(b"#15ab")


class Talk:
    """An instrument around a lamp: what is sent, and what is answered."""

    def __init__(self) -> None:
        self.lamp = Lamp()
        self.instrument = Instrument(self.lamp)

    def __call__(self, message: str | bytes) -> str:
        """The answer to a message that need not be waited for."""
        raw = message if isinstance(message, bytes) else message.encode("latin-1")
        steps = self.instrument.respond(raw)
        try:
            pause = next(steps)
        except StopIteration as end:
            return end.value.decode("latin-1").removesuffix("\n")
        raise AssertionError(f"{message!r} would wait {pause} s")

    def errors(self) -> list[int]:
        """Numbers in the error queue, which is empty then."""
        found = []
        while (number := int(self("SYST:ERR?").split(",")[0])) != 0:
            found.append(number)
        return found
