"""The façade: observations in, each method's estimate out.

It checks the input once; everything below trusts it. The same observations give the same bits.
"""

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from solver import __version__
from solver.error_model import observation_equations
from solver.errors import InputError, Message, NotConverged, SolverError
from solver.estimation import least_squares_estimate, paper_estimate
from solver.records import Calibration, Estimate, Failure, Observations
from solver.units import deg_from_rad

LEAST_DURATION: Final = 60.0
"""Shortest measurement of a position by the method, s."""
LEAST_RATE: Final = 200.0
"""Slowest sampling by the method, Hz."""
RULE_TOLERANCE: Final = 1e-3
"""Relative tolerance on both."""
_MOST_NAMED: Final = 8


def calibrate(
    observations: Observations, method: Literal["least-squares", "paper", "both"] = "both"
) -> Calibration:
    """Find the eight parameters.

    Parameters
    ----------
    observations
        From `Observations.sorted_from`.
    method
        ``both`` gives the two estimates side by side.

    Returns
    -------
    Calibration
        With ``both``, a failure of the paper's method is a `Failure` in `Calibration.paper`.

    Raises
    ------
    InputError
        When there are no positions, rows are not sorted, or (``paper`` alone) a position is missing.
    NotConverged
        With ``paper`` alone, when the iteration does not end.
    """
    _check(observations, method)
    equations = observation_equations(observations)
    least_squares: Estimate | None = None
    paper: Estimate | Failure | None = None
    if method != "paper":
        least_squares = _complete(least_squares_estimate(equations), observations)
    if method != "least-squares":
        try:
            paper = _complete(paper_estimate(equations, observations), observations)
        except SolverError as error:
            if method == "paper":
                raise
            iterations = error.iterations if isinstance(error, NotConverged) else None
            paper = Failure("paper", error.message, iterations)
    return Calibration(observations.input_hash(), __version__, observations, least_squares, paper)


def _check(observations: Observations, method: str) -> None:
    if method not in ("least-squares", "paper", "both"):
        raise InputError(
            Message(
                "bad-method",
                "The method must be least-squares, paper or both, not %(method)s.",
                {"method": method},
            )
        )
    if len(observations) == 0:
        raise InputError(Message("no-positions", "There is no measured position."))
    order = np.lexsort((observations.repeat, observations.psi, observations.theta))
    if not np.array_equal(order, np.arange(len(observations))):
        raise InputError(
            Message(
                "not-sorted", "The positions must be sorted by θ, ψ and repeat: use Observations.sorted_from."
            )
        )
    if not np.any(observations.jx) and not np.any(observations.jy):
        raise InputError(
            Message("no-currents", "All currents are zero. Check that the ammeter was connected.")
        )


def _complete(estimate: Estimate, observations: Observations) -> Estimate:
    """Add the warnings that both methods share."""
    warnings = (*estimate.warnings, *_about_measurement(observations), *_about_fit(estimate, observations))
    return Estimate(
        **{name: getattr(estimate, name) for name in Estimate.__dataclass_fields__ if name != "warnings"},
        warnings=warnings,
    )


def _about_measurement(observations: Observations) -> list[Message]:
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


def _about_fit(estimate: Estimate, observations: Observations) -> list[Message]:
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
    if untold and estimate.uncertainty_basis == "none":
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
