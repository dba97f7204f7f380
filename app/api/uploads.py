"""A whole session in one request."""

import shutil
import zipfile
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import ConfigDict, ValidationError
from starlette.datastructures import UploadFile

from app.api import bodies, links
from app.api.auth import Uploader
from app.api.bodies import body_of, refused_as
from app.api.schemas.common import Incoming, Moment, Name
from app.api.schemas.measuring import Measurement, Uploaded
from app.api.schemas.results import METHODS
from app.api.schemas.warned import warned
from app.api.sessions import Key
from app.services import idempotency, uploads
from app.services.lab import Lab

router = APIRouter(tags=["sessions"])
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
_STATUS: Final[dict[int | str, dict[str, Any]]] = {
    200: {"model": Uploaded, "description": "Brought before, with this Idempotency-Key."},
    202: {"model": Uploaded, "description": "A long session: `job` reads it in the background."},
    404: {},
    409: {},
    413: {},
}
_FORM: Final = {
    "multipart/form-data": {
        "schema": {
            "type": "object",
            "properties": {
                "files": {"type": "array", "items": {"type": "string", "format": "binary"}},
                "gyro": {"type": "string"},
                "stand": {"type": "string"},
                "certificate": {"type": "string"},
                "started_at": {"type": "string", "format": "date-time"},
                "method": {"type": "string", "enum": ["least-squares", "paper", "both"]},
            },
            "required": ["files"],
        }
    }
}


class Fields(Incoming):
    """What is said beside the files; it wins over their `session.json`."""

    model_config = ConfigDict(extra="forbid")

    gyro: Name | None = None
    stand: Name | None = None
    certificate: Name | None = None
    started_at: Moment | None = None
    method: METHODS | None = None
    filename: Name | None = None


@dataclass(frozen=True, slots=True)
class Sent:
    """A session's files in one file on disk."""

    path: Path
    name: str
    fields: Fields


async def _sent(request: Request, query: Annotated[Fields, Query()]) -> AsyncIterator[Sent]:
    """Write what is sent to disk as it comes; everything is gone after the answer."""
    lab: Lab = request.app.state.lab
    request.state.body_budget.limit = lab.settings.upload_limit_bytes
    folder = Path(await run_in_threadpool(mkdtemp, dir=lab.settings.uploads, prefix="session-"))
    try:
        if bodies.media_type(request) == "multipart/form-data":
            async with request.form(max_files=10_000) as form:
                files = [item for _, item in form.multi_items() if isinstance(item, UploadFile)]
                texts = {name: item for name, item in form.multi_items() if isinstance(item, str)}
                fields = _merged(query, texts)
                path = await run_in_threadpool(_packed, folder, files)
            named = files[0].filename if len(files) == 1 else None
            yield Sent(path, fields.filename or named or "session.zip", fields)
        else:
            path = folder / "body"
            await bodies.write(request, path)
            yield Sent(path, bodies.filename(request, query.filename, "session"), query)
    finally:
        await run_in_threadpool(shutil.rmtree, folder)


@router.post(
    "/sessions/upload",
    status_code=201,
    responses=_STATUS,
    openapi_extra=body_of("application/zip", "application/octet-stream", extra=_FORM),
)
def upload(
    caller: Uploader, sent: Annotated[Sent, Depends(_sent)], response: Response, key: Key = None
) -> Uploaded:
    """Bring a whole session, as ZIP or as files of a form; a long one is read in the background."""
    arrived = uploads.arrive(caller.lab.files, sent.path, sent.name)
    wanted = uploads.Wanted(**sent.fields.model_dump(exclude={"filename"}))
    asked = idempotency.fingerprint("upload", [arrived.digest, sent.fields.model_dump(mode="json")])
    with caller.write() as work:
        before = idempotency.made_before(work, key, asked)
        if before is not None:
            response.status_code = 200
            return _shown(uploads.brought_before(work, int(before)), response)
        made = uploads.bring_in(work, arrived, wanted)
        idempotency.remember(work, key, asked, str(made.session.id))
    response.status_code = 202 if arrived.measured is None else 201
    return _shown(made, response)


def _shown(made: uploads.BroughtIn, response: Response) -> Uploaded:
    waiting = made.job if response.status_code == 202 else None
    response.headers["location"] = links.job(waiting.id) if waiting else links.session(made.session.id)
    return Uploaded.model_validate(
        {
            "session": made.session,
            "measured": [Measurement.model_validate(item.measurement) for item in made.saved],
            "job": made.job,
            "warnings": warned(made.warnings),
        }
    )


def _merged(query: Fields, texts: dict[str, Any]) -> Fields:
    try:
        return Fields.model_validate(query.model_dump(exclude_none=True) | texts)
    except ValidationError as error:
        raise refused_as("body", error) from None


def _packed(folder: Path, files: Sequence[UploadFile]) -> Path:
    """The one file that was sent, or an archive of the files that were."""
    path = folder / "session"
    if len(files) == 1:
        with path.open("wb") as target:
            shutil.copyfileobj(files[0].file, target)
        return path
    with zipfile.ZipFile(path, "w") as archive:
        for file in files:
            member = zipfile.ZipInfo(file.filename or "unnamed", _EPOCH)
            with archive.open(member, "w", force_zip64=True) as target:
                shutil.copyfileobj(file.file, target)
    return path
