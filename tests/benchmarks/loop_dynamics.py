"""How fast the loop's responses are, beside `scipy.integrate.solve_ivp` and `control.forced_response`.

Run as ``python tests/benchmarks/loop_dynamics.py``. One BLAS thread; the runs are interleaved and
their medians compared, so that other load on the machine meets all of them alike. Every way gives
the same output, both deflections and both measured rates of the paper's gyro at the same times, and
its largest difference to ours is printed beside its time. Ours begins with the parameters each time:
state matrix, exponential and all.

`solve_ivp` is DOP853 with rtol 1e-12 (the stiff Radau needs longer still). `forced_response` gets
the same system with real states; for held inputs that system is sampled first (`c2d`, not timed),
since it would join the samples of a continuous one by straight lines.
"""

import os
import sys
import time
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import control
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from simdevice.dynamics import GVK_6, LoopDynamics
from simdevice.responses import held_response, step_response

Array = NDArray[np.float64]
RUNS = 5
IN_A_ROW = 10


def real_system() -> control.StateSpace:
    """The loop with real states and outputs α, β and the measured rates; inputs ωx, ωy, ωpx, ωpy."""
    dynamics = LoopDynamics(GVK_6)

    def real(matrix: NDArray[np.complex128]) -> Array:
        return np.block([[matrix.real, -matrix.imag], [matrix.imag, matrix.real]])

    inputs = real(dynamics.inputs)[:, [0, 2, 1, 3]]
    outputs = real(dynamics.output)[[0, 2, 1, 3]]
    return control.ss(real(dynamics.matrix), inputs, outputs, np.zeros((4, 4)))


def our_step(t: Array) -> Array:
    found = step_response(LoopDynamics(GVK_6), t[-1], t[1])
    return np.array([found.alpha, found.beta, found.rate_x, found.rate_y])


def our_modes(t: Array) -> Array:
    x, y = LoopDynamics(GVK_6).measured_rates_after_step(1.0, 0.0, t)
    return np.array([x + 1.0, y])


def integrated_step(system: control.StateSpace, t: Array) -> Array:
    drive = system.B[:, 0]
    solution = solve_ivp(
        lambda _, x: system.A @ x + drive, (0.0, t[-1]), np.zeros(len(drive)), "DOP853", t, rtol=1e-12, atol=1e-16
    )  # fmt: skip
    return np.asarray(system.C @ solution.y)


def forced_step(system: control.StateSpace, t: Array) -> Array:
    return np.asarray(
        control.forced_response(system, t, np.outer([1.0, 0.0, 0.0, 0.0], np.ones(len(t)))).outputs
    )


def our_held(t: Array, inputs: Array) -> Array:
    z, measured = held_response(
        LoopDynamics(GVK_6), inputs[0] + 1j * inputs[1], inputs[2] + 1j * inputs[3], t[1]
    )
    return np.array([z.real, z.imag, measured.real, measured.imag])


def timed(tasks: dict[str, tuple[Callable[[], Array], int]]) -> dict[str, float]:
    """Median seconds of one call of each task, the runs interleaved; each is timed so often in a row."""
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(RUNS):
        for name, (task, often) in tasks.items():
            begin = time.perf_counter()
            for _ in range(often):
                task()
            times[name].append((time.perf_counter() - begin) / often)
    return {name: float(np.median(found)) for name, found in times.items()}


def table(title: str, tasks: dict[str, tuple[Callable[[], Array], int]]) -> None:
    """Times, ratios to the first task, and the largest difference to its output, of its peak."""
    print(title)
    (first, (reference, _)), *_ = tasks.items()
    expected, found = reference(), timed(tasks)
    for name, (task, _) in tasks.items():
        outputs = task()
        same = expected[-len(outputs) :]
        peak = np.abs(same).max(axis=1)
        difference = float((np.abs(outputs - same).max(axis=1)[peak > 0] / peak[peak > 0]).max())
        seconds = found[name]
        print(
            f"  {name:<32}{1e3 * seconds:>10.3f} ms{seconds / found[first]:>10.1f} ×   differs {difference:.0e}"
        )


def main() -> int:
    system = real_system()
    for title, t in (
        ("Figures 4 and 5: a step, 0.2 s in 2,001 points", np.linspace(0.0, 0.2, 2_001)),
        ("A step as the ammeter would follow it: 2 s at 200 Hz", np.linspace(0.0, 2.0, 401)),
    ):
        table(title, {
            "step_response": (lambda t=t: our_step(t), IN_A_ROW),
            "measured_rates_after_step": (lambda t=t: our_modes(t), IN_A_ROW),
            "control.forced_response": (lambda t=t: forced_step(system, t), 1),
            "solve_ivp": (lambda t=t: integrated_step(system, t), 1),
        })  # fmt: skip
    t = np.linspace(0.0, 60.0, 12_001)
    inputs = np.random.default_rng(1).standard_normal((4, len(t)))
    sampled = control.c2d(system, t[1])
    table("Held inputs, all four random: 60 s at 200 Hz", {
        "held_response": (lambda: our_held(t, inputs), IN_A_ROW),
        "control.forced_response": (
            lambda: np.asarray(control.forced_response(sampled, t, inputs).outputs), 1),
    })  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
