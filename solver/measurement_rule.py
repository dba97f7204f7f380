"""What a reader must know of a measurement: the method's rule, its noise, its outliers, as warnings."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.errors import Message
from solver.records import Estimate, Observations
from solver.units import deg_from_rad

LEAST_DURATION: Final = 60.0
"""Shortest measurement of a position by the method, s."""
LEAST_RATE: Final = 200.0
"""Slowest sampling by the method, Hz."""
RULE_TOLERANCE: Final = 1e-3
"""Relative tolerance on both."""
_MOST_NAMED: Final = 8


def about_measurement(observations: Observations) -> list[Message]:
    """Say which positions are below the method (60 s at 200 Hz), or that nobody knows."""
    warnings = []
    duration, rate = observations.duration, observations.rate
    unknown = np.isnan(duration) | np.isnan(rate)
    if unknown.all():
        warnings.append(
            Message(
                "duration-unknown",
                "Duration or sampling rate is not given for any position, so the measurement rule (60 s at "
                "200 Hz) cannot be checked.",
            )
        )
    elif unknown.any():
        warnings.append(
            Message(
                "duration-unknown",
                "Duration or sampling rate is not given, so the measurement rule (60 s at 200 Hz) cannot be "
                "checked: %(positions)s.",
                {"positions": _named(unknown, observations)},
            )
        )
    least = 1.0 - RULE_TOLERANCE
    below = (duration < LEAST_DURATION * least) | (rate < LEAST_RATE * least)
    if below.all():
        warnings.append(
            Message(
                "below-method",
                "Every position was measured for less than 60 s or at less than 200 Hz: below the method.",
            )
        )
    elif below.any():
        warnings.append(
            Message(
                "below-method",
                "Measured for less than 60 s or at less than 200 Hz, below the method: %(positions)s.",
                {"positions": _named(below, observations)},
            )
        )
    return warnings


def about_fit(estimate: Estimate, observations: Observations) -> list[Message]:
    """Say where the noise is taken from when it is not stated, and which residuals are outliers."""
    warnings = []
    untold = observations.u_jx is None or observations.u_jy is None
    if untold and estimate.uncertainty_basis == "scatter":
        warnings.append(
            Message(
                "no-uncertainty",
                "No uncertainty of the currents is given: the parameters' uncertainty is taken from the "
                "scatter of the residuals, and the fit cannot be tested.",
            )
        )
    if untold and estimate.uncertainty_basis == "none" and estimate.fit.dof > 0:
        warnings.append(
            Message(
                "no-uncertainty",
                "No uncertainty of the currents is given, and the residuals do not tell it where the scale factors "
                "are not determined: the parameters have no uncertainty. Measure positions with other θ and ψ.",
            )
        )
    elif untold and estimate.uncertainty_basis == "none":
        warnings.append(
            Message(
                "no-uncertainty",
                "No uncertainty of the currents is given and no residual is left to take it from: the "
                "parameters have no uncertainty. Give u(J) or measure more positions.",
            )
        )
    if estimate.outliers.any():
        places = [
            f"{axis} ({_named(estimate.outliers[:, index], observations)})"
            for index, axis in enumerate("xy")
            if estimate.outliers[:, index].any()
        ]
        warnings.append(
            Message(
                "outlier",
                "Residuals too large for their noise (test at 1 %% over all residuals): %(places)s. Check "
                "these positions and measure them again.",
                {"places": "; ".join(places)},
            )
        )
    return warnings


def _named(marked: NDArray[np.bool_], observations: Observations) -> str:
    """Name the marked positions in no language: ``θ 0° ψ 90°, θ 90° ψ 0° ·2`` (its first repeat), ``… (+3)``."""
    places = []
    for row in np.flatnonzero(marked)[:_MOST_NAMED]:
        theta, psi = (deg_from_rad(float(angle[row])) for angle in (observations.theta, observations.psi))
        repeat = int(observations.repeat[row])
        places.append(f"θ {theta:.6g}° ψ {psi:.6g}°" + (f" ·{repeat + 1}" if repeat else ""))
    more = int(marked.sum()) - len(places)
    return ", ".join(places) + (f", … (+{more})" if more else "")
