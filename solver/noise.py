"""Noise of a sampled current: what its mean is worth."""

from math import isqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solver.errors import InputError, Message

_FEWEST_FOR_BATCHES: Final = 64


class Mean(NamedTuple):
    """A mean and its standard uncertainty, in the unit of the samples."""

    value: float
    standard_uncertainty: float


def mean_with_uncertainty(samples: ArrayLike) -> Mean:
    """Mean of evenly sampled, possibly autocorrelated values, with its standard uncertainty.

    Neighbouring samples of a current at 200 Hz are not independent, so s/√n is too small. The
    record is cut into ⌊√n⌋ batches of equal length; the batch means are nearly independent once a
    batch is much longer than the correlation time, and their scatter over the root of their number
    is the uncertainty (method of batch means: Law, Simulation Modeling and Analysis, ch. 9). For
    60 s at 200 Hz that is 109 batches of 0.55 s, good for correlation times to about 50 ms, and u is
    itself uncertain by about 7 %. Fewer than 64 samples are taken as independent.

    Parameters
    ----------
    samples : (n,) array_like
        At least two finite values.

    Raises
    ------
    InputError
        When there are fewer than two samples or one is not finite.
    """
    values = np.asarray(samples, dtype=np.float64)
    if values.ndim != 1 or len(values) < 2:
        raise InputError(
            Message("too-few-samples", "A mean with its uncertainty needs at least two samples.")
        )
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values))) + 1
        raise InputError(Message("not-finite", "Sample %(row)d is not a finite number.", {"row": row}))
    mean = float(np.mean(values))
    count = len(values) if len(values) < _FEWEST_FOR_BATCHES else isqrt(len(values))
    length = len(values) // count
    # The few samples that fill no batch are left out of the scatter, at the start, where transients are.
    batches = np.mean((values[-count * length :] - mean).reshape(count, length), axis=1)
    return Mean(mean, float(np.std(batches, ddof=1)) / count**0.5)
