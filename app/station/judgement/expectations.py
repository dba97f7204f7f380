"""What a laboratory judges records by, and what it expects of a type of gyro."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What a record is judged by; a laboratory may set each in ``[checks]``.

    Attributes
    ----------
    shortest_s, slowest_hz
        The method's rule, each with a tolerance of 0.1 %.
    false_alarm
        Largest probability that a check objects to one good record.
    noise_factor
        Scatter of the samples so many times larger or smaller than the type's is an objection.
    drift_na
        Change of a current within the record that matters, nA, where the type says no other.
    partner_na
        Difference between sums of partners that matters, nA, likewise.
    """

    shortest_s: float = 60.0
    slowest_hz: float = 200.0
    false_alarm: float = 1e-6
    noise_factor: float = 2.0
    drift_na: float = 25.0
    partner_na: float = 100.0


@dataclass(frozen=True, slots=True)
class Expectations:
    """What is expected of a type of gyro; 0 where nothing is.

    Attributes
    ----------
    noise_na
        Standard deviation of one sample at 200 Hz, nA; it grows with the root of the rate.
    largest_ma
        Largest mean current of a good gyro of the type, mA.
    drift_na, partner_na
        As in `Thresholds`, for this type.
    scale_deg_per_h_per_ma, g_drift_deg_per_h
        Its smallest scale factor and its largest √(ωg² + ωк²) + 2·|ωн|: what certified angles do to its currents.
    """

    noise_na: float = 0.0
    largest_ma: float = 0.0
    drift_na: float = 0.0
    partner_na: float = 0.0
    scale_deg_per_h_per_ma: float = 0.0
    g_drift_deg_per_h: float = 0.0
