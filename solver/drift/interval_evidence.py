"""What `solver.drift.recalibration` goes by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solver.drift.in_use import Use
from solver.drift.reliability import TARGET
from solver.errors import InputError, Message
from solver.records import Array


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found at the end of intervals, oldest first.

    Attributes
    ----------
    days : (n,) array_like
        Length of each interval.
    used : (n,) array_like
        Largest share of a limit used by any parameter: 0 in the middle of its limits, 1 at one of them, more beyond.
    """

    days: ArrayLike
    used: ArrayLike

    def checked(self) -> tuple[Array, Array]:
        """Both as arrays; InputError if they do not fit."""
        days, used = np.asarray(self.days, np.float64), np.asarray(self.used, np.float64)
        if days.ndim != 1 or used.shape != days.shape or not np.isfinite(days).all() or np.isnan(used).any():
            raise InputError(_FINDINGS)
        if (days <= 0.0).any() or (used < 0.0).any():
            raise InputError(_FINDINGS)
        return days, used


@dataclass(frozen=True, slots=True)
class Outlook:
    """The band that holds the next value of a parameter, as `solver.drift.forecast.predict` gives it.

    Attributes
    ----------
    parameter : str
        Its name, for the reason.
    days : (m,) array_like
        From the last calibration on, increasing from 0.
    low, high : (m,) array_like
        Ends of the band.
    lower_limit, upper_limit : float or None
    """

    parameter: str
    days: ArrayLike
    low: ArrayLike
    high: ArrayLike
    lower_limit: float | None
    upper_limit: float | None


@dataclass(frozen=True, slots=True)
class Check:
    """A check measurement of a parameter between calibrations.

    Attributes
    ----------
    parameter : str
    u : float
        Standard uncertainty of what the check compares, its own scatter and that of the starts.
    margin : float
        From the present value to the nearer limit.
    drift : float
        Per day, no less than it may be: its amount and what it may be off by.
    unit : str
        Of `u` and `margin`, for the reason.
    """

    parameter: str
    u: float
    margin: float
    drift: float
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Evidence:
    """What there is to go by.

    Attributes
    ----------
    days : float
        Interval so far.
    own, of_type : Findings or None
        Of the gyro, and of all gyros of its type.
    outlooks, uses, checks
        Of each parameter with limits.
    target : float
        Share that is to be within tolerance.
    horizon : float
        Days looked ahead.
    """

    days: float
    own: Findings | None = None
    of_type: Findings | None = None
    outlooks: Sequence[Outlook] = ()
    uses: Sequence[Use] = ()
    checks: Sequence[Check] = ()
    target: float = TARGET
    horizon: float = 1826.0


_FINDINGS = Message(
    "interval-findings",
    "Findings need, for each interval, its length in days and the share of the limits used, neither negative.",
)
