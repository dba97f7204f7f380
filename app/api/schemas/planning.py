"""Plans of sessions."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from app.api.schemas.common import Incoming, OptionalText, Outgoing
from app.api.schemas.warned import Warned, warned
from app.services.views import Verdict

Seconds = Annotated[float, Field(gt=0, le=86_400)]
Noise = Annotated[float, Field(ge=0, le=10)]


class PlanQuery(Incoming):
    """What is asked of a plan. Without `count` the listed positions, or the whole certificate, are judged."""

    certificate: Annotated[
        OptionalText, Field(description="Number of the certificate; without it the one that is valid today.")
    ] = None
    gyro: Annotated[
        OptionalText, Field(description="Its last calibration, else its type, gives the nominal values.")
    ] = None
    type: Annotated[OptionalText, Field(description="Nominal values and limits of a type of gyro.")] = None
    positions: Annotated[
        OptionalText, Field(description="θ/ψ in degrees, such as `0/0 0/90 90/180`; a repeat counts again.")
    ] = None
    count: Annotated[int | None, Field(ge=4, le=64, description="Propose so many positions.")] = None
    grid_deg: Annotated[
        float | None,
        Field(ge=30, le=90, description="Choose from the grid of this step, not from the certificate."),
    ] = None
    criterion: Annotated[
        str, Field(description="D, A, or the parameter whose uncertainty shall be smallest.", max_length=10)
    ] = "D"
    repeats: Annotated[bool, Field(description="A position may be proposed several times.")] = False
    time_s: Annotated[Seconds, Field(description="Of the whole session.")] = 2400.0
    moving_s: Annotated[
        float, Field(ge=0, le=86_400, description="To get to each position and settle there.")
    ] = 60.0
    noise_deg_per_h: Annotated[Noise, Field(description="u of a mean over 60 s, as a rate.")] = 0.005
    floor_deg_per_h: Annotated[Noise, Field(description="What no longer measuring takes away.")] = 0.0
    counts: Annotated[bool, Field(description="Compare 4 to 16 positions as well.")] = False
    trade: Annotated[bool, Field(description="The trade between u(K) and u(ωg) as well.")] = False


class PlannedPosition(Outgoing):
    """A position to measure, so many times."""

    theta_deg: float
    psi_deg: float
    times: int
    certified: bool


class PlannedParameter(Outgoing):
    """What will be known of a parameter; null where it will not be determined."""

    name: str
    nominal: float
    u: float | None
    k: float | None
    expanded: float | None
    unit: str
    low: float | None
    high: float | None
    of_limits: float | None = Field(description="U over half the width of the limits.")
    verdict: Verdict
    dominating: str | None = Field(description="Line of the uncertainty budget with the largest part.")
    share: float | None = Field(description="That part of the variance.")


class Search(Outgoing):
    """How the positions were found."""

    criterion: str
    figure: float | None = Field(description="What the criterion makes of them, in `unit`.")
    unit: str
    candidates: int
    exhaustive: bool = Field(
        description="Every set was tried, so none is better but those that bury the scale factors in noise."
    )
    starts: int
    tried: int


class Plan(Outgoing):
    """What the positions will tell."""

    positions: list[PlannedPosition]
    count: int
    total_s: float
    duration_s: float
    below_method: bool
    parameters: list[PlannedParameter]
    rank: int
    condition: float | None
    dof: int
    warnings: list[Warned]
    determined: bool
    search: Search | None

    _warned = field_validator("warnings", mode="before")(warned)


class Worth(Outgoing):
    """The best positions of one number of them."""

    count: int
    duration_s: float
    below_method: bool
    figure: float
    unit: str
    u: dict[str, float | None]
    best: bool


class TradePoint(Outgoing):
    """A set of positions by the two uncertainties."""

    kind: Literal["front", "paper", "all", "plan"]
    u_k_deg_per_h_per_ma: float
    u_wg_deg_per_h_per_g: float
    positions: list[tuple[float, float]]
    duration_s: float


class Trade(Outgoing):
    """The sets that no other betters in both, and sets for comparison."""

    count: int
    grid_deg: float
    exhaustive: bool
    tried: int
    front: list[TradePoint]
    marked: list[TradePoint]


class Planned(Outgoing):
    """A plan, and what was asked beside it."""

    stand: str
    certificate: str
    latitude_deg: float
    nominal_source: str
    plan: Plan
    counts: list[Worth]
    trade: Trade | None

    @field_validator("nominal_source", mode="before")
    @classmethod
    def _text(cls, source: object) -> str:
        return str(getattr(source, "text", source))
