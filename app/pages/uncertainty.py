"""What all positions measured on a stand have in common, and how well it is known."""

from fastapi import APIRouter, Request, Response

from app.errors import AppError
from app.pages import uncertainty_fields as statement
from app.pages.base import Reader, TheLab, Writer, render, see
from app.pages.forms import Form, Sent
from app.services import stands
from app.services.lab import Lab, Person
from app.services.views import StandView

router = APIRouter()


@router.get("/stands/{name}/uncertainty")
def stated(request: Request, person: Reader, lab: TheLab, name: str) -> Response:
    """What is stated, in a form for whoever may change it."""
    stand = _find(lab, person, name)
    return _shown(request, stand, statement.form_of(stand.uncertainty))


@router.post("/stands/{name}/uncertainty")
def state(request: Request, person: Writer, lab: TheLab, name: str, sent: Sent) -> Response:
    """State it anew; what the form does not show stays."""
    stand = _find(lab, person, name)
    form = Form.of(sent, *statement.FIELDS)
    try:
        given = statement.read(form)
        with lab.write(person) as work:
            before = stands.stand(work, name).uncertainty
            stands.state_uncertainty(work, name, statement.merged(before, given))
    except AppError as error:
        problems = [statement.beside_field(item) for item in error.problems]
        return _shown(request, stand, form.with_problems(*problems), error.status)
    return see(f"/stands/{stand.name}")


def _find(lab: Lab, person: Person, name: str) -> StandView:
    with lab.read(person) as work:
        return stands.stand(work, name)


def _shown(request: Request, stand: StandView, form: Form, status: int = 200) -> Response:
    return render(
        request, "stands/uncertainty.html", status=status, stand=stand, form=form, groups=statement.GROUPS,
        name_of=statement.name_of, correlation=statement.CORRELATION,
        further=statement.further(stand.uncertainty),
    )  # fmt: skip
