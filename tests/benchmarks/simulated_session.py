"""What a simulated session costs beside drawing its random numbers.

Run as ``python tests/benchmarks/simulated_session.py [--turns 15]``. One BLAS thread, one worker. The
session: sixteen positions, 60 s at 200 Hz, the scenario ``full-noise``, in which every part is on. The
reference: as many standard normal numbers from PCG64 in arrays as long as a record. How many is
counted while one session is made. Both take turns in one run, the least time of each counts; the
session's slow noise is forgotten before every turn, so each one draws it.

The bound is ten times; beyond it the exit code is 1.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable

import numpy as np

from simdevice import currents, interference, noise, slow
from simdevice.bench import run_session
from simdevice.certificate import sixteen_positions
from simdevice.scenarios import scenario

BOUND = 10.0


def session() -> None:
    """Make the records of one session from nothing."""
    slow._axis.cache_clear()
    run_session(scenario("full-noise").bench(1), sixteen_positions())


def count_numbers() -> int:
    """Count the standard normal numbers of one session."""
    drawn = 0

    class Counting:
        def __init__(self, generator: np.random.Generator) -> None:
            self.generator = generator

        def standard_normal(self, n: int) -> np.ndarray:
            nonlocal drawn
            drawn += n
            return self.generator.standard_normal(n)

        def uniform(self, low: float, high: float) -> float:
            return self.generator.uniform(low, high)

    modules = (currents, interference, noise, slow)
    original = currents.stream
    for module in modules:
        module.stream = lambda *key: Counting(original(*key))
    try:
        session()
    finally:
        for module in modules:
            module.stream = original
    return drawn


def draw(count: int, length: int) -> None:
    """Draw so many standard normal numbers, in arrays of a record's length."""
    generator = np.random.Generator(np.random.PCG64(1))
    for _ in range(count // length):
        generator.standard_normal(length)
    generator.standard_normal(count % length)


def least(tasks: dict[str, Callable[[], object]], turns: int) -> dict[str, float]:
    """Least time of each task, s, in turns."""
    times = dict.fromkeys(tasks, np.inf)
    for _ in range(turns):
        for name, task in tasks.items():
            start = time.process_time()
            task()
            times[name] = min(times[name], time.process_time() - start)
    return times


def main() -> int:
    """Measure, print, and compare with the bound."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=int, default=15)
    turns = parser.parse_args().turns
    count = count_numbers()
    times = least({"session": session, "numbers": lambda: draw(count, 12000)}, turns)
    ratio = times["session"] / times["numbers"]
    print(f"A session of 16 positions, 200 Hz, 60 s, full noise: {times['session'] * 1e3:.1f} ms")
    print(f"Its {count} standard normal numbers from PCG64:      {times['numbers'] * 1e3:.1f} ms")
    print(f"Ratio {ratio:.2f}, at most {BOUND:g}")
    return 0 if ratio <= BOUND else 1


if __name__ == "__main__":
    if any(os.environ.get(name) != "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")):
        one = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **one})
    sys.exit(main())
