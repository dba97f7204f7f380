"""Which power law a noise follows: its lag-1 autocorrelation tells.

For noise with a spectrum f^α the lag-1 autocorrelation r of its averages gives δ = r/(1 + r), and
α = −2·δ; when δ is not below ¼ the noise is not stationary enough for that, so its differences are
taken and 2 subtracted (W. J. Riley, C. A. Greenhall, Power law noise identification using the lag 1
autocorrelation, 18th European Frequency and Time Forum, 2004; NIST SP 1065, sec. 5.5).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

FEWEST_TO_IDENTIFY: Final = 30
"""Averages that the lag-1 autocorrelation needs to tell a noise (Riley, Greenhall)."""
_NOT_STATIONARY: Final = 0.25
_BEYOND_CHANCE: Final = 2.0
"""Standard deviations, of 1/√count in the lag-1 autocorrelation and twice that in α."""


def noise_exponent(samples: NDArray[np.float64], factor: int, likely: int | None = None) -> int:
    """α of the noise that dominates averages of so many samples, −2 … 2.

    A straight line is removed first: drift is no noise. Samples that do not change count as white.

    Parameters
    ----------
    samples : (n,) array
    factor
        Samples in an average; n // factor should be at least `FEWEST_TO_IDENTIFY`.
    likely
        What shorter averages told: it stands until the averages contradict it by more than chance,
        lest some of the few long averages of white noise look like another.
    """
    count = len(samples) // factor
    averages = np.mean(samples[: count * factor].reshape(count, factor), axis=1)
    place = np.arange(count) - (count - 1) / 2.0
    rest = averages - np.mean(averages)
    rest = rest - place * (np.sum(place * rest) / np.sum(place * place))
    delta = _delta(rest)
    if delta >= _NOT_STATIONARY:
        delta = _delta(np.diff(rest)) + 1.0
    exponent = -2.0 * delta
    if likely is not None and abs(exponent - likely) <= 0.5 + _BEYOND_CHANCE * 2.0 / np.sqrt(count):
        return likely
    return int(np.clip(round(exponent), -2, 2))


def _delta(values: NDArray[np.float64]) -> float:
    centred = values - np.mean(values)
    power = float(np.sum(centred * centred))
    if power == 0.0:
        return 0.0
    lag_1 = max(float(np.sum(centred[1:] * centred[:-1])) / power, -0.999)
    return lag_1 / (1.0 + lag_1)
