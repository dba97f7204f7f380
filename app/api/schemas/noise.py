"""What a record of currents says of its noise."""

from typing import Annotated

from pydantic import Field

from app.api.schemas.common import Outgoing
from app.api.schemas.warned import Warned, warned
from app.services.noise import RecordNoise


class Tested(Outgoing):
    """A number tested against zero, two-sided; `expanded` is its uncertainty at 95 %."""

    value: float
    u: float
    expanded: float | None
    dof: float | None
    p_value: float


class TestedCurrent(Outgoing):
    """A difference of currents tested against zero, two-sided; `expanded_ma` holds at 95 %."""

    value_ma: float
    u_ma: float
    expanded_ma: float | None
    dof: float | None
    p_value: float


class TestedSlope(Outgoing):
    """A slope tested against zero, two-sided; `expanded_ma_per_s` holds at 95 %."""

    value_ma_per_s: float
    u_ma_per_s: float
    expanded_ma_per_s: float | None
    dof: float | None
    p_value: float


class AllanPoint(Outgoing):
    """Allan deviation at one averaging time with its 95 % interval.

    `exponent` is α of the noise there, with a spectrum f^α; `edf` its equivalent degrees of freedom.
    """

    tau_s: float
    deviation_ma: float
    low_ma: float
    high_ma: float
    edf: float
    exponent: int


class Coefficient(Outgoing):
    """A noise coefficient in the unit of its field's name.

    `low` and `high` are its 95 % interval. When the record does not show it (`seen` is false) there is
    no value, and `high` is the limit that it does not exceed.
    """

    value: float | None
    u: float | None
    low: float
    high: float
    seen: bool


class Coefficients(Outgoing):
    """Coefficients of IEEE Std 952, annex C, as currents, and as rates where the gyro has a result."""

    angle_random_walk_ma_sqrt_s: Coefficient
    angle_random_walk_deg_per_sqrt_h: Coefficient | None
    bias_instability_ma: Coefficient
    bias_instability_deg_per_h: Coefficient | None
    rate_random_walk_ma_per_sqrt_s: Coefficient
    rate_random_walk_deg_per_h_per_sqrt_h: Coefficient | None
    quantisation_ma_s: Coefficient
    quantisation_arcsec: Coefficient | None
    highest_frequency_hz: Annotated[float, Field(description="Up to which the noise follows the model.")]
    p_value: Annotated[float, Field(description="Of the fit.")]
    fits: bool


class ChannelNoise(Outgoing):
    """One channel. What is null cannot be told: the channel does not change, or the record is too short.

    `u_ma` is the uncertainty that is stated with the mean, by the slow fluctuations of the record;
    `u_batches_ma` and `u_autocorrelation_ma` are two other ways to it.
    """

    samples: int
    mean_ma: float
    u_ma: float | None
    dof: float | None
    n_eff: float | None
    autocorrelation_time_s: float | None
    u_batches_ma: float | None
    dof_batches: float | None
    u_autocorrelation_ma: float | None
    dof_autocorrelation: float | None
    slope: TestedSlope | None
    mean_step: TestedCurrent | None
    log_variance_ratio: Tested | None
    resolution_ma: float | None
    u_resolution_ma: float | None
    allan: list[AllanPoint]
    coefficients: Coefficients | None
    findings: list[Warned]


class PositionNoise(Outgoing):
    """Both channels of the record that counts at a position."""

    measurement: int
    session: int
    theta_deg: float
    psi_deg: float
    repeat: int
    revision: int
    duration_s: float
    rate_hz: float
    scales_from_calibration: int | None
    jx: ChannelNoise
    jy: ChannelNoise


def position_noise(noise: RecordNoise) -> PositionNoise:
    """The answer made of what the service gives."""
    kept, row = noise.currents, noise.currents.measurement
    channels = {
        channel: ChannelNoise.model_validate({**document, "findings": warned(document["findings"])})
        for channel, document in noise.documents.items()
    }
    return PositionNoise(
        measurement=row.id, session=kept.session, theta_deg=row.theta_deg, psi_deg=row.psi_deg,
        repeat=row.repeat, revision=row.revision, duration_s=kept.duration_s, rate_hz=kept.rate_hz,
        scales_from_calibration=kept.scales_from, jx=channels["jx"], jy=channels["jy"],
    )  # fmt: skip
