"""Events of gyros and stands: entered after they happened, taken back when they did not."""

from datetime import UTC, datetime, time
from typing import Final

from fastapi import APIRouter, Request, Response

from app.errors import AppError, NotFound
from app.pages import drift_labels
from app.pages.base import TheLab, Writer, local_path, render, see
from app.pages.forms import Fields, Form, Sent
from app.services import gyros, stands
from app.services.drift import events
from app.services.lab import Lab, Person

router = APIRouter()

_EMPTY: Final = {"kind": "repair", "happened_at": "", "note": ""}


@router.get("/gyros/{serial}/events/new")
def new_of_gyro(request: Request, person: Writer, lab: TheLab, serial: str) -> Response:
    """Ask what happened to a gyro."""
    return _form(request, lab, person, Form(_EMPTY), gyro=serial)


@router.post("/gyros/{serial}/events/new")
def add_to_gyro(request: Request, person: Writer, lab: TheLab, serial: str, sent: Sent) -> Response:
    """Enter what happened to a gyro."""
    return _add(request, lab, person, sent, gyro=serial)


@router.get("/stands/{name}/events/new")
def new_of_stand(request: Request, person: Writer, lab: TheLab, name: str) -> Response:
    """Ask what happened to a stand."""
    return _form(request, lab, person, Form({**_EMPTY, "kind": "moved"}), stand=name)


@router.post("/stands/{name}/events/new")
def add_to_stand(request: Request, person: Writer, lab: TheLab, name: str, sent: Sent) -> Response:
    """Enter what happened to a stand."""
    return _add(request, lab, person, sent, stand=name)


@router.post("/events/{number}/withdrawal")
def withdraw(person: Writer, lab: TheLab, number: int, sent: Sent) -> Response:
    """Take back an event that was entered in error; for whoever entered it, and for the roles that judge."""
    with lab.write(person) as work:
        found = events.withdraw(work, number)
    wanted = sent.get("next")
    return see(local_path(wanted if isinstance(wanted, str) else None, _page_of(found.gyro, found.stand)))


def _page_of(gyro: str | None, stand: str | None) -> str:
    return f"/gyros/{gyro}" if gyro else f"/stands/{stand}/drift"


def _add(
    request: Request, lab: Lab, person: Person, sent: Sent, *, gyro: str | None = None, stand: str | None = None
) -> Response:  # fmt: skip
    form = Form.of(sent, *_EMPTY)
    try:
        fields = Fields(form)
        day, note = fields.day("happened_at"), fields.text("note", 4000)
        fields.check()
        # The beginning of the day: its sessions come after what happened.
        at = datetime.combine(day, time(), UTC)
        with lab.write(person) as work:
            events.add(work, form.value("kind"), at, note, gyro=gyro, stand=stand)
    except NotFound:
        raise
    except AppError as error:
        shown = form.with_problems(*error.problems)
        return _form(request, lab, person, shown, error.status, gyro=gyro, stand=stand)
    return see(_page_of(gyro, stand))


def _form(
    request: Request, lab: Lab, person: Person, form: Form, status: int = 200, *, gyro: str | None = None,
    stand: str | None = None,
) -> Response:  # fmt: skip
    with lab.read(person) as work:
        if gyro:
            gyros.gyro(work, gyro)
        elif stand:
            stands.stand(work, stand)
    return render(
        request, "events/form.html", status=status, form=form, gyro=gyro, stand=stand, kinds=events.KINDS,
        drift=drift_labels, back=_page_of(gyro, stand),
    )  # fmt: skip
