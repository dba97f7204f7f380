"""Stands: where they are, which certificate is valid, what they do now."""

from datetime import UTC, datetime

from fastapi import APIRouter, Request, Response

from app.errors import AppError
from app.pages import uncertainty_fields
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.forms import Fields, Form, Sent
from app.services import sessions, stands

router = APIRouter()


@router.get("/stands")
def listing(request: Request, person: Reader, lab: TheLab) -> Response:
    """Every stand."""
    with lab.read(person) as work:
        found = stands.stands(work)
    return render(request, "stands/list.html", stands=found, today=datetime.now(UTC).date())


@router.get("/stands/new")
def new(request: Request, person: Writer) -> Response:
    """Ask for name and latitude."""
    return render(request, "stands/form.html", form=Form())


@router.post("/stands/new")
def add(request: Request, person: Writer, lab: TheLab, sent: Sent) -> Response:
    """Register a stand."""
    form = Form.of(sent, "name", "latitude_deg", "note")
    try:
        fields = Fields(form)
        name, note = fields.text("name", 60), fields.text("note")
        latitude_deg = fields.number("latitude_deg", "deg")
        fields.check()
        with lab.write(person) as work:
            made = stands.add_stand(work, name, latitude_deg, note)
    except AppError as error:
        shown = form.with_problems(*error.problems)
        return render(request, "stands/form.html", status=error.status, form=shown)
    return see(f"/stands/{made.name}")


@router.get("/stands/{name}")
def detail(request: Request, person: Reader, lab: TheLab, name: str) -> Response:
    """One stand with its certificates and its latest sessions."""
    with lab.read(person) as work:
        stand = stands.stand(work, name)
        certificates = stands.certificates(work, name)
        latest = sessions.sessions(work, stand=name, limit=6).items
    return render(
        request, "stands/detail.html", stand=stand, certificates=certificates, sessions=latest,
        stated=uncertainty_fields.summary(stand.uncertainty), today=datetime.now(UTC).date(),
    )  # fmt: skip
