"""A finished take judged on the spot."""

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
        Change of a current within the record that matters, nA.
    partner_na
        Difference between sums of partners that matters, nA, where the type says no other.
    """

    shortest_s: float = 60.0
    slowest_hz: float = 200.0
    false_alarm: float = 1e-6
    noise_factor: float = 2.0
    drift_na: float = 25.0
    partner_na: float = 40.0


@dataclass(frozen=True, slots=True)
class Expectations:
    """What is expected of a type of gyro.

    Attributes
    ----------
    noise_na
        Standard deviation of one sample at 200 Hz, nA; 0 where nothing is known.
    largest_ma
        Largest current of a good gyro of the type, mA; 0 where nothing is known.
    drift_na, partner_na
        As in `Thresholds`, for this type; 0 where those hold.
    """

    noise_na: float = 0.0
    largest_ma: float = 0.0
    drift_na: float = 0.0
    partner_na: float = 0.0
