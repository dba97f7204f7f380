"""The validation pack, from the command line."""

import sys
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from app.cli.validation_text import print_summary, text
from app.errors import Invalid, problem
from app.validation import pack
from app.validation.report import json_text, report_json


class Suffix(StrEnum):
    """Formats of a report, by the ending of its file's name."""

    HTML = ".html"
    JSON = ".json"
    TEXT = ".txt"


_SUFFIXES: Final = ", ".join(Suffix)


def validate(
    full: Annotated[
        bool, typer.Option("--full", help="Coverage over 4,000 sessions with their records: some minutes.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="For programs: the whole report.")] = False,
    report: Annotated[
        list[Path] | None,
        typer.Option("--report", help="Write a dated report; the ending says how: .html, .json, .txt."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Everything random comes from it.")] = pack.SEED,
) -> None:
    """Validate the installed build against published problems; exit code 1 when anything fails."""
    files = [(path, _suffix(path)) for path in report or ()]
    found = report_json(_run(full, seed))
    for path, suffix in files:
        path.write_text(_WRITERS[suffix](found), encoding="utf-8")
    if as_json:
        typer.echo(json_text(found))
    else:
        print_summary(found)
        for path, _ in files:
            typer.echo(f"report: {path}", err=True)
    if found["verdict"] != "pass":
        sys.exit(1)


def _suffix(path: Path) -> Suffix:
    if path.suffix.lower() not in list(Suffix):
        raise Invalid(
            problem("bad-report-name", "A report ends with one of %(endings)s; %(name)s does not.",
                    column="--report", endings=_SUFFIXES, name=path.name)
        )  # fmt: skip
    if not path.parent.is_dir():
        raise Invalid(problem("no-folder", "There is no folder %(folder)s. Make it first.",
                              column="--report", folder=str(path.parent)))  # fmt: skip
    return Suffix(path.suffix.lower())


def _run(full: bool, seed: int) -> Any:
    if not sys.stderr.isatty():
        return pack.run(lambda fraction, what: None, full=full, seed=seed)
    columns = (TextColumn("{task.description:<40}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        return pack.run(
            lambda fraction, what: bar.update(task, completed=fraction, description=what),
            full=full, seed=seed,
        )  # fmt: skip


def _html(found: dict[str, Any]) -> str:
    from app.pages.validation import document  # the pages are slow to load, and only this needs them

    return document(found)


_WRITERS: Final[dict[Suffix, Callable[[dict[str, Any]], str]]] = {
    Suffix.HTML: _html,
    Suffix.JSON: lambda found: json_text(found) + "\n",
    Suffix.TEXT: text,
}
