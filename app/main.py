"""The service, put together: laboratory, jobs, API, pages, middleware."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractContextManager, asynccontextmanager, contextmanager
from datetime import timedelta
from typing import Final

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Scope

from app import api, logs, pages, plots
from app.errors import AppError, Forbidden, problem
from app.jobs.engine import JobEngine
from app.middleware import BodyLimit, LastResort, RequestLog, SameSite, SecurityHeaders
from app.services import access, uploads
from app.services.drift import following
from app.services.lab import Lab
from app.services.ledger import JobLedger
from app.services.opening import open_lab
from app.settings import Settings

_PRELOAD: Final = ("app.services.computing",)
_LEFT_BEHIND: Final = timedelta(days=1)
"""No upload takes so long: older parts of one belong to nobody."""

Opening = Callable[[Settings], AbstractContextManager[Lab]]


@contextmanager
def working_lab(settings: Settings) -> Iterator[Lab]:
    """The laboratory with its job engine at work; not to be entered inside an event loop."""
    with open_lab(settings) as lab:
        engine = JobEngine(settings.url, JobLedger(lab), slots=settings.workers, preload=_PRELOAD)
        lab.queue = engine
        engine.start()
        with lab.write(access.SYSTEM) as work:
            following.catch_up(work)
        uploads.sweep(settings.uploads, _LEFT_BEHIND)
        try:
            yield lab
        finally:
            engine.stop()


def create_app(settings: Settings, opening: Opening = working_lab) -> FastAPI:
    """The service for one laboratory.

    Parameters
    ----------
    settings
        Where its data are, and how it runs.
    opening
        How the laboratory is opened; while the service runs it is ``app.state.lab``.
    """
    logs.configure()
    service = api.create()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        opened = opening(settings)
        app.state.lab = service.state.lab = await asyncio.to_thread(opened.__enter__)
        charts = plots.warm_up()
        try:
            yield
        finally:
            charts.cancel()
            await asyncio.to_thread(opened.__exit__, None, None, None)

    app = FastAPI(title="Driftbook", lifespan=lifespan, openapi_url=None)
    app.state.metrics = api.Metrics()
    app.include_router(api.health)
    app.mount(api.ROOT, service)
    pages.mount(app)
    for kind in (AppError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, _answer)
    service.add_middleware(LastResort, answer=api.problems.answer)
    app.add_middleware(LastResort, answer=_answer)
    _protect(app, settings)
    return app


def _protect(app: FastAPI, settings: Settings) -> None:
    """Wrap the middleware around it, from the inside out."""
    app.add_middleware(BodyLimit, largest=settings.upload_limit_bytes)
    app.add_middleware(SameSite, origin=settings.origin, refusal=_foreign)
    app.add_middleware(SecurityHeaders, https=settings.origin.startswith("https:"))
    app.add_middleware(RequestLog, observe=app.state.metrics.observe)


def _foreign(scope: Scope) -> Response:
    error = Forbidden(
        problem("cross-site", "This request came from another site. Open the page here and send it again.")
    )
    if _is_for_programs(scope["path"]):
        return api.problems.response(error)
    return Response(str(error), error.status, media_type="text/plain")


async def _answer(request: Request, error: Exception) -> Response:
    """A problem document for programs, a page for people."""
    if _is_for_programs(request.url.path):
        return await api.problems.answer(request, error)
    return await asyncio.to_thread(pages.errors.page, request, error)


def _is_for_programs(path: str) -> bool:
    return path.startswith("/api/")
