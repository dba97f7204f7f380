"""Pages for people: one module per noun, handlers that parse, call a service and render.

Addresses: ``/`` today · ``/sessions`` ``/sessions/new`` ``/sessions/{id}`` ``/sessions/{id}/live`` · ``/results``
``/results/{id}`` · ``/measurements/{id}`` · ``/gyros`` ``/gyros/{serial}`` (its history)
``/gyros/{serial}/edit`` ``/gyros/{serial}/drift/{parameter}`` ``/gyros/{serial}/baseline``
``/gyros/{serial}/events/new`` · ``/alarms`` ``/alarms/{id}`` · ``/types/{name}`` · ``/stands`` ``/stands/{name}``
``/stands/{name}/plan`` ``/stands/{name}/uncertainty`` · ``/certificates``
``/certificates/{stand}/{number}`` · ``/simulations/new`` · ``/jobs/{id}`` · ``/method`` ·
``/loop`` · ``/validation`` ``/validation/{report}``.

State is in the address: filters, sorting and pages of a list are GET. A form that cannot be used
comes back with status 422 and what was typed. `mount` puts everything into an application whose
``app.state.lab`` is a `Lab`; errors are shown by `errors.page`.
"""

from fastapi import APIRouter, FastAPI
from fastapi.staticfiles import StaticFiles

from app.pages import (
    alarms,
    assets,
    baselines,
    certificates,
    choices,
    compare,
    drift,
    drift_files,
    entry,
    errors,
    events,
    fleet,
    gyros,
    history,
    jobs,
    live,
    loop,
    measurements,
    method,
    planning,
    results,
    session_files,
    sessions,
    sign_in,
    simulations,
    stand_drift,
    stands,
    today,
    types,
    uncertainty,
    validation,
)
from app.pages.base import STATIC, Language

__all__ = ["errors", "mount", "router"]

router = APIRouter(include_in_schema=False)
for _noun in (
    today, sessions, session_files, entry, live, results, measurements, gyros, history, drift, baselines,
    events, alarms, types, fleet, compare, stands, stand_drift, drift_files, planning, uncertainty, certificates,
    simulations, jobs, method, loop, validation, sign_in, choices, assets,
):  # fmt: skip
    router.include_router(_noun.router)


def mount(app: FastAPI) -> None:
    """Put the pages, their files and the choice of language into the application."""
    app.include_router(router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    # The package is only looked up, never imported: it would want Django.
    app.mount("/lib/htmx", StaticFiles(packages=[("django_htmx", "static/django_htmx")]), name="htmx")
    app.add_middleware(Language)
