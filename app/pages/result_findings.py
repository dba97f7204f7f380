"""What an examination found, as a result's page shows it: blunders with their places, what was not excluded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from app.exchange.json_values import message_from
from app.figures import degrees
from app.i18n import gettext, marked, translate
from app.services.views import MeasurementView
from solver.errors import Message

TITLES: Final = {
    "outlier": marked("one reading stands out"),
    "positions-swapped": marked("positions exchanged"),
    "position-wrong": marked("wrong position"),
    "angle-unit": marked("unit of the certified angles"),
    "channel-stuck": marked("a channel was stuck"),
    "channel-saturated": marked("a channel was saturated"),
    "warm-up": marked("begun in warm-up"),
    "channels-swapped": marked("channels exchanged"),
    "channel-sign": marked("sign of a channel"),
    "latitude-sign": marked("sign of the latitude"),
    "latitude-complement": marked("complement of the latitude"),
    "psi-reversed": marked("ψ counted the other way"),
    "theta-reversed": marked("θ counted the other way"),
    "current-unit": marked("unit of the currents"),
    "unexplained": marked("more scatter than stated"),
    "far-from-prior": marked("not the gyro expected"),
}
"""Findings in a few words, by code; pass through `gettext`."""

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class PlaceLink:
    """A position that a finding names; `href` leads to its samples, empty where nothing was measured."""

    name: str
    href: str


@dataclass(frozen=True, slots=True)
class FindingRow:
    """One explanation."""

    title: str
    text: str
    advice: str
    places: Sequence[PlaceLink]


def findings(answer: Json, inputs: Sequence[MeasurementView]) -> list[FindingRow]:
    """What went wrong, best explanation first."""
    measured = {(item.theta_deg, item.psi_deg, item.repeat): item.id for item in inputs}
    return [_finding(item, measured) for item in answer.get("diagnosis") or ()]


def not_excluded(answer: Json) -> list[str]:
    """What this fit cannot show, in sentences."""
    return [translate(_in_words(message_from(item))) for item in answer.get("not_excluded") or ()]


def _in_words(message: Message) -> Message:
    """A message whose kinds of blunders are named by their titles, not by their codes."""
    kinds = message.values.get("kinds")
    if not isinstance(kinds, str):
        return message
    words = [gettext(TITLES[code]) if code in TITLES else code for code in kinds.split(", ")]
    return replace(message, values={**message.values, "kinds": ", ".join(words)})


def _finding(item: Json, measured: Mapping[tuple[float, float, int], int]) -> FindingRow:
    advice, code = item.get("advice"), item["code"]
    return FindingRow(
        title=gettext(TITLES[code]) if code in TITLES else code,
        text=translate(message_from(item)),
        advice=translate(message_from(advice)) if advice else "",
        places=[_place(place, measured) for place in item["positions"]],
    )


def _place(place: Sequence[float], measured: Mapping[tuple[float, float, int], int]) -> PlaceLink:
    theta, psi, *repeat = place
    number = measured.get((theta, psi, int(repeat[0]) if repeat else 0))
    name = f"θ {degrees(theta)} ψ {degrees(psi)}"
    return PlaceLink(name, f"/measurements/{number}" if number else "")
