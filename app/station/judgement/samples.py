"""What the samples of one channel do that noise alone does not: leap, repeat themselves, lie on a limit.

All functions take samples (n,) in any unit and hold for coarse ammeters too, whose codes repeat. With q the
ammeter's step (0 where it is finer than the noise), a reading is at most q/2 from the true value.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtrc, ndtri

from app.station.contracts import Array
from solver.signals.resolution import resolution

_NORMAL: Final = 1.482602218505602
"""Standard deviation of a normal distribution over its median absolute deviation, 1/Φ⁻¹(¾)."""
_MAD_ERROR: Final = 1.1664
"""√n times the relative standard deviation of a normal sample's median absolute deviation (Huber, Robust
Statistics, 1981, 5.1: an efficiency of 36.7 % against the standard deviation's √(1/2n))."""
_GOLDEN: Final = (5.0**0.5 - 1.0) / 2.0
_FEW_CODES: Final = 5
_SHORTEST_RUN: Final = 20
_RUNS: Final = 5
_SPAN: Final = 8


def step_of(values: Array) -> float:
    """The ammeter's step as the samples show it; 0 when it is fine beside the noise, or all are equal."""
    found = resolution(values)
    return found.step if found else 0.0


def limit_of_noise(values: Array, false_alarm: float) -> float:
    """A distance from the median that no sample of normal noise exceeds but with probability `false_alarm`.

    With probability α/2 one of n samples is beyond ±k·σ, Q(k) = α/4n. The standard deviation comes from the median
    absolute deviation, 1.4826·M; it is underestimated by more than the part k·1.17/√n with a probability below α/2.
    Codes are spread evenly over their step before M is taken, which makes it larger, never smaller; and a code is
    off by q at most from the unrounded value and median. So the distance is k·1.4826·M/(1 − k·1.17/√n) + q.
    """
    n = len(values)
    k = -float(ndtri(false_alarm / (4.0 * n)))
    step = step_of(values)
    if step:
        # Evenly, and the same for the same record: the multiples of the golden ratio, modulo 1.
        values = values + step * (np.arange(n) * _GOLDEN % 1.0 - 0.5)
    deviation = float(np.median(np.abs(values - np.median(values))))
    return k * _NORMAL * deviation / _trusted(k, n) + step


def outlying(values: Array, false_alarm: float) -> NDArray[np.bool_]:
    """Which samples are further from the median than normal noise goes, (n,)."""
    return np.abs(values - np.median(values)) > limit_of_noise(values, false_alarm)


def largest_step(steps: Array, false_alarm: float) -> float:
    """The same distance for time steps, whose rounding to digits is no ammeter's."""
    n = len(steps)
    k = -float(ndtri(false_alarm / (4.0 * n)))
    deviation = float(np.median(np.abs(steps - np.median(steps))))
    return k * _NORMAL * deviation / _trusted(k, n)


def _trusted(k: float, n: int) -> float:
    return max(0.5, 1.0 - k * _MAD_ERROR / float(np.sqrt(n)))


def longest_run(values: Array, false_alarm: float) -> int:
    """Length of a run of equal samples that is no chance, or 0.

    With p the share of pairs of neighbours that are equal, outside the run, a run of L among n independent samples
    has a probability of at most n·p^(L−1). It must also be four times longer than the fifth longest: a current
    that creeps through the codes of a coarse ammeter rests on each of them. Fewer than five codes tell nothing.
    """
    ends = np.append(np.flatnonzero(values[1:] != values[:-1]), len(values) - 1)
    lengths = np.diff(ends, prepend=-1)
    if len(lengths) == 1:
        return len(values)
    longest = int(lengths.max())
    if len(np.unique(values)) < _FEW_CODES or longest < _SHORTEST_RUN or len(lengths) < _RUNS:
        return 0
    pairs = len(values) - longest
    equal = len(values) - len(lengths) - (longest - 1)
    share = min((equal + 5.0) / (pairs + 5.0), 1.0 - 1e-9)
    by_chance = 1.0 + np.log(len(values) / false_alarm) / -np.log(share)
    fifth = int(np.partition(lengths, -_RUNS)[-_RUNS])
    return longest if longest > max(by_chance, 4 * fifth) else 0


def at_a_limit(values: Array, false_alarm: float) -> int:
    """How many samples a limit has cut to one extreme value, or 0.

    Noise has fewer samples at its very extreme than at the value next to it; of m samples at both, more than half
    lie at the extreme with the binomial's probability. Leaping samples are left out, and so are records of a few
    codes, whose extreme may be where most samples are. Where the extreme is the median too, the rest lies on one
    side; noise does that only where it hardly ever leaves two codes.
    """
    median = np.median(values)
    for extreme in (values.max(), values.min()):
        beside_it = values[values != extreme]
        if extreme == median and len(np.unique(beside_it)) >= _FEW_CODES - 1:
            return int(np.sum(values == extreme))
    step = step_of(values)
    inner = values[~outlying(values, false_alarm)]
    codes, counts = np.unique(inner, return_counts=True)
    if len(codes) < _SPAN or (step and codes[-1] - codes[0] < _SPAN * step):
        return 0
    for extreme, beside in ((counts[-1], counts[-2]), (counts[0], counts[1])):
        # P(X ≥ extreme) for X of a binomial distribution with probability 1/2; two sides.
        if float(bdtrc(extreme - 1, int(extreme + beside), 0.5)) < false_alarm / 2.0:
            return int(extreme)
    return 0


def scatter(values: Array) -> float:
    """Standard deviation about the straight line through the samples, without what the rounding adds (Sheppard)."""
    places = np.arange(len(values)) - (len(values) - 1) / 2.0
    deviations = values - values.mean()
    residuals = deviations - places * float(places @ deviations) / float(places @ places)
    variance = float(residuals @ residuals) / max(len(values) - 2, 1)
    return float(np.sqrt(max(variance - step_of(values) ** 2 / 12.0, 0.0)))
