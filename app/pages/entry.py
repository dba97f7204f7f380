"""The entry grid: one row for each position of the certificate, saved one by one.

A row is a form of its own, so it works without script; with htmx the answer is the row and the line
that says how many are saved. What is typed is read exactly (`app.exchange.numbers`) and shown again
exactly: 4.536 µA, 0.004536 mA and an uploaded 0.004536 give the same bits.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query, Request, Response

from app.errors import AppError, Invalid, Problem, problem
from app.exchange.numbers import typed
from app.exchange.rows import MeansRow
from app.i18n import localised
from app.pages.base import Reader, TheLab, Writer, fragment, render, see
from app.pages.forms import Form, Sent
from app.services import ingest, measurements, sessions
from app.services.lab import Work
from app.services.measurements import Before, Surprise
from app.services.views import MeasurementView, PositionView, SessionDetail

router = APIRouter()

Unit = Literal["ua", "ma"]
AskedUnit = Annotated[Unit, Query(alias="unit")]
UNIT_NAMES: Final = {"ua": "µA", "ma": "mA"}
_SHIFT: Final = {"ua": 3, "ma": 0}
_BY_HAND: Final = ("typed", "pasted")
_LONGEST_NOTE: Final = 200

Key = tuple[float, float, int]


@dataclass(frozen=True, slots=True)
class Row:
    """A row as it stands: the position, what is typed or saved, what is wrong or surprising."""

    position: PositionView
    again: bool
    form: Form
    surprise: Surprise | None

    @property
    def saved(self) -> MeasurementView | None:
        """The measurement that counts, None when there is none or it was withdrawn."""
        measured = self.position.measurement
        return None if measured is None or measured.withdrawn else measured

    @property
    def by_hand(self) -> bool:
        """Whether it may be typed over: a record or a machine's value is withdrawn first."""
        return self.saved is None or (self.saved.origin in _BY_HAND and self.saved.record is None)

    @property
    def path(self) -> str:
        """Its part of an address."""
        place = self.position
        return f"{place.theta_deg:.10g}/{place.psi_deg:.10g}/{place.repeat}"

    @property
    def anchor(self) -> str:
        """Its place on the page."""
        return anchor(self.position)


@dataclass(frozen=True, slots=True)
class Grid:
    """Everything of the page but the frame."""

    detail: SessionDetail
    rows: tuple[Row, ...]
    unit: Unit
    full: bool
    earlier: Before | None

    @property
    def unit_name(self) -> str:
        """Unit of the currents as it is printed."""
        return UNIT_NAMES[self.unit]

    @property
    def query(self) -> str:
        """What keeps the choice of unit and columns in an address."""
        return f"unit={self.unit}" + ("&columns=all" if self.full else "")

    @property
    def saved(self) -> list[Row]:
        """Rows that count."""
        return [row for row in self.rows if row.saved]

    @property
    def groups(self) -> list[list[Row]]:
        """Rows by θ."""
        found: list[list[Row]] = []
        for row in self.rows:
            if not found or not row.again:
                found.append([])
            found[-1].append(row)
        return found


@router.get("/sessions/{session_id}/entry")
def grid(
    request: Request, person: Reader, lab: TheLab, session_id: int, unit: AskedUnit = "ua", columns: str = ""
) -> Response:
    """The grid of all positions."""
    with lab.read(person) as work:
        found = _grid(work, session_id, unit, columns == "all")
    return render(request, "sessions/entry.html", grid=found, general=())


@router.post("/sessions/{session_id}/rows/{theta_deg}/{psi_deg}/{repeat}")
def save(
    request: Request, person: Writer, lab: TheLab, sent: Sent, session_id: int, theta_deg: float,
    psi_deg: float, repeat: int, unit: AskedUnit = "ua", columns: str = "",
) -> Response:  # fmt: skip
    """Save one row."""
    key, full = (theta_deg, psi_deg, repeat), columns == "all"
    form = Form.of(sent, *fields(unit, full))
    try:
        with lab.write(person) as work:
            means = _means(form, unit, key, _last(work, session_id, key))
            source = ingest.Source("pasted" if sent.get("origin") == "pasted" else "typed")
            ingest.save_means(work, session_id, means, source, note=form.value("note").strip())
    except AppError as error:
        if error.status not in (409, 422):
            raise
        return _answer(request, person, lab, session_id, unit, full, key, form.with_problems(*error.problems))
    return _answer(request, person, lab, session_id, unit, full, key, None)


@router.post("/sessions/{session_id}/rows/{theta_deg}/{psi_deg}/{repeat}/withdraw")
def withdraw(
    request: Request, person: Writer, lab: TheLab, sent: Sent, session_id: int, theta_deg: float,
    psi_deg: float, repeat: int, unit: AskedUnit = "ua", columns: str = "",
) -> Response:  # fmt: skip
    """Take one row back; what it held stays among the revisions."""
    note = sent.get("note")
    with lab.write(person) as work:
        reason = note.strip()[:_LONGEST_NOTE] if isinstance(note, str) else ""
        ingest.withdraw(work, session_id, theta_deg, psi_deg, repeat, reason)
    key = (theta_deg, psi_deg, repeat)
    return _answer(request, person, lab, session_id, unit, columns == "all", key, None)


def fields(unit: Unit, full: bool) -> tuple[str, ...]:
    """Fields of a row in the order of its columns."""
    currents = (f"jx_{unit}", f"jy_{unit}")
    if full:
        return (*currents, f"u_jx_{unit}", f"u_jy_{unit}", "duration_s", "rate_hz", "note")
    return (*currents, "duration_s", "note")


def _answer(
    request: Request, person: Reader, lab: TheLab, session_id: int, unit: Unit, full: bool, key: Key,
    refused: Form | None,
) -> Response:  # fmt: skip
    """The row alone for htmx; without script the page, or the way back to the row."""
    with lab.read(person) as work:
        found = _grid(work, session_id, unit, full, {key: refused} if refused else None)
    row = next((item for item in found.rows if _key(item.position) == key), None)
    status = 422 if refused else 200
    if request.headers.get("hx-request") and row is not None:
        html = fragment("sessions/entry_row.html", grid=found, row=row)
        return Response(html, status_code=status, media_type="text/html; charset=utf-8")
    if refused:
        general = refused.general if row is not None else tuple(_texts(refused))
        return render(request, "sessions/entry.html", status=status, grid=found, general=general)
    return see(f"/sessions/{session_id}/entry?{found.query}" + (f"#{row.anchor}" if row else ""))


def _texts(form: Form) -> Sequence[str]:
    return [*form.general, *(form.problem(name) for name in form.values if form.problem(name))]


def anchor(position: PositionView) -> str:
    """Where a position stands on the pages of its session: ``position-7``, its repeat ``position-7-1``."""
    return f"position-{position.number}" + (f"-{position.repeat}" if position.repeat else "")


def _key(position: PositionView) -> Key:
    return (position.theta_deg, position.psi_deg, position.repeat)


def _last(work: Work, session_id: int, key: Key) -> MeasurementView | None:
    positions = sessions.detail(work, session_id).positions
    return next((item.measurement for item in positions if _key(item) == key), None)


def _means(form: Form, unit: Unit, key: Key, last: MeasurementView | None) -> MeansRow:
    """What was typed, in the laboratory's units; columns that are not shown keep what they had."""
    problems: list[Problem] = []
    kept = last if last is not None and not last.withdrawn else None

    def number(name: str, of: str, to: str, otherwise: float | None) -> float | None:
        if name not in form.values:
            return otherwise
        text = form.value(name)
        if not text.strip() and not name.startswith("j"):
            return None
        try:
            return typed(text, of, to, column=name)
        except Invalid as error:
            problems.extend(error.problems)
            return None

    jx_ma, jy_ma = (number(f"j{axis}_{unit}", unit, "ma", None) for axis in "xy")
    u_jx_ma, u_jy_ma = (
        number(f"u_j{axis}_{unit}", unit, "ma", getattr(kept, f"u_j{axis}_ma", None)) for axis in "xy"
    )
    duration_s = number("duration_s", "s", "s", None)
    rate_hz = number("rate_hz", "hz", "hz", kept.rate_hz if kept else None)
    positive = {
        f"u_jx_{unit}": u_jx_ma,
        f"u_jy_{unit}": u_jy_ma,
        "duration_s": duration_s,
        "rate_hz": rate_hz,
    }
    problems.extend(
        problem("not-positive", "This must be greater than zero.", column=name)
        for name, value in positive.items()
        if name in form.values and value is not None and not value > 0
    )
    if len(form.value("note").strip()) > _LONGEST_NOTE:
        problems.append(
            problem("too-long", "This is too long. Keep it to %(limit)d characters.", column="note",
                    limit=_LONGEST_NOTE)
        )  # fmt: skip
    if problems or jx_ma is None or jy_ma is None:
        raise Invalid(*problems)
    theta_deg, psi_deg, repeat = key
    return MeansRow(theta_deg, psi_deg, jx_ma, jy_ma, u_jx_ma, u_jy_ma, duration_s, rate_hz, repeat=repeat)


def _grid(
    work: Work, session_id: int, unit: Unit, full: bool, refused: Mapping[Key, Form] | None = None
) -> Grid:
    detail = sessions.detail(work, session_id)
    earlier = measurements.before(work, detail.session)
    surprising = measurements.surprises(detail.positions, earlier)
    places = _places(detail.positions, unit)
    rows, before = [], None
    for position in detail.positions:
        key = _key(position)
        form = (refused or {}).get(key) or Form(_shown(position.measurement, unit, full, places))
        rows.append(Row(position, position.theta_deg == before, form, surprising.get(key)))
        before = position.theta_deg
    return Grid(detail, tuple(rows), unit, full, earlier)


def _shown(
    saved: MeasurementView | None, unit: Unit, full: bool, places: Mapping[str, int]
) -> dict[str, str]:
    if saved is None or saved.withdrawn:
        return dict.fromkeys(fields(unit, full), "")
    values = {
        f"jx_{unit}": _decimal(saved.jx_ma, _SHIFT[unit], places["jx_ma"]),
        f"jy_{unit}": _decimal(saved.jy_ma, _SHIFT[unit], places["jy_ma"]),
        f"u_jx_{unit}": _decimal(saved.u_jx_ma, _SHIFT[unit]),
        f"u_jy_{unit}": _decimal(saved.u_jy_ma, _SHIFT[unit]),
        "duration_s": _decimal(saved.duration_s),
        "rate_hz": _decimal(saved.rate_hz),
        "note": saved.note,
    }
    return {name: values[name] for name in fields(unit, full)}


def _places(positions: Sequence[PositionView], unit: Unit) -> dict[str, int]:
    """Decimals that the column's longest typed number has, so that decimal signs stand in one line."""
    found = {}
    for name in ("jx_ma", "jy_ma"):
        texts = [
            _decimal(getattr(item.measurement, name), _SHIFT[unit])
            for item in positions
            if item.measurement is not None and item.measurement.origin in _BY_HAND
        ]
        found[name] = max((_decimals(text) for text in texts), default=0)
    return found


def _decimals(text: str) -> int:
    return len(text.replace(",", ".").partition(".")[2])


def _decimal(value: float | None, shift: int = 0, places: int = 0) -> str:
    """The shortest decimal of a float64, its point moved exactly; padded to so many places."""
    if value is None:
        return ""
    exact = Decimal(repr(value)).scaleb(shift).normalize()
    text = f"{exact:f}"
    missing = places - _decimals(text)
    if missing > 0:
        text = f"{text}{'' if '.' in text else '.'}{'0' * missing}"
    return localised(text)
