"""Units in which every history looks alike: time from −1 to 0, values about 1, rounding told from scatter."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from solver.drift.courses.paths import Path
from solver.drift.courses.regression import LINE, Series
from solver.drift.history import History
from solver.records import Array

_EPS: Final = float(np.finfo(np.float64).eps)
_ROUNDING: Final = 1e-12
"""Standard uncertainty that every value has at least, in the unit of the series: so no weight is infinite."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Where the series' units lie in the history's.

    Attributes
    ----------
    centre, unit : float
        Value 0 and 1 of the series.
    last, span : float
        Time x = 0 of the last value, s, and length of the history, s; 1 where it has none.
    """

    centre: float
    unit: float
    last: float
    span: float

    def path(self, one: Path) -> Path:
        """A path of the series in the history's units."""
        factors = np.full(len(one.coefficients), self.unit)
        if one.time_constant == LINE:
            factors[1:] /= self.span
        coefficients = one.coefficients * factors
        coefficients[0] += self.centre
        return replace(
            one,
            time_constant=None if one.time_constant is None else one.time_constant * self.span,
            coefficients=coefficients,
            covariance=one.covariance * np.outer(factors, factors),
            tau2=one.tau2 * self.unit**2,
            origin=self.last + one.origin * self.span,
        )


def framed(history: History) -> tuple[Frame, Series]:
    """A history's frame, and its series in it."""
    centre = float(np.median(history.value))
    sizes = (np.abs(history.value - centre).max(), history.u.max(), np.abs(history.value).max(), 1.0)
    unit = next(float(one) for one in sizes if one > 0.0)
    last = float(history.time[-1])
    span = last - float(history.time[0]) or 1.0
    least = max(_ROUNDING, _EPS * float(np.abs(history.value).max()) / unit)
    known: Array = (history.u / unit) ** 2 + least**2
    series = Series((history.time - last) / span, (history.value - centre) / unit, known)
    return Frame(centre, unit, last, span), series
