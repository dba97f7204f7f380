"""How often 95 % intervals of the parameters hold the truth, by how well u(J) is known.

Run as ``python tests/benchmarks/parameter_coverage.py [SESSIONS]``. Sessions of the sixteen positions whose only
error is the noise of the means, solved by least squares; the interval is ±k·u with k for the smallest degrees of
freedom that matter, those of all estimates of a channel together (1.97). u(J) is χ² distributed with ν
degrees of freedom, or what `mean_with_uncertainty` makes of 640 records of white noise and 0.3 of its standard
deviation correlated over a time. Each cell: mean of the eight coverages (least to most), % of sessions with
χ² improbable at 1 %. With 4,000 sessions a coverage is known within ±0.7 % (two standard deviations).
`moderated` is what is used, `as stated` takes each u(J) as it is.
"""

import os
import sys
from collections.abc import Iterator

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy import special

from app.validation.coverage import noise_records
from simdevice.certificate import sixteen_positions
from solver.error_model import currents
from solver.estimators.batch import Stand, solve_sessions
from solver.geometry import case_orientation, elements
from solver.signals.noise import mean_with_uncertainty
from solver.units import rad_per_s_from_deg_per_h, scale_from_deg_per_h_per_ma

RECORDS, POSITIONS = 640, 16
LATITUDE = np.radians(55.7558)
TRUTH = np.concatenate(
    (
        scale_from_deg_per_h_per_ma(np.array([2062.65, 2041.0, 10.3, -8.25])),
        rad_per_s_from_deg_per_h(np.array([1.5, -0.8, 6.0, 2.0])),
    )
)
SIGMA = float(rad_per_s_from_deg_per_h(0.005)) / TRUTH[0]
K = special.stdtrit(180.0, 0.975)
ONE_BAD = np.where(np.arange(2 * POSITIONS).reshape(2, 1, -1) % POSITIONS == 5, 10.0, 1.0)


def known(random: np.random.Generator, dof: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """u/σ of `dof` degrees of freedom and these, (2, count, 16) each."""
    freedom = np.full((2, count, POSITIONS), dof)
    return np.sqrt(random.chisquare(freedom) / freedom), freedom


def recorded(random: np.random.Generator, time_s: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same as records give them."""
    found = []
    for _ in range(RECORDS // 32):
        found += [mean_with_uncertainty(record)[1:3] for record in noise_records(random, 32, time_s)]
    u, dof = np.array(found).T
    chosen = random.integers(RECORDS, size=(2, count, POSITIONS))
    return u[chosen], dof[chosen]


CASES = {
    **{f"ν = {dof:g}": (known, dof, 1.0) for dof in (4.0, 6.0, 10.0, 20.0)},
    **{f"ν = {dof:g}, one position of 10 σ": (known, dof, ONE_BAD) for dof in (6.0, 10.0)},
    **{f"records, {time:g} s": (recorded, time, 1.0) for time in (0.1, 0.5, 1.0, 2.0, 3.0)},
}


def coverages(name: str, count: int, seed: int) -> Iterator[str]:
    """Coverage, its range over the parameters, and improbable χ², moderated and as stated."""
    make, how, spread = CASES[name]
    random = np.random.default_rng(seed)
    u, dof = make(random, how, count)
    places = sixteen_positions()
    theta, psi = (np.array([getattr(place, axis) for place in places]) for axis in ("theta", "psi"))
    none = np.zeros(POSITIONS)
    at = elements(case_orientation(theta, psi, none, none, none))
    exact = np.stack(currents(TRUTH, at, LATITUDE))[:, None]
    jx, jy = exact + SIGMA * spread * random.standard_normal((2, count, POSITIONS))
    stand = Stand(theta, psi, float(LATITUDE))
    for freedom in (dof, (np.inf, np.inf)):
        found = solve_sessions(stand, np.zeros((POSITIONS, 3)), jx, jy, *(SIGMA * spread * u), *freedom)
        held = 100 * np.mean(np.abs(found.values - TRUTH) <= K * found.standard_uncertainties, axis=0)
        improbable = 100 * np.mean(special.chdtrc(2 * POSITIONS - 8, found.chi2) < 0.01)
        yield f"{held.mean():5.1f} ({held.min():.1f} to {held.max():.1f}), χ² {improbable:4.1f}"


def main(sessions: int) -> None:
    """Print the table."""
    print(f"{sessions} sessions each; coverage of 95 % intervals, %, and χ² improbable at 1 %, %")
    print(f"{'':30}{'moderated':>34}{'as stated':>34}")
    for seed, name in enumerate(CASES):
        print(f"{name:30}" + "".join(f"{text:>34}" for text in coverages(name, sessions, seed)), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4000)
