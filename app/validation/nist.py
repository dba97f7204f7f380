"""NIST StRD linear regression: how many digits the least-squares core keeps.

Each problem is solved as it is stated, by the three ways in which the product solves: `solve`
(singular values, for reported results), `estimate` (QR) and `solve_batch` (Cholesky with
refinement). Filip, a polynomial of degree ten, is solved in powers of x as they stand and once more
in powers of (x + 6)/3, brought back to powers of x in exact arithmetic.
"""

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from math import comb
from typing import Any, Final

import numpy as np

from app.i18n import marked
from app.validation.numbers import load
from app.validation.report import Case, Check, Group, Progress, attempt, by_digits
from solver.least_squares import LinearSolution, estimate, solve, solve_batch
from solver.records import Array

_FUNCTION: Final = "solver.least_squares.solve, estimate, solve_batch"
_CENTRE, _SCALE = Fraction(-6), Fraction(3)
_CENTRED_DIGITS: Final = 10.0
_FILIP_NOTE: Final = marked(
    "Powers of x as they stand, columns scaled: condition 5·10⁹. The rounding of the factorisation, which differs "
    "between processors, leaves seven digits and a bit: seven are required here, ten of the centred form below."
)
_CENTRED_NOTE: Final = marked(
    "The same polynomial in powers of (x + 6)/3, condition 1.6·10³, its coefficients and their covariance "
    "brought back to powers of x in exact arithmetic. NIST’s threshold for this problem is seven digits."
)
_EXACT_NOTE: Final = marked(
    "An exact polynomial: standard deviations and residual are zero, of which the digits are counted after the point."
)
_NOISY_NOTE: Final = marked(
    "The residuals dwarf the coefficients, so a rounding of y alone costs digits: of a coefficient’s standard "
    "deviation thirteen digits and more are right."
)
_NOTES: Final = {
    "Filip": _FILIP_NOTE, "Wampler1": _EXACT_NOTE, "Wampler2": _EXACT_NOTE,
    "Wampler4": _NOISY_NOTE, "Wampler5": _NOISY_NOTE,
}  # fmt: skip


def group(progress: Progress) -> Group:
    """Solve every problem."""
    stored = load("nist_strd")
    cases: list[Case] = []
    for number, problem in enumerate(stored["datasets"]):
        progress(number / len(stored["datasets"]), problem["name"])
        source = f"{stored['source']}: {problem['name']}. {problem['origin']}"
        cases.append(
            attempt(problem["name"], source, _FUNCTION, partial(_as_stated, problem),
                    _NOTES.get(problem["name"], ""))
        )  # fmt: skip
        if problem["name"] == "Filip":
            name = marked("Filip, centred")
            cases.append(attempt(name, source, _FUNCTION, partial(_centred, problem), _CENTRED_NOTE))
    return Group("nist-strd", marked("NIST StRD: linear regression"), tuple(cases))


def design_of(problem: Mapping[str, Any]) -> Array:
    """Design matrix of a problem: powers of x, a constant beside several x, or x alone."""
    x = np.array(problem["x"], dtype=np.float64)
    if problem["model"] == "polynomial":
        return np.asarray(x[:, None] ** np.arange(problem["degree"] + 1))
    if problem["model"] == "linear":
        return np.column_stack((np.ones(len(x)), x))
    return x[:, None]


def _as_stated(problem: Mapping[str, Any]) -> Iterator[Check]:
    design, y = design_of(problem), np.array(problem["y"], dtype=np.float64)
    required = float(problem["required_digits"])
    solution = solve(design, y)
    rest = y - design @ solution.values
    yield from _certified(problem, solution.values, solution.covariance, rest, required)
    by_qr = estimate(design, y)[0]
    in_batch = solve_batch(np.stack((design, design)), np.stack((y, y)))[0][1]
    for name, values in (("estimate", by_qr), ("solve_batch", in_batch)):
        for index, (value, certified) in enumerate(zip(values, problem["estimates"], strict=True)):
            yield by_digits(_coefficient(problem, index), certified, value, required, detail=name)


def _centred(problem: Mapping[str, Any]) -> Iterator[Check]:
    x = [Fraction(repr(value)) for value in problem["x"]]
    powers = np.array([float((value - _CENTRE) / _SCALE) for value in x])
    design, y = powers[:, None] ** np.arange(problem["degree"] + 1), np.array(problem["y"])
    solution = solve(design, y)
    values, covariance = _brought_back(solution)
    yield from _certified(problem, values, covariance, y - design @ solution.values, _CENTRED_DIGITS)


def _brought_back(solution: LinearSolution) -> tuple[Array, Array]:
    """Coefficients of powers of x, and their covariance, from those of powers of (x − centre)/scale."""
    count = len(solution.values)
    turn = [
        [comb(k, j) * (-_CENTRE) ** (k - j) / _SCALE**k if k >= j else Fraction(0) for k in range(count)]
        for j in range(count)
    ]
    values = [_sum(row, map(Fraction, solution.values.tolist())) for row in turn]
    covariance = [[Fraction(item) for item in row] for row in solution.covariance.tolist()]
    spread = [[_sum(row, column) for column in zip(*covariance, strict=True)] for row in turn]
    variances = [_sum(left, right) for left, right in zip(spread, turn, strict=True)]
    return np.array([float(item) for item in values]), np.diag([float(item) for item in variances])


def _sum(left: Sequence[Fraction], right: Any) -> Fraction:
    return sum((a * b for a, b in zip(left, right, strict=True)), Fraction(0))


def _certified(
    problem: Mapping[str, Any], values: Array, covariance: Array, rest: Array, required: float
) -> Iterator[Check]:
    """Check what NIST certifies."""
    y = np.array(problem["y"], dtype=np.float64)
    residual = float(rest @ rest)
    variance = residual / (len(y) - len(values))
    about = y if problem["model"] == "proportional" else y - y.mean()
    deviations = np.sqrt(variance * np.diagonal(covariance))
    for index, (value, certified) in enumerate(zip(values, problem["estimates"], strict=True)):
        yield by_digits(_coefficient(problem, index), certified, value, required)
    for index, (value, certified) in enumerate(zip(deviations, problem["standard_deviations"], strict=True)):
        yield by_digits(f"s({_coefficient(problem, index)})", certified, value, required)
    yield by_digits("s(y)", problem["residual_sd"], variance**0.5, required)
    yield by_digits("R²", problem["r_squared"], 1.0 - residual / float(about @ about), required)


def _coefficient(problem: Mapping[str, Any], index: int) -> str:
    return f"B{index + (problem['model'] == 'proportional')}"
