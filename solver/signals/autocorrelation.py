"""Autocorrelation of evenly sampled values, and what it costs a mean.

The variance of a mean of n correlated samples is τ·s²/n with the integrated autocorrelation time,
counted in samples,

    τ = 1 + 2·Σ ρ(k),    k = 1 … W

as if there were only n/τ independent ones. Summed to the record's end the estimate is pure noise, so
the window W is the first that is c times half of τ itself (A. D. Sokal, Monte Carlo methods in
statistical mechanics, 1989, sec. 3); the mean's own removal costs (2W + 1)/n of τ, which is put back
(U. Wolff, Comput. Phys. Commun. 156 (2004) 143, eq. (49)). The relative variance of τ is
2·(2W + 1 − τ)/n (same place, eq. (42)), that of χ² with n/(2W + 1 − τ) degrees of freedom.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW: Final = 5.0
"""c of the window; Sokal advises 4 to 6 for an autocorrelation that decays like an exponential."""
_SHORTEST: Final = 1e-3
"""Least τ, samples: of anticorrelated samples the sum may come out at zero or below."""


@dataclass(frozen=True, slots=True)
class AutocorrelationTime:
    """Integrated autocorrelation time.

    Attributes
    ----------
    samples
        τ, in samples; 1 for independent ones.
    window
        Lags summed, W.
    dof
        Degrees of freedom of a variance that is proportional to τ.
    """

    samples: float
    window: int
    dof: float

    @property
    def standard_uncertainty(self) -> float:
        """Of τ, in samples."""
        return self.samples * float(np.sqrt(2.0 / self.dof))


def autocorrelation(samples: Array) -> Array:
    """ρ(0) = 1, ρ(1), … ρ(n − 1) of samples that are not all equal, (n,), each sum divided by n."""
    n = len(samples)
    size = 1 << (2 * n - 1).bit_length()  # Long enough that the end does not meet the beginning.
    spectrum = np.fft.rfft(samples - np.mean(samples), size)
    sums = np.fft.irfft(spectrum.real**2 + spectrum.imag**2, size)[:n]
    return np.asarray(sums / sums[0])


def integrated_time(correlation: Array) -> AutocorrelationTime:
    """Integrated autocorrelation time from ρ(0), ρ(1), … of the whole record, (n,)."""
    n = len(correlation)
    times = 2.0 * np.cumsum(correlation) - 1.0
    enough = np.arange(n) >= 0.5 * WINDOW * np.maximum(times, 1.0)
    window = int(np.argmax(enough)) if enough.any() else n - 1
    corrected = float(times[window]) * (1.0 + (2 * window + 1) / n)
    time = max(corrected, _SHORTEST)
    return AutocorrelationTime(time, window, n / max(2.0 * window + 1.0 - time, 1.0))
