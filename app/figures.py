"""Numbers, their uncertainties and dates as people read them, in the language of the moment.

A value is shown down to the second significant digit of its expanded uncertainty U (GUM, 7.2.6) and
never further; a minus is U+2212; four digits are not grouped.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, date, datetime
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Final

from babel.dates import format_date, format_datetime, format_time

from app.i18n import LOCALE, MINUS, gettext, localised, ngettext

DASH: Final = "\u2013"
_BABEL: Final = {"en": "en", "ru": "ru"}


@dataclass(frozen=True, slots=True)
class Figure:
    """A number in two parts, so that decimal signs stand in one line: ``−0`` and ``.2302``."""

    whole: str
    fraction: str

    def __str__(self) -> str:
        return self.whole + self.fraction


def decimals_of(expanded: float | None, digits: int = 2) -> int | None:
    """Decimal places that show `digits` significant digits of U; None when U says nothing.

    A U that rounds up to a further digit (0.0996 → 0.10) counts as rounded.
    """
    if expanded is None or not expanded > 0 or expanded == float("inf"):
        return None
    rounded = Decimal(f"{expanded:.{digits - 1}e}")
    return digits - 1 - rounded.adjusted()


def rounded(value: float, decimals: int) -> str:
    """The value with so many decimals, rounded half to even on its exact binary value; no locale."""
    step = Decimal(1).scaleb(-decimals)
    text = f"{Decimal(value).quantize(step, ROUND_HALF_EVEN):f}"
    return text.lstrip("-") if not text.strip("-0.") else text


def figure(value: float | None, decimals: int, *, sign: bool = False) -> Figure:
    """A number with so many decimals, split at its decimal sign; an en dash for None.

    With `sign` a positive number carries a plus: for differences only.
    """
    if value is None:
        return Figure(DASH, "")
    text = rounded(value, decimals)
    if sign and not text.startswith("-") and text.strip("0."):
        text = "+" + text
    text = localised(text)
    mark = "," if LOCALE.get() == "ru" else "."
    whole, separator, fraction = text.partition(mark)
    return Figure(whole, separator + fraction)


@dataclass(frozen=True, slots=True)
class Measured:
    """A value with its expanded uncertainty, both down to U's second digit."""

    value: Figure
    expanded: Figure | None

    def __str__(self) -> str:
        return f"{self.value} ± {self.expanded}" if self.expanded else str(self.value)


def measured(
    value: float | None, expanded: float | None, otherwise: int = 4, *, sign: bool = False
) -> Measured:
    """Round value and U together; without U the value has `otherwise` decimals and no ±; `sign` as in `figure`."""
    decimals = decimals_of(expanded)
    if value is None or decimals is None:
        return Measured(figure(value, otherwise, sign=sign), None)
    return Measured(figure(value, decimals, sign=sign), figure(expanded, decimals))


def significant(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, powers of ten written out: ``1.2·10⁻⁵``."""
    if value is None:
        return DASH
    text = f"{value:.{digits}g}"
    mantissa, _, exponent = text.partition("e")
    if not exponent:
        return localised(text)
    return f"{localised(mantissa)}·10{superscript(int(exponent))}"


def superscript(exponent: int) -> str:
    """An exponent raised: ``⁻⁵``."""
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def plain(value: float | None, largest_decimals: int = 10) -> str:
    """A number that somebody gave, with the digits it was given with."""
    if value is None:
        return DASH
    text = f"{value:.{largest_decimals}f}".rstrip("0").rstrip(".")
    return localised(text if text not in ("-0", "") else "0")


def places(values: Iterable[float | None], most: int = 6) -> int:
    """Decimal places that show all these numbers as they were given, at most so many."""
    found = [Decimal(repr(value)).normalize().as_tuple().exponent for value in values if value is not None]
    return max([0, *(min(most, -item) for item in found if isinstance(item, int))])


def entered(value: float | None) -> str:
    """A number for a form's field: the shortest decimal that reads back as the same bits."""
    if value is None:
        return ""
    return localised(f"{Decimal(repr(value)):f}").removesuffix(".0").removesuffix(",0")


def day(moment: date | datetime, *, short: bool = False) -> str:
    """``20 Nov 2026``, ``20.11.2026`` in Russian; `short` leaves out the year."""
    if LOCALE.get() == "ru":
        return format_date(moment, "dd.MM" if short else "dd.MM.yyyy", locale="ru")
    return format_date(moment, "d MMM" if short else "d MMM yyyy", locale="en")


def long_day(moment: date | datetime) -> str:
    """``Friday 20 November 2026``."""
    pattern = "EEEE, d MMMM yyyy" if LOCALE.get() == "ru" else "EEEE d MMMM yyyy"
    text = format_date(moment, pattern, locale=_BABEL[LOCALE.get()])
    return text[:1].upper() + text[1:]


def clock(moment: datetime, *, seconds: bool = False) -> str:
    """Time of day, 24 hours, in the server's time zone."""
    return format_time(moment.astimezone(), "HH:mm:ss" if seconds else "HH:mm", locale="en")


def instant(moment: datetime, *, now: datetime | None = None) -> str:
    """Day and time of day; the year only when it is not this one."""
    local = moment.astimezone()
    this_year = local.year == (now or datetime.now(UTC)).astimezone().year
    return f"{day(local, short=this_year)} {format_datetime(local, 'HH:mm', locale='en_GB')}"


def age(moment: datetime, now: datetime | None = None) -> str:
    """How long ago: ``3 s ago``, ``5 min ago``, ``2 h ago``, ``4 days ago``."""
    seconds = max(0, int(((now or datetime.now(UTC)) - moment).total_seconds()))
    if seconds < 60:
        return gettext("%(count)d s ago") % {"count": seconds}
    if seconds < 3600:
        return gettext("%(count)d min ago") % {"count": seconds // 60}
    if seconds < 86400:
        return gettext("%(count)d h ago") % {"count": seconds // 3600}
    days = seconds // 86400
    return ngettext("%(count)d day ago", "%(count)d days ago", days) % {"count": days}


def term(until: date, today: date) -> str:
    """How far a date is: ``in 90 days``, ``today``, ``18 days ago``."""
    days = (until - today).days
    if days == 0:
        return gettext("today")
    if days > 0:
        return ngettext("in %(count)d day", "in %(count)d days", days) % {"count": days}
    return ngettext("%(count)d day ago", "%(count)d days ago", -days) % {"count": -days}


def duration(seconds: float | None) -> str:
    """A length of time: ``0.4 s``, ``60 s``, ``2 min 5 s``."""
    if seconds is None:
        return DASH
    if seconds < 10:
        return f"{localised(f'{seconds:.1f}')} {gettext('s')}"
    whole = round(seconds)
    if whole < 120:
        return f"{whole} {gettext('s')}"
    minutes, rest = divmod(whole, 60)
    return f"{minutes} {gettext('min')}" + (f" {rest} {gettext('s')}" if rest else "")


def degrees(value: float) -> str:
    """A stand angle with its sign of degree: ``180°``."""
    return f"{plain(value, 6)}°"


__all__ = [
    "DASH", "MINUS", "Figure", "Measured", "age", "clock", "day", "decimals_of", "degrees", "duration",
    "entered", "figure", "instant", "long_day", "measured", "places", "plain", "rounded", "significant",
    "superscript", "term",
]  # fmt: skip
