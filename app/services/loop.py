"""The rebalance loop of a gyro: is it stable and with what margin, how does it answer a step.

Fields carry the units of the paper's own list of parameters, which are SI. The answers depend on
nothing but the parameters, so the same question is answered from memory.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid, NotFound, Problem, problem
from app.exchange.si import parameter_si
from app.services import gyros
from app.services.lab import Work
from simdevice.dynamics import GVK_6, LoopDynamics, LoopParameters
from simdevice.frequency import BothSigns, loop_gain, margins, rate_response
from simdevice.responses import StepResponse, settling_time, step_response
from simdevice.stability import cause_of_instability

Array = NDArray[np.float64]

MEMBERS: Final = {
    "h_n_m_s": "angular_momentum", "a_kg_m2": "inertia", "k_alpha_v_per_rad": "pickoff_gain",
    "k_u_a_per_v": "amplifier_gain", "k_m_rad_per_s_per_a": "torquer_scale", "t1_s": "integral_time",
    "t2_s": "lag_time",
}  # fmt: skip
"""Each parameter's field and its name in `LoopParameters`."""

RANGES: Final = {
    "h_n_m_s": (1e-8, 1e3), "a_kg_m2": (1e-11, 10.0), "k_alpha_v_per_rad": (1e-4, 1e5),
    "k_u_a_per_v": (1e-4, 1e5), "k_m_rad_per_s_per_a": (1e-4, 1e5), "t1_s": (1e-6, 1e4), "t2_s": (1e-8, 1e2),
}  # fmt: skip
"""What a gyro's loop can have; the integral time may be infinite, the lag zero."""
NUTATIONS: Final = (1.0, 1e6)
GAINS: Final = (1e-3, 1e6)
DURATIONS: Final = (1e-6, 1e4)
POINTS: Final = 1001
"""Of a step response that is given away; the charts have as many as they need."""

RATE_STEP: Final = 1.0
"""Of the case about x, rad/s: the paper's figures 4 and 5."""
SETTLED: Final = 0.02

_PER_DECADE: Final = 40
_GROWTHS: Final = 2.5
"""Time constants of growth that are shown of an unstable loop when nobody asks for a time."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether the loop is stable, else why not, and the limit that its cause names (`simdevice.stability`).

    ``undamped``: the slowest mode, whose frequency in rad/s is the limit, decays by less than can be computed.
    """

    code: Literal["stable", "integral-time", "nutation", "gain", "undamped"]
    limit: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Loop gain L and measured rate by case rate R at ω rad/s, both signs; arrays (n,), complex but `omega`."""

    omega: Array
    loop: NDArray[np.complex128]
    rate: NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class LoopAnswer:
    """What is to be known of a loop; SI.

    Attributes
    ----------
    margins, settling
        None of an unstable loop. The settling time is that to 2 % of a step.
    steps
        Of ωx = 1 rad/s, on `POINTS` times or up to where an unstable response is cut off.
    frequency
        Rising ω, without 0 and the nutation, where the loop gain is infinite.
    """

    parameters: LoopParameters
    duration: float
    verdict: Verdict
    poles: tuple[complex, ...]
    margins: BothSigns | None
    settling: float | None
    steps: StepResponse
    frequency: FrequencyResponse

    @property
    def stable(self) -> bool:
        """Whether everything decays."""
        return self.verdict.code == "stable"


def usual(work: Work, type_name: str | None) -> LoopParameters:
    """The paper's loop; of a type its scale factor to six digits, as far as its nominal values give one.

    Raises
    ------
    NotFound
        Unknown type.
    """
    if not type_name:
        return GVK_6
    for kind in gyros.types(work):
        if kind.name == type_name:
            known = [kind.nominals[name].value for name in ("kx", "ky") if name in kind.nominals]
            scale = abs(parameter_si("kx", sum(known) / len(known))) if known else 0.0
            return replace(GVK_6, torquer_scale=float(f"{scale:.6g}")) if scale else GVK_6
    raise NotFound(problem("unknown-type", "There is no type %(name)s.", column="type", name=type_name))


def changed(loop: LoopParameters, given: Mapping[str, float]) -> LoopParameters:
    """The loop with some of its parameters, by field, in place of its own.

    Raises
    ------
    Invalid
        With every value that no gyro's loop has, each at its field.
    """
    wrong = problems_of(given)
    if not wrong:
        made = replace(loop, **{MEMBERS[name]: value for name, value in given.items()})
        wrong = _beyond_together(made)
    if wrong:
        raise Invalid(*wrong)
    return made


def problems_of(given: Mapping[str, float], duration: float | None = None) -> list[Problem]:
    """What is wrong with single parameters, and with the length of the step response in ``duration_s``."""
    wrong = [item for name, value in given.items() if (item := _problem(name, value))]
    low, high = DURATIONS
    if duration is not None and not low <= duration <= high:
        wrong.append(problem("loop-range", "Give a value from %(low)g to %(high)g.", column="duration_s",
                             low=low, high=high))  # fmt: skip
    return wrong


def _problem(name: str, value: float) -> Problem | None:
    low, high = RANGES[name]
    if low <= value <= high or (name == "t1_s" and value == math.inf) or (name == "t2_s" and value == 0.0):
        return None
    if name == "t2_s":
        return problem("loop-range", "Give a value from %(low)g to %(high)g, or 0 for a loop without lags.",
                       column=name, low=low, high=high)  # fmt: skip
    if name == "t1_s":
        return problem("loop-range", "Give a value from %(low)g to %(high)g, or ∞ for a loop without integrator.",
                       column=name, low=low, high=high)  # fmt: skip
    return problem("loop-range", "Give a value from %(low)g to %(high)g.", column=name, low=low, high=high)


def _beyond_together(loop: LoopParameters) -> list[Problem]:
    wrong = []
    if not NUTATIONS[0] <= loop.nutation <= NUTATIONS[1]:
        wrong.append(problem("loop-nutation", "The nutation H/A would be %(value).3g rad/s. H and A must make one "
                             "from %(low)g to %(high)g.", column="a_kg_m2", value=loop.nutation, low=NUTATIONS[0],
                             high=NUTATIONS[1]))  # fmt: skip
    if not GAINS[0] <= loop.gain <= GAINS[1]:
        wrong.append(problem("loop-gain", "The gain Kα·Ku·Km would be %(value).3g 1/s. The three must make one from "
                             "%(low)g to %(high)g.", column="k_alpha_v_per_rad", value=loop.gain, low=GAINS[0],
                             high=GAINS[1]))  # fmt: skip
    return wrong


@lru_cache(maxsize=32)
def answer(loop: LoopParameters, duration: float | None = None) -> LoopAnswer:
    """Everything about a loop; without a duration the step response is as long as it needs.

    Raises
    ------
    Invalid
        With a duration that makes no sense.
    """
    if wrong := problems_of({}, duration):
        raise Invalid(*wrong)
    dynamics = LoopDynamics(loop)
    settling = settling_time(dynamics, SETTLED) if dynamics.stable else None
    shown = duration or _rounded_up(2.0 * settling if settling else _GROWTHS / _growth(dynamics))
    return LoopAnswer(
        parameters=loop,
        duration=shown,
        verdict=_verdict(dynamics),
        poles=tuple(complex(pole) for pole in dynamics.poles),
        margins=margins(dynamics),
        settling=settling,
        steps=_steps(dynamics, shown, POINTS),
        frequency=_frequency(dynamics),
    )


def drawn_steps(found: LoopAnswer, bins: int = 400) -> StepResponse:
    """The step response for a chart: the extremes of each of so many stretches, so that no swing is lost."""
    dynamics = LoopDynamics(found.parameters)
    fastest = float(np.abs(dynamics.poles.imag).max()) / (2.0 * np.pi)
    wanted = 16.0 * fastest * found.duration  # sixteen points of each period
    fine = _steps(dynamics, found.duration, int(np.clip(wanted, 2 * bins, 200_000)))
    n = len(fine.t)
    if n <= 4 * bins:
        return fine
    edges = np.linspace(0, n, bins + 1).astype(np.int64)
    kept = {0, n - 1}
    for values in (fine.alpha, fine.beta, fine.rate_x, fine.rate_y):
        for begin, end in pairwise(edges.tolist()):
            kept |= {begin + int(values[begin:end].argmin()), begin + int(values[begin:end].argmax())}
    at = np.array(sorted(kept))
    return replace(
        fine, t=fine.t[at], alpha=fine.alpha[at], beta=fine.beta[at], rate_x=fine.rate_x[at], rate_y=fine.rate_y[at]
    )  # fmt: skip


def _steps(dynamics: LoopDynamics, duration: float, points: int) -> StepResponse:
    return step_response(dynamics, duration, duration / (points - 1), rate=(RATE_STEP, 0.0))


def _verdict(dynamics: LoopDynamics) -> Verdict:
    """From the poles; the conditions only give the reason."""
    if dynamics.stable:
        return Verdict("stable")
    cause = cause_of_instability(dynamics.parameters)
    return Verdict(cause.reason, cause.limit) if cause else Verdict("undamped", float(dynamics.poles[0].imag))


def _growth(dynamics: LoopDynamics) -> float:
    """Of the fastest growth, 1/s; of an oscillation that hardly grows, a hundredth of its frequency."""
    worst = dynamics.poles[0]
    return max(float(worst.real), 0.01 * float(np.abs(dynamics.poles).min()))


def _rounded_up(value: float) -> float:
    """To the next 1, 2 or 5 of its decade."""
    decade = 10.0 ** math.floor(math.log10(value))
    step = next(step for step in (1, 2, 5, 10) if step * decade >= value * (1 - 1e-12))
    return float(np.clip(float(f"{step * decade:.1g}"), *DURATIONS))


def _frequency(dynamics: LoopDynamics) -> FrequencyResponse:
    loop, sizes = dynamics.parameters, np.abs(dynamics.poles)
    first, last = math.floor(math.log10(sizes.min() / 3)), math.ceil(math.log10(sizes.max() * 3))
    grid = np.logspace(first, last, (last - first) * _PER_DECADE + 1)
    # The loop gain has a pole at the nutation and so does its margin lie near: closer and closer to it.
    near = loop.nutation * (1 + np.outer([-1, 1], np.geomspace(1e-4, 0.2, 18)).ravel())
    found = margins(dynamics)
    marked = [] if found is None else [
        at for side in (found.positive, found.negative)
        for at in (side.gain and side.gain.omega, side.phase and side.phase.omega, side.bandwidth) if at
    ]  # fmt: skip
    one_sided = np.unique(np.abs(np.concatenate((grid, near, marked))))
    one_sided = one_sided[np.abs(one_sided / loop.nutation - 1) > 1e-6]
    omega = np.concatenate((-one_sided[::-1], one_sided))
    return FrequencyResponse(omega, loop_gain(loop, omega), rate_response(loop, omega))
