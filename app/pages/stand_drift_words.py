"""A stand's findings in sentences: whose change it is, how much, when, how sure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from app.figures import day, decimals_of, figure, plain
from app.i18n import gettext, marked
from app.pages import drift_labels, drift_words, labels
from app.pages.labels import Mark
from app.services.drift.stand_reading import StandDrift
from app.services.views import COVERAGE_FACTOR

AXES: Final = {
    "azimuth": ("azimuth", marked("Azimuth of the base")),
    "level_north": ("level-north", marked("Level about north")),
    "level_east": ("level-east", marked("Level about east")),
}
"""By axis of the points the direction of a finding, and its name."""
_DIRECTIONS: Final = {
    "azimuth": marked("about the vertical"), "level-north": marked("about north"), "level-east": marked("about east"),
}  # fmt: skip
_MARKS: Final = {
    "stand": Mark("out", marked("The stand")), "certificate": Mark("out", marked("The certificate")),
    "gyro": Mark("attention", marked("A gyro")), "unclear": Mark("attention", marked("Not clear")),
    "none": Mark("ok", marked("Nothing")),
}  # fmt: skip
_WORST_FIRST: Final = ("stand", "certificate", "unclear", "gyro")
Entry = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Found:
    """One finding as it is printed."""

    entry: Entry
    mark: Mark
    sentence: str
    explained: str


def findings(drift: StandDrift) -> list[Found]:
    """What was found, the stand's first, of those alike the latest first; judged certificates at the end."""
    # At a new certificate each way of looking gives a finding; where nothing shows one of them says it.
    quiet = {item["session"]: item for item in entries(drift) if item["verdict"] == "none"}
    told = [item for item in entries(drift) if item["verdict"] != "none"]
    latest = sorted([*told, *quiet.values()], key=lambda item: item["at"], reverse=True)
    rank = {name: number for number, name in enumerate(_WORST_FIRST)}
    ordered = sorted(
        latest, key=lambda item: (item["event"] is not None, rank.get(item["verdict"], len(rank)))
    )
    return [
        Found(item, _mark(item["verdict"]), sentence(item, drift.stand), _explained(item)) for item in ordered
    ]


def entries(drift: StandDrift) -> Sequence[Entry]:
    """The findings of a stand's document; none before the first study."""
    return [] if drift.document is None else drift.document["findings"]


def _mark(verdict: str) -> Mark:
    return Mark(_MARKS[verdict].shape, gettext(_MARKS[verdict].word))


def verdict(drift: StandDrift, found: Sequence[Found]) -> Found | None:
    """The finding that the page opens with: the worst that no event explains; None when nothing changed."""
    return next((item for item in found if item.entry["verdict"] != "none" and not item.explained), None)


def sentence(item: Entry, stand: str) -> str:
    """What happened, how much, when, and how sure."""
    values = {
        "stand": stand, "gyro": item["gyro"], "between": between(item), "day": drift_words.day(item["at"]),
        "size": size(item), "direction": direction(item["direction"]), "what": _shifts(item),
        "probability": probability(item["probability"]),
    }  # fmt: skip
    if item["verdict"] == "stand":
        return (
            gettext(
                "Stand %(stand)s turned by %(size)s %(direction)s %(between)s; probability %(probability)s."
            )
            % values
        )
    if item["verdict"] == "unclear":
        return gettext(
            "Either stand %(stand)s tilted by %(size)s %(direction)s %(between)s, or gyro %(gyro)s changed: the other "
            "gyros do not tell. Measure another one."
        ) % (values | {"gyro": item["gyro"] or gettext("one of them")})  # fmt: skip
    if item["verdict"] == "gyro":
        return (
            gettext(
                "%(what)s of gyro %(gyro)s changed %(between)s, the stand did not; probability %(probability)s."
            )
            % values
        )
    if item["verdict"] == "certificate":
        return gettext(
            "At the new certificate of %(day)s all gyros changed together by more than the certificates state; "
            "probability %(probability)s."
        ) % values  # fmt: skip
    return (
        gettext(
            "At the new certificate of %(day)s nothing shows but what the certificates state; probability "
            "%(probability)s."
        )
        % values
    )


def between(item: Entry) -> str:
    """Between which days it happened."""
    since, until = (datetime.fromisoformat(item[name]) for name in ("since", "until"))
    return gettext("between %(since)s and %(until)s") % {"since": day(since), "until": day(until)}


def size(item: Entry) -> str:
    """Of a turn: ``+58″ ± 9″`` with the expanded uncertainty."""
    value, u = item["size_arcsec"], item["u_arcsec"]
    if value is None:
        return ""
    expanded = None if u is None else COVERAGE_FACTOR * u
    decimals = decimals_of(expanded)
    shown = figure(value, 0 if decimals is None else max(0, decimals), sign=True)
    return f"{shown}″" if expanded is None else f"{shown}″ ± {figure(expanded, max(0, decimals or 0))}″"


def _shifts(item: Entry) -> str:
    """The parameters that a gyro changed by more than three times their uncertainty, the surest first."""
    known = {name: abs(part["value"]) / part["u"] for name, part in item["shift"].items() if part["u"]}
    sure = sorted((name for name in known if known[name] > 3.0), key=lambda name: -known[name])
    return ", ".join(
        labels.symbol_text(name) for name in sure[:3] or sorted(known, key=lambda name: -known[name])[:1]
    )


def _explained(item: Entry) -> str:
    return drift_labels.event(item["event_kind"]) if item["event"] is not None else ""


def smallest(drift: StandDrift) -> str:
    """The smallest turns that these sessions reveal, in a sentence; empty when they show none."""
    found = (drift.document or {}).get("detectable") or {}
    parts = [
        gettext("%(size)s″ %(direction)s")
        % {"size": figure(found[f"{axis}_arcsec"], 0), "direction": direction(code)}
        for axis, (code, _) in AXES.items()
        if found.get(f"{axis}_arcsec") is not None
    ]
    if not parts:
        return ""
    return gettext("A turn of %(sizes)s would be found with a probability of %(percent)s %%.") % {
        "sizes": ", ".join(parts), "percent": plain(round(100 * found["probability"])),
    }  # fmt: skip


def direction(code: str) -> str:
    """About which axis the base turned; empty for what is no turn."""
    return gettext(_DIRECTIONS[code]) if code in _DIRECTIONS else ""


def probability(value: float) -> str:
    """A probability that is near to one: ``0.996``, ``> 0.999``."""
    return f"> {plain(0.999)}" if value > 0.999 else str(figure(value, 3))
