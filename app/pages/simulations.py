"""A simulated session: which gyro, on which stand, with how much noise."""

import secrets
from typing import Final

from fastapi import APIRouter, Request, Response

from app.errors import AppError
from app.pages.base import TheLab, Writer, render, see
from app.pages.forms import Fields, Form, Sent
from app.services import gyros, simulations, stands
from app.services.lab import Lab, Person
from app.services.simulations import NewSimulation

router = APIRouter()

_FIELDS: Final = ("gyro", "stand", "duration_s", "rate_hz", "noise_deg_per_h", "seed")
_SEEDS: Final = 1_000_000


@router.get("/simulations/new")
def new(request: Request, person: Writer, lab: TheLab, gyro: str = "", stand: str = "") -> Response:
    """Ask for gyro, stand and the conditions; the seed offered differs each time."""
    offered = {"gyro": gyro, "stand": stand, "seed": str(secrets.randbelow(_SEEDS)), "duration_s": "60",
               "rate_hz": "200", "noise_deg_per_h": ""}  # fmt: skip
    return _form(request, lab, person, Form(offered))


@router.post("/simulations/new")
def start(request: Request, person: Writer, lab: TheLab, sent: Sent) -> Response:
    """Open the session and queue its simulation, then watch it."""
    form = Form.of(sent, *_FIELDS)
    try:
        fields = Fields(form)
        wanted = NewSimulation(
            gyro=form.value("gyro"), stand=form.value("stand"), seed=fields.whole("seed"),
            duration_s=fields.number("duration_s", "s"), rate_hz=fields.number("rate_hz", "hz"),
            noise_deg_per_h=fields.optional("noise_deg_per_h", ""),
        )  # fmt: skip
        fields.check()
        with lab.write(person) as work:
            _, job = simulations.request(work, wanted)
    except AppError as error:
        return _form(request, lab, person, form.with_problems(*error.problems), error.status)
    return see(f"/jobs/{job.id}")


def _form(request: Request, lab: Lab, person: Person, form: Form, status: int = 200) -> Response:
    with lab.read(person) as work:
        known = gyros.gyros(work, limit=1000).items
        certified = [item for item in stands.stands(work) if item.certificate]
    return render(
        request, "simulations/form.html", status=status, form=form,
        gyros=[(item.serial, f"{item.serial}, {item.type}") for item in known],
        stands=[(item.name, item.name) for item in certified],
    )  # fmt: skip
