"""How often 95 % intervals of a mean current hold the truth, by noise and by method.

Run as ``python tests/benchmarks/mean_coverage.py [RECORDS]``. Records of 60 s at 200 Hz; the interval is
mean ± t·u with Student's t for the degrees of freedom that each method states. Methods: `cosines`
(`mean_with_uncertainty`), `correlation` (integrated autocorrelation time), `batches` (means of parts),
and s/√n for comparison. After each coverage stands the median number of degrees of freedom. With
4,000 records a coverage of 95 % is known within ±0.7 % (two standard deviations).
"""

import os
import sys
from collections.abc import Callable, Iterator

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy import signal, special

from solver.signals.noise import Mean, batch_means, mean_by_correlation, mean_with_uncertainty

SAMPLES, RATE_HZ = 12_000, 200.0
Make = Callable[[np.random.Generator], tuple[np.ndarray, float]]
"""A record and the true mean."""


def markov(random: np.random.Generator, time_s: float) -> np.ndarray:
    """First-order Markov noise of unit variance."""
    phi = np.exp(-1.0 / (time_s * RATE_HZ))
    settled = int(10 * time_s * RATE_HZ)
    shocks = random.standard_normal(SAMPLES + settled) * np.sqrt(1.0 - phi**2)
    return signal.lfilter([1.0], [1.0, -phi], shocks)[settled:]


def correlated(time_s: float) -> Make:
    """Markov noise alone."""
    return lambda random: (markov(random, time_s), 0.0)


def mixed(part: float, time_s: float) -> Make:
    """White noise, and Markov noise with so many of its standard deviations."""
    return lambda random: (random.standard_normal(SAMPLES) + part * markov(random, time_s), 0.0)


def quantised(step: float, time_s: float = 0.0) -> Make:
    """Noise of unit variance, rounded to a step; the true mean is anywhere between two steps."""

    def make(random: np.random.Generator) -> tuple[np.ndarray, float]:
        truth = float(random.uniform(0.0, step))
        noise = markov(random, time_s) if time_s else random.standard_normal(SAMPLES)
        return step * np.rint((truth + noise) / step), truth

    return make


def with_hum(random: np.random.Generator) -> tuple[np.ndarray, float]:
    """White noise and three times as much of 50.02 Hz, sampled into slow beats."""
    seconds = np.arange(SAMPLES) / RATE_HZ
    return random.standard_normal(SAMPLES) + 4.0 * np.sin(
        2 * np.pi * (50.02 * seconds + random.uniform())
    ), 0.0


def resonant(random: np.random.Generator) -> tuple[np.ndarray, float]:
    """A weakly damped oscillation at 5 Hz that white noise excites."""
    radius, turn = 0.98, 2 * np.pi * 5.0 / RATE_HZ
    shocks = random.standard_normal(SAMPLES + 1000)
    return signal.lfilter([1.0], [1.0, -2 * radius * np.cos(turn), radius**2], shocks)[1000:], 0.0


NOISES: dict[str, Make] = {
    "white": lambda random: (random.standard_normal(SAMPLES), 0.0),
    **{
        f"correlated over {1000 * time:.0f} ms": correlated(time)
        for time in (0.005, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
    },
    **{
        f"white + {part:g} σ over {1000 * time:.0f} ms": mixed(part, time)
        for part, time in ((0.3, 0.1), (0.1, 0.5), (0.3, 0.5), (0.1, 1.0), (0.3, 1.0))
    },
    **{f"white, steps of {step:g} σ": quantised(step) for step in (1.0, 2.0)},
    "over 50 ms, steps of 2 σ": quantised(2.0, 0.05),
    "white + mains hum": with_hum,
    "resonance at 5 Hz": resonant,
}
METHODS: dict[str, Callable[[np.ndarray], Mean]] = {
    "cosines": mean_with_uncertainty,
    "correlation": mean_by_correlation,
    "batches": batch_means,
    "s/√n": lambda record: Mean(
        float(record.mean()), float(record.std(ddof=1)) / SAMPLES**0.5, SAMPLES - 1.0, float(SAMPLES)
    ),
}


def coverages(make: Make, records: int, seed: int) -> Iterator[str]:
    """Coverage and median degrees of freedom of each method."""
    random = np.random.default_rng(seed)
    inside = np.zeros((len(METHODS), records), dtype=bool)
    dof = np.zeros((len(METHODS), records))
    for number in range(records):
        record, truth = make(random)
        for row, method in enumerate(METHODS.values()):
            mean = method(record)
            reach = special.stdtrit(mean.dof, 0.975) * mean.standard_uncertainty
            inside[row, number], dof[row, number] = abs(mean.value - truth) <= reach, mean.dof
    for row in range(len(METHODS)):
        yield f"{100 * inside[row].mean():5.1f} ({np.median(dof[row]):5.0f})"


def main(records: int) -> None:
    """Print the table."""
    print(f"{records} records each; coverage of 95 % intervals, % (degrees of freedom)")
    print(f"{'':28}" + "".join(f"{name:>15}" for name in METHODS))
    for seed, (name, make) in enumerate(NOISES.items()):
        print(f"{name:28}" + "".join(f"{text:>15}" for text in coverages(make, records, seed)), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4000)
