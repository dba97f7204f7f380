"""A channel's noise in laboratory units: mA, s, and through a scale factor °/h."""

from typing import Any, Final

import numpy as np
from scipy import special

from solver.signals.channel_noise import ChannelNoise
from solver.signals.noise_coefficients import Coefficient
from solver.signals.stationarity import Tested
from solver.units import (
    SECONDS_PER_HOUR,
    arcsec_from_rad,
    deg_per_h_from_rad_per_s,
    ma_from_ampere,
    scale_from_deg_per_h_per_ma,
)

Document = dict[str, Any]

_ROOT_HOUR: Final = float(np.sqrt(SECONDS_PER_HOUR))
CURRENT_FIELDS: Final = {
    "angle_random_walk": "angle_random_walk_ma_sqrt_s",
    "bias_instability": "bias_instability_ma",
    "rate_random_walk": "rate_random_walk_ma_per_sqrt_s",
    "quantisation": "quantisation_ma_s",
}
RATE_FIELDS: Final = {
    "angle_random_walk": "angle_random_walk_deg_per_sqrt_h",
    "bias_instability": "bias_instability_deg_per_h",
    "rate_random_walk": "rate_random_walk_deg_per_h_per_sqrt_h",
    "quantisation": "quantisation_arcsec",
}


def noise_document(noise: ChannelNoise, scale_deg_per_h_per_ma: float | None) -> Document:
    """One channel's noise as plain values.

    Parameters
    ----------
    noise
        Of samples in A.
    scale_deg_per_h_per_ma
        The axis's scale factor, for the coefficients as rates; None where the gyro has no result.
    """
    mean = noise.mean
    return {
        "samples": noise.samples,
        "mean_ma": ma_from_ampere(mean.value),
        "u_ma": _known(mean.standard_uncertainty, mean.dof),
        "dof": mean.dof or None,
        "n_eff": mean.n_eff if mean.dof else None,
        "autocorrelation_time_s": noise.samples * noise.interval / mean.n_eff if mean.dof else None,
        "u_batches_ma": _known(noise.by_batches.standard_uncertainty, noise.by_batches.dof),
        "dof_batches": noise.by_batches.dof or None,
        "u_autocorrelation_ma": _known(noise.by_correlation.standard_uncertainty, noise.by_correlation.dof),
        "dof_autocorrelation": noise.by_correlation.dof or None,
        **_steadiness(noise),
        "resolution_ma": None if noise.resolution is None else ma_from_ampere(noise.resolution.step),
        "u_resolution_ma": None if noise.resolution is None else ma_from_ampere(noise.resolution.uncertainty),
        "allan": _allan(noise),
        "coefficients": _coefficients(noise, scale_deg_per_h_per_ma),
        "findings": list(noise.findings),
    }


def _known(u_ampere: float, dof: float) -> float | None:
    return ma_from_ampere(u_ampere) if dof else None


def _steadiness(noise: ChannelNoise) -> Document:
    tests = noise.stationarity
    if tests is None:
        return {"slope": None, "mean_step": None, "log_variance_ratio": None}
    return {
        "slope": _tested(tests.slope, "ma_per_s", 1.0),
        "mean_step": _tested(tests.mean_step, "ma", 1.0),
        "log_variance_ratio": _tested(tests.log_variance_ratio, "", None),
    }


def _tested(test: Tested, suffix: str, amperes: float | None) -> Document:
    """Fields ``value_ma_per_s``, ``u_ma_per_s``, ``expanded_ma_per_s`` (95 %), dof and p.

    A bare number has no suffix.
    """
    unit = 1.0 if amperes is None else ma_from_ampere(amperes)
    value, u = unit * test.value, unit * test.standard_uncertainty
    ending = f"_{suffix}" if suffix else ""
    return {
        f"value{ending}": value,
        f"u{ending}": u,
        f"expanded{ending}": u * float(special.stdtrit(test.dof, 0.975)) if test.dof else None,
        "dof": test.dof or None,
        "p_value": test.p_value,
    }


def _allan(noise: ChannelNoise) -> list[Document]:
    curve = noise.allan
    if curve is None:
        return []
    columns = (
        curve.tau, ma_from_ampere(curve.deviation), ma_from_ampere(curve.low), ma_from_ampere(curve.high),
        curve.edf, curve.exponent,
    )  # fmt: skip
    names = ("tau_s", "deviation_ma", "low_ma", "high_ma", "edf", "exponent")
    return [dict(zip(names, row, strict=True)) for row in zip(*(c.tolist() for c in columns), strict=True)]


def _coefficients(noise: ChannelNoise, scale_deg_per_h_per_ma: float | None) -> Document | None:
    found = noise.coefficients
    if found is None:
        return None
    document: Document = {}
    for name, field in CURRENT_FIELDS.items():
        coefficient: Coefficient = getattr(found, name)
        document[field] = _coefficient(coefficient.times(ma_from_ampere(1.0)))
        factor = _rate_factor(name, scale_deg_per_h_per_ma)
        document[RATE_FIELDS[name]] = None if factor is None else _coefficient(coefficient.times(factor))
    return document | {
        "highest_frequency_hz": found.highest_frequency,
        "p_value": found.p_value,
        "fits": found.fits,
    }


def _coefficient(found: Coefficient) -> Document:
    return {
        "value": found.value,
        "u": found.standard_uncertainty,
        "low": found.low,
        "high": found.high,
        "seen": found.seen,
    }


def _rate_factor(name: str, scale_deg_per_h_per_ma: float | None) -> float | None:
    """From A times a power of s to the laboratory's unit of the rate's coefficient."""
    if scale_deg_per_h_per_ma is None:
        return None
    rad_per_s = abs(scale_from_deg_per_h_per_ma(scale_deg_per_h_per_ma))
    if name == "quantisation":
        return arcsec_from_rad(rad_per_s)
    factor = deg_per_h_from_rad_per_s(rad_per_s)
    return {"angle_random_walk": factor / _ROOT_HOUR, "bias_instability": factor}.get(
        name, factor * _ROOT_HOUR
    )
