"""Results."""

from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request, Response

from app.api import links
from app.api.auth import Reader, Uploader
from app.api.pagination import CSV_TOO, Cell, Columns, Listing, Part, listed
from app.api.schemas.common import Id, Name
from app.api.schemas.jobs import Job, NewCalibration
from app.api.schemas.results import Calibration, CalibrationLine
from app.services import calibrations
from app.services.views import CalibrationView, ResultSummary, SessionView
from solver.records import PARAMETERS

router = APIRouter(tags=["results"])

_UNITS: Final = {"k": "deg_per_h_per_ma", "w0": "deg_per_h", "w": "deg_per_h_per_g"}


class CalibrationPart(Part):
    """Which results."""

    gyro: Name | None = None
    type: Name | None = None


@router.post("/sessions/{session_id}/calibrations", status_code=202, responses={404: {}})
def solve(session_id: Id, body: NewCalibration, caller: Uploader, response: Response) -> Job:
    """Ask for a calibration of what is measured now; the same while it waits or runs is the same job."""
    with caller.write() as work:
        trials = None if body.monte_carlo == "adaptive" else body.monte_carlo
        job = calibrations.request(work, session_id, body.method, trials, body.seed)
    response.headers["location"] = links.job(job.id)
    return Job.model_validate(job)


@router.get("/calibrations", response_model=Listing[CalibrationLine], responses=CSV_TOO)
def listing(part: Annotated[CalibrationPart, Query()], caller: Reader, request: Request) -> Response:
    """The newest result of each session, the last one measured first."""
    with caller.read() as work:
        found = calibrations.calibrations(
            work, gyro=part.gyro, type_name=part.type, before=part.before(), limit=part.limit
        )
    return listed(request, [_line(item) for item in found.items], found.next, _COLUMNS)


@router.get("/calibrations/{calibration_id}", responses={404: {}}, response_model_exclude_unset=True)
def detail(calibration_id: Id, caller: Reader) -> Calibration:
    """A result: parameters, covariance, residuals, fit, budget, tests, diagnosis; and its provenance."""
    with caller.read() as work:
        found = calibrations.calibration(work, calibration_id)
    return Calibration.model_validate({**found.result, **_provenance(found)})


def _provenance(view: CalibrationView) -> dict[str, Any]:
    return {
        "id": view.id,
        "session": view.session.id,
        "gyro": view.session.gyro,
        "stand": view.session.stand,
        "certificate": view.certificate.number,
        "certificate_digest": view.certificate.digest,
        "latitude_deg": view.session.latitude_deg,
        "revision": view.revision,
        "replaces": view.replaces,
        "replaced_by": view.replaced_by,
        "result_digest": view.result_digest,
        "created_at": view.created_at,
        "created_by": view.created_by,
        "verdict": view.summary.verdict,
    }


def _line(view: SessionView) -> CalibrationLine:
    session = {name: getattr(view, name) for name in ("gyro", "type", "stand", "certificate", "started_at")}
    result = {name: getattr(view.result, name) for name in ResultSummary.__slots__}
    return CalibrationLine.model_validate({**result, **session, "session": view.id})


def _value(name: str, which: str) -> Any:
    def cell(item: CalibrationLine) -> Cell:
        parameter = item.parameters.get(name)
        value: float | None = getattr(parameter, which) if parameter else None
        return value

    return cell


def _unit(name: str) -> str:
    return next(unit for start, unit in _UNITS.items() if name.startswith(start))


_COLUMNS: Final[Columns[CalibrationLine]] = {
    "id": lambda item: item.id,
    "session": lambda item: item.session,
    "revision": lambda item: item.revision,
    "gyro": lambda item: item.gyro,
    "type": lambda item: item.type,
    "stand": lambda item: item.stand,
    "certificate": lambda item: item.certificate,
    "started_at": lambda item: item.started_at,
    "solved_at": lambda item: item.solved_at,
    "method": lambda item: item.method,
    "verdict": lambda item: item.verdict,
    **{f"{name}_{_unit(name)}": _value(name, "value") for name in PARAMETERS},
    **{f"u_{name}_{_unit(name)}": _value(name, "standard_uncertainty") for name in PARAMETERS},
}
