"""What is known of a loop, as rows and as one document for programs; every number with its unit in its name."""

import math
from collections.abc import Iterator
from typing import Any, Final, Literal

import numpy as np

from app.exchange.json_values import finite, message_json
from app.services.loop import MEMBERS, RATE_STEP, SETTLED, LoopAnswer
from simdevice.frequency import Margins
from solver.errors import Message

Table = Literal["steps", "poles", "frequency"]
Row = dict[str, float | None]

COLUMNS: Final[dict[Table, tuple[str, ...]]] = {
    "steps": ("t_s", "alpha_rad", "beta_rad", "measured_x_rad_per_s", "measured_y_rad_per_s"),
    "poles": ("re_per_s", "im_rad_per_s", "damping_ratio", "time_constant_s"),
    "frequency": ("omega_rad_per_s", "loop_gain_db", "loop_phase_deg", "rate_gain_db", "rate_phase_deg"),
}


def rows(found: LoopAnswer, table: Table) -> list[Row]:
    """One table of the answer, in the columns of `COLUMNS`."""
    return [dict(zip(COLUMNS[table], values, strict=True)) for values in _ROWS[table](found)]


def _steps(found: LoopAnswer) -> Iterator[tuple[float, ...]]:
    steps = found.steps
    columns = (steps.t, steps.alpha, steps.beta, steps.rate_x, steps.rate_y)
    yield from zip(*(column.tolist() for column in columns), strict=True)


def _poles(found: LoopAnswer) -> Iterator[tuple[float | None, ...]]:
    for pole in found.poles:
        yield pole.real, pole.imag, -pole.real / abs(pole), -1.0 / pole.real if pole.real < 0 else None


def _frequency(found: LoopAnswer) -> Iterator[tuple[float, ...]]:
    response = found.frequency
    columns = [response.omega]
    for gain in (response.loop, response.rate):
        columns += [decibels(np.abs(gain)), np.degrees(np.angle(gain))]
    yield from zip(*(column.tolist() for column in columns), strict=True)


_ROWS: Final = {"steps": _steps, "poles": _poles, "frequency": _frequency}


def decibels(ratio: Any) -> Any:
    """A ratio of amplitudes in decibels."""
    return 20.0 * np.log10(ratio)


def verdict_message(found: LoopAnswer) -> Message:
    """Whether the loop is stable, and why not, in a sentence."""
    loop = found.parameters
    values = {"limit": found.verdict.limit, "gain": loop.gain, "nutation": loop.nutation}
    if found.verdict.code == "integral-time":
        return Message(
            "integral-time", "T1 is not longer than 2·T2 = %(limit).3g s: integrator and lags together turn the "
            "phase beyond −180° at low frequencies, so that no gain would do. Lengthen T1 or shorten T2.", values,
        )  # fmt: skip
    if found.verdict.code == "nutation":
        return Message(
            "nutation", "The nutation at H/A = %(nutation).4g rad/s grows: the double lag turns its phase too "
            "little, at any gain. With this T1 it needs a T2 above %(limit).3g s.", values,
        )  # fmt: skip
    if found.verdict.code == "gain":
        return Message(
            "gain", "The gain Kα·Ku·Km = %(gain).4g 1/s is too high: with these time constants the loop is stable "
            "below %(limit).4g 1/s.", values,
        )  # fmt: skip
    if found.verdict.code == "undamped":
        return Message(
            "undamped", "The oscillation at %(limit).4g rad/s decays by less than can be computed, so it counts "
            "as one that does not.", values,
        )  # fmt: skip
    return Message(
        "stable", "After a step of the case rate the measured rates are within %(percent)d %% of it in "
        "%(settling).3g s.", {"percent": round(100 * SETTLED), "settling": found.settling},
    )  # fmt: skip


def as_json(found: LoopAnswer) -> dict[str, Any]:
    """The whole answer; null stands for what there is not (an integrator, margins of an unstable loop)."""
    loop, steps = found.parameters, found.steps
    margins = found.margins
    return {
        "parameters": {name: finite(getattr(loop, member)) for name, member in MEMBERS.items()},
        "gain_per_s": loop.gain,
        "nutation_rad_per_s": loop.nutation,
        "stable": found.stable,
        "verdict": message_json(verdict_message(found)),
        "poles": rows(found, "poles"),
        "margins": None if margins is None else {
            "worse": margin_numbers(margins.worse), "positive": margin_numbers(margins.positive),
            "negative": margin_numbers(margins.negative),
        },
        "settling_time_s": found.settling,
        "settled_within": SETTLED,
        "step_response": {
            "rate_x_rad_per_s": RATE_STEP, "rate_y_rad_per_s": 0.0, "duration_s": found.duration,
            "cut_off_s": steps.cut_off, **_columns(found, "steps"),
        },
        "frequency_response": _columns(found, "frequency"),
    }  # fmt: skip


def _columns(found: LoopAnswer, table: Table) -> dict[str, list[float | None]]:
    columns = zip(*_ROWS[table](found), strict=True)
    return {name: list(values) for name, values in zip(COLUMNS[table], columns, strict=True)}


def margin_numbers(side: Margins) -> Row:
    """The margins of one sign of ω, or the worse ones."""
    factor, gain_at = (side.gain.value, side.gain.omega) if side.gain else (None, None)
    angle, phase_at = (math.degrees(side.phase.value), side.phase.omega) if side.phase else (None, None)
    bandwidth = side.bandwidth
    return {
        "gain_factor": factor,
        "gain_db": None if factor is None else float(decibels(factor)),
        "gain_at_rad_per_s": gain_at,
        "phase_deg": angle,
        "phase_at_rad_per_s": phase_at,
        "bandwidth_rad_per_s": bandwidth,
        "bandwidth_hz": None if bandwidth is None else bandwidth / (2.0 * math.pi),
    }
