"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from app.settings import Settings, default_data_folder

Data = Annotated[
    Path | None,
    typer.Option("--data", help="Data folder (default: $DRIFTBOOK_DATA, else a folder of the user's)."),
]


def settings(data: Path | None) -> Settings:
    """The laboratory in that folder."""
    return Settings(data=data or default_data_folder())
