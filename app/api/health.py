"""For whoever operates the service, at the root and without a token."""

from typing import Literal

import structlog
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from app.api.metrics import MEDIA_TYPE, Metrics
from app.services import readiness
from app.services.lab import Lab

router = APIRouter(tags=["operation"], include_in_schema=False)
_log = structlog.get_logger(__name__)


class Alive(BaseModel):
    """The process answers."""

    status: Literal["alive"] = "alive"


class Ready(BaseModel):
    """Whether requests can be served, and what each part says: ``ok`` or what is wrong."""

    status: Literal["ready", "not ready"]
    checks: dict[str, str]


@router.get("/health/live")
def live() -> Alive:
    """The process answers; restart it when it does not."""
    return Alive()


@router.get("/health/ready")
def ready(request: Request, response: Response) -> Ready:
    """Database, migrations and data folder are there; 503 sends traffic elsewhere."""
    checks = readiness.checks(request.app.state.lab)
    wrong = {name: said for name, said in checks.items() if said != readiness.OK}
    if wrong:
        _log.warning("not-ready", **wrong)
        response.status_code = 503
    return Ready(status="not ready" if wrong else "ready", checks=checks)


@router.get("/metrics")
def metrics(request: Request) -> Response:
    """Counters in Prometheus' text format."""
    lab: Lab = request.app.state.lab
    counted: Metrics = request.app.state.metrics
    return Response(counted.text(lab), media_type=MEDIA_TYPE)
