"""Sessions: the index by state, stand and gyro; a new one; one with its positions, results and files."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Query, Request, Response

from app.errors import AppError
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.entry import anchor
from app.pages.forms import Fields, Form, Sent
from app.pages.positions import position_map
from app.pages.states import session_state
from app.pages.tables import Row, csv_answer, json_answer
from app.services import calibrations, gyros, session_index, sessions, stands
from app.services.lab import Lab, Person, Work
from app.services.sessions import NewSession
from app.services.views import MeasurementView, SessionDetail, SessionView

router = APIRouter()
_TRIALS: Final = ("0", str(calibrations.TRIALS), "1000000", "adaptive")

STATES: Final = ("measuring", "ready", "solving", "failed", "solved")
_PER_PAGE: Final = 50
_ALL: Final = 100_000
_NEW: Final = ("gyro", "stand", "certificate", "power", "temperature_c", "note")

Before = Annotated[int | None, Query(ge=1)]


@router.get("/sessions")
def listing(
    request: Request, person: Reader, lab: TheLab, gyro: str = "", stand: str = "", state: str = "",
    before: Before = None,
) -> Response:  # fmt: skip
    """The sessions, the newest first."""
    with lab.read(person) as work:
        index = session_index.find(work, gyro=gyro, stand=stand, state=state, before=before, limit=_PER_PAGE)
    return render(
        request, "sessions/list.html", index=index, gyro=gyro, stand=stand, state=state, state_mark=session_state,
        states=[item for item in STATES if index.counts["state"].get(item) or item == state],
    )  # fmt: skip


@router.get("/sessions.{form}")
def exported(
    person: Reader,
    lab: TheLab,
    form: Literal["csv", "json"],
    gyro: str = "",
    stand: str = "",
    state: str = "",
) -> Response:
    """The same list as a file."""
    with lab.read(person) as work:
        found = session_index.find(work, gyro=gyro, stand=stand, state=state, limit=_ALL)
    rows = [_line(item) for item in found.page.items]
    return json_answer(rows) if form == "json" else csv_answer(rows, _COLUMNS, "sessions")


@router.get("/sessions/new")
def new(request: Request, person: Writer, lab: TheLab, gyro: str = "", stand: str = "") -> Response:
    """Ask for gyro, stand, certificate and start."""
    return _form(request, lab, person, Form({"gyro": gyro, "stand": stand}))


@router.post("/sessions/new")
def open_new(request: Request, person: Writer, lab: TheLab, sent: Sent) -> Response:
    """Open a session and go to its entry grid."""
    form = Form.of(sent, *_NEW)
    try:
        fields = Fields(form)
        temperature_c = fields.optional("temperature_c", "c")
        note = fields.text("note")
        fields.check()
        with lab.write(person) as work:
            stand, _, certificate = form.value("certificate").rpartition("/")
            opened = sessions.open_session(
                work,
                NewSession(
                    form.value("gyro"), stand or form.value("stand"), certificate or None,
                    new_start=form.value("power") == "new", temperature_c=temperature_c, note=note,
                ),
            )  # fmt: skip
    except AppError as error:
        return _form(request, lab, person, form.with_problems(*error.problems), error.status)
    return see(f"/sessions/{opened.id}/entry")


def _form(request: Request, lab: Lab, person: Person, form: Form, status: int = 200) -> Response:
    with lab.read(person) as work:
        serials = _serials(work)
        known = stands.stands(work)
        choices = stands.certificates(work)
    chosen = form.value("stand") or (known[0].name if len(known) == 1 else "")
    return render(
        request, "sessions/new.html", status=422 if status == 404 else status,
        form=Form({**form.values, "stand": chosen}, form.problems), serials=serials, stands=known,
        certificates=choices, valid=[item for item in known if item.certificate],
    )  # fmt: skip


def _serials(work: Work) -> list[tuple[str, str]]:
    page = gyros.gyros(work, limit=5000)
    return [(item.serial, item.type) for item in page.items]


@router.get("/sessions/{session_id:int}")
def detail(request: Request, person: Reader, lab: TheLab, session_id: int) -> Response:
    """One session: what is measured, what came out, what to do next."""
    return show(request, lab, person, session_id)


def show(
    request: Request, lab: Lab, person: Person, session_id: int, *, form: Form | None = None,
    warnings: Sequence[str] = (), status: int = 200,
) -> Response:  # fmt: skip
    """The page of a session; `form` and `warnings` are about files that were brought."""
    with lab.read(person) as work:
        found = sessions.detail(work, session_id)
    return render(
        request, "sessions/detail.html", status=status, detail=found, session=found.session,
        map=position_map(found), superseded=_superseded(found), anchor=anchor, form=form or Form(),
        warnings=warnings, measured=[row for row in found.positions if _counts(row.measurement)],
        methods=calibrations.METHODS[::-1], trials=_TRIALS, usual_trials=str(calibrations.TRIALS),
    )  # fmt: skip


@router.get("/sessions/{session_id:int}.{form}")
def measured(person: Reader, lab: TheLab, session_id: int, form: Literal["csv", "json"]) -> Response:
    """What counts of a session, as a file of means that can be brought in again."""
    with lab.read(person) as work:
        found = sessions.detail(work, session_id)
    rows = [
        _means(item.measurement) for item in found.positions if item.measurement and _counts(item.measurement)
    ]
    return json_answer(rows) if form == "json" else csv_answer(rows, _MEANS, f"session-{session_id}")


@router.post("/sessions/{session_id}/solve")
def solve(request: Request, person: Writer, lab: TheLab, session_id: int, sent: Sent) -> Response:
    """Ask for the calibration and watch it."""
    form = Form.of(sent, "method", "monte_carlo")
    fields = Fields(form)
    trials = _draws(fields, form.value("monte_carlo"))
    fields.check()
    with lab.write(person) as work:
        job = calibrations.request(work, session_id, form.value("method") or "both", trials)
    return see(f"/jobs/{job.id}")


def _draws(fields: Fields, said: str) -> int | None:
    """Draws of the Monte Carlo check; None for as many as are needed."""
    if said == "adaptive":
        return None
    return fields.whole("monte_carlo") if said else calibrations.TRIALS


def _counts(measurement: MeasurementView | None) -> bool:
    return measurement is not None and not measurement.withdrawn


def _superseded(found: SessionDetail) -> list[MeasurementView]:
    """Revisions that count no more, the newest first."""
    current = {row.measurement.id for row in found.positions if row.measurement}
    gone = [item for item in found.revisions if item.id not in current or item.withdrawn]
    return sorted(gone, key=lambda item: item.created_at, reverse=True)


_COLUMNS: Final = (
    "session", "gyro", "type", "stand", "certificate", "start", "started_at", "origin", "operator",
    "temperature_c", "positions_measured", "positions_total", "state", "result", "verdict",
    "w0x_deg_per_h", "expanded_w0x_deg_per_h", "w0y_deg_per_h", "expanded_w0y_deg_per_h",
    "coverage_factor_w0x", "coverage_factor_w0y",
    "note",
)  # fmt: skip
_MEANS: Final = (
    "theta_deg", "psi_deg", "jx_ma", "jy_ma", "u_jx_ma", "u_jy_ma", "duration_s", "rate_hz", "started_at",
    "temperature_c", "repeat",
)  # fmt: skip


def _line(session: SessionView) -> Row:
    result = session.result
    drift: Mapping[str, Any] = result.parameters if result else {}
    known = {name: drift.get(name) for name in ("w0x", "w0y")}
    return {
        "session": session.id, "gyro": session.gyro, "type": session.type, "stand": session.stand,
        "certificate": session.certificate, "start": session.start,
        "started_at": session.started_at.astimezone(UTC), "origin": session.origin,
        "operator": session.created_by, "temperature_c": session.temperature_c,
        "positions_measured": session.positions_measured, "positions_total": session.positions_total,
        "state": session.state, "result": result.id if result else None,
        "verdict": result.verdict if result else None,
        **{f"{name}_deg_per_h": view.value if view else None for name, view in known.items()},
        **{f"expanded_{name}_deg_per_h": view.expanded if view else None for name, view in known.items()},
        **{f"coverage_factor_{name}": view.k if view else None for name, view in known.items()},
        "note": session.note,
    }  # fmt: skip


def _means(item: MeasurementView) -> Row:
    at: datetime | None = item.measured_at
    return {
        "theta_deg": item.theta_deg, "psi_deg": item.psi_deg, "jx_ma": item.jx_ma, "jy_ma": item.jy_ma,
        "u_jx_ma": item.u_jx_ma, "u_jy_ma": item.u_jy_ma, "duration_s": item.duration_s,
        "rate_hz": item.rate_hz, "started_at": at.astimezone(UTC) if at else None,
        "temperature_c": item.temperature_c, "repeat": item.repeat,
    }  # fmt: skip
