"""Our own worked calibrations: currents by another route, in arithmetic of fifty digits.

Their truth is known. The stored currents were made by turning vectors with Rodrigues' formula and
solving each position's two equations, all to fifty digits, and rounded to seventeen; the simulator,
which turns with scipy's `Rotation`, must agree with them, and both methods must give the truth back.
The noisy case has no truth to give back: what both methods answer, and how they differ, was computed
from the rounded currents in the same arithmetic.
"""

import hashlib
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.i18n import marked
from app.validation.numbers import load
from app.validation.report import Case, Check, Group, Progress, attempt, by_digits, holds
from simdevice.bench import Bench, steady_currents
from simdevice.certificate import Position, certify
from simdevice.gyro import Gyro
from simdevice.stand import Stand
from solver.calibrate import calibrate
from solver.errors import Message
from solver.records import PARAMETERS, Array, Estimate, Observations
from solver.units import (
    ampere_from_ma,
    deg_per_h_from_rad_per_s,
    deg_per_h_per_ma_from_scale,
    rad_from_arcsec,
    rad_from_deg,
    rad_per_s_from_deg_per_h,
    scale_from_deg_per_h_per_ma,
)

_DIGITS: Final = 9.0
_SIMULATOR_DIGITS: Final = 12.0
_SOURCE: Final = marked(
    "Driftbook’s own: currents of a known gyro in arithmetic of fifty digits, orientations by Rodrigues’ formula"
)
_SQUARES, _PAPER = marked("least squares"), marked("paper’s iteration")
_FUNCTION: Final = "solver.calibrate.calibrate"
_NAMES: Final = {
    "moscow": marked("Sixteen positions, Moscow (55.76° N)"),
    "petersburg": marked("Eight positions, St Petersburg (59.94° N), ky negative"),
    "sydney": marked("Sixteen positions, Sydney (33.87° S), angles of 900″"),
    "noisy": marked("Sixteen positions with noise: both methods and their difference"),
}
_UNITS: Final = ("°/h/mA",) * 4 + ("°/h",) * 2 + ("°/h/g",) * 2


def group(progress: Progress) -> Group:
    """Solve every case."""
    cases: list[Case] = []
    for case in load("worked")["cases"]:
        progress(len(cases) / (len(_NAMES) + 1), _NAMES[case["key"]])
        compute = _answers if "least_squares" in case else _truth
        cases.append(
            attempt(
                _NAMES[case["key"]],
                _SOURCE,
                _FUNCTION,
                partial(compute, case),
            )
        )
    noisy = load("worked")["cases"][-1]
    cases.append(
        attempt(marked("The same bits again"), _SOURCE, _FUNCTION, lambda: _same_bits(noisy),
                marked("Two runs, and the rows in another order, give a result of the same bits."))
    )  # fmt: skip
    return Group("worked", marked("Worked calibrations"), tuple(cases))


def observations_of(case: Mapping[str, Any], order: NDArray[np.int64] | None = None) -> Observations:
    """A stored case as the solver takes it; `order` shuffles its rows."""
    rows = np.array(case["rows"], dtype=np.float64)
    theta, psi, alpha, beta, gamma, jx, jy = (rows if order is None else rows[order]).T
    return Observations.sorted_from(
        theta=rad_from_deg(theta), psi=rad_from_deg(psi),
        alpha=rad_from_arcsec(alpha), beta=rad_from_arcsec(beta), gamma=rad_from_arcsec(gamma),
        jx=ampere_from_ma(jx), jy=ampere_from_ma(jy), latitude=rad_from_deg(float(case["latitude_deg"])),
    )  # fmt: skip


def _truth(case: Mapping[str, Any]) -> Iterator[Check]:
    found = calibrate(observations_of(case), "both")
    truth = [case["truth"][name] for name in PARAMETERS]
    for method, estimate in ((_SQUARES, found.least_squares), (_PAPER, found.paper)):
        yield from _parameters(method, truth, _lab(_answer(estimate).values), _DIGITS)
    yield from _simulated(case)


def _simulated(case: Mapping[str, Any]) -> Iterator[Check]:
    """Check that the simulator gives the same currents by its own route; one check for each channel's worst."""
    rows = np.array(case["rows"], dtype=np.float64)
    places = [Position(*rad_from_deg(row[:2])) for row in rows]
    certificate = certify(rad_from_deg(rows[:, 0]), rad_from_deg(rows[:, 1]), rad_from_arcsec(rows[:, 2:5]))
    bench = Bench(_gyro(case["truth"]), Stand(rad_from_deg(float(case["latitude_deg"])), certificate))
    for name, stored, simulated in zip("xy", rows[:, 5:].T, steady_currents(bench, places), strict=True):
        worst = int(np.argmax(np.abs(simulated / ampere_from_ma(stored) - 1.0)))
        yield by_digits(
            f"J{name}",
            float(stored[worst]),
            float(simulated[worst]) * 1e3,
            _SIMULATOR_DIGITS,
            "mA",
            "simdevice",
        )


def _answers(case: Mapping[str, Any]) -> Iterator[Check]:
    found = calibrate(observations_of(case), "both")
    squares, paper = _answer(found.least_squares), _answer(found.paper)
    yield from _parameters(_SQUARES, case["least_squares"], _lab(squares.values), _DIGITS)
    yield from _parameters(
        marked("u, least squares"),
        case["standard_uncertainties"],
        _lab(squares.standard_uncertainties),
        _DIGITS,
    )
    yield from _parameters(_PAPER, case["paper"], _lab(paper.values), _DIGITS)
    differences = np.array(case["paper"]) - np.array(case["least_squares"])
    # A difference of two numbers that agree to about three digits has three digits fewer than they.
    yield from _parameters(
        marked("iteration − least squares"), differences, _lab(paper.values - squares.values), _DIGITS - 3
    )


def _same_bits(case: Mapping[str, Any]) -> Iterator[Check]:
    order = np.random.default_rng(1).permutation(len(case["rows"]))
    first = observations_of(case)
    for name, second in (
        (marked("again"), first),
        (marked("rows in another order"), observations_of(case, order)),
    ):
        yield holds("SHA-256", _digest(first), _digest(second), name)
        yield holds("input_hash", first.input_hash(), second.input_hash(), name)


def _digest(observations: Observations) -> str:
    found = calibrate(observations, "both")
    whole = hashlib.sha256()
    for estimate in (found.least_squares, found.paper):
        answer = _answer(estimate)
        for part in (answer.values, answer.covariance, answer.residuals):
            whole.update(part.tobytes())
    return whole.hexdigest()


def _answer(estimate: object) -> Estimate:
    if isinstance(estimate, Estimate):
        return estimate
    message = getattr(estimate, "message", None)
    raise ValueError(message.text if isinstance(message, Message) else "no estimate")


def _parameters(kind: str, expected: Any, obtained: Array, required: float) -> Iterator[Check]:
    for name, unit, truth, value in zip(PARAMETERS, _UNITS, expected, obtained, strict=True):
        yield by_digits(name, float(truth), float(value), required, unit, kind)


def _lab(values: Array) -> Array:
    return np.concatenate((deg_per_h_per_ma_from_scale(values[:4]), deg_per_h_from_rad_per_s(values[4:])))


def _gyro(truth: Mapping[str, float]) -> Gyro:
    scales = {name: scale_from_deg_per_h_per_ma(truth[name]) for name in PARAMETERS[:4]}
    return Gyro(**scales, **{name: rad_per_s_from_deg_per_h(truth[name]) for name in PARAMETERS[4:]})
