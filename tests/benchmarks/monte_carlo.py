"""How fast, how lean and how linear the Monte Carlo over all inputs is.

Run as ``python tests/benchmarks/monte_carlo.py [--draws 1000000] [--linear]``. One BLAS thread. The
inputs are those of a session of sixteen positions: 32 currents, 48 certified angles and the 13 common
terms with a correlation. The reference is a loop in which each draw is one vectorised scipy `Rotation`
over the positions and one `numpy.linalg.lstsq` on the whitened design, its inputs drawn beforehand. Loop
and engine take turns in one run, so that other load on the machine meets both alike; the
loop's time for all draws is scaled up from its own.

``--linear`` goes to 10⁷ draws and prints the time per draw and the memory at each step.
"""

import argparse
import os
import resource
import sys
import time
import tracemalloc
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from solver.calibrate import calibrate
from solver.constants import EARTH_RATE
from solver.error_model import currents
from solver.estimators.conclusion import Solved
from solver.estimators.rate_noise import whitening_of
from solver.geometry import case_orientation, elements
from solver.inputs import COMMON, CommonUncertainty
from solver.propagation.budget import make_budget
from solver.propagation.distributions import compare_with_budget, propagate_distributions
from solver.records import Array, Observations
from solver.units import rad_from_arcsec, rad_per_s_from_deg_per_h, scale_from_deg_per_h_per_ma

TURNS = 5
LOOP = 2_000
"""Draws of the loop in each turn."""


def session(rng: np.random.Generator) -> Observations:
    """Sixteen positions with noise of 0.005 °/h and angles certified to 2″."""
    right_angles = np.radians([0.0, 90.0, 180.0, 270.0])
    theta, psi = np.repeat(right_angles, 4), np.tile(right_angles, 4)
    angles = rng.normal(0.0, 1e-4, (3, 16))
    scales = scale_from_deg_per_h_per_ma(np.array([2062.65, 2041.0, 10.3, -8.25]))
    drifts = rad_per_s_from_deg_per_h(np.array([1.5, -0.8, 6.0, 2.0]))
    parameters = np.concatenate((scales, drifts))
    latitude = float(np.radians(55.7558))
    noise = float(rad_per_s_from_deg_per_h(0.005)) / parameters[0]
    jx, jy = currents(parameters, elements(case_orientation(theta, psi, *angles)), latitude)
    u, u_angle = np.full(16, noise), np.full(16, rad_from_arcsec(2.0))
    plain = Observations.sorted_from(
        theta=theta, psi=psi, alpha=angles[0], beta=angles[1], gamma=angles[2],
        jx=jx + noise * rng.standard_normal(16), jy=jy + noise * rng.standard_normal(16), u_jx=u, u_jy=u,
        latitude=latitude,
    )  # fmt: skip
    return replace(plain, u_alpha=u_angle, u_beta=u_angle, u_gamma=u_angle)


def common() -> CommonUncertainty:
    """All thirteen terms, two of them correlated."""
    arcsec = float(rad_from_arcsec(1.0))
    standard = {
        "gain_x": 2e-5, "gain_y": 2e-5, "offset_x": 1e-12, "offset_y": 1e-12, "alpha": 2 * arcsec, "beta": 2 * arcsec,
        "gamma": 3 * arcsec, "level_1": 2 * arcsec, "level_2": 2 * arcsec, "azimuth": 20 * arcsec,
        "latitude": 5 * arcsec, "gravity": 1e-5, "temperature": 0.1,
    }  # fmt: skip
    return CommonUncertainty.of(
        standard, correlation={("gain_x", "gain_y"): 0.5}, temperature_coefficients={"kx": 1e-3, "ky": 1e-3}
    )


class Loop:
    """Draw by draw with scipy's rotations and numpy's lstsq."""

    def __init__(self, solved: Solved, uncertain: CommonUncertainty) -> None:
        at = solved.problem.observations
        assert at is not None
        assert at.u_jx is not None
        assert at.u_jy is not None
        u = np.stack((at.u_jx, at.u_jy), axis=1)
        whitening = whitening_of(solved.values, u)
        assert whitening is not None
        self.at, self.u, self.whitening = at, u, whitening
        self.currents = np.stack((at.jx, at.jy), axis=1)
        self.angles = np.stack((at.alpha, at.beta, at.gamma), axis=1)
        self.u_angles = np.stack((at.u_alpha, at.u_beta, at.u_gamma), axis=1)
        self.root = np.linalg.cholesky(uncertain.covariance)
        self.coefficients = uncertain.temperature_coefficients
        self.commanded = Rotation.from_euler("xz", -np.stack((at.theta, at.psi), axis=1))
        whitened = whitening @ solved.problem.equations.design.reshape(-1, 2, 8)
        self.scale = np.linalg.norm(whitened.reshape(-1, 8), axis=0)

    def draws(self, rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
        """Currents, angles and common errors of all draws."""
        shared = rng.standard_normal((count, len(COMMON))) @ self.root.T
        j = self.currents + self.u * rng.standard_normal((count, *self.u.shape))
        j = j * (1 + shared[:, None, 0:2]) + shared[:, None, 2:4]
        angles = self.angles + self.u_angles * rng.standard_normal((count, *self.u_angles.shape))
        return j, angles + shared[:, None, 4:7], shared

    def solve(self, j: Array, angles: Array, shared: Array) -> Array:
        """One draw."""
        base = Rotation.from_euler("xyz", -shared[7:10])
        turn = (Rotation.from_euler("xyz", -angles) * self.commanded * base).as_matrix()
        latitude = self.at.latitude + shared[10]
        rates = EARTH_RATE * (np.cos(latitude) * turn[:, :2, 1] + np.sin(latitude) * turn[:, :2, 2])
        design = np.zeros((len(j), 2, 8))
        design[:, 0, 0] = design[:, 1, 3] = j[:, 0]
        design[:, 0, 2] = design[:, 1, 1] = j[:, 1]
        design[:, 0, 4] = design[:, 1, 5] = 1.0
        c, d = (1 + shared[11]) * turn[:, :2, 2].T
        design[:, 0, 6] = design[:, 1, 7] = c
        design[:, 1, 6] = d
        design[:, 0, 7] = -d
        left = (self.whitening @ design).reshape(-1, 8) / self.scale
        right = (self.whitening @ rates[:, :, None]).ravel()
        values: Array = np.linalg.lstsq(left, right)[0] / self.scale
        return values - self.coefficients * shared[12]


def memory() -> float:
    """Largest resident memory so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def speed(solved: Solved, loop: Loop, draws: int) -> None:
    """Time both in turns, and hold their answers together."""
    rng = np.random.default_rng(1)
    times: dict[str, list[float]] = {"loop": [], "engine": []}
    answers = []
    part = max(20_000, draws // TURNS)
    for turn in range(TURNS):
        inputs = loop.draws(rng, LOOP)
        start = time.perf_counter()
        answers += [loop.solve(*one) for one in zip(*inputs, strict=True)]
        times["loop"].append((time.perf_counter() - start) / LOOP)
        start = time.perf_counter()
        propagate_distributions(solved, trials=part, seed=turn)
        times["engine"].append((time.perf_counter() - start) / part)
    each, engine = (float(np.median(times[name])) for name in ("loop", "engine"))
    print(f"{draws:,} draws over {32 + 48 + 13} inputs, sixteen positions (medians of {TURNS} turns)")
    print(
        f"  Rotation and lstsq, draw by draw {each * 1e6:>9.2f} µs a draw   {each * draws:>8.1f} s (scaled up)"
    )
    print(f"  propagate_distributions          {engine * 1e6:>9.2f} µs a draw   {engine * draws:>8.1f} s")
    print(f"  ratio {each / engine:.1f}")
    before, start = memory(), time.perf_counter()
    found = propagate_distributions(solved, trials=draws)
    print(
        f"  one run of {draws:,}: {time.perf_counter() - start:.1f} s, resident memory +{memory() - before:.1f} MB"
    )
    tracemalloc.start()
    propagate_distributions(solved, trials=50_000)
    print(f"  most memory at a time {tracemalloc.get_traced_memory()[1] / 1e6:.1f} MB")
    tracemalloc.stop()
    spread = np.array(answers).std(axis=0) / found.standard_uncertainties
    print(
        f"  u of {len(answers):,} draws by the loop over u by the engine: {spread.min():.3f} to {spread.max():.3f}"
    )
    linear = solved.linearise()
    budget = make_budget(linear.gain, linear.inputs)
    print(f"  {compare_with_budget(solved, budget, found, digits=1).message.text}")


def linearity(solved: Solved) -> None:
    """Time and memory up to ten million draws; processor time, which other load hardly changes."""
    print("Draws, processor time per draw, processor and wall time, resident memory")
    for draws in (10_000, 100_000, 1_000_000, 10_000_000):
        start, start_cpu = time.perf_counter(), time.process_time()
        propagate_distributions(solved, trials=draws)
        spent, cpu = time.perf_counter() - start, time.process_time() - start_cpu
        print(
            f"  {draws:>10,} {cpu / draws * 1e6:>8.2f} µs {cpu:>8.2f} s {spent:>8.2f} s {memory():>8.1f} MB",
            flush=True,
        )


def main() -> None:
    """Run what is asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--draws", type=int, default=1_000_000, help="draws of the speed comparison")
    parser.add_argument("--linear", action="store_true", help="go to ten million draws instead")
    asked = parser.parse_args()
    uncertain = common()
    solved = calibrate(session(np.random.default_rng(1)), "least-squares", uncertain).solved["least-squares"]
    if asked.linear:
        linearity(solved)
    else:
        speed(solved, Loop(solved, uncertain), asked.draws)


def with_one_thread() -> None:
    """Start again with one BLAS thread: the libraries read it when they are loaded."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    if any(os.environ.get(name) != "1" for name in names):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **dict.fromkeys(names, "1")})


if __name__ == "__main__":
    with_one_thread()
    main()
