"""A plan as its page shows it: rows, the map of positions, the chart of the trade."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from fastapi import Request

from app import plots
from app.figures import DASH, Figure, decimals_of, figure, significant
from app.i18n import gettext, ngettext
from app.pages import labels
from app.pages.base import with_query
from app.pages.result_limits import SOURCES
from app.pages.result_view import limit_text
from app.plots.theme import Spec
from app.services.plan_views import Plan, PlannedParameter, PlannedPosition, Trade, TradePoint, Worth
from solver.records import PARAMETERS

_LARGE_MAP = 6


@dataclass(frozen=True, slots=True)
class ParameterRow:
    """One parameter: its uncertainties as printed (None: not determined) and what they come from."""

    view: PlannedParameter
    u: Figure | None
    expanded: Figure | None
    limit: str
    of_limits: str
    mostly: str


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of the map: class of its look, its number in the list, and the word in it."""

    theta_deg: float
    psi_deg: float
    shape: str
    number: int | None
    word: str


@dataclass(frozen=True, slots=True)
class PlanMap:
    """Rows by θ, columns by ψ; `fine` when there are many."""

    psi_deg: tuple[float, ...]
    rows: tuple[tuple[float, tuple[Cell | None, ...]], ...]
    fine: bool


def parameter_rows(plan: Plan) -> list[ParameterRow]:
    """The table of parameters: u and U down to U's second digit."""
    return [_row(item) for item in plan.parameters]


def factors_text(plan: Plan) -> str:
    """The coverage factors, smallest to largest where they differ."""
    known = [item.k for item in plan.parameters if item.k is not None]
    ends = {str(figure(end, 2)) for end in (min(known), max(known))} if known else set()
    return "…".join(sorted(ends)) or DASH


def _row(item: PlannedParameter) -> ParameterRow:
    decimals = decimals_of(item.expanded)
    known = item.u is not None and decimals is not None
    mostly = ""
    if item.dominating is not None and item.share is not None:
        mostly = gettext("%(source)s, %(share)d %%") % {
            "source": gettext(SOURCES[item.dominating]), "share": round(100 * item.share)
        }  # fmt: skip
    return ParameterRow(
        view=item,
        u=figure(item.u, decimals) if known and decimals is not None else None,
        expanded=figure(item.expanded, decimals) if known and decimals is not None else None,
        limit=limit_text(item.low, item.high),
        of_limits="" if item.of_limits is None else f"{significant(100 * item.of_limits, 2)} %",
        mostly=mostly,
    )


def plan_map(plan: Plan, candidates: Iterable[tuple[float, float]]) -> PlanMap:
    """Every candidate, and which of them are chosen."""
    chosen = {(item.theta_deg, item.psi_deg): (number, item) for number, item in enumerate(plan.positions, 1)}
    places = sorted({*candidates, *chosen})
    psi = tuple(sorted({place[1] for place in places}))
    theta = sorted({place[0] for place in places})
    known = set(places)
    return PlanMap(
        psi,
        tuple((t, tuple(_cell(t, p, chosen.get((t, p))) if (t, p) in known else None for p in psi)) for t in theta),
        fine=len(psi) > _LARGE_MAP,
    )  # fmt: skip


def _cell(theta: float, psi: float, chosen: tuple[int, PlannedPosition] | None) -> Cell:
    if chosen is None:
        return Cell(theta, psi, "left", None, "")
    number, item = chosen
    if not item.certified:
        return Cell(theta, psi, "attention", number, gettext("not certified"))
    word = gettext("measure") if item.times == 1 else times_text(item.times)
    return Cell(theta, psi, "ok", number, word)


def times_text(times: int) -> str:
    """How often a position is measured."""
    return ngettext("%(num)d time", "%(num)d times", times) % {"num": times}


@dataclass(frozen=True, slots=True)
class WorthRow:
    """One number of positions: what it is worth, as printed, and the address of its proposal."""

    view: Worth
    dof: int
    figure: str
    u: tuple[str, ...]
    href: str


def worth_rows(request: Request, counts: tuple[Worth, ...]) -> list[WorthRow]:
    """The table of numbers of positions; every column down to the same decimal."""
    places = {name: _places((item.u[name] for item in counts), 2) for name in PARAMETERS}
    figures = _places((item.figure for item in counts), 3)
    return [
        WorthRow(
            view=item, dof=2 * item.count - len(PARAMETERS), figure=str(figure(item.figure, figures)),
            u=tuple(str(figure(item.u[name], places[name])) for name in PARAMETERS),
            href=with_query(request, mode="propose", count=item.count, view=None),
        )
        for item in counts
    ]  # fmt: skip


def _places(values: Iterable[float | None], digits: int) -> int:
    """Decimals that show so many digits of the smallest."""
    return decimals_of(min((value for value in values if value), default=None), digits) or 0


@dataclass(frozen=True, slots=True)
class TradeRow:
    """One set of the trade: its kind in words, both uncertainties as printed, positions and their plan."""

    view: TradePoint
    kind: str
    u_k: str
    u_g: str
    positions: str
    href: str


def trade_rows(request: Request, trade: Trade) -> list[TradeRow]:
    """The table behind the chart: the sets for comparison first, then the front."""
    points = (*trade.marked, *trade.front)
    first = _places((point.u_k_deg_per_h_per_ma for point in points), 3)
    second = _places((point.u_wg_deg_per_h_per_g for point in points), 3)
    return [
        TradeRow(
            view=point,
            kind=_kinds()[point.kind] if number < 1 else gettext("No. %(number)d") % {"number": number},
            u_k=str(figure(point.u_k_deg_per_h_per_ma, first)),
            u_g=str(figure(point.u_wg_deg_per_h_per_g, second)),
            positions=listed(point.positions),
            href=_address(request, point),
        )
        for number, point in enumerate(points, 1 - len(trade.marked))
    ]


def listed(positions: tuple[tuple[float, float], ...]) -> str:
    """Positions as they can be typed again: ``0/0 0/90``; a decimal point within."""
    return " ".join(f"{theta:.10g}/{psi:.10g}" for theta, psi in positions)


def _kinds() -> dict[str, str]:
    return {
        "front": gettext("not bettered"), "paper": gettext("the paper’s eight"),
        "all": gettext("all sixteen"), "plan": gettext("this plan"),
    }  # fmt: skip


def _address(request: Request, point: TradePoint) -> str:
    return with_query(request, mode="judge", positions=listed(point.positions), view=None)


def trade_chart(request: Request, trade: Trade) -> Spec:
    """The chart of the trade; every point opens its plan."""
    unit_k, unit_g = labels.unit("deg/h/mA"), labels.unit("deg/h/g")
    symbol_k, symbol_g = "u(K)", f"u({labels.symbol_text('wg')})"
    marks = [
        plots.TradeMark(
            point.kind, point.u_k_deg_per_h_per_ma, point.u_wg_deg_per_h_per_g,
            gettext("%(kind)s: %(k)s = %(u_k)s %(unit_k)s, %(g)s = %(u_g)s %(unit_g)s") % {
                "kind": name, "k": symbol_k, "u_k": significant(point.u_k_deg_per_h_per_ma, 3),
                "unit_k": unit_k, "g": symbol_g, "u_g": significant(point.u_wg_deg_per_h_per_g, 3),
                "unit_g": unit_g,
            },
            "" if point.kind == "front" else name, _address(request, point),
        )
        for point, name in _named(trade)
    ]  # fmt: skip
    description = gettext("%(g)s against %(k)s, %(count)d sets that no other betters in both") % {
        "g": symbol_g, "k": symbol_k, "count": len(trade.front)
    }  # fmt: skip
    return plots.pareto(marks, f"{symbol_k}, {unit_k}", f"{symbol_g}, {unit_g}", description)


def _named(trade: Trade) -> Iterator[tuple[TradePoint, str]]:
    """Every point with its name; those for comparison that are one set are one point with both names."""
    kinds = _kinds()
    for point in trade.front:
        yield point, kinds["front"]
    alike: dict[tuple[tuple[float, float], ...], list[TradePoint]] = {}
    for point in trade.marked:
        alike.setdefault(tuple(sorted(point.positions)), []).append(point)
    for points in alike.values():
        yield points[0], ", ".join(kinds[point.kind] for point in points)
