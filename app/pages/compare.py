"""Two results side by side: what they differ by, in units of the uncertainty of the difference."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Request, Response

from app.errors import AppError
from app.figures import Figure, Measured, decimals_of, figure, measured
from app.i18n import gettext, marked
from app.pages import drift_words
from app.pages.base import Reader, TheLab, render
from app.pages.forms import Form
from app.pages.labels import Mark
from app.pages.tables import csv_answer, json_answer, parquet_answer
from app.services import session_index
from app.services.drift import comparing, due
from app.services.drift.comparing_rows import COLUMNS, rows
from app.services.drift.comparing_views import Compared, ComparisonView, Side

router = APIRouter()

_GAUGE: Final = (6.0, 82.0)
_GAUGE_END: Final = 2.0
"""Of the gauge of E_n: what lies farther is shown at its end."""
_SUGGESTED: Final = 12
_TYPED: Final = re.compile(r"\s*([a-z]+)\s*[: ]\s*(\S.*?)\s*", re.IGNORECASE)
_MARKS: Final = {
    "agree": Mark("ok", marked("Agree")), "differ": Mark("out", marked("Differ")),
    "undetermined": Mark("attention", marked("Not determined")),
}  # fmt: skip
_SOURCES: Final = {
    "angles": marked("certified angles, position by position"), "angles-common": marked("certified angles, in common"),
    "ammeter-gain": marked("gain of the ammeter"), "ammeter-offset": marked("offset of the ammeter"),
    "level": marked("level of the base"), "azimuth": marked("azimuth of the base"),
    "latitude": marked("latitude"), "gravity": marked("gravity"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """One parameter of both as it is printed."""

    item: Compared
    a: Measured
    b: Measured
    difference: Figure
    expanded: Figure
    ratio: Figure
    p: str
    in_scatter: Figure
    gauge: float | None
    mark: Mark


@router.get("/compare")
def page(request: Request, person: Reader, lab: TheLab, a: str = "", b: str = "") -> Response:
    """Choose two results, and see what they differ by."""
    form = Form({"a": a, "b": b})
    found, status = None, 200
    with lab.read(person) as work:
        if a.strip() and b.strip():
            try:
                found = comparing.compare(work, tidy(a), tidy(b))
            except AppError as error:
                form, status = form.with_problems(*error.problems), error.status
        gyros = [item.gyro for item in due.due_list(work) if item.calibration is not None]
        sessions = session_index.find(work, state="solved", limit=_SUGGESTED).page.items
    return render(
        request, "compare/page.html", status=status, form=form, found=found, gyros=sorted(gyros), sessions=sessions,
        rows=list(_rows(found)) if found else [],
        sources=[gettext(_SOURCES[code]) for code in found.common] if found else [],
        verdict=mark(found.verdict) if found else None, p_value=relation(found.p_value) if found else "",
        query=urlencode({"a": tidy(a), "b": tidy(b)}), side=named,
    )  # fmt: skip


@router.get("/compare.{form}")
def exported(
    person: Reader, lab: TheLab, form: Literal["csv", "json", "parquet"], a: str, b: str
) -> Response:
    """The same table as a file."""
    with lab.read(person) as work:
        table = rows(comparing.compare(work, tidy(a), tidy(b)))
    if form == "json":
        return json_answer(table)
    answer = csv_answer if form == "csv" else parquet_answer
    return answer(table, COLUMNS, "comparison")


def tidy(text: str) -> str:
    """``session:78`` of ``Session 78``."""
    found = _TYPED.fullmatch(text)
    return f"{found[1].lower()}:{found[2]}" if found else text.strip()


def named(side: Side) -> str:
    """One of the two in words, as it was asked for."""
    kind = side.asked.partition(":")[0]
    if kind == "gyro":
        return gettext("gyro %(serial)s") % {"serial": side.gyro}
    if kind == "result":
        return gettext("result no. %(number)d") % {"number": side.calibration}
    return gettext("session %(number)d") % {"number": side.session}


def mark(verdict: str) -> Mark:
    """A verdict as a status."""
    return Mark(_MARKS[verdict].shape, gettext(_MARKS[verdict].word))


def relation(p_value: float | None) -> str:
    """A p-value as it stands after ``p`` in a sentence: ``= 0.21``, ``< 0.001``."""
    said = drift_words.probability(p_value)
    return said if said.startswith("<") else f"= {said}"


def _rows(found: ComparisonView) -> Iterator[Row]:
    for item in found.parameters:
        decimals = decimals_of(item.expanded) or 4
        ratio = item.in_expanded
        yield Row(
            item, measured(item.a.value, item.a.expanded), measured(item.b.value, item.b.expanded),
            figure(item.difference, decimals, sign=True), figure(item.expanded, decimals),
            figure(ratio, 2 if ratio is None or abs(ratio) < 100 else 0, sign=True),
            drift_words.probability(item.p_holm),
            figure(item.in_scatter, 1, sign=True), _place(ratio), mark(item.verdict),
        )  # fmt: skip


def _place(ratio: float | None) -> float | None:
    """Where the difference in units of U stands on a gauge from −2 to 2."""
    if ratio is None:
        return None
    low, high = _GAUGE
    part = (max(-_GAUGE_END, min(_GAUGE_END, ratio)) + _GAUGE_END) / (2 * _GAUGE_END)
    return round(low + part * (high - low), 1)
