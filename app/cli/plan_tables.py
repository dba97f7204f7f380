"""A plan as tables in a terminal."""

from collections.abc import Iterable, Sequence
from typing import Final

import typer
from rich.console import Console
from rich.table import Table

from app.figures import decimals_of, rounded
from app.services.plan_views import Plan, Planned, PlannedParameter, Trade, TradePoint, Worth
from solver.errors import Message

_NAMES: Final = {
    "kx": "Kx  scale factor, x", "ky": "Ky  scale factor, y", "kxy": "Kxy cross-coupling, y into x",
    "kyx": "Kyx cross-coupling, x into y", "w0x": "ω0x fixed drift, x", "w0y": "ω0y fixed drift, y",
    "wg": "ωg  g-drift, direct", "wk": "ωк  g-drift, quadrature",
}  # fmt: skip
_UNITS: Final = {"deg/h/mA": "°/h/mA", "deg/h": "°/h", "deg/h/g": "°/h/g"}
_KINDS: Final = {"front": "", "paper": "the paper's eight", "all": "all sixteen", "plan": "this plan"}


def print_planned(planned: Planned, warnings: Sequence[Message]) -> None:
    """Print the positions, the uncertainties to expect, and what was compared."""
    console = Console(highlight=False)
    plan = planned.plan
    console.print(_head(plan), soft_wrap=True)
    if plan.determined:
        chosen = [(item.theta_deg, item.psi_deg) for item in plan.positions for _ in range(item.times)]
        console.print(f"  {_listed(chosen)}", soft_wrap=True)
        console.print(_parameters(plan.parameters))
        condition = "" if plan.condition is None else f", condition {plan.condition:.3g}"
        console.print(f"rank {plan.rank}{condition}, {plan.dof} degrees of freedom", soft_wrap=True)
    if planned.counts:
        console.print(_counts(planned.counts))
    if planned.trade is not None:
        console.print(_trade(planned.trade))
    for message in [*warnings, *plan.warnings]:
        typer.echo(f"warning: {message.text}", err=True)


def _head(plan: Plan) -> str:
    time = f"{plan.count} positions, {plan.duration_s:.4g} s at each"
    if plan.search is None:
        return time
    if not plan.determined:
        return (
            f"No choice of {plan.count} positions determines what criterion {plan.search.criterion} asks for."
        )
    search = plan.search
    how = (
        f"best of {search.tried} sets, every one tried, those that bury the scale factors in noise last"
        if search.exhaustive
        else (f"best of {search.starts} exchanges, {search.tried} sets tried")
    )
    return (
        f"{time}, chosen from {search.candidates}: {how}; "
        f"{search.criterion} = {search.figure:.4g} {_UNITS[search.unit]}"
    )


def _listed(positions: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{theta:g}/{psi:g}" for theta, psi in positions)


def _parameters(parameters: Sequence[PlannedParameter]) -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("parameter")
    for name in ("u", "U", "k"):
        table.add_column(name, justify="right")
    table.add_column("unit")
    table.add_column("mostly from")
    for item in parameters:
        if item.u is None or item.expanded is None or item.k is None:
            table.add_row(_NAMES[item.name], "–", "not determined", "–", _UNITS[item.unit], "")
            continue
        decimals = decimals_of(item.u) or 0
        mostly = "" if item.share is None else f"{item.dominating} {100 * item.share:.0f} %"
        table.add_row(
            _NAMES[item.name], rounded(item.u, decimals), rounded(item.expanded, decimals), f"{item.k:.2f}",
            _UNITS[item.unit], mostly,
        )  # fmt: skip
    return table


def _counts(counts: Sequence[Worth]) -> Table:
    table = Table(title="How many positions are worth it", title_justify="left", box=None, pad_edge=False)
    for name in ("positions", "s at each", "criterion", "u(Kx)", "u(ω0x)", "u(ωg)"):
        table.add_column(name, justify="right")
    table.add_column("")
    for item in counts:
        cells = ["–" if item.u[name] is None else f"{item.u[name]:.3g}" for name in ("kx", "w0x", "wg")]
        said = ["best"] * item.best + ["below method"] * item.below_method
        table.add_row(
            str(item.count), f"{item.duration_s:.4g}", f"{item.figure:.4g}", *cells, ", ".join(said)
        )
    return table


def _trade(trade: Trade) -> Table:
    title = f"u(K) against u(ωg): {trade.count} positions of the grid of {trade.grid_deg:g}°"
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column("u(K), °/h/mA", justify="right")
    table.add_column("u(ωg), °/h/g", justify="right")
    table.add_column("")
    table.add_column("positions")
    for point in [*trade.front, *trade.marked]:
        table.add_row(*_point(point))
    return table


def _point(point: TradePoint) -> tuple[str, ...]:
    return (
        f"{point.u_k_deg_per_h_per_ma:.4g}",
        f"{point.u_wg_deg_per_h_per_g:.4g}",
        _KINDS[point.kind],
        _listed(point.positions),
    )
