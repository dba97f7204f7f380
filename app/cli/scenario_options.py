"""What the commands that simulate have in common: which bench they mean."""

from dataclasses import replace
from typing import Annotated, Final

import typer

from app.errors import Invalid, problem
from simdevice.bench import Bench
from simdevice.certificate import Position
from simdevice.scenarios import SCENARIOS
from solver.units import rad_from_deg

_HELP: Final = "; ".join(f"{item.name}: {item.summary}" for item in SCENARIOS.values())

Seed = Annotated[int, typer.Option("--seed", min=0, help="Everything random comes from it.")]
ScenarioName = Annotated[str, typer.Option("--scenario", help=_HELP)]
Latitude = Annotated[
    float | None, typer.Option("--latitude", min=-90, max=90, help="Degrees, south negative.")
]


def scenario_bench(
    name: str, seed: int, latitude_deg: float | None, places: tuple[Position, ...] | None = None
) -> Bench:
    """The bench of a named scenario, moved to another latitude if one is given.

    `places` are those that the stand's certificate covers; default: the sixteen.

    Raises
    ------
    Invalid
        Names the scenarios that there are.
    """
    if name not in SCENARIOS:
        raise Invalid(problem("unknown-scenario", "There is no scenario %(name)s. There are: %(names)s.",
                              column="--scenario", name=name, names=", ".join(SCENARIOS)))  # fmt: skip
    bench = SCENARIOS[name].bench(seed, places)
    if latitude_deg is None:
        return bench
    return replace(bench, stand=replace(bench.stand, latitude=rad_from_deg(latitude_deg)))
