"""How long a quantity stays within its limits by what the gyro does: starts, or hours of running, beside the calendar.

    y_i = a + b·t_i + c·n_i + e_i          t days, n starts (or hours) since the first value; e of one variance s²

by ordinary least squares. What the calendar explains is b, what the use explains is c, tested by Student's t with
ν = m − 3 beside the calendar. With a rate r of use ahead, a value of t days from now lies within

    ŷ(t) ± t(ν)·s·√(1 + x·(XᵀX)⁻¹·xᵀ),   x = (1, t_m + t, n_m + r·t)

(N. R. Draper, H. Smith, Applied Regression Analysis, 3rd ed., 1998, section 3.1 and 5.1); the time is up when that band
meets a limit. Where use always went on with the calendar the two are not told apart: then all is ascribed to the
use, b = 0, ν = m − 2.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from solver.errors import InputError, Message
from solver.records import Array

FEWEST: Final = 5
_APART: Final = 100.0
"""Variance inflation from which calendar and use are not told apart."""
_MOMENTS: Final = 2000


@dataclass(frozen=True, slots=True)
class Use:
    """How a quantity went with the use of a gyro.

    Attributes
    ----------
    parameter : str
        Its name, for the reason.
    days, used, value : (m,) array_like
        Time of each value, starts or hours until then, the value.
    low, high : float or None
        Limits.
    rate : float
        Starts or hours a day ahead.
    counted
        What `used` counts.
    unit : str
        Of the values, for the reason.
    """

    parameter: str
    days: ArrayLike
    used: ArrayLike
    value: ArrayLike
    low: float | None
    high: float | None
    rate: float
    counted: Literal["starts", "hours"] = "starts"
    unit: str = ""


@dataclass(frozen=True, slots=True)
class UseFit:
    """What the use does.

    Attributes
    ----------
    per_day, per_use : float
        b and c, in the quantity's unit.
    p_value : float
        Of c.
    scatter : float
        s.
    days : float or None
        From the last value until the band meets a limit; None beyond the time looked at.
    uses : float or None
        Starts or hours until then.
    apart : bool
        Whether calendar and use were told apart.
    """

    per_day: float
    per_use: float
    p_value: float
    scatter: float
    days: float | None
    uses: float | None
    apart: bool


def follow_use(use: Use, until: float, probability: float = 0.95) -> UseFit | None:
    """Fit calendar and use, and look ahead; None with fewer than five values or no use between them.

    Parameters
    ----------
    use
        Values with their times and use.
    until : float
        Days to look ahead.
    probability : float
        Of the band.

    Raises
    ------
    InputError
        When lengths differ or a number is not finite.
    """
    days, used, value = (np.asarray(one, np.float64) for one in (use.days, use.used, use.value))
    if not (value.ndim == 1 and days.shape == used.shape == value.shape):
        raise InputError(_COLUMNS)
    if not all(np.isfinite(one).all() for one in (days, used, value)) or not use.rate >= 0.0:
        raise InputError(_COLUMNS)
    if len(value) < FEWEST or np.ptp(used) == 0.0:
        return None
    apart = _told_apart(days, used)
    columns = [np.ones(len(value)), used - used[-1]]
    if apart:
        columns.append(days - days[-1])
    design = np.column_stack(columns)
    ahead = np.linspace(0.0, until, _MOMENTS)
    shapes = [np.ones(_MOMENTS), use.rate * ahead] + ([ahead] if apart else [])
    return _looked_ahead(use, design, value, np.column_stack(shapes), ahead, probability)


def band_meets(
    days: Array, low: Array, high: Array, lower: float | None, upper: float | None
) -> float | None:
    """When a band first meets a limit: between two moments by a straight line; None if it does not."""
    margin = np.full(len(days), np.inf)
    if upper is not None:
        margin = np.minimum(margin, upper - high)
    if lower is not None:
        margin = np.minimum(margin, low - lower)
    beyond = np.flatnonzero(margin <= 0.0)
    if len(beyond) == 0:
        return None
    first = int(beyond[0])
    if first == 0:
        return float(days[0])
    share = margin[first - 1] / (margin[first - 1] - margin[first]) if np.isfinite(margin[first]) else 0.0
    return float(days[first - 1] + share * (days[first] - days[first - 1]))


def _told_apart(days: Array, used: Array) -> bool:
    x, y = days - days.mean(), used - used.mean()
    rest = float(y @ y) - float(x @ y) ** 2 / float(x @ x) if x.any() else 0.0
    return rest * _APART > float(y @ y)


def _looked_ahead(
    use: Use, design: Array, value: Array, shapes: Array, ahead: Array, probability: float
) -> UseFit:
    scale = np.linalg.norm(design, axis=0)
    q, r = np.linalg.qr(design / scale)
    root = np.linalg.inv(r).T / scale
    values = (q.T @ value) @ root
    dof = len(value) - design.shape[1]
    rest = value - q @ (q.T @ value)
    scatter = float(rest @ rest / dof) ** 0.5
    u_use = scatter * float(np.linalg.norm(root[:, 1]))
    t = abs(float(values[1])) / u_use if u_use > 0.0 else np.inf
    half = special.stdtrit(dof, (1.0 + probability) / 2.0) * scatter
    half = half * np.sqrt(1.0 + np.sum((shapes @ root.T) ** 2, axis=1))
    course = shapes @ values
    days = band_meets(ahead, course - half, course + half, use.low, use.high)
    return UseFit(
        per_day=float(values[2]) if len(values) > 2 else 0.0,
        per_use=float(values[1]),
        p_value=2.0 * float(special.stdtr(dof, -t)),
        scatter=scatter,
        days=days,
        uses=None if days is None else use.rate * days,
        apart=len(values) > 2,
    )


_COLUMNS = Message(
    "use-columns",
    "Times, use and values must be equally many finite numbers, and the use ahead not negative.",
)
