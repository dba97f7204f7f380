"""What `solver.drift.recalibrating.recalibration` goes by."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from solver.drift.recalibrating.in_use import Use
from solver.drift.recalibrating.reliability import TARGET
from solver.errors import InputError, Message
from solver.records import Array

COUNTS_FROM: Final = 0.75
"""Share of the interval from which a finding counts as one at its end."""


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

    @classmethod
    def of_history(
        cls, days: ArrayLike, used: ArrayLike, interval: float, breaks: Sequence[float] = ()
    ) -> "Findings":
        """Take the findings out of a history in which calibrations may be more frequent than the interval.

        An interval begins at a calibration within the limits and ends at the first one that is beyond
        them, or at which three quarters of the interval are over; those between are checks on the way. A
        repair or an adjustment ends it without a finding.

        Parameters
        ----------
        days, used : (n,) array_like
            Time of each calibration and largest share of a limit used.
        interval : float
            Interval so far, days.
        breaks : sequence of float
            Times of repairs and adjustments, days; a calibration of that very time comes after it.
        """
        moments, shares = np.asarray(days, np.float64), np.asarray(used, np.float64)
        if shares.shape != moments.shape or moments.ndim != 1:
            raise InputError(_FINDINGS)
        order = np.argsort(moments, kind="stable")
        lengths, found = list[float](), list[float]()
        begun: float | None = None
        for moment, share in zip(moments[order].tolist(), shares[order].tolist(), strict=True):
            if begun is not None and any(begun < event <= moment for event in breaks):
                begun = None
            if (
                begun is not None
                and moment > begun
                and (share > 1.0 or moment - begun >= COUNTS_FROM * interval)
            ):
                lengths.append(moment - begun)
                found.append(share)
                begun = None
            if begun is None and share <= 1.0:
                begun = moment
        return cls(np.array(lengths), np.array(found))

    @classmethod
    def together(cls, several: Sequence["Findings"]) -> "Findings":
        """Findings of several gyros of a type."""
        checked = [one.checked() for one in several]
        if not checked:
            return cls(np.empty(0), np.empty(0))
        return cls(np.concatenate([one[0] for one in checked]), np.concatenate([one[1] for one in checked]))

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
    """The band that holds the next value of a parameter, as `solver.drift.courses.forecast.predict` gives it.

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
