"""Simulated sessions."""

from typing import Any, Final

from fastapi import APIRouter, Response

from app.api import links
from app.api.auth import Uploader
from app.api.schemas.jobs import Job, NewSimulation
from app.api.sessions import Key
from app.services import idempotency, jobs, simulations

router = APIRouter(tags=["sessions"])
_AGAIN: Final[dict[int | str, dict[str, Any]]] = {
    200: {"model": Job, "description": "Asked for before, with this Idempotency-Key."}
}


@router.post("/simulations", status_code=202, responses=_AGAIN | {404: {}, 409: {}})
def simulate(body: NewSimulation, caller: Uploader, response: Response, key: Key = None) -> Job:
    """Open a session, measure it by the simulator, and solve it: all in the background."""
    asked = idempotency.fingerprint("simulation", body.model_dump(mode="json", exclude_unset=True))
    with caller.write() as work:
        before = idempotency.made_before(work, key, asked)
        if before is None:
            _, job = simulations.request(work, simulations.NewSimulation(**body.model_dump()))
            idempotency.remember(work, key, asked, job.id)
        else:
            job, response.status_code = jobs.job(work, before), 200
    response.headers["location"] = links.job(job.id)
    return Job.model_validate(job)
