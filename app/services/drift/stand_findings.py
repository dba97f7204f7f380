"""A stand's findings as its document has them, and the alarms among them."""

from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta
from typing import Any, Final

import numpy as np

from app.exchange.json_values import Json, finite
from app.exchange.si import PARAMETER_UNITS, parameter_lab
from app.services.drift.alarms import Finding
from app.services.drift.series import SeriesTable, aware, iso
from app.services.drift.views import EventView, quantity
from solver.drift.stands import attribution
from solver.errors import Message
from solver.records import PARAMETERS
from solver.units import arcsec_from_rad

EXPLAINING: Final = frozenset({"moved", "adjustment", "repair"})
"""Events of a stand after which it may stand otherwise."""
LIKELY: Final = 0.05
"""A date of a change that is less probable does not count when its days are told."""


def described(
    table: SeriesTable, found: attribution.Finding, gyros: Sequence[str], happened: Sequence[EventView]
) -> Json:
    """One finding with its sessions and days; `gyros` by their labels."""
    likely = [session for session, chance in found.dates if chance >= LIKELY] or [found.session]
    since, until = _day(table, max(likely[0] - 1, 0)), _day(table, likely[-1])
    # An event is entered by its day: it may lie up to a day beside the session.
    spare = timedelta(days=1)
    event = next(
        (item for item in happened if item.kind in EXPLAINING and since - spare <= item.at <= until), None
    )
    known = np.isfinite(found.shift)
    return {
        "verdict": found.verdict, "direction": found.direction, **_session(table, found.session),
        "since": since.isoformat(), "until": until.isoformat(),
        "dates": [{**_session(table, session), "probability": chance} for session, chance in found.dates],
        "size_arcsec": _arcsec(found.size), "u_arcsec": _arcsec(found.u),
        "shift": {
            name: {
                "value": parameter_lab(name, float(found.shift[place])),
                "u": finite(parameter_lab(name, float(found.u_shift[place]))), "unit": PARAMETER_UNITS[name][0],
            }
            for place, name in enumerate(PARAMETERS)
            if known[place]
        },
        "probabilities": found.probability, "directions": found.directions,
        "probability": found.probability.get("nothing" if found.verdict == "none" else _owner(found.verdict), 0.0),
        "gyro": None if found.gyro is None else gyros[found.gyro],
        "event": event.id if event else None, "event_kind": event.kind if event else None,
    }  # fmt: skip


def _owner(verdict: str) -> str:
    return "stand" if verdict == "unclear" else verdict


def _session(table: SeriesTable, place: int) -> Json:
    return {
        "session": int(table["session"][place]), "calibration": int(table["calibration"][place]),
        "at": iso(table["measured_at"][place]),
    }  # fmt: skip


def _day(table: SeriesTable, place: int) -> datetime:
    return aware(table["measured_at"][place])


def _arcsec(angle: float) -> float | None:
    return finite(float(arcsec_from_rad(angle)))


def alarms(document: Json) -> Iterator[Finding]:
    """What a person has to be told of the stand: changes, also those that an event explains."""
    for item in document["findings"]:
        kind = _kind(item)
        if kind is None:
            continue
        sentence = _UNCLEAR if item["verdict"] == "unclear" else _SENTENCES[kind]
        values: dict[str, Any] = {
            "since": item["since"][:10],
            "day": item["until"][:10],
            "probability": _sure(item["probability"]),
            "size": quantity(item["size_arcsec"], item["u_arcsec"], change=True),
            "gyro": item["gyro"],
        }
        yield Finding(
            None, kind, item["calibration"], item["calibration"], item["since"], item["until"],
            sentence.template, values, explained=item["event"] is not None,
        )  # fmt: skip


def _sure(probability: float) -> str:
    """A probability that is near to one, as a sentence gives it."""
    return "> 0.999" if probability > 0.999 else f"{probability:.3f}"


def _kind(item: Json) -> str | None:
    if item["verdict"] == "stand":
        return f"stand-{item['direction']}"
    if item["verdict"] == "unclear":
        return "stand-level-east"
    return "stand-certificate" if item["verdict"] == "certificate" else None


_SENTENCES: Final = {
    "stand-azimuth": Message(
        "stand-azimuth", "The base turned by %(size)s″ about the vertical between %(since)s and "
        "%(day)s; probability %(probability)s."),
    "stand-level-north": Message(
        "stand-level-north", "The base tilted by %(size)s″ about north between %(since)s and "
        "%(day)s; probability %(probability)s."),
    "stand-level-east": Message(
        "stand-level-east", "The base tilted by %(size)s″ about east between %(since)s and "
        "%(day)s; probability %(probability)s."),
    "stand-certificate": Message(
        "stand-certificate", "At the new certificate of %(day)s all gyros changed together by more than the "
        "certificates state; probability %(probability)s."),
}  # fmt: skip
_UNCLEAR: Final = Message(
    "stand-or-gyro", "Between %(since)s and %(day)s the base tilted by %(size)s″ about east, or one "
    "gyro changed: the others do not tell. Measure another gyro."
)  # fmt: skip
