"""What a simulated session was made of, for its files: every part that is on, in the laboratory's units."""

from typing import Any

from simdevice.ammeter import Ammeter
from simdevice.bench import Bench
from simdevice.dynamics import LoopParameters
from simdevice.interference import aliased
from simdevice.noise import RateNoise
from simdevice.thermal import ZERO_CELSIUS, Temperature, WarmUp
from solver.units import (
    SECONDS_PER_HOUR,
    deg_from_rad,
    deg_per_h_from_rad_per_s,
    ma_from_ampere,
)

_ROOT_HOUR = SECONDS_PER_HOUR**0.5
_DECIMALS = 9


def simulation_facts(bench: Bench, scenario: str) -> dict[str, Any]:
    """Scenario, seed and all parts of the signal that are on; faults with the places they strike."""
    interference, timetable = bench.interference, bench.timetable
    parts: dict[str, Any] = {
        "noise": _noise(bench.noise),
        "warm_up": None if bench.warm_up.quiet else _warm_up(bench.warm_up),
        "temperature": None if bench.temperature is None else _temperature(bench.temperature),
        "mains": interference.mains
        and {"amplitude_ma": _short(ma_from_ampere(interference.mains)), "hz": interference.mains_frequency},
        "ripple": interference.ripple and _ripple(bench),
        "jitter_s": interference.jitter,
        "ammeter": _ammeter(bench.ammeter),
        "loop": None if bench.loop is None else _loop(bench.loop),
        "faults": [
            _fault(str(fault.kind), fault.theta, fault.psi, fault.every) for fault in bench.located_faults
        ],
    }
    on = {name: value for name, value in parts.items() if value}
    if {"warm_up", "temperature", "loop"} & set(on) or bench.noise.wanders:
        on["timetable"] = {
            "first_s": timetable.first, "move_s": timetable.move, "settle_s": timetable.settle,
        }  # fmt: skip
    return {
        "scenario": scenario,
        "seed": bench.seed,
        "duration_s": bench.duration,
        "rate_hz": bench.rate,
    } | on


def _noise(noise: RateNoise) -> dict[str, float]:
    coefficients = {
        "angle_random_walk_deg_per_root_h": deg_per_h_from_rad_per_s(noise.angle_random_walk) / _ROOT_HOUR,
        "bias_instability_deg_per_h": deg_per_h_from_rad_per_s(noise.bias_instability),
        "rate_random_walk_deg_per_h_per_root_h": deg_per_h_from_rad_per_s(noise.rate_random_walk)
        * _ROOT_HOUR,
        "turn_on_deg_per_h": deg_per_h_from_rad_per_s(noise.turn_on),
    }
    return {name: _short(value) for name, value in coefficients.items() if value}


def _warm_up(warm_up: WarmUp) -> dict[str, float]:
    return {
        "x_deg_per_h": _short(deg_per_h_from_rad_per_s(warm_up.x.amplitude)),
        "x_time_constant_s": warm_up.x.time_constant,
        "y_deg_per_h": _short(deg_per_h_from_rad_per_s(warm_up.y.amplitude)),
        "y_time_constant_s": warm_up.y.time_constant,
    }


def _temperature(temperature: Temperature) -> dict[str, float]:
    return {
        "at_power_up_c": _short(temperature.at_power_up - ZERO_CELSIUS),
        "drift_k_per_h": _short(temperature.drift * SECONDS_PER_HOUR),
        "swing_k": temperature.swing,
        "period_s": temperature.period,
        "reference_c": _short(temperature.reference - ZERO_CELSIUS),
    }


def _ripple(bench: Bench) -> dict[str, float]:
    hz = bench.interference.ripple_frequency
    return {
        "amplitude_ma": _short(ma_from_ampere(bench.interference.ripple)),
        "hz": _short(hz),
        "seen_at_hz": _short(aliased(hz, bench.rate)),
    }


def _ammeter(ammeter: Ammeter) -> dict[str, float]:
    """Errors of gain and zero, where there are any."""
    errors: dict[str, float] = {}
    for axis, channel in zip("xy", ammeter.channels, strict=True):
        errors[f"gain_error_{axis}_ppm"] = round((channel.gain - 1.0) * 1e6, _DECIMALS)
        errors[f"offset_{axis}_ma"] = _short(ma_from_ampere(channel.offset))
    return {name: value for name, value in errors.items() if value}


def _loop(loop: LoopParameters) -> dict[str, float]:
    return {
        "angular_momentum_nms": loop.angular_momentum,
        "inertia_kgm2": loop.inertia,
        "pickoff_v_per_rad": loop.pickoff_gain,
        "amplifier_a_per_v": loop.amplifier_gain,
        "torquer_rad_per_s_a": loop.torquer_scale,
        "t1_s": loop.integral_time,
        "t2_s": loop.lag_time,
    }


def _fault(kind: str, theta: float | None, psi: float | None, every: bool) -> dict[str, Any]:
    angles = [
        None if angle is None else round(float(deg_from_rad(angle)), _DECIMALS) for angle in (theta, psi)
    ]
    return {"kind": kind, "theta_deg": angles[0], "psi_deg": angles[1], "every_take": every}


def _short(value: float) -> float:
    """Without the last digits, which conversion to SI and back has left."""
    return float(f"{value:.12g}")
