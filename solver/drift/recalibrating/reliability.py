"""Intervals from findings at recalibration: how long instruments stay within tolerance.

A finding is known only at the calibration that ends its interval: within, or out of, tolerance.

Test interval, NCSLI RP-1 method A3
    All findings at one interval I: g of n within. With R = g/n and the target R_t, Q is the confidence that the
    true reliability differs from the target; the interval is changed if Q is more than one half::

        R < R_t:  Q = 1 − 2·P(X ≤ g),   I' = I·10^((R − R_t)·Q)           not below I/2
        R > R_t:  Q = 1 − 2·P(X ≥ g),   I' = I·10^((R − R_t)/(1 − Q))     not above 2·I

    with X binomial (n, R_t), and one tail only, 1 − P(X = g), where all or none are within: there is no
    further one. Bounds of the reliability are those of Clopper and Pearson, Biometrika 26, 1934, 404-413.

Reliability model, NCSLI RP-1 method S2
    R(t) = exp(−(t/η)^β), β = 1 for a constant rate; maximum likelihood with each finding a trial::

        ln L = Σ_within ln R(t_i) + Σ_out ln(1 − R(t_i)),   I' = η·(−ln R_t)^(1/β)

    Weibull's β is taken where 2·Δln L exceeds the 95 % point of χ²(1). The bound of I' is that of the
    likelihood ratio along the rate at the β taken. Without any finding out of tolerance the rate is
    that at which their absence would be as likely as not, Σ(t_i/η) = ln 2.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from solver.errors import InputError, Message
from solver.records import Array

TARGET: Final = 0.95
"""Share within tolerance at the end of the interval."""
_CHANGE_CONFIDENCE: Final = 0.5
_LARGEST_CHANGE: Final = 2.0
_SHAPES: Final = (0.2, 8.0)
_WEIBULL_GAIN: Final = float(special.chdtri(1, 0.05)) / 2.0
_BOUND_LOSS: Final = float(special.chdtri(1, 0.10)) / 2.0
"""One-sided 95 %."""
_SECTIONS: Final = 25
_STEPS: Final = 100
_AGREEMENT: Final = 1e-10
_GOLDEN: Final = (5.0**0.5 - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class IntervalJudgement:
    """By method A3.

    Attributes
    ----------
    days : float
        New interval; the old one where it stands.
    observed, low, high : float
        Reliability and its bounds.
    confidence : float
        Q, not below 0.
    changed : bool
    """

    days: float
    observed: float
    low: float
    high: float
    confidence: float
    changed: bool


@dataclass(frozen=True, slots=True)
class ReliabilityModel:
    """By method S2.

    Attributes
    ----------
    days : float
        I'.
    at_least : float
        Lower bound of it, one-sided 95 %.
    shape : float
        β: above 1 wear, 1 a constant rate.
    scale : float
        η, days.
    log_likelihood : float
    """

    days: float
    at_least: float
    shape: float
    scale: float
    log_likelihood: float


def judge_interval(
    within: int, count: int, days: float, target: float = TARGET, confidence: float = _CHANGE_CONFIDENCE
) -> IntervalJudgement:
    """Judge one interval by the findings at its end.

    Parameters
    ----------
    within, count : int
        g and n.
    days : float
        I.
    target : float
        R_t.
    confidence : float
        Q from which the interval is changed, and level of the bounds of the reliability.

    Raises
    ------
    InputError
        When numbers do not fit.
    """
    if not (0 <= within <= count and count > 0 and days > 0.0 and 0.0 < target < 1.0):
        raise InputError(_FINDINGS)
    observed = within / count
    if within in (0, count):
        q = 1.0 - (target**count if within else (1.0 - target) ** count)
    elif observed < target:
        q = 1.0 - 2.0 * float(special.bdtr(within, count, target))
    else:
        q = 1.0 - 2.0 * float(special.bdtrc(within - 1, count, target))
    if observed < target:
        factor = max(1.0 / _LARGEST_CHANGE, 10.0 ** ((observed - target) * q))
    else:
        exponent = (observed - target) / (1.0 - q) if q < 1.0 else np.inf
        factor = 10.0 ** min(float(np.log10(_LARGEST_CHANGE)), exponent)
    changed = q > confidence
    tails = (1.0 - confidence) / 2.0, (1.0 + confidence) / 2.0
    low = float(special.betaincinv(within, count - within + 1, tails[0])) if within else 0.0
    high = float(special.betaincinv(within + 1, count - within, tails[1])) if within < count else 1.0
    return IntervalJudgement(days * factor if changed else days, observed, low, high, max(0.0, q), changed)


def reliability_model(days: ArrayLike, within: ArrayLike, target: float = TARGET) -> ReliabilityModel:
    """Fit how the share within tolerance falls with time.

    Parameters
    ----------
    days : (n,) array_like
        Length of each interval.
    within : (n,) array_like of bool
        What was found at its end.
    target : float
        R_t.

    Raises
    ------
    InputError
        When numbers do not fit.
    """
    times, inside = np.asarray(days, np.float64), np.asarray(within, bool)
    if not (times.ndim == 1 and len(times) and inside.shape == times.shape and 0.0 < target < 1.0):
        raise InputError(_FINDINGS)
    if not (np.isfinite(times).all() and (times > 0.0).all()):
        raise InputError(_FINDINGS)
    unit = float(np.exp(np.mean(np.log(times))))
    shape = _shape(times / unit, inside)
    powers = (times / unit) ** shape
    rate = _rate(powers, inside)
    highest = _highest_rate(powers, inside, rate)
    need = -np.log(target)
    return ReliabilityModel(
        days=unit * float(need / rate) ** (1.0 / shape) if np.isfinite(rate) else 0.0,
        at_least=unit * float(need / highest) ** (1.0 / shape) if np.isfinite(highest) else 0.0,
        shape=shape,
        scale=unit * rate ** (-1.0 / shape) if np.isfinite(rate) else 0.0,
        log_likelihood=_log_likelihood(rate, powers, inside),
    )


def _shape(times: Array, inside: NDArray[np.bool_]) -> float:
    """Weibull's β where it says clearly more than a constant rate."""
    if inside.all() or not inside.any() or times.max() <= times.min() * (1.0 + 1e-9):
        return 1.0

    def gain(logarithm: float) -> float:
        powers = times ** float(np.exp(logarithm))
        return _log_likelihood(_rate(powers, inside), powers, inside)

    low, high = (float(np.log(end)) for end in _SHAPES)
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    gain_a, gain_b = gain(a), gain(b)
    for _ in range(_SECTIONS):
        if gain_a < gain_b:
            low, a, gain_a = a, b, gain_b
            b = low + _GOLDEN * (high - low)
            gain_b = gain(b)
        else:
            high, b, gain_b = b, a, gain_a
            a = high - _GOLDEN * (high - low)
            gain_a = gain(a)
    best = (low + high) / 2.0
    return float(np.exp(best)) if gain(best) - gain(0.0) > _WEIBULL_GAIN else 1.0


def _rate(powers: Array, inside: NDArray[np.bool_]) -> float:
    """λ = η^−β of the largest likelihood: Newton's steps on its derivative, Σ_out p/(e^λp − 1) − Σ_within p.

    It is convex and falls with λ, so that from the left no step goes too far; since 1/(eˣ − 1) ≥ 1/x − 1/2, the
    start is on the left.
    """
    if inside.all():
        return float(np.log(2.0) / powers.sum())
    if not inside.any():
        return float("inf")
    held, out = float(powers[inside].sum()), powers[~inside]
    rate = len(out) / (held + float(out.sum()) / 2.0)
    for _ in range(_STEPS):
        grown = np.expm1(rate * out)
        over = float(np.sum(out / grown)) - held
        change = over / float(np.sum(out**2 * (grown + 1.0) / grown**2))
        rate += change
        if change <= _AGREEMENT * rate:
            break
    return rate


def _highest_rate(powers: Array, inside: NDArray[np.bool_], rate: float) -> float:
    """Where the likelihood has fallen by what a one-sided 95 % bound allows."""
    if not inside.any():
        return float("inf")
    if inside.all():
        return float(-np.log(0.05) / powers.sum())
    least = _log_likelihood(rate, powers, inside) - _BOUND_LOSS
    low = high = rate
    while _log_likelihood(high, powers, inside) > least:
        low, high = high, 2.0 * high
    while high > low * (1.0 + _AGREEMENT):
        middle = (low + high) / 2.0
        low, high = (middle, high) if _log_likelihood(middle, powers, inside) > least else (low, middle)
    return high


def _log_likelihood(rate: float, powers: Array, inside: NDArray[np.bool_]) -> float:
    if not np.isfinite(rate):
        return 0.0
    return float(-rate * powers[inside].sum() + np.sum(np.log(-np.expm1(-rate * powers[~inside]))))


_FINDINGS = Message(
    "findings",
    "Findings at recalibration need positive lengths of the intervals, as many findings, and a target between 0 and 1.",
)
