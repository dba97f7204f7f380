"""`session.json`: what a session's folder says about itself."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from app.exchange.archive import is_safe
from app.exchange.fields import instant
from app.exchange.json_text import Reader, load_object
from app.exchange.problems import Problems
from app.exchange.rows import Facts
from solver.errors import Message

FILE_NAME: Final = "session.json"
_KNOWN: Final = ("gyro", "stand", "latitude_deg", "certificate", "started_at", "temperature_c", "positions")
_ABSOLUTE_ZERO_C: Final = -273.15


@dataclass(frozen=True, slots=True)
class Entry:
    """One record file that `session.json` lists; None where it leaves the position to the file."""

    file: str
    theta_deg: float | None
    psi_deg: float | None
    repeat: int | None
    pointer: str


def read_session_json(data: bytes, filename: str = FILE_NAME) -> tuple[Facts, list[Entry]]:
    """Read and check `session.json`.

    Returns
    -------
    facts
        Keys of other programs are kept in `Facts.further`.
    entries
        The files listed, in their order.

    Raises
    ------
    Invalid
        With every problem, each under the JSON pointer of its value as the column.
    """
    content = load_object(data, filename)
    problems = Problems(filename)
    reader = Reader(content, problems)
    facts = Facts(
        gyro=reader.text("gyro"),
        stand=reader.text("stand"),
        latitude_deg=reader.number("latitude_deg", -90.0, 90.0),
        certificate=reader.text("certificate"),
        started_at=_instant(reader, "started_at"),
        temperature_c=reader.number("temperature_c", _ABSOLUTE_ZERO_C, 1000.0),
        further={key: value for key, value in content.items() if key not in _KNOWN} or None,
    )
    entries = _entries(content.get("positions"), reader, problems)
    problems.raise_if_any()
    return facts, entries


def _instant(reader: Reader, key: str) -> datetime | None:
    text = reader.text(key)
    value = instant(text) if text is not None else None
    if isinstance(value, Message):
        reader.wrong(key, value)
        return None
    return value


def _entries(listed: Any, reader: Reader, problems: Problems) -> list[Entry]:
    if listed is None:
        return []
    if not isinstance(listed, list) or not all(isinstance(item, dict) for item in listed):
        message = Message(
            "not-a-list",
            'This must be a list of objects, each with its file: [{"file": "theta000_psi000.csv"}, …].',
        )
        reader.wrong("positions", message)
        return []
    entries = [_entry(item, f"/positions/{place}", problems) for place, item in enumerate(listed)]
    return [entry for entry in entries if entry]


def _entry(item: dict[str, Any], pointer: str, problems: Problems) -> Entry | None:
    reader = Reader(item, problems, pointer)
    file = reader.text("file")
    theta_deg, psi_deg = reader.number("theta_deg"), reader.number("psi_deg")
    if ("theta_deg" in item) != ("psi_deg" in item):
        missing = "psi_deg" if "theta_deg" in item else "theta_deg"
        message = Message(
            "missing-value", "A position needs both theta_deg and psi_deg. Add the other, or leave both out."
        )
        reader.wrong(missing, message)
    if item.get("file") is None:
        reader.wrong("file", Message("missing-value", "No file is named here. Name the record's file."))
    elif file is not None and not is_safe(file):
        message = Message(
            "unsafe-name",
            "The file must lie in the session's folder. Name it without “..” and without a leading slash.",
        )
        reader.wrong("file", message)
    return Entry(file, theta_deg, psi_deg, reader.count("repeat"), pointer) if file else None
