"""The REST API for machines, under ``/api/v1``: one module per noun, the same nouns as the pages.

A handler parses, calls a service, and answers by a schema; it is synchronous and runs in a thread,
and its transaction is committed before the answer is sent. Errors become problem documents in
`problems`. `create` makes an application of its own, to be mounted at `ROOT`, whose ``state.lab``
is set when the laboratory is open.
"""

from importlib.metadata import version
from typing import Final

from fastapi import FastAPI

from app.api import (
    alarms,
    baselines,
    calibrations,
    certificates,
    compare,
    docs,
    drift,
    drift_tables,
    due,
    events,
    fleet,
    gyros,
    history,
    jobs,
    loop,
    openapi,
    planning,
    positions,
    problems,
    sessions,
    simulations,
    stand_drift,
    stands,
    station,
    types,
    uploads,
    validation,
)
from app.api.health import router as health
from app.api.links import ROOT
from app.api.metrics import Metrics

__all__ = ["ROOT", "Metrics", "create", "health", "problems"]

_DESCRIPTION: Final = (
    "Calibration of dynamically tuned gyroscopes: gyros, stands and their certificates, sessions, "
    "results. Every number is in the unit that its field's name ends with."
)
_NOUNS: Final = (
    gyros, history, drift, events, baselines, alarms, types, fleet, compare, loop, stands, stand_drift,
    drift_tables, planning, certificates, uploads, sessions, positions, calibrations, due, simulations, station, jobs,
    validation, docs,
)  # fmt: skip


def create() -> FastAPI:
    """The API's application."""
    app = FastAPI(
        title="Driftbook",
        version=version("driftbook"),
        description=_DESCRIPTION,
        servers=[{"url": ROOT}],
        root_path_in_servers=False,
        docs_url=None,
        redoc_url=None,
    )
    problems.install(app)
    for noun in _NOUNS:
        app.include_router(noun.router)
    app.openapi = lambda: openapi.describe(app)  # type: ignore[method-assign]
    return app
