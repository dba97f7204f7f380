"""Baselines: what a gyro's parameters are judged against."""

from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from app.api.auth import Reader, Uploader
from app.api.pagination import TABLE_TOO, Columns, Listing, listed
from app.api.schemas.common import Id, Incoming, Name, Since
from app.api.schemas.drift import Baseline, Method, NewBaseline, ProposedBaseline
from app.services.drift import baselines

router = APIRouter(tags=["drift"])

_COLUMNS: Final[Columns[Baseline]] = {
    "id": lambda item: item.id,
    "parameter": lambda item: item.parameter,
    "unit": lambda item: item.unit,
    "method": lambda item: item.method,
    "valid_from": lambda item: item.valid_from,
    "estimator": lambda item: item.estimator,
    "centre": lambda item: item.centre,
    "scatter": lambda item: item.scatter,
    "dof": lambda item: item.dof,
    "u_typical": lambda item: item.u_typical,
    "within": lambda item: item.within,
    "count": lambda item: item.count,
    "limits": lambda item: item.limits,
    "calibrations": lambda item: " ".join(map(str, item.calibrations)),
    "reason": lambda item: item.reason,
    "frozen_at": lambda item: item.frozen_at,
    "frozen_by": lambda item: item.frozen_by,
    "retired_at": lambda item: item.retired_at,
    "retired_by": lambda item: item.retired_by,
}


class Which(Incoming):
    """Which baselines."""

    method: Method | None = None
    retired: Annotated[bool, Field(description="Those retired as well.")] = False


class Stretch(Incoming):
    """Where to look for a stretch."""

    method: Method = "least-squares"
    since: Annotated[Since, Field(alias="from", description="Not before this time or day.")] = None


@router.get("/gyros/{serial}/baselines", response_model=Listing[Baseline], responses=TABLE_TOO | {404: {}})
def of_gyro(serial: Name, which: Annotated[Which, Query()], caller: Reader, request: Request) -> Response:
    """What a gyro's parameters are judged against."""
    with caller.read() as work:
        found = baselines.of_gyro(work, serial, method=which.method, retired=which.retired)
    return listed(request, [Baseline.model_validate(item) for item in found], None, _COLUMNS)


@router.get("/gyros/{serial}/baselines/proposal", responses={404: {}, 409: {}})
def proposal(serial: Name, stretch: Annotated[Stretch, Query()], caller: Reader) -> ProposedBaseline:
    """The first stretch of sessions that no event interrupts, and what it would give."""
    with caller.read() as work:
        return ProposedBaseline.model_validate(
            baselines.propose(work, serial, method=stretch.method, since=stretch.since)
        )


@router.post("/gyros/{serial}/baselines", status_code=201, responses={404: {}})
def freeze(serial: Name, body: NewBaseline, caller: Uploader) -> list[Baseline]:
    """Freeze baselines; for accounts with the role metrologist, quality or admin."""
    with caller.write() as work:
        made = baselines.freeze(
            work, serial, body.parameters, body.calibrations, method=body.method, estimator=body.estimator,
            limits=body.limits, rules=body.rules, valid_from=body.valid_from, reason=body.reason,
        )  # fmt: skip
    return [Baseline.model_validate(item) for item in made]


@router.post("/baselines/{number}/retirement", responses={404: {}, 409: {}})
def retire(number: Id, caller: Uploader) -> Baseline:
    """Judge by a baseline no more; for accounts with the role metrologist, quality or admin."""
    with caller.write() as work:
        return Baseline.model_validate(baselines.retire(work, number))
