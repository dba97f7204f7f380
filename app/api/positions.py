"""One position of a session: its means, or its record of currents."""

from dataclasses import replace
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Query, Request, Response

from app.api import bodies
from app.api.auth import Reader, Uploader
from app.api.bodies import FILE_TYPES, StreamedBody, body_of
from app.api.pagination import CSV_TOO, Listing, wants_csv
from app.api.schemas.common import Id, Incoming, Name, PathAngle, Text
from app.api.schemas.measuring import MeasuredRecord, Measurement, NewMeans, Position, Repeat
from app.api.schemas.noise import PositionNoise, position_noise
from app.api.schemas.warned import warned
from app.exchange.means import write_means_csv
from app.exchange.rows import MeansRow
from app.services import calibrations, ingest, noise, sessions, uploads

router = APIRouter(tags=["sessions"])

Theta = Annotated[PathAngle, Path(description="θ in degrees: 90 and 090 are the same.")]
Psi = Annotated[PathAngle, Path(description="ψ in degrees.")]
_PLACE: Final = "/sessions/{session_id}/positions/{theta_deg}/{psi_deg}"


class Which(Incoming):
    """Which measurement of the position."""

    repeat: Repeat = 0


class Naming(Which):
    """What a record's bytes do not say."""

    filename: Name | None = None
    note: Text = ""


def _saved(model: Any) -> dict[int | str, dict[str, Any]]:
    return {
        200: {"model": model, "description": "The very same is there already."},
        201: {"model": model, "description": "A new revision."},
        404: {},
    }


@router.get(
    "/sessions/{session_id}/positions", response_model=Listing[Position], responses=CSV_TOO | {404: {}}
)
def listing(session_id: Id, caller: Reader, request: Request) -> Response | Listing[Position]:
    """Every position of a session in one part; as CSV it is the file of the means that count."""
    with caller.read() as work:
        found = sessions.detail(work, session_id)
        rows = calibrations.current_means(work, session_id)
    if wants_csv(request):
        return Response(write_means_csv(rows), headers={"vary": "Accept"}, media_type="text/csv")
    return Listing(items=[Position.model_validate(item) for item in found.positions], next=None)


@router.put(_PLACE + "/means", status_code=201, responses=_saved(Measurement))
def put_means(
    session_id: Id,
    theta_deg: Theta,
    psi_deg: Psi,
    which: Annotated[Which, Query()],
    body: NewMeans,
    caller: Uploader,
    response: Response,
) -> Measurement:
    """Save the means of one position: 200 when they are there already, else a new revision."""
    repeat = which.repeat if body.repeat is None else body.repeat
    row = MeansRow(theta_deg, psi_deg, **body.model_dump(exclude={"note", "repeat"}), repeat=repeat)
    with caller.write() as work:
        saved = ingest.save_means(work, session_id, row, ingest.Source("api"), body.note)
    response.status_code = 201 if saved.new else 200
    return Measurement.model_validate(saved.measurement)


@router.put(
    _PLACE + "/currents",
    status_code=201,
    responses=_saved(MeasuredRecord) | {413: {}},
    openapi_extra=body_of(*FILE_TYPES),
)
def put_currents(
    session_id: Id,
    theta_deg: Theta,
    psi_deg: Psi,
    naming: Annotated[Naming, Query()],
    caller: Uploader,
    body: StreamedBody,
    request: Request,
    response: Response,
) -> MeasuredRecord:
    """Save the record of one position: the bytes are kept, and its means become a new revision."""
    name = bodies.filename(request, naming.filename, "currents")
    measured, warnings = uploads.keep_position(
        caller.lab.files, body, name, theta_deg, psi_deg, naming.repeat
    )
    with caller.write() as work:
        saved = ingest.save(work, session_id, [replace(measured, note=naming.note)])[0]
    response.status_code = 201 if saved.new else 200
    shown = Measurement.model_validate(saved.measurement)
    return MeasuredRecord.model_validate(dict(shown) | {"warnings": warned(warnings)})


@router.get(_PLACE + "/noise", responses={404: {}})
def read_noise(
    session_id: Id, theta_deg: Theta, psi_deg: Psi, which: Annotated[Which, Query()], caller: Reader
) -> PositionNoise:
    """What the record that counts says of its noise; 404 for a position without a record."""
    with caller.read() as work:
        kept = noise.currents_at(work, session_id, theta_deg, psi_deg, which.repeat)
    return position_noise(noise.analysed(kept))
