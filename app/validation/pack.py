"""The whole pack: every suite in turn."""

from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from time import monotonic
from typing import Final

from app.validation import coverage, gum, jcgm101, nbs14, nist, worked
from app.validation.environment import environment
from app.validation.numbers import digest
from app.validation.report import Group, Progress, Report

SEED: Final = 20_170_501
"""Seed of everything random, unless another one is asked for."""

Suite = Callable[[Progress], Group]


def suites(full: bool, seed: int) -> dict[str, tuple[float, Suite]]:
    """Every suite by its key, with its share of the time."""
    return {
        "nist-strd": (1.0, nist.group),
        "gum": (1.0, gum.group),
        "jcgm101": (8.0, partial(jcgm101.group, seed=seed)),
        "nbs14": (1.0, nbs14.group),
        "worked": (1.0, worked.group),
        "coverage": (400.0 if full else 20.0, partial(coverage.group, full=full, seed=seed)),
    }


def run(progress: Progress, *, full: bool = False, seed: int = SEED) -> Report:
    """Validate the installed build.

    Parameters
    ----------
    progress
        Called with a fraction and what is being done.
    full
        The coverage study over 4,000 sessions with their records instead of 400 with their means.
    seed
        Of everything random.
    """
    started_at, start = datetime.now(UTC), monotonic()
    chosen = suites(full, seed)
    whole = sum(share for share, _ in chosen.values())
    groups, done = [], 0.0
    for share, suite in chosen.values():

        def within(fraction: float, what: str, done: float = done, share: float = share) -> None:
            progress((done + share * fraction) / whole, what)

        groups.append(suite(within))
        done += share
    mode = "full" if full else "quick"
    return Report(
        started_at, monotonic() - start, mode, seed, digest(mode, str(seed)), environment(), tuple(groups)
    )
