"""What a job of the kind ``validate`` computes, in a process of its own: the pack, kept as a file."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from app.validation import pack
from app.validation.report import json_text, report_json


def validate(payload: Mapping[str, Any], report: Callable[[float, str], None]) -> dict[str, Any]:
    """Run the pack and keep its report in ``payload["folder"]``; see `app.services.validation`."""
    found = pack.run(report, full=payload["full"], seed=payload["seed"])
    name = f"{found.started_at:%Y%m%dT%H%M%S%fZ}.json"
    keep(Path(payload["folder"]), name, json_text(report_json(found)) + "\n")
    return {"name": name}


def keep(folder: Path, name: str, text: str) -> None:
    """Write a report so that nobody ever sees half of one."""
    folder.mkdir(parents=True, exist_ok=True)
    being_written = folder / f".{name}.part"
    with being_written.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    being_written.replace(folder / name)
