"""NIST's problems: data and certified values belong together, and the pack sees a solver that is off."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from app.validation import nist
from app.validation.numbers import load
from solver import least_squares

PROBLEMS = {problem["name"]: problem for problem in load("nist_strd")["datasets"]}


def exactly(problem):
    """Coefficients, standard deviations, s and R² by the normal equations in rational arithmetic."""
    x = [[Fraction(repr(item)) for item in (row if isinstance(row, list) else [row])] for row in problem["x"]]
    if problem["model"] == "polynomial":
        design = [[row[0] ** power for power in range(problem["degree"] + 1)] for row in x]
    else:
        design = [([Fraction(1)] if problem["model"] == "linear" else []) + row for row in x]
    y = [Fraction(repr(item)) for item in problem["y"]]
    count = len(design[0])
    normal = [
        [sum(row[i] * row[j] for row in design) for j in range(count)]
        + [Fraction(i == j) for j in range(count)]
        for i in range(count)
    ]
    for i in range(count):
        pivot = normal[i][i]
        normal[i] = [item / pivot for item in normal[i]]
        for j in range(count):
            if j != i:
                factor = normal[j][i]
                normal[j] = [a - factor * b for a, b in zip(normal[j], normal[i], strict=True)]
    inverse = [row[count:] for row in normal]
    moments = [sum(row[i] * value for row, value in zip(design, y, strict=True)) for i in range(count)]
    q = [sum(a * b for a, b in zip(row, moments, strict=True)) for row in inverse]
    rest = sum(
        (v - sum(a * b for a, b in zip(row, q, strict=True))) ** 2 for row, v in zip(design, y, strict=True)
    )
    mean = Fraction(0) if problem["model"] == "proportional" else sum(y) / len(y)
    variance = rest / (len(y) - count)
    deviations = [float(root(variance * inverse[i][i])) for i in range(count)]
    r_squared = 1 - rest / sum((v - mean) ** 2 for v in y)
    return [float(item) for item in q], deviations, float(root(variance)), float(r_squared)


def root(value):
    return (Decimal(value.numerator) / Decimal(value.denominator)).sqrt()


@pytest.mark.parametrize("name", PROBLEMS)
def test_data_and_certified_values_belong_together(name):
    # NIST prints fifteen digits, rounded: half a unit of the fifteenth, and the double's own rounding.
    problem = PROBLEMS[name]
    q, deviations, s, r_squared = exactly(problem)
    assert q == pytest.approx(problem["estimates"], rel=1e-14, abs=0)
    assert deviations == pytest.approx(problem["standard_deviations"], rel=1e-14, abs=0)
    assert s == pytest.approx(problem["residual_sd"], rel=1e-14, abs=0)
    assert r_squared == pytest.approx(problem["r_squared"], rel=1e-14)


def test_every_problem_of_the_collection_is_there():
    assert list(PROBLEMS) == [
        "Norris", "Pontius", "NoInt1", "NoInt2", "Filip", "Longley",
        "Wampler1", "Wampler2", "Wampler3", "Wampler4", "Wampler5",
    ]  # fmt: skip
    assert len(PROBLEMS["Filip"]["y"]) == 82


def test_the_solver_keeps_the_digits_that_are_asked_of_it():
    cases = {case.name: case for case in nist.group(lambda fraction, what: None).cases}
    assert all(case.passed for case in cases.values())
    assert cases["Norris"].digits >= 10
    assert cases["Longley"].digits >= 9
    assert cases["Filip"].digits >= 7
    assert cases["Filip, centred"].digits >= 10


def test_a_solver_that_is_off_by_one_in_ten_to_the_ninth_fails(monkeypatch):
    right = least_squares.solve

    def off(design, y):
        found = right(design, y)
        return replace(found, values=found.values * (1 + 1e-9))

    monkeypatch.setattr(nist, "solve", off)
    cases = {case.name: case for case in nist.group(lambda fraction, what: None).cases}
    assert not cases["Norris"].passed
    assert cases["Norris"].digits == pytest.approx(9, abs=0.01)
    assert cases["Wampler5"].passed  # it asks for four digits


def test_a_solver_that_refuses_fails_with_its_reason(monkeypatch):
    def refusing(design, y):
        raise np.linalg.LinAlgError("a design has not full column rank")

    monkeypatch.setattr(nist, "solve", refusing)
    found = nist.group(lambda fraction, what: None)
    assert not found.passed
    assert found.cases[0].error == "LinAlgError: a design has not full column rank"
