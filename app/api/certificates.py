"""Certificates of stands: versions that never change, as JSON or as the file they came in."""

from dataclasses import asdict
from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response

from app.api import links
from app.api.auth import Reader, Uploader
from app.api.bodies import WholeBody, body_of, filename, is_json, missing, parsed
from app.api.pagination import CSV_TOO, Columns, Listing, Part, cut, listed, wants_csv
from app.api.schemas.common import Day, Incoming, Name, QueryNotNegative, Text
from app.api.schemas.equipment import Certificate, CertificateHead, CertificateRead, NewCertificate
from app.api.schemas.warned import Warned, warned
from app.exchange.certificate import read_certificate, write_certificate_csv
from app.exchange.rows import CertificateRow
from app.services import stands
from app.services.views import CommonAngles

router = APIRouter(tags=["stands"])

_COLUMNS: Final[Columns[CertificateHead]] = {
    "number": lambda item: item.number,
    "version": lambda item: item.version,
    "valid_from": lambda item: item.valid_from.isoformat(),
    "valid_until": lambda item: item.valid_until.isoformat(),
    "valid": lambda item: "yes" if item.valid else "no",
    "issued_by": lambda item: item.issued_by,
    "u_alpha_common_arcsec": lambda item: item.u_alpha_common_arcsec,
    "u_beta_common_arcsec": lambda item: item.u_beta_common_arcsec,
    "u_gamma_common_arcsec": lambda item: item.u_gamma_common_arcsec,
    "digest": lambda item: item.digest,
    "created_at": lambda item: item.created_at,
    "created_by": lambda item: item.created_by,
}


class Heading(Incoming):
    """What a file does not say about its certificate."""

    number: Name | None = None
    valid_from: Day | None = None
    valid_until: Day | None = None
    issued_by: Text = ""
    u_alpha_common_arcsec: QueryNotNegative | None = None
    u_beta_common_arcsec: QueryNotNegative | None = None
    u_gamma_common_arcsec: QueryNotNegative | None = None
    filename: Name | None = None


@router.post(
    "/stands/{name}/certificates",
    status_code=201,
    responses={404: {}, 409: {}},
    openapi_extra=body_of("text/csv", model="NewCertificate"),
)
def add(
    name: Name,
    caller: Uploader,
    heading: Annotated[Heading, Query()],
    body: WholeBody,
    request: Request,
    response: Response,
) -> CertificateRead:
    """Keep a certificate: JSON, or the file with number, valid_from and valid_until in the query."""
    new, warnings = _from_json(body) if is_json(request) else _from_file(body, heading, request)
    rows = [CertificateRow(**item.model_dump()) for item in new.positions]
    common = CommonAngles(*(getattr(new, key) for key in CommonAngles._fields))
    with caller.write() as work:
        made = stands.add_certificate(
            work, name, new.number, new.valid_from, new.valid_until, rows, new.issued_by, common
        )
    response.headers["location"] = links.certificate(made.stand, made.number)
    shown = Certificate.model_validate(made)
    return CertificateRead(**dict(shown), warnings=warnings)


def _from_json(body: bytes) -> tuple[NewCertificate, list[Warned]]:
    return parsed(NewCertificate, body), []


def _from_file(body: bytes, heading: Heading, request: Request) -> tuple[NewCertificate, list[Warned]]:
    needed = ("number", "valid_from", "valid_until")
    absent = [name for name in needed if getattr(heading, name) is None]
    if absent:
        raise missing(*absent)
    rows, warnings = read_certificate(body, filename(request, heading.filename, "certificate"))
    new = NewCertificate.model_validate(
        {**heading.model_dump(exclude={"filename"}), "positions": [asdict(row) for row in rows]}
    )
    return new, warned(warnings)


@router.get(
    "/stands/{name}/certificates",
    response_model=Listing[CertificateHead],
    responses=CSV_TOO | {404: {}},
)
def listing(name: Name, part: Annotated[Part, Query()], caller: Reader, request: Request) -> Response:
    """Certificates of a stand, the newest first."""
    with caller.read() as work:
        found, following = cut(stands.certificates(work, name), part, lambda item: item.number)
    return listed(request, [CertificateHead.model_validate(item) for item in found], following, _COLUMNS)


@router.get("/stands/{name}/certificates/{number}", response_model=Certificate, responses=CSV_TOO | {404: {}})
def detail(name: Name, number: Name, caller: Reader, request: Request) -> Response | Certificate:
    """One certificate; as CSV it is the file of its positions."""
    with caller.read() as work:
        found = stands.certificate(work, name, number)
    if wants_csv(request):
        return Response(write_certificate_csv(found.positions), media_type="text/csv")
    return Certificate.model_validate(found)
