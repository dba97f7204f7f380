"""Certificates of stands: the list, one with all its positions, a new one."""

from collections.abc import Sequence
from datetime import UTC, date, datetime
from typing import Final

from fastapi import APIRouter, Request, Response

from app import figures
from app.errors import AppError, Invalid, Problem
from app.exchange.certificate import write_certificate_csv
from app.i18n import translate
from app.pages import certificate_rows
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.certificate_rows import Cells, Given, Unusable
from app.pages.forms import Fields, Form, Sent
from app.services import stands
from app.services.lab import Lab, Person
from app.services.views import CertificateView, CommonAngles

router = APIRouter()

_FIELDS: Final = (
    "stand", "number", "valid_from", "valid_until", "issued_by", *CommonAngles._fields, "pasted", "agreed",
)  # fmt: skip


@router.get("/certificates")
def listing(request: Request, person: Reader, lab: TheLab) -> Response:
    """Certificates of every stand, the newest first."""
    with lab.read(person) as work:
        found, known = stands.certificates(work), stands.stands(work)
    return render(
        request,
        "certificates/list.html",
        certificates=found,
        has_stand=bool(known),
        today=datetime.now(UTC).date(),
    )


@router.get("/certificates/new")
def new(request: Request, person: Writer, lab: TheLab, stand: str = "") -> Response:
    """Ask for number, validity and positions."""
    return _form(request, lab, person, Form({"stand": stand}), certificate_rows.empty_grid())


@router.post("/certificates/new")
def add(request: Request, person: Writer, lab: TheLab, sent: Sent) -> Response:
    """Keep a new certificate; what looks odd is asked back once."""
    form = Form.of(sent, *_FIELDS)
    try:
        read = certificate_rows.given(sent)
    except Unusable as error:
        own = _problems_of_head(form)
        return _form(request, lab, person, form.with_problems(*own, *error.problems), error.grid, status=422)
    kept = Form({**form.values, "pasted": ""})  # the rows stand in the grid now
    if read.warnings and form.value("agreed") != "yes":
        warnings = [translate(item) for item in read.warnings]
        return _form(request, lab, person, kept, read.grid, warnings, status=422)
    try:
        made = _add(lab, person, form, read)
    except AppError as error:
        return _form(
            request, lab, person, kept.with_problems(*error.problems), read.grid, status=error.status
        )
    return see(f"/certificates/{made.stand}/{made.number}")


@router.get("/certificates/{stand}/{number}.csv")
def exported(person: Reader, lab: TheLab, stand: str, number: str) -> Response:
    """The positions as the file that can be brought again."""
    with lab.read(person) as work:
        found = stands.certificate(work, stand, number)
    return Response(
        write_certificate_csv(found.positions), media_type="text/csv; charset=utf-8",
        headers={"content-disposition": 'attachment; filename="certificate.csv"'},
    )  # fmt: skip


@router.get("/certificates/{stand}/{number}")
def detail(request: Request, person: Reader, lab: TheLab, stand: str, number: str) -> Response:
    """One certificate with every position."""
    with lab.read(person) as work:
        found = stands.certificate(work, stand, number)
    angles, uncertainties = (
        [getattr(row, name) for row in found.positions for name in names]
        for names in (certificate_rows.ANGLES, certificate_rows.UNCERTAINTIES)
    )
    return render(
        request, "certificates/detail.html", certificate=found, today=datetime.now(UTC).date(),
        uncertain=any(item is not None for item in uncertainties), places=figures.places(angles),
        u_places=figures.places(uncertainties),
    )  # fmt: skip


def _head(form: Form) -> tuple[str, str, date, date, CommonAngles]:
    """Number, issuer, validity, and what the angles share; `Invalid` with every field that is wrong."""
    fields = Fields(form)
    number, issued_by = fields.text("number", 60), fields.text("issued_by", 200)
    valid_from, valid_until = fields.day("valid_from"), fields.day("valid_until")
    common = CommonAngles(*(fields.not_negative(name) for name in CommonAngles._fields))
    fields.check()
    return number, issued_by, valid_from, valid_until, common


def _problems_of_head(form: Form) -> Sequence[Problem]:
    try:
        _head(form)
    except Invalid as error:
        return error.problems
    return ()


def _add(lab: Lab, person: Person, form: Form, read: Given) -> CertificateView:
    number, issued_by, valid_from, valid_until, common = _head(form)
    with lab.write(person) as work:
        return stands.add_certificate(
            work, form.value("stand"), number, valid_from, valid_until, read.rows, issued_by, common
        )


def _form(
    request: Request, lab: Lab, person: Person, form: Form, grid: Sequence[Cells],
    warnings: Sequence[str] = (), status: int = 200,
) -> Response:  # fmt: skip
    with lab.read(person) as work:
        known = stands.stands(work)
    in_rows = [_cell_problems(form, row) for row in range(len(grid))]
    cells = [f"{name}.{row}" for row, found in enumerate(in_rows) for name, _ in found]
    form = Form({**form.values, **dict.fromkeys(cells, "")}, form.problems)
    return render(
        request, "certificates/form.html", status=status, form=form, grid=grid, warnings=warnings,
        stands=[(item.name, item.name) for item in known], columns=certificate_rows.COLUMNS, in_rows=in_rows,
    )  # fmt: skip


def _cell_problems(form: Form, row: int) -> list[tuple[str, str]]:
    """Problems of one row of the grid: column and sentence."""
    found = ((name, form.problem(f"{name}.{row}")) for name in certificate_rows.COLUMNS)
    return [(name, text) for name, text in found if text]
