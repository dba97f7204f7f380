"""Everything that one channel's record says of its noise, and what to make of it in words."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from solver.errors import Message
from solver.signals.allan import AllanDeviation, allan
from solver.signals.autocorrelation import AutocorrelationTime, autocorrelation, integrated_time
from solver.signals.noise import (
    Array,
    Mean,
    batch_means,
    checked,
    is_constant,
    mean_by_correlation,
    mean_with_uncertainty,
)
from solver.signals.noise_coefficients import FEWEST as FEWEST_FOR_COEFFICIENTS
from solver.signals.noise_coefficients import NoiseCoefficients, noise_coefficients
from solver.signals.resolution import Resolution, resolution
from solver.signals.stationarity import FEWEST as FEWEST_FOR_STATIONARITY
from solver.signals.stationarity import UNLIKELY, Stationarity, stationarity

LAGS: Final = 400
_SHOWN_WINDOWS: Final = 20
_FEWEST_LAGS: Final = 100
_COARSE: Final = 1.0 / 3.0
"""Of u: a rounding error that adds 5 % to it."""


@dataclass(frozen=True, slots=True)
class Correlogram:
    """Autocorrelation for the eye.

    Attributes
    ----------
    lag, value : (l,) array
        At most 400 lags, s, and ρ there.
    chance
        Two standard deviations of ρ for independent samples.
    time
        Integrated autocorrelation time, in samples.
    """

    lag: Array
    value: Array
    chance: float
    time: AutocorrelationTime


@dataclass(frozen=True, slots=True)
class ChannelNoise:
    """Noise of one channel; units of the samples and s.

    Attributes
    ----------
    mean
        With the uncertainty that is stated (slow cosines).
    by_batches, by_correlation
        The same mean with its uncertainty by the two other ways.
    correlogram, allan, coefficients, stationarity, resolution
        None where the record cannot tell: all samples equal, or too few of them; `resolution` is None
        too where the samples are fine.
    interval
        Between samples, s.
    findings
        What a reader should know, the gravest first; never empty.
    """

    samples: int
    interval: float
    mean: Mean
    by_batches: Mean
    by_correlation: Mean
    correlogram: Correlogram | None
    allan: AllanDeviation | None
    coefficients: NoiseCoefficients | None
    stationarity: Stationarity | None
    resolution: Resolution | None
    findings: tuple[Message, ...]


def channel_noise(samples: ArrayLike, interval: float) -> ChannelNoise:
    """Look at one channel's record from every side.

    Parameters
    ----------
    samples : (n,) array_like
        At least two finite values, evenly sampled.
    interval
        Between samples, s.

    Raises
    ------
    InputError
        With fewer than two samples, one that is not finite, or an interval that is not positive.
    """
    values = checked(samples)
    n = len(values)
    changing = not is_constant(values)
    steady = stationarity(values, interval) if changing and n >= FEWEST_FOR_STATIONARITY else None
    drifting = steady is not None and 3.0 * steady.slope.p_value < UNLIKELY
    mean = mean_with_uncertainty(values)
    steps = resolution(values)
    coefficients = None
    if n >= FEWEST_FOR_COEFFICIENTS:
        coefficients = noise_coefficients(values, interval, without_drift=drifting)
    return ChannelNoise(
        samples=n,
        interval=interval,
        mean=mean,
        by_batches=batch_means(values),
        by_correlation=mean_by_correlation(values),
        correlogram=_correlogram(values, interval) if changing else None,
        allan=allan(values, interval) if changing and n > 2 else None,
        coefficients=coefficients,
        stationarity=steady,
        resolution=steps,
        findings=tuple(_findings(mean, steady, steps, coefficients)) if changing else (_STUCK,),
    )


_STUCK: Final = Message(
    "constant-channel",
    "Every sample is the same: the channel is stuck, or its noise is below the ammeter's resolution. "
    "The uncertainty of this mean is not known.",
)


def _findings(
    mean: Mean, steady: Stationarity | None, steps: Resolution | None, coefficients: NoiseCoefficients | None
) -> list[Message]:
    found = []
    if steady is not None and steady.finding.code != "steady":
        found.append(steady.finding)
    if steps is not None and steps.uncertainty > _COARSE * mean.standard_uncertainty:
        found.append(
            Message(
                "coarse-resolution",
                "The ammeter's steps are coarse for this noise: rounding alone may shift the mean. "
                "Choose a smaller range.",
            )
        )
    if coefficients is not None and not coefficients.fits:
        found.append(
            Message(
                "noise-not-modelled",
                "The noise follows none of the model's laws; its coefficients are only a rough guide.",
            )
        )
    if steady is None:
        return found or [
            Message("too-short-to-judge", "The record is too short to judge whether it is steady.")
        ]
    return found or [steady.finding]


def _correlogram(values: Array, interval: float) -> Correlogram:
    n = len(values)
    correlation = autocorrelation(values)
    time = integrated_time(correlation)
    longest = min(n - 1, max(_FEWEST_LAGS, _SHOWN_WINDOWS * time.window))
    lags = np.unique(np.linspace(0, longest, min(LAGS, longest + 1)).astype(np.int64))
    return Correlogram(lags.astype(np.float64) * interval, correlation[lags], 2.0 / float(np.sqrt(n)), time)
