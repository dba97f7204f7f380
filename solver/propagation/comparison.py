"""Is first-order propagation good enough? The GUM validated by Monte Carlo: JCGM 101:2008, clause 8.

The ends of the GUM's interval y ± U are held against those of the Monte Carlo interval::

    d_low = |y − U − y_low|,   d_high = |y + U − y_high|          8.1 b

Both within the numerical tolerance δ of u(y), 7.9.2: first order is validated for this output. But the
Monte Carlo ends scatter themselves (8.2 asks for a run whose own tolerance is δ/5). So the
verdict stays open where they are not known to δ, two standard errors, or lie beyond δ by less than that.

First order takes an input of ν degrees of freedom by its u, Monte Carlo by its t-distribution, whose standard deviation
is u·√(ν/(ν − 2)) (JCGM 101, 6.4.9). Where these alone give the draws their standard deviation, and their mean is the
estimate, that is the cause and no non-linearity.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.errors import Message
from solver.propagation.monte_carlo import MonteCarlo, numerical_tolerance
from solver.records import Array

_NEAR: Final = 0.05
Verdict = Literal["agree", "disagree", "open"]


@dataclass(frozen=True, slots=True)
class Comparison:
    """First order against Monte Carlo.

    Attributes
    ----------
    tolerance : (p,) array
        δ of each output's first-order u.
    low, high : (p,) array
        d_low and d_high, the distances between the intervals' ends.
    within : (p,) bool array
        Both distances within δ: clause 8.1 as it stands.
    open : (p,) bool array
        The Monte Carlo ends scatter too much to tell.
    verdict
        ``disagree``: an output is surely not within δ. ``agree``: every one is, none open. Else ``open``.
    message
        The verdict in words.
    """

    tolerance: Array
    low: Array
    high: Array
    within: NDArray[np.bool_]
    open: NDArray[np.bool_]
    verdict: Verdict
    message: Message


def compare(
    found: MonteCarlo,
    values: Array,
    u: Array,
    expanded: Array,
    *,
    digits: int = 2,
    unit: ArrayLike = 1.0,
    names: Sequence[str],
    by_t: Array | None = None,
) -> Comparison:
    """Hold first order against Monte Carlo.

    Parameters
    ----------
    found
        From `solver.propagation.monte_carlo.run`, at the level of `expanded`.
    values, u, expanded : (p,) array
        Estimates, standard and expanded uncertainties of first order.
    digits, unit
        Significant digits of u that matter, and the unit of each output in which they are counted.
    names : (p,)
        Of the outputs, for the words.
    by_t : (p,) array, optional
        `u` with the standard deviations of the inputs' t-distributions in place of their u.
    """
    tolerance = numerical_tolerance(u, digits, unit)
    apart = np.abs(np.stack((values - expanded, values + expanded), axis=1) - found.symmetric)
    allowed = tolerance[:, None]
    within = (apart <= allowed).all(axis=1)
    outside = (apart - 2 * found.errors > allowed).any(axis=1)
    unsure = ~outside & (~within | (2 * found.errors > allowed).any(axis=1))
    verdict: Verdict = "disagree" if outside.any() else "open" if unsure.any() else "agree"
    here = outside if verdict == "disagree" else unsure
    told = ", ".join(np.array(names, dtype=object)[here])
    with np.errstate(divide="ignore", invalid="ignore"):
        worst = float(np.max(np.nan_to_num(apart / allowed)))
    few = by_t is not None and bool(_by_few(found, values, u, by_t)[here].all())
    return Comparison(
        tolerance=tolerance,
        low=apart[:, 0],
        high=apart[:, 1],
        within=np.asarray(within),
        open=np.asarray(unsure),
        verdict=verdict,
        message=_words(verdict, told, worst, digits, 100 * found.level, found.trials, few=few),
    )


def _by_few(found: MonteCarlo, values: Array, u: Array, by_t: Array) -> NDArray[np.bool_]:
    """Where the draws are as wide as few degrees of freedom make them, and not moved, (p,)."""
    drawn = found.standard_uncertainties
    as_wide = np.abs(drawn - by_t) < np.minimum(_NEAR * u, (by_t - u) / 2)
    return np.asarray(as_wide & (np.abs(found.mean - values) < _NEAR * u))


def _words(
    verdict: Verdict, names: str, worst: float, digits: int, percent: float, trials: int, *, few: bool
) -> Message:
    common = {"digits": digits, "level": percent, "trials": trials, "worst": worst, "names": names}
    if verdict == "agree":
        return Message(
            "first-order-confirmed",
            "First-order propagation (GUM) and Monte Carlo agree: the ends of every %(level)g %% interval are "
            "the same within the tolerance of JCGM 101 (8.1; significant digits of u: %(digits)d).",
            common,
        )
    if verdict == "disagree" and few:
        return Message(
            "first-order-refuted",
            "First-order propagation (GUM) and Monte Carlo disagree for %(names)s: the ends of the %(level)g %% "
            "intervals differ by up to %(worst).3g times the tolerance of JCGM 101 (8.1; significant digits of u: "
            "%(digits)d). The cause is that standard uncertainties were estimated with few degrees of freedom: their "
            "t-distributions are wider than u. There is no sign of non-linearity. Use the Monte Carlo intervals.",
            common,
        )
    if verdict == "disagree":
        return Message(
            "first-order-refuted",
            "First-order propagation (GUM) and Monte Carlo disagree for %(names)s: the ends of the %(level)g %% "
            "intervals differ by up to %(worst).3g times the tolerance of JCGM 101 (8.1; significant digits of u: "
            "%(digits)d). Use the Monte Carlo intervals.",
            common,
        )
    return Message(
        "first-order-open",
        "Whether first-order propagation (GUM) is good enough for %(names)s is open after %(trials)d draws: "
        "the ends of the %(level)g %% intervals differ by up to %(worst).3g times the tolerance of JCGM 101 (8.1; "
        "significant digits of u: %(digits)d), and Monte Carlo does not know its own any better. Draw more, or "
        "ask for fewer digits.",
        common,
    )
