"""The rebalance loop of a gyro."""

from typing import Annotated

from pydantic import Field

from app.api.schemas.common import Incoming, OptionalText, Outgoing

Parameter = Annotated[float | None, Field(ge=0, allow_inf_nan=True)]


class LoopQuery(Incoming):
    """A loop: the paper's, with everything else that is given in place of it."""

    type: Annotated[OptionalText, Field(description="A type of gyro, whose nominal scale factor is Km.")] = (
        None
    )
    h_n_m_s: Annotated[Parameter, Field(description="H, angular momentum; 0.0014 without it.")] = None
    a_kg_m2: Annotated[Parameter, Field(description="A, equatorial moment of inertia; 5e-7.")] = None
    k_alpha_v_per_rad: Annotated[Parameter, Field(description="Kα, pickoff; 6.")] = None
    k_u_a_per_v: Annotated[Parameter, Field(description="Ku, amplifier; 3.")] = None
    k_m_rad_per_s_per_a: Annotated[Parameter, Field(description="Km, torquer; the type’s, or 10.")] = None
    t1_s: Annotated[
        Parameter, Field(description="T1, integral time; 0.015. `inf` for a loop without integrator.")
    ] = None
    t2_s: Annotated[Parameter, Field(description="T2 of the double lag; 0.001. 0 for none.")] = None
    duration_s: Annotated[
        float | None, Field(gt=0, description="Length of the step response; as long as it needs without it.")
    ] = None


class LoopParameters(Outgoing):
    """The loop that was looked at; a null T1 is that of a loop without integrator."""

    h_n_m_s: float
    a_kg_m2: float
    k_alpha_v_per_rad: float
    k_u_a_per_v: float
    k_m_rad_per_s_per_a: float
    t1_s: float | None
    t2_s: float


class LoopVerdict(Outgoing):
    """`stable`, or what keeps the loop from it: `integral-time`, `nutation`, `gain`, `undamped`."""

    code: str
    message: str


class Pole(Outgoing):
    """A pole of the complex equation; what does not decay has no time constant."""

    re_per_s: float
    im_rad_per_s: float
    damping_ratio: float
    time_constant_s: float | None


class LoopMargins(Outgoing):
    """Margins for one sign of ω, or the worse of both; null where there is no end."""

    gain_factor: float | None
    gain_db: float | None
    gain_at_rad_per_s: float | None
    phase_deg: float | None = Field(description="With the sign in which the loop gain may turn so far.")
    phase_at_rad_per_s: float | None
    bandwidth_rad_per_s: float | None = Field(description="Measured rate by case rate, first down by 3 dB.")
    bandwidth_hz: float | None


class BothMargins(Outgoing):
    """L(iω) of a complex loop is another for each sign of ω; the worse one counts."""

    worse: LoopMargins
    positive: LoopMargins
    negative: LoopMargins


class LoopSteps(Outgoing):
    """Deflections and measured rates after a step of the case rate, from rest (paper, figures 4 and 5)."""

    rate_x_rad_per_s: float
    rate_y_rad_per_s: float
    duration_s: float
    cut_off_s: float | None = Field(description="Where the response of an unstable loop is cut off.")
    t_s: list[float]
    alpha_rad: list[float]
    beta_rad: list[float]
    measured_x_rad_per_s: list[float]
    measured_y_rad_per_s: list[float]


class LoopFrequencies(Outgoing):
    """Loop gain L, and measured rate by case rate, at ω of both signs."""

    omega_rad_per_s: list[float]
    loop_gain_db: list[float]
    loop_phase_deg: list[float]
    rate_gain_db: list[float]
    rate_phase_deg: list[float]


class Loop(Outgoing):
    """Everything about a loop."""

    parameters: LoopParameters
    gain_per_s: float = Field(description="Kα·Ku·Km.")
    nutation_rad_per_s: float = Field(description="H/A.")
    stable: bool
    verdict: LoopVerdict
    poles: list[Pole] = Field(description="The slowest to decay first.")
    margins: BothMargins | None = Field(description="Null for an unstable loop, which has none.")
    settling_time_s: float | None
    settled_within: float = Field(description="Part of the step that counts as settled.")
    step_response: LoopSteps
    frequency_response: LoopFrequencies
