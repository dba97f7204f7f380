"""The demonstration laboratory."""

import shutil
from datetime import timedelta
from pathlib import Path
from typing import Annotated

import platformdirs
import typer

from app.cli.service import Port, listen, run
from app.errors import Conflict, problem
from app.services import access, demonstration
from app.services.access import SYSTEM
from app.services.opening import open_lab
from app.settings import Settings

_MARK = "demonstration"
_LINK_VALID = timedelta(days=1)


def demo(
    port: Port = 8000,
    data: Annotated[Path | None, typer.Option("--data", help="Folder of the demonstration's own.")] = None,
    reset: Annotated[bool, typer.Option("--reset", help="Throw the folder away and begin anew.")] = False,
    serve: Annotated[bool, typer.Option("--serve/--no-serve", help="Serve it afterwards.")] = True,
) -> None:
    """Make a demonstration laboratory, then serve it with a sign-in link."""
    folder = data or Path(platformdirs.user_data_dir("driftbook-demo", appauthor=False))
    lab_settings = Settings(data=folder)
    listening = listen("127.0.0.1", port) if serve else None
    _prepare(folder, reset)
    if not (folder / _MARK).exists():
        _build(lab_settings)
    typer.echo(f"Laboratory: {folder}")
    if listening is not None:
        with open_lab(lab_settings) as lab, lab.write(SYSTEM) as work:
            secret = access.make_sign_in_link(work, demonstration.DEMO_ACCOUNT, _LINK_VALID)
        run(lab_settings, listening, lambda url: _announce(url, secret))


def _prepare(folder: Path, reset: bool) -> None:
    """Empty the folder when asked or half built; never one that is not a demonstration's."""
    if not folder.exists() or not any(folder.iterdir()):
        return
    ours = (folder / _MARK).exists() or (folder / (_MARK + ".building")).exists()
    if not ours:
        raise Conflict(
            problem(
                "not-a-demonstration",
                "%(folder)s holds something else than a demonstration laboratory and is left alone. "
                "Name an empty folder with --data.",
                folder=str(folder),
            )
        )
    if reset or not (folder / _MARK).exists():
        shutil.rmtree(folder)


def _build(lab_settings: Settings) -> None:
    typer.echo("Making a laboratory: six gyros, one stand, a year of sessions …")
    lab_settings.data.mkdir(parents=True, exist_ok=True)
    building = lab_settings.data / (_MARK + ".building")
    building.touch()
    with open_lab(lab_settings) as lab:
        demonstration.build(lab)
    building.rename(lab_settings.data / _MARK)


def _announce(url: str, secret: str) -> None:
    typer.echo(f"Driftbook is on {url}")
    typer.echo(f"Sign in: {url}/sign-in/link/{secret}")
    typer.echo("Stop with Ctrl+C.")
