"""How fast the solver is, beside `numpy.linalg.lstsq` and `scipy.optimize.least_squares`.

Run as ``python tests/benchmarks/solver_speed.py``. One BLAS thread; the runs are interleaved and
their medians compared, so that other load on the machine meets all of them alike. The problem is
a session of sixteen positions with noise of 0.005 °/h; the batch is 10,000 draws of that noise.

The library functions give the estimate alone; `estimate` and `solve_batch` give its covariance too,
`solve` the singular values and vectors, `calibrate` everything of a result (weights from the scale
factors, observability, outliers, …). `solve_sessions` begins with angles and currents: it forms the
equations, weights them by u(J) in two rounds, and gives values, covariance, χ² and a verdict on what
is observable.
"""

import os
import sys
import time
from collections.abc import Callable

import numpy as np
from scipy import optimize

from solver.calibrate import calibrate
from solver.error_model import Equations, currents, design_matrix, observation_equations, scale_matrix
from solver.estimators.batch import Stand, solve_sessions
from solver.geometry import case_orientation, elements
from solver.least_squares import column_scale, estimate, solve, solve_batch
from solver.records import Array, Observations
from solver.units import rad_per_s_from_deg_per_h, scale_from_deg_per_h_per_ma

BATCH = 10_000
SINGLE_RUNS = 40
IN_A_ROW = 20
"""Single solutions timed together, so that each task finds the caches as it left them itself."""
BATCH_RUNS = 7
SCIPY_PART = 200
"""Problems of the batch that scipy solves; its time is scaled up, since all would take half a minute."""


def session(rng: np.random.Generator) -> Observations:
    """Sixteen positions with noise, its uncertainty given."""
    right_angles = np.radians([0.0, 90.0, 180.0, 270.0])
    theta, psi = np.repeat(right_angles, 4), np.tile(right_angles, 4)
    angles = rng.normal(0.0, 1e-4, (3, 16))
    at = elements(case_orientation(theta, psi, *angles))
    scales = scale_from_deg_per_h_per_ma(np.array([2062.65, 2041.0, 10.3, -8.25]))
    drifts = rad_per_s_from_deg_per_h(np.array([1.5, -0.8, 6.0, 2.0]))
    parameters = np.concatenate((scales, drifts))
    noise = float(rad_per_s_from_deg_per_h(0.005)) / parameters[0]
    jx, jy = np.array(currents(parameters, at, np.radians(55.7558))) + noise * rng.standard_normal((2, 16))
    u = np.full(16, noise)
    return Observations.sorted_from(
        theta=theta, psi=psi, alpha=angles[0], beta=angles[1], gamma=angles[2],
        jx=jx, jy=jy, u_jx=u, u_jy=u, latitude=float(np.radians(55.7558)),
    )  # fmt: skip


def batch(
    observations: Observations, equations: Equations, rng: np.random.Generator
) -> tuple[Array, Array, Array, Array]:
    """Whitened designs (N, 32, 8), right sides (N, 32) and the currents with fresh noise in every one."""
    at = elements(
        case_orientation(
            observations.theta, observations.psi, observations.alpha, observations.beta, observations.gamma
        )
    )
    assert observations.u_jx is not None
    u = observations.u_jx[0]
    jx, jy = (j + u * rng.standard_normal((BATCH, 16)) for j in (observations.jx, observations.jy))
    values = calibrate(observations, "least-squares").least_squares
    assert values is not None
    noise = u * np.sqrt(np.linalg.det(scale_matrix(values.values)))
    design = design_matrix(at, jx, jy) / noise
    return design, np.broadcast_to(equations.right_side / noise, (BATCH, 32)).copy(), jx, jy


def medians(tasks: dict[str, Callable[[], object]], runs: int, in_a_row: int = 1) -> dict[str, float]:
    """Median time of each task, s, taking turns of `in_a_row` calls."""
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(runs):
        for name, task in tasks.items():
            start = time.perf_counter()
            for _ in range(in_a_row):
                task()
            times[name].append((time.perf_counter() - start) / in_a_row)
    return {name: float(np.median(values)) for name, values in times.items()}


def by_scipy(design: Array, right_side: Array, scale: Array) -> Array:
    """Solve with the general nonlinear solver: the same residuals, scaled, and their Jacobian."""
    scaled = design / scale

    def residuals(q: Array) -> Array:
        return np.asarray(scaled @ q - right_side)

    def jacobian(_: Array) -> Array:
        return scaled

    result = optimize.least_squares(residuals, np.zeros(len(scale)), jac=jacobian, method="lm")
    return np.asarray(result.x / scale)


def report(title: str, times: dict[str, float], unit: str, factor: float) -> None:
    """Print the times and how they compare with lstsq."""
    print(title)
    reference = times["numpy.linalg.lstsq"]
    for name, value in times.items():
        print(f"  {name:<36}{value * factor:>11.3f} {unit}   lstsq / this: {reference / value:>7.2f}")


def main() -> None:
    """Run both comparisons and check that all agree."""
    rng = np.random.default_rng(1)
    observations = session(rng)
    equations = observation_equations(observations)
    designs, right_sides, jx, jy = batch(observations, equations, rng)
    design, right_side = designs[0], right_sides[0]
    scale = column_scale(design)

    single = medians(
        {
            "numpy.linalg.lstsq": lambda: np.linalg.lstsq(design, right_side),
            "scipy.optimize.least_squares": lambda: by_scipy(design, right_side, scale),
            "solver estimate (with covariance)": lambda: estimate(design, right_side),
            "solver solve (with spectrum)": lambda: solve(design, right_side),
            "solver calibrate, least squares": lambda: calibrate(observations, "least-squares"),
            "solver calibrate, both methods": lambda: calibrate(observations, "both"),
        },
        SINGLE_RUNS,
        IN_A_ROW,
    )
    report("One session of 16 positions (32 equations, 8 unknowns)", single, "µs", 1e6)

    stand = Stand(observations.theta, observations.psi, observations.latitude)
    angles = np.column_stack((observations.alpha, observations.beta, observations.gamma))
    every_angle = np.broadcast_to(angles, (BATCH, *angles.shape)).copy()
    u_jx, u_jy = observations.u_jx, observations.u_jy
    assert u_jx is not None
    assert u_jy is not None
    many = medians(
        {
            "numpy.linalg.lstsq": lambda: [
                np.linalg.lstsq(*one) for one in zip(designs, right_sides, strict=True)
            ],
            "scipy.optimize.least_squares": lambda: [
                by_scipy(designs[i], right_sides[i], scale) for i in range(SCIPY_PART)
            ],
            "solver solve_batch": lambda: solve_batch(designs, right_sides),
            "solver solve_sessions, same angles": lambda: solve_sessions(stand, angles, jx, jy, u_jx, u_jy),
            "solver solve_sessions, own angles": lambda: solve_sessions(
                stand, every_angle, jx, jy, u_jx, u_jy
            ),
        },
        BATCH_RUNS,
    )
    many["scipy.optimize.least_squares"] *= BATCH / SCIPY_PART
    report(f"{BATCH} sessions (scipy's time scaled up from {SCIPY_PART})", many, "ms", 1e3)

    values, covariance = solve_batch(designs, right_sides)
    u = np.sqrt(np.einsum("nii->ni", covariance))
    apart = max(
        float(
            np.max(np.abs(values[i] - np.linalg.lstsq(designs[i] / scale, right_sides[i])[0] / scale) / u[i])
        )
        for i in range(0, BATCH, 10)
    )
    print(f"Largest difference from lstsq with scaled columns: {apart:.1e} u")


def with_one_thread() -> None:
    """Start again with one BLAS thread: the libraries read it when they are loaded."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    if any(os.environ.get(name) != "1" for name in names):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **dict.fromkeys(names, "1")})


if __name__ == "__main__":
    with_one_thread()
    main()
