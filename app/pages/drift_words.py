"""What a study found, in sentences: courses, forecasts, alarms, numbers down to the digits that they bear."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, Final

from markupsafe import Markup

from app import figures
from app.i18n import gettext, localised, translate
from app.pages import drift_labels, labels
from app.services.drift.views import AlarmView
from app.services.views import COVERAGE_FACTOR
from solver.drift.control.run_rules import RULES

_WEEKS_FROM: Final = 21
_DAYS_A_MONTH: Final = 365.25 / 12
Entry = Mapping[str, Any]
"""A part of a study's document."""


@dataclass(frozen=True, slots=True)
class Said:
    """A translatable sentence with its values (see `i18n.Sentence`)."""

    template: str
    values: Mapping[str, Any]


def sentence(template: str, values: Mapping[str, Any]) -> str:
    """A finding's or a method's sentence; units and days among its values as people read them."""
    said = translate(Said(template, {name: _readable(name, value) for name, value in values.items()}))
    unit = labels.unit(values["unit"]) if values.get("unit") else ""
    return said.replace(f" {unit}", f"\u00a0{unit}") if unit else said  # a value and its unit on one line


def _readable(name: str, value: Any) -> Any:
    if isinstance(value, dict):
        return str(figures.measured(**value))
    if not isinstance(value, str):
        return value
    if name == "unit":
        return labels.unit(value)
    if name in labels.PARAMETER_UNITS.values():
        return labels.unit(value)
    if name == "rule":
        return drift_labels.rule(value)
    if name == "event":
        return drift_labels.event(value)
    if name == "probability":
        return localised(value)
    if name == "parameter" and value in labels.PARAMETER_NAMES:
        return labels.symbol_text(value)
    moment = _moment(value)
    return figures.day(moment) if moment else value


def _moment(text: str) -> date | None:
    """The day that an ISO text names, if it names one."""
    if len(text) < len("2026-01-01") or text[4:5] != "-":
        return None
    try:
        return date.fromisoformat(text[:10])
    except ValueError:
        return None


def moment(text: str | None) -> datetime | None:
    """A time of a document."""
    return datetime.fromisoformat(text) if text else None


def day(text: str | None) -> str:
    """A document's time as a day."""
    found = moment(text)
    return figures.day(found) if found else figures.DASH


def alarm(found: AlarmView) -> str:
    """An alarm's sentence."""
    said = sentence(found.template, found.values)
    if found.kind in RULES and found.kind not in drift_labels.ALARM_KINDS:
        return f"{drift_labels.rule(found.kind)} {said}"
    return said


def course(trend: Entry, unit: str) -> str:
    """How a parameter goes on since its last change: constant, so much a year, or ageing."""
    since = day(trend.get("since"))
    slope, u_slope = trend.get("slope_per_year"), trend.get("u_slope_per_year")
    if trend["model"] == "constant" or slope is None:
        return gettext("constant since %(day)s") % {"day": since}
    text, expanded = _signed(slope, u_slope)
    values = {"slope": text, "u": expanded, "unit": labels.unit(unit), "day": since}
    if trend["model"] == "exponential" and trend.get("time_constant_days"):
        values["days"] = figures.significant(trend["time_constant_days"], 2)
        return gettext("ageing since %(day)s with a time constant of %(days)s days; now %(slope)s ± %(u)s "
                       "%(unit)s a year") % values  # fmt: skip
    return gettext("%(slope)s ± %(u)s %(unit)s a year since %(day)s") % values


def _signed(value: float, u: float | None) -> tuple[str, str]:
    expanded = None if u is None else COVERAGE_FACTOR * u
    decimals = figures.decimals_of(expanded)
    if decimals is None:
        return figures.significant(value, 2), figures.DASH
    return str(figures.figure(value, decimals, sign=True)), str(figures.figure(expanded, decimals))


def a_month(per_year: float) -> float:
    """A slope per year as one per month."""
    return per_year * _DAYS_A_MONTH / 365.25


def outside(since: datetime | None) -> str:
    """Of a parameter whose latest value lies beyond its limits: since when, where it is known."""
    if since is None:
        return gettext("beyond its limits")
    return gettext("beyond its limits since %(day)s") % {"day": figures.day(since)}


def forecast(found: Entry | None, unit: str, *, limited: bool) -> str:
    """Whether and when the parameter is to leave its limits."""
    if not found or not found.get("at"):
        return gettext("too few sessions to forecast")
    if not limited:
        return gettext("no limit to reach")
    leaves = found.get("leaves")
    if not leaves:
        return gettext("within its limits until %(day)s at least") % {"day": day(found["at"][-1])}
    values = {"limit": figures.plain(leaves["limit"]), "unit": labels.unit(unit), "day": day(leaves["date"]),
              "earliest": day(leaves["earliest"]), "latest": day(leaves["latest"])}  # fmt: skip
    if not leaves.get("date"):
        return gettext("may reach %(limit)s %(unit)s from %(earliest)s on") % values
    if leaves["earliest"][:10] <= found["at"][0][:10]:
        return gettext("reaches %(limit)s %(unit)s on %(day)s, perhaps already") % values
    if not leaves.get("latest"):
        return gettext("reaches %(limit)s %(unit)s on %(day)s (not before %(earliest)s)") % values
    return gettext("reaches %(limit)s %(unit)s on %(day)s (between %(earliest)s and %(latest)s)") % values


def change(found: Entry, unit: str) -> str:
    """A step with its uncertainty: ``+0.0224 ± 0.0013 °/h``."""
    text, expanded = _signed(found["size"], found.get("u"))
    return f"{text} ± {expanded} {labels.unit(unit)}"


def size(found: Entry) -> str:
    """A step where there is room for its size only: ``+0.0224``."""
    return _signed(found["size"], found.get("u"))[0]


def probability(value: float | None) -> str:
    """A probability of a test: ``0.032``, ``< 0.001``."""
    if value is None:
        return figures.DASH
    if value < 0.001:
        return f"< {figures.plain(0.001)}"
    return str(figures.figure(value, 3 if value < 0.1 else 2))


def p(value: float | None) -> Markup:
    """A probability with its symbol: ``p = 0.032``."""
    said = probability(value)
    equals = "" if said.startswith("<") else "= "
    return Markup('<span class="q">p</span> {}{}').format(equals, said)


def percent(value: float | None) -> str:
    """A probability in percent: ``98 %``, ``0.3 %``."""
    if value is None:
        return figures.DASH
    hundred = 100.0 * value
    return f"{figures.figure(hundred, 0 if hundred >= 9.95 else 1)}\u00a0%"


def degrees_of_freedom(dof: float | Sequence[float] | None) -> str:
    """Of a test: both numbers of an F."""
    if dof is None:
        return figures.DASH
    return " / ".join(figures.significant(item, 3) for item in (dof if isinstance(dof, Sequence) else [dof]))
