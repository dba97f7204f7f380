"""How often each blunder is detected and named, and how often good sessions alarm.

Run from the top folder as ``python -m tests.benchmarks.diagnosis``; prints the Markdown tables that the README
shows. The sessions are simulated by `tests.solver.blundered`, which shares no geometry with the solver:
16 positions at 55.76°, noise of 0.005 °/h per position and channel, certificate angles of 60″ (1σ; 300″ for
angle-unit) that are true, a gyro drawn around its type's nominal values. What the fit cannot see is
judged against those as prior (scale factors 5 %, g-sensitive drifts 0 ± 5 °/h/g), the rest without prior.
*Named* counts a class of equivalent explanations that holds the truth. Of exchanged positions the eight pairs of
twins (θ+180°, ψ+180°) are left out, which differ by their misalignment alone, and shown apart.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver.blunders.diagnosis import diagnose
from tests.solver.blundered import (
    INVISIBLE,
    VISIBLE,
    Made,
    Session,
    Study,
    at,
    good,
    prior,
    right,
    twins_swapped,
)

Make = Callable[[Session], Made]
ANGLES = (5.0, 20.0, 60.0, 300.0)
"""Certificate angles of the second table, arcsec."""
OF_ANGLES: dict[str, Make] = {
    "angle-unit": VISIBLE["angle-unit"],
    "psi-reversed": INVISIBLE["psi-reversed"],
    "theta-reversed": INVISIBLE["theta-reversed"],
    "twins exchanged": twins_swapped,
}
"""Blunders that show by the certificate's angles, without a prior."""


@dataclass(frozen=True)
class Rates:
    """Parts of the sessions detected and named, and the median time of a diagnosis, s."""

    detected: float
    named: float
    time: float


def rates(label: str, make: Make, study: Study, count: int, seed: int, *, with_prior: bool) -> Rates:
    """Simulate and diagnose; what went wrong goes to standard error."""
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
        elif diagnosis.findings or truth is not None:
            wrong[diagnosis.findings[0].code if diagnosis.findings else "nothing"] += 1
    print(f"{label}: {count}, else {dict(wrong)}", file=sys.stderr, flush=True)
    return Rates(detected / count, named / count, float(np.median(times)))


def by_blunder(counts: tuple[int, int], seed: int, only: str) -> None:
    """Print the rates of each blunder, with and without u(J)."""
    print("| blunder | detected | named | without u(J): detected | named | time, ms |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, make in {**VISIBLE, **INVISIBLE}.items():
        if only in name:
            study = Study(misalignment=300.0 if name == "angle-unit" else 60.0)
            told, untold = (
                rates(name, make, at(study, u_given=given), count, seed, with_prior=name in INVISIBLE)
                for given, count in zip((True, False), counts, strict=True)
            )
            print(
                f"| {name} | {told.detected:.1%} | {told.named:.1%} | {untold.detected:.1%} | {untold.named:.1%} "
                f"| {told.time * 1e3:.0f} |",
                flush=True,
            )


def of_good_sessions(counts: tuple[int, int], seed: int) -> None:
    """Print the false alarms."""
    print("\n| good sessions | false alarms | without u(J) | time, ms |\n| --- | --- | --- | --- |")
    for with_prior in (False, True):
        told, untold = (
            rates("good", good, Study(u_given=given), count, seed, with_prior=with_prior)
            for given, count in zip((True, False), counts, strict=True)
        )
        label = "with prior" if with_prior else "without prior"
        print(
            f"| {label} | {told.detected:.2%} | {untold.detected:.2%} | {told.time * 1e3:.1f} |", flush=True
        )


def by_angles(count: int, seed: int) -> None:
    """Print how the rates fall with the certificate's angles."""
    print("\n| named, without prior | " + " | ".join(f"{angle:g}″" for angle in ANGLES) + " |")
    print("| --- |" + " --- |" * len(ANGLES))
    for name, make in OF_ANGLES.items():
        cells = [
            f"{rates(name, make, Study(misalignment=angle), count, seed, with_prior=False).named:.0%}"
            for angle in ANGLES
        ]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=1000, help="for each blunder")
    parser.add_argument("--good", type=int, default=10_000, help="good sessions, for each kind")
    parser.add_argument("--untold", type=float, default=1.0, help="part of these for sessions without u(J)")
    parser.add_argument("--angles", type=int, default=300, help="sessions for each cell of the second table")
    parser.add_argument("--only", default="", help="blunders whose name contains this")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.sessions:
        by_blunder((options.sessions, round(options.sessions * options.untold)), options.seed, options.only)
    if options.good:
        of_good_sessions((options.good, round(options.good * options.untold)), options.seed)
    if options.angles:
        by_angles(options.angles, options.seed)


if __name__ == "__main__":
    main()
