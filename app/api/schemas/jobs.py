"""Work in the background, and problem documents."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.api import links, problems
from app.api.schemas.common import Incoming, Name, NotNegative, Outgoing, Positive
from app.api.schemas.results import METHODS
from app.services.calibrations import TRIALS
from app.services.views import JobView


class PlacedProblem(BaseModel):
    """One thing that is wrong, and where."""

    model_config = ConfigDict(extra="allow")

    detail: str
    code: str
    pointer: Annotated[str, Field(description="Place in a JSON body (RFC 6901).")] = ""
    parameter: Annotated[str, Field(description="Parameter of the address.")] = ""
    header: str = ""
    file: str = ""
    row: Annotated[int, Field(description="Line of the file; the header is line 1.")] = 0
    column: str = ""


class ProblemDocument(BaseModel):
    """Why a request was refused, or a job failed (RFC 9457)."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "/api/v1/docs#invalid",
                    "title": "Input not usable",
                    "status": 422,
                    "detail": "jx_ma: This must be a number, written without quotation marks.",
                    "code": "not-a-number",
                    "errors": [
                        {
                            "detail": "This must be a number, written without quotation marks.",
                            "code": "not-a-number",
                            "pointer": "#/jx_ma",
                        }
                    ],
                }
            ]
        }
    )

    type: str
    title: str
    status: int
    detail: str
    code: str
    errors: list[PlacedProblem]


class Job(Outgoing):
    """How a piece of work stands; `result` is the address of what it gave."""

    id: str
    kind: str
    state: Literal["queued", "running", "succeeded", "failed", "cancelled"]
    progress: Annotated[float, Field(ge=0, le=1)]
    phase: str
    session: int | None
    result: str | None
    error: dict[str, Any] | None
    created_at: datetime
    created_by: str
    started_at: datetime | None
    finished_at: datetime | None

    @model_validator(mode="before")
    @classmethod
    def _of_view(cls, value: Any) -> Any:
        return _fields(value) if isinstance(value, JobView) else value


class NewCalibration(Incoming):
    """How to solve."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"method": "both"}]})

    method: METHODS = "both"
    monte_carlo: Annotated[
        Annotated[int, Field(strict=True, ge=0)] | Literal["adaptive"],
        Field(
            description="Draws to propagate the distributions by: 0 for none, from 10,000 on, or adaptive for as many "
            "as are needed."
        ),
    ] = TRIALS
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63, description="Of these draws.")] = 0


class NewSimulation(Incoming):
    """A session to simulate; without `noise_deg_per_h` (of a position's mean) the type's own noise."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"gyro": "0417", "stand": "S1", "seed": 7}]})

    gyro: Name
    stand: Name
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)]
    duration_s: Positive = 60.0
    rate_hz: Positive = 200.0
    noise_deg_per_h: NotNegative | None = None
    certificate: Name | None = None
    method: METHODS = "both"


def _fields(view: JobView) -> dict[str, Any]:
    fields: dict[str, Any] = {name: getattr(view, name) for name in JobView.__slots__}
    failed = view.state == "failed"
    return fields | {
        "result": _result(view),
        "error": problems.job_failed(view.problems) if failed else None,
    }


def _result(view: JobView) -> str | None:
    if view.calibration is not None:
        return links.calibration(view.calibration)
    if view.kind == "import" and view.state == "succeeded" and view.session is not None:
        return links.session(view.session)
    if view.kind == "validate" and view.state == "succeeded":
        return f"{links.ROOT}/validation"
    return None
