"""The ammeter's resolution as the samples show it, and what it may do to their mean.

Rounding to steps of q does no harm to a mean as long as the noise σ moves the current across several
steps: the mean of the codes is off by at most (q/π)·exp(−2π²σ²/q²), the first term of a Fourier series
(B. Widrow, I. Kollár, Quantization Noise, 2008, ch. 4). Without noise it is off by anything up to half
a step, q/√12 as a standard deviation. Averaging reduces neither, and no scatter tells it.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from solver.signals.noise import checked

_SAMPLES_PER_CODE: Final = 4
"""Values that repeat so often on average are codes of an ammeter, not numbers of a computer."""
_SAME: Final = 1e-3
"""Codes that differ by less than this part of a usual difference are one code written in two ways."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """Steps in which the samples come.

    Attributes
    ----------
    step
        Smallest difference of two codes, in the unit of the samples.
    codes
        Different values that occur.
    uncertainty
        Standard uncertainty of the mean because of the steps, in the unit of the samples:
        (q/√12)·exp(−2π²σ²/q²) with σ² = s² − q²/12.
    """

    step: float
    codes: int
    uncertainty: float


def resolution(samples: ArrayLike) -> Resolution | None:
    """Steps of the samples; None when they are fine, or when all samples are equal.

    Parameters
    ----------
    samples : (n,) array_like
        At least two finite values.
    """
    values = checked(samples)
    codes = np.unique(values)
    if len(codes) < 2 or len(codes) * _SAMPLES_PER_CODE > len(values):
        return None
    differences = np.diff(codes)
    step = float(np.min(differences[differences > _SAME * np.median(differences)]))
    noise = max(0.0, float(np.var(values)) / step**2 - 1.0 / 12.0)
    return Resolution(step, len(codes), step / 12.0**0.5 * float(np.exp(-2.0 * np.pi**2 * noise)))
