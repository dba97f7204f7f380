"""Planning from files, with no database."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from app.cli.plan_tables import print_planned
from app.errors import Invalid, Problem, problem
from app.exchange.certificate import read_certificate
from app.exchange.json_values import dumps, message_json
from app.exchange.parameters import read_parameters
from app.exchange.planned import listed_positions
from app.exchange.uncertainties import read_uncertainties
from app.services import planning
from app.services.plan_question import Asked, Question, Subject
from app.services.plan_subjects import typical
from app.services.plan_views import Planned, as_json
from solver.errors import Message
from solver.records import PARAMETERS

_OPTIONS: Final = {
    "count": "--count", "positions": "--positions", "grid_deg": "--grid", "criterion": "--criterion",
    "time_s": "--time", "moving_s": "--moving", "noise_deg_per_h": "--noise", "floor_deg_per_h": "--floor",
    "gyro": "--nominal",
}  # fmt: skip
"""Where each field of a question stands on the command line."""


def plan(
    certificate: Annotated[
        Path, typer.Option("--certificate", help="The stand's certificate (CSV, Parquet).")
    ],
    latitude: Annotated[
        float, typer.Option("--latitude", min=-90, max=90, help="Of the stand, degrees; south negative.")
    ],
    positions: Annotated[
        str, typer.Option("--positions", help="What these tell, such as 0/0,0/90,90/180; all when not given.")
    ] = "",
    count: Annotated[int | None, typer.Option("--count", help="Propose the best so many instead.")] = None,
    grid: Annotated[
        float | None, typer.Option("--grid", help="Choose from the grid of this step, degrees.")
    ] = None,
    criterion: Annotated[
        str, typer.Option("--criterion", help="D, A, or a parameter: kx ky kxy kyx w0x w0y wg wk.")
    ] = "D",
    repeats: Annotated[bool, typer.Option("--repeats", help="Propose a position several times.")] = False,
    time: Annotated[float, typer.Option("--time", help="Of the whole session, s.")] = 2400.0,
    moving: Annotated[float, typer.Option("--moving", help="To get to each position and settle, s.")] = 60.0,
    noise: Annotated[
        float, typer.Option("--noise", help="Standard uncertainty of a mean over 60 s, °/h.")
    ] = 0.005,
    floor: Annotated[float, typer.Option("--floor", help="What no longer measuring takes away, °/h.")] = 0.0,
    nominal: Annotated[
        Path | None, typer.Option("--nominal", help="Parameters to expect of the gyro (JSON).")
    ] = None,
    uncertainties: Annotated[
        Path | None,
        typer.Option("--uncertainties", help="What all positions have in common: gain, level, … (JSON)."),
    ] = None,
    counts: Annotated[bool, typer.Option("--counts", help="Compare 4 to 16 positions as well.")] = False,
    trade: Annotated[bool, typer.Option("--trade", help="The trade between u(K) and u(ωg) as well.")] = False,
    for_programs: Annotated[bool, typer.Option("--json", help="For programs.")] = False,
) -> None:
    """Tell what positions will tell, or propose the best ones, before anything is measured."""
    rows, warnings = read_certificate(_bytes(certificate), str(certificate))
    values, source = _nominal(nominal)
    statement = read_uncertainties(_bytes(uncertainties), str(uncertainties)) if uncertainties else {}
    asked = Asked(
        count, listed_positions(positions, "--positions") if positions else (), grid, criterion, repeats, time,
        moving, noise, floor,
    )  # fmt: skip
    question = Question(
        tuple(rows), latitude, tuple(values[name] for name in PARAMETERS), asked,
        json.dumps(statement, sort_keys=True),
    )  # fmt: skip
    try:
        found = planning.planned(
            Subject(question, None, str(certificate), source), with_counts=counts, with_trade=trade
        )
    except Invalid as error:
        raise Invalid(*(_at_option(item) for item in error.problems)) from error
    if for_programs:
        typer.echo(dumps(_json(found, warnings)))
    else:
        print_planned(found, warnings)


def _at_option(item: Problem) -> Problem:
    """The problem of a field as that of the option it came from."""
    return replace(item, column=_OPTIONS.get(item.column or "", item.column))


def _nominal(path: Path | None) -> tuple[dict[str, float], Message]:
    values, source = typical()
    if path is None:
        return values, source
    known = read_parameters(_bytes(path), str(path))
    return (
        values | {name: item.value for name, item in known.items()},
        Message("nominal-file", "the file %(file)s", {"file": path.name}),
    )


def _bytes(path: Path) -> bytes:
    if not path.is_file():
        raise Invalid(problem("no-file", "There is no such file.", file=str(path)))
    return path.read_bytes()


def _json(found: Planned, warnings: list[Message]) -> dict[str, Any]:
    written = as_json(found)
    written["plan"]["warnings"][:0] = [message_json(item) for item in warnings]
    return written
