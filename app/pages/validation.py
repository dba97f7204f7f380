"""The validation pack: the latest report, earlier ones, and running it now."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from fastapi import APIRouter, Request, Response
from markupsafe import Markup

from app import figures
from app.i18n import gettext, localised, marked
from app.pages.base import STATIC, Reader, TheLab, Writer, fragment, render, see
from app.pages.labels import Mark
from app.services import validation
from app.services.validation import KeptReport
from app.validation.report import json_text

router = APIRouter()

_VALUE_DIGITS: Final = 15
_UNITS: Final = (marked("mg"), marked("nm"), marked("µV"), marked("V"), marked("rad"), marked("Ω"))
"""Units of the published problems, for the catalogue: reports bring them as they stand here."""


@dataclass(frozen=True, slots=True)
class ReportPage:
    """A report as it is shown."""

    report: Mapping[str, Any]

    @property
    def at(self) -> datetime:
        """When it was begun."""
        return datetime.fromisoformat(self.report["started_at"])

    def text(self, text: str) -> str:
        """A title, source or note of the report in the language of the page."""
        return gettext(text)

    def mark(self, item: Mapping[str, Any]) -> Mark:
        """Verdict on a check, a case, a group or the whole."""
        passed = item["verdict"] == "pass"
        return Mark("ok" if passed else "out", gettext("Passed") if passed else gettext("Failed"))

    def value(self, value: float | str | None) -> str:
        """An expected or obtained value; printed numbers and words as they are."""
        if isinstance(value, str):
            return localised(value) if _is_number(value) else gettext(value)
        return figures.significant(value, _VALUE_DIGITS)

    def digits(self, value: float | None) -> str:
        """Digits agreed, to a tenth."""
        return figures.DASH if value is None else str(figures.figure(value, 1))

    def accepted(self, check: Mapping[str, Any]) -> str:
        """What the obtained value must fulfil."""
        if check["required_digits"] is not None:
            return gettext("≥ %(digits)s digits") % {"digits": figures.plain(check["required_digits"])}
        if check["low"] is not None:
            return f"{figures.significant(check['low'], 6)} … {figures.significant(check['high'], 6)}"
        return gettext("the same")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@router.get("/validation")
def latest(request: Request, person: Reader, lab: TheLab, every: bool = False) -> Response:
    """The latest report; `every` opens each case, as for printing."""
    with lab.read(person) as work:
        kept, job, names = validation.latest(work), validation.running(work), validation.names(work)
    return _shown(request, kept, every, job=job, earlier=names[1:])


@router.post("/validation")
def start(person: Writer, lab: TheLab) -> Response:
    """Run the pack now and watch it."""
    with lab.write(person) as work:
        job = validation.request(work)
    return see(f"/jobs/{job.id}")


@router.get("/validation/{name}.json")
def exported(person: Reader, lab: TheLab, name: str) -> Response:
    """A report for programs."""
    with lab.read(person) as work:
        return Response(json_text(validation.report(work, name).content), media_type="application/json")


@router.get("/validation/{name}")
def one(request: Request, person: Reader, lab: TheLab, name: str, every: bool = False) -> Response:
    """A certain report."""
    with lab.read(person) as work:
        kept, names = validation.report(work, name), validation.names(work)
    return _shown(request, kept, every, job=None, earlier=[item for item in names if item != name])


def _shown(request: Request, kept: KeptReport | None, every: bool, **context: Any) -> Response:
    page = ReportPage(kept.content) if kept else None
    return render(
        request, "validation/page.html", page=page, name=kept.name if kept else "", every=every,
        moment=_moment, **context,
    )  # fmt: skip


def _moment(name: str) -> datetime:
    """The instant that a report is named by."""
    return datetime.strptime(name, "%Y%m%dT%H%M%S%fZ").replace(tzinfo=UTC)


def document(report: Mapping[str, Any]) -> str:
    """A report as a page of its own, with the stylesheet inside: for a file."""
    style = Markup("<style>{}</style>").format(Markup((STATIC / "style.css").read_text(encoding="utf-8")))
    return fragment("validation/document.html", page=ReportPage(report), every=True, style=style)
