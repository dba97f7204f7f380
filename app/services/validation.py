"""Validations of the installed build: asked for, computed by a job, kept in the data folder.

A report is a file ``validation/TIME.json`` beside the records, named by the instant it was begun; the
latest is the one that counts. Reports of older versions stay: they say what those versions did.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from app.errors import NotFound, problem
from app.services import jobs
from app.services.lab import Work
from app.services.views import JobView
from app.validation import pack

KIND: Final = "validate"
_NAME: Final = re.compile(r"\d{8}T\d{12}Z")


@dataclass(frozen=True, slots=True)
class KeptReport:
    """A report by its name, which is the instant when it was begun; `content` as `report_json` wrote it."""

    name: str
    content: Mapping[str, Any]


def request(work: Work, *, full: bool = False, seed: int = pack.SEED) -> JobView:
    """Put a validation in the queue; one that waits or runs already is answered instead of a second."""
    going = running(work)
    if going is not None:
        return going
    return jobs.submit(work, KIND, {"full": full, "seed": seed}, None)


def running(work: Work) -> JobView | None:
    """The validation that waits or runs."""
    return next((job for job in jobs.active(work) if job.kind == KIND), None)


def names(work: Work) -> tuple[str, ...]:
    """Names of the reports kept, the newest first."""
    found = (path.stem for path in _folder(work).glob("*.json"))
    return tuple(sorted((name for name in found if _NAME.fullmatch(name)), reverse=True))


def latest(work: Work) -> KeptReport | None:
    """The newest report."""
    kept = names(work)
    return report(work, kept[0]) if kept else None


def report(work: Work, name: str) -> KeptReport:
    """One report.

    Raises
    ------
    NotFound
        There is none of that name.
    """
    if name not in names(work):
        raise NotFound(problem("unknown-report", "There is no validation report %(name)s.", name=name))
    text = (_folder(work) / f"{name}.json").read_text(encoding="utf-8")
    return KeptReport(name, json.loads(text))


def prepare(work: Work, session_id: int | None, wanted: Mapping[str, Any]) -> dict[str, Any]:
    """What the validating process needs."""
    return {"folder": str(_folder(work)), "full": wanted["full"], "seed": wanted["seed"]}


def store(
    work: Work, session_id: int | None, wanted: Mapping[str, Any], output: Mapping[str, Any]
) -> int | None:
    """Nothing is left to be kept: the process wrote the report."""
    return None


def _folder(work: Work) -> Path:
    return work.files.folder.parent / "validation"
