"""Errors by their SCPI numbers (SCPI 1999.0, volume 2, chapter 21.8).

The number's hundred is its class, and the class has its bit in the standard event status register:
−1xx command, −2xx execution, −3xx and positive device-dependent, −4xx query.
"""

from typing import Final

_TEXTS: Final = {
    0: "No error",
    -100: "Command error",
    -101: "Invalid character",
    -102: "Syntax error",
    -103: "Invalid separator",
    -104: "Data type error",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -110: "Command header error",
    -112: "Program mnemonic too long",
    -113: "Undefined header",
    -120: "Numeric data error",
    -121: "Invalid character in number",
    -123: "Exponent too large",
    -124: "Too many digits",
    -128: "Numeric data not allowed",
    -131: "Invalid suffix",
    -138: "Suffix not allowed",
    -141: "Invalid character data",
    -144: "Character data too long",
    -148: "Character data not allowed",
    -151: "Invalid string data",
    -158: "String data not allowed",
    -161: "Invalid block data",
    -168: "Block data not allowed",
    -178: "Expression data not allowed",
    -200: "Execution error",
    -213: "Init ignored",
    -221: "Settings conflict",
    -222: "Data out of range",
    -224: "Illegal parameter value",
    -230: "Data corrupt or stale",
    -310: "System error",
    -350: "Queue overflow",
    -363: "Input buffer overrun",
    -440: "Query UNTERMINATED after indefinite response",
}
_LONGEST: Final = 255
"""Characters of a description with its device-dependent part."""


class ScpiError(Exception):
    """What goes into the error queue.

    Parameters
    ----------
    number
        A standard number, or a positive one with a `text` of the device's own.
    detail
        What, where and what to do; follows the standard text after a semicolon.
    text
        Of a device-dependent error.
    """

    def __init__(self, number: int, detail: str = "", text: str = "") -> None:
        self.number = number
        self.text = text or _TEXTS[number]
        self.detail = detail
        super().__init__(str(self))

    def __str__(self) -> str:
        said = (f"{self.text};{self.detail}" if self.detail else self.text)[:_LONGEST]
        quoted = said.encode("ascii", "replace").decode().replace('"', '""')
        return f'{self.number},"{quoted}"'

    @property
    def is_command_error(self) -> bool:
        """Whether the message was not understood, so that what follows in it is not executed."""
        return -200 < self.number <= -100

    @property
    def event_bit(self) -> int:
        """Bit of the standard event status register: QYE 4, DDE 8, EXE 16, CME 32."""
        if self.number > 0:
            return 8
        return {1: 32, 2: 16, 3: 8, 4: 4}[-self.number // 100]


NO_ERROR: Final = ScpiError(0)
