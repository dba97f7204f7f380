"""How often each blunder is detected and named, and how often good sessions alarm.

Run as ``python -m tests.benchmarks.diagnosis --sessions 1000 --good 10000``; prints Markdown. The sessions are
simulated by `tests.solver.blundered`, which shares nothing with the solver's geometry.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable

import numpy as np

from solver.diagnosis import diagnose
from tests.solver.blundered import (
    INVISIBLE,
    VISIBLE,
    Made,
    Session,
    Study,
    good,
    prior,
    right,
)


def rates(
    make: Callable[[Session], Made], study: Study, count: int, seed: int, *, with_prior: bool, show: int = 0
) -> tuple[float, float, float]:
    """Parts detected and named rightly, and seconds for a diagnosis (median)."""
    rng = np.random.default_rng(seed)
    expected = prior() if with_prior else None
    detected = named = 0
    times = []
    wrong: Counter[str] = Counter()
    for _ in range(count):
        observations, truth = make(study.draw(rng))
        start = time.process_time()
        diagnosis = diagnose(observations, prior=expected)
        times.append(time.process_time() - start)
        detected += bool(diagnosis.findings)
        if truth is not None and right(diagnosis, truth):
            named += 1
        elif diagnosis.findings:
            wrong[diagnosis.findings[0].code] += 1
        elif truth is not None:
            wrong["(nothing)"] += 1
    if show:
        print(f"    {dict(wrong)}", file=sys.stderr)
    return detected / count, named / count, float(np.median(times))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sessions", type=int, default=200)
    parser.add_argument("--good", type=int, default=1000)
    parser.add_argument("--angles", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for u_given in (True, False):
        print(f"\nu(J) given: {u_given}\n\n| blunder | detected | named | ms |\n| --- | --- | --- | --- |")
        for name, make in {**VISIBLE, **INVISIBLE}.items():
            if options.only and options.only not in name:
                continue
            study = Study(misalignment=300.0 if name == "angle-unit" else 60.0, u_given=u_given)
            d, n, t = rates(make, study, options.sessions, options.seed, with_prior=name in INVISIBLE, show=1)
            print(f"| {name} | {d:.1%} | {n:.1%} | {t * 1e3:.1f} |", flush=True)
        if options.good:
            for with_prior in (False, True):
                d, _, t = rates(good, Study(u_given=u_given), options.good, 7, with_prior=with_prior, show=1)
                print(f"| good, prior {with_prior} | {d:.2%} | | {t * 1e3:.1f} |", flush=True)


if __name__ == "__main__":
    main()
