"""Files for a session: chosen or dropped, read at once when they are short, else in the background."""

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from fastapi import APIRouter, Request, Response
from starlette.datastructures import UploadFile

from app.errors import AppError, Invalid, problem
from app.exchange.archive import zip_bytes
from app.i18n import ngettext, translate
from app.pages.base import TheLab, Writer, see
from app.pages.forms import Form, Sent
from app.pages.sessions import show
from app.services import session_files, uploads
from app.services.lab import Lab
from app.services.uploads import Arrived, BroughtIn

router = APIRouter()

_LARGEST_PACKED: Final = 256 * 2**20


@router.post("/sessions/{session_id:int}/files")
def bring(request: Request, person: Writer, lab: TheLab, session_id: int, sent: Sent) -> Response:
    """Read the files into the session; several are taken as one session's."""
    files = [item for item in sent.getlist("files") if isinstance(item, UploadFile) and item.filename]
    try:
        arrived = _arrive(lab, files)
        with lab.write(person) as work:
            brought = session_files.bring_into(work, session_id, arrived)
    except AppError as error:
        if error.status not in (409, 422):
            raise
        form = Form().with_problems(*error.problems)
        return show(request, lab, person, session_id, form=form, status=error.status)
    if brought.job is not None:
        return see(f"/jobs/{brought.job.id}")
    return show(request, lab, person, session_id, warnings=_told(brought))


def _told(brought: BroughtIn) -> list[str]:
    new = sum(item.new for item in brought.saved)
    count = ngettext("%(n)d position was saved.", "%(n)d positions were saved.", new) % {"n": new}
    same = len(brought.saved) - new
    texts = [count]
    if same:
        texts.append(ngettext("%(n)d was there already.", "%(n)d were there already.", same) % {"n": same})
    return [" ".join(texts), *(translate(message) for message in brought.warnings)]


def _arrive(lab: Lab, files: Sequence[UploadFile]) -> Arrived:
    """Bring the files to disk beside the record files, several of them packed into one archive."""
    if not files:
        raise Invalid(problem("no-file-chosen", "Choose at least one file.", column="files"))
    lab.settings.uploads.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=lab.settings.uploads) as folder:
        path = Path(folder) / "upload"
        if len(files) == 1:
            with path.open("wb") as target:
                shutil.copyfileobj(files[0].file, target)
            return uploads.arrive(lab.files, path, files[0].filename or "file")
        path.write_bytes(zip_bytes(_read(files)))
        return uploads.arrive(lab.files, path, "files.zip")


def _read(files: Sequence[UploadFile]) -> dict[str, bytes]:
    if sum(item.size or 0 for item in files) > _LARGEST_PACKED:
        raise Invalid(
            problem(
                "too-much-at-once",
                "These files are too long together. Pack them into a ZIP archive and bring that.",
                column="files",
            )
        )
    return {Path(item.filename or "file").name: item.file.read() for item in files}
