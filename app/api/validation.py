"""The validation pack: its latest report, and running it."""

from datetime import datetime
from typing import Literal

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from app.api import links
from app.api.auth import Reader, Uploader
from app.api.schemas.common import Incoming
from app.api.schemas.jobs import Job
from app.errors import NotFound, problem
from app.services import validation
from app.validation.pack import SEED

router = APIRouter(tags=["operation"])

Verdict = Literal["pass", "fail"]


class Check(BaseModel):
    """One expected value beside the obtained one: so many digits must agree, or it must lie in a range."""

    name: str
    detail: str = ""
    unit: str
    expected: float | str
    obtained: float | str | None
    digits: float | None
    required_digits: float | None
    low: float | None
    high: float | None
    verdict: Verdict


class Case(BaseModel):
    """A problem with its source and the function that solves it."""

    name: str
    verdict: Verdict
    source: str
    function: str
    digits: float | None
    required_digits: float | None
    note: str
    error: str | None
    checks: list[Check]


class Group(BaseModel):
    """Cases that belong together."""

    key: str
    title: str
    verdict: Verdict
    cases: list[Case]


class Validation(BaseModel):
    """What a validation of the installed build found."""

    format: str
    verdict: Verdict
    started_at: datetime
    duration_s: float
    mode: Literal["quick", "full"]
    seed: int
    input_hash: str
    environment: dict[str, str]
    cases: int
    cases_failed: int
    groups: list[Group]


class NewValidation(Incoming):
    """How to validate: `full` is the long coverage study."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"full": False}]})

    full: bool = False
    seed: int = Field(default=SEED, strict=True, ge=0, lt=2**63)


@router.get("/validation", responses={404: {}})
def latest(caller: Reader) -> Validation:
    """The latest report of the installed build; POST runs the pack."""
    with caller.read() as work:
        kept = validation.latest(work)
    if kept is None:
        raise NotFound(
            problem("not-validated", "Nothing has been validated here yet. POST to this address runs it.")
        )
    return Validation.model_validate(kept.content)


@router.post("/validation", status_code=202)
def run(body: NewValidation, caller: Uploader, response: Response) -> Job:
    """Run the pack in the background; while one runs, that one is answered."""
    with caller.write() as work:
        job = validation.request(work, full=body.full, seed=body.seed)
    response.headers["location"] = links.job(job.id)
    return Job.model_validate(job)
