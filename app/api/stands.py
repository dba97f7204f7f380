"""Stands."""

from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response

from app.api import links
from app.api.auth import Reader, Uploader
from app.api.pagination import CSV_TOO, Columns, Listing, Part, cut, listed
from app.api.schemas.common import Name
from app.api.schemas.equipment import NewStand, Stand
from app.api.schemas.uncertainty import Uncertainty
from app.services import stands

router = APIRouter(tags=["stands"])

_COLUMNS: Final[Columns[Stand]] = {
    "name": lambda item: item.name,
    "latitude_deg": lambda item: item.latitude_deg,
    "note": lambda item: item.note,
    "created_at": lambda item: item.created_at,
    "certificate": lambda item: item.certificate.number if item.certificate else None,
    "certificate_valid_until": lambda item: (
        item.certificate.valid_until.isoformat() if item.certificate else None
    ),
}


@router.post("/stands", status_code=201, responses={409: {}})
def add(body: NewStand, caller: Uploader, response: Response) -> Stand:
    """Register a stand in its place."""
    with caller.write() as work:
        made = stands.add_stand(work, body.name, body.latitude_deg, body.note)
    response.headers["location"] = links.stand(made.name)
    return Stand.model_validate(made)


@router.get("/stands", response_model=Listing[Stand], responses=CSV_TOO)
def listing(part: Annotated[Part, Query()], caller: Reader, request: Request) -> Response:
    """Stands by name, each with the certificate that is valid today."""
    with caller.read() as work:
        found, following = cut(stands.stands(work), part, lambda item: item.name)
    return listed(request, [Stand.model_validate(item) for item in found], following, _COLUMNS)


@router.get("/stands/{name}", responses={404: {}})
def detail(name: Name, caller: Reader) -> Stand:
    """One stand."""
    with caller.read() as work:
        return Stand.model_validate(stands.stand(work, name))


@router.put("/stands/{name}/uncertainty", responses={404: {}})
def state_uncertainty(name: Name, body: Uncertainty, caller: Uploader) -> Stand:
    """State what all positions measured on a stand have in common; an empty object clears it.

    Results that are there already keep what they were computed with.
    """
    with caller.write() as work:
        return Stand.model_validate(stands.state_uncertainty(work, name, body.root))
