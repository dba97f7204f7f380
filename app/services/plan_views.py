"""What a plan shows: frozen, in laboratory units."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from app.exchange.json_values import message_json
from app.services.views import Verdict
from solver.errors import Message


@dataclass(frozen=True, slots=True)
class PlannedPosition:
    """One position to measure; `certified` says whether the certificate knows it."""

    theta_deg: float
    psi_deg: float
    times: int
    certified: bool


@dataclass(frozen=True, slots=True)
class PlannedParameter:
    """What will be known of a parameter.

    `u` and `expanded` are None when the positions do not determine it; `verdict` is that of a gyro
    whose parameter has its nominal value; `dominating` is the line of the budget with the largest
    part of the variance, `share` that part.
    """

    name: str
    nominal: float
    u: float | None
    k: float | None
    expanded: float | None
    unit: str
    low: float | None
    high: float | None
    verdict: Verdict
    dominating: str | None
    share: float | None

    @property
    def of_limits(self) -> float | None:
        """U as a part of half the width of the limits: what the uncertainty takes of the tolerance."""
        if self.expanded is None or self.low is None or self.high is None:
            return None
        return 2.0 * self.expanded / (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Search:
    """How the positions were found: `figure` is what the criterion makes of them, in `unit`."""

    criterion: str
    figure: float | None
    unit: str
    candidates: int
    exhaustive: bool
    starts: int
    tried: int


@dataclass(frozen=True, slots=True)
class Plan:
    """What a list of positions will tell; `search` is None when the list was given.

    `determined` is False when no choice determines what the criterion asks for; the positions then
    mean nothing.
    """

    positions: tuple[PlannedPosition, ...]
    count: int
    total_s: float
    duration_s: float
    below_method: bool
    parameters: tuple[PlannedParameter, ...]
    rank: int
    condition: float | None
    dof: int
    warnings: tuple[Message, ...]
    determined: bool
    search: Search | None


@dataclass(frozen=True, slots=True)
class Worth:
    """The best positions of one number of them; `u` by parameter, None where not determined."""

    count: int
    duration_s: float
    below_method: bool
    figure: float
    unit: str
    u: Mapping[str, float | None]
    best: bool


@dataclass(frozen=True, slots=True)
class TradePoint:
    """A set of positions by u(K), the root mean square of both scale factors, and u(ωg)."""

    kind: Literal["front", "paper", "all", "plan"]
    u_k_deg_per_h_per_ma: float
    u_wg_deg_per_h_per_g: float
    positions: tuple[tuple[float, float], ...]
    duration_s: float


@dataclass(frozen=True, slots=True)
class Trade:
    """The front of the trade, and marked sets for comparison, all measured in the same total time."""

    count: int
    grid_deg: float
    exhaustive: bool
    tried: int
    front: tuple[TradePoint, ...]
    marked: tuple[TradePoint, ...]


@dataclass(frozen=True, slots=True)
class Planned:
    """Everything a page or a program wants of one question."""

    stand: str | None
    certificate: str | None
    latitude_deg: float
    nominal_source: Message
    plan: Plan
    counts: tuple[Worth, ...] = ()
    trade: Trade | None = None


def as_json(planned: Planned) -> dict[str, Any]:
    """The whole answer for programs; what was not asked for is left out."""
    written = asdict(planned)
    written["nominal_source"] = planned.nominal_source.text
    for entry, item in zip(written["plan"]["parameters"], planned.plan.parameters, strict=True):
        entry["of_limits"] = item.of_limits
    written["plan"]["warnings"] = [message_json(item) for item in planned.plan.warnings]
    return {name: value for name, value in written.items() if value not in (None, ())}
