"""Results: the queue, the worst verdict first when asked, and one result with its evidence."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Query, Request, Response

from app import plots
from app.figures import superscript
from app.i18n import gettext
from app.pages.base import Reader, TheLab, render
from app.pages.result_view import TOLERANCE, ResultPage, limit_text, standard
from app.pages.tables import Row, csv_answer, json_answer
from app.services import calibrations, gyros, sessions
from app.services.lab import Work
from app.services.views import COVERAGE_FACTOR, CalibrationView, SessionView

router = APIRouter()

_PER_PAGE: Final = 50
_RANKED: Final = 200
"""So many of the latest results are put in order of their verdict."""
_WORST_FIRST: Final = ("fails", "undetermined", "conditional", "no-limit", "conforms")
Order = Literal["newest", "worst"]


@router.get("/results")
def listing(
    request: Request, person: Reader, lab: TheLab, order: Order = "newest", gyro: str = "",
    before: Annotated[int | None, Query(ge=1)] = None,
) -> Response:  # fmt: skip
    """The newest result of each session."""
    with lab.read(person) as work:
        found, following = _queue(work, order, gyro, before, _PER_PAGE)
        known = [item.serial for item in gyros.gyros(work, limit=500).items if item.last_result]
    return render(
        request, "results/list.html", sessions=found, following=following, order=order, gyro=gyro,
        gyros=known, ranked=_RANKED, limit_text=limit_text,
    )  # fmt: skip


def _queue(
    work: Work, order: Order, gyro: str, before: int | None, limit: int
) -> tuple[Sequence[SessionView], str | None]:
    if order == "newest":
        page = calibrations.calibrations(work, gyro=gyro or None, before=before, limit=limit)
        return page.items, page.next
    latest = calibrations.calibrations(work, gyro=gyro or None, limit=_RANKED).items
    return sorted(latest, key=_rank), None


def _rank(session: SessionView) -> tuple[int, float]:
    verdict = session.result.verdict if session.result else "conforms"
    return _WORST_FIRST.index(verdict), -session.started_at.timestamp()


@router.get("/results.{form}")
def exported(
    person: Reader, lab: TheLab, form: Literal["csv", "json"], order: Order = "newest", gyro: str = ""
) -> Response:
    """The same list as a file: one row for each parameter of each result."""
    with lab.read(person) as work:
        found, _ = _queue(work, order, gyro, None, 100_000)
    rows = [row for session in found for row in _rows(session)]
    return json_answer(rows) if form == "json" else csv_answer(rows, _COLUMNS, "results")


@router.get("/results/{result_id:int}")
def detail(request: Request, person: Reader, lab: TheLab, result_id: int) -> Response:
    """One result with everything that leads to it."""
    with lab.read(person) as work:
        view = calibrations.calibration(work, result_id)
        truth = sessions.detail(work, view.session.id).truth
    page = ResultPage(view, truth)
    return render(
        request, "results/detail.html", page=page, view=view, session=view.session, standard=standard,
        residuals=_residuals(page), convergence=_convergence(page), recorded=_recorded(view),
        tolerance=f"10{superscript(-12)}", operators=sorted({item.created_by for item in view.inputs}),
    )  # fmt: skip


@router.get("/results/{result_id:int}.json")
def document(person: Reader, lab: TheLab, result_id: int) -> Response:
    """The result as it was stored, byte for byte."""
    with lab.read(person) as work:
        text = calibrations.result_text(work, result_id)
    return Response(text, media_type="application/json")


@router.get("/results/{result_id:int}.csv")
def parameters(person: Reader, lab: TheLab, result_id: int) -> Response:
    """The parameters of every method of the result."""
    with lab.read(person) as work:
        view = calibrations.calibration(work, result_id)
    answers = [view.result[name] for name in ("least-squares", "paper") if name in view.result] or [
        view.result
    ]
    rows = [row for answer in answers for row in _parameter_rows(view, answer)]
    return csv_answer(rows, _RESULT_COLUMNS, f"result-{result_id}")


def _parameter_rows(view: CalibrationView, answer: Mapping[str, Any]) -> Iterator[Row]:
    judging = "paper" if view.method == "paper" else "least-squares"
    for name, found in answer.get("parameters", {}).items():
        judged = view.summary.parameters[name]
        u, k = found["standard_uncertainty"], found.get("coverage_factor", COVERAGE_FACTOR)
        yield {
            "method": answer["method"], "parameter": name, "value": found["value"], "unit": found["unit"],
            "standard_uncertainty": u, "expanded_uncertainty": None if u is None or k is None else k * u,
            "coverage_factor": k, "low": judged.low, "high": judged.high,
            "verdict": judged.verdict if answer["method"] == judging else None,
        }  # fmt: skip


def _residuals(page: ResultPage) -> plots.theme.Spec:
    return plots.residuals(
        list(page.residual_points()),
        page.places(),
        page.exponent,
        gettext("Residuals of both equations by position, in %(unit)s, with limits at 3 standard deviations")
        % {"unit": page.rate_unit},
        gettext("beyond 3 s.d."),
    )


def _convergence(page: ResultPage) -> plots.theme.Spec | None:
    changes = list(page.changes())
    if not any(change.relative for change in changes):
        return None
    return plots.convergence(
        changes,
        TOLERANCE,
        gettext("tolerance %(size)s") % {"size": f"10{superscript(-12)}"},
        gettext("Change of each unknown of the paper’s iteration by round, as a part of its size"),
    )


def _recorded(view: CalibrationView) -> tuple[datetime, datetime]:
    moments = [item.measured_at or item.created_at for item in view.inputs]
    return min(moments), max(moments)


_RESULT_COLUMNS: Final = (
    "method", "parameter", "value", "unit", "standard_uncertainty", "expanded_uncertainty",
    "coverage_factor", "low", "high", "verdict",
)  # fmt: skip
_COLUMNS: Final = (
    "result", "session", "gyro", "type", "stand", "certificate", "started_at", "solved_at", "revision",
    "method", "verdict", "parameter", "value", "standard_uncertainty", "expanded_uncertainty",
    "coverage_factor", "unit", "low", "high", "parameter_verdict",
)  # fmt: skip


def _rows(session: SessionView) -> list[Row]:
    result = session.result
    if result is None:
        return []
    return [
        {
            "result": result.id, "session": session.id, "gyro": session.gyro, "type": session.type,
            "stand": session.stand, "certificate": session.certificate,
            "started_at": session.started_at.astimezone(UTC), "solved_at": result.solved_at.astimezone(UTC),
            "revision": result.revision, "method": result.method, "verdict": result.verdict,
            "parameter": view.name, "value": view.value, "standard_uncertainty": view.u,
            "expanded_uncertainty": view.expanded, "coverage_factor": view.k, "unit": view.unit,
            "low": view.low, "high": view.high, "parameter_verdict": view.verdict,
        }
        for view in result.parameters.values()
    ]  # fmt: skip
