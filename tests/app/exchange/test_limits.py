"""A budget as JSON: shares stay as they are, uncertainties come out in laboratory units."""

import numpy as np
import pytest

from app.exchange.limits import SOURCE_NAMES, budget_json, expanded_json
from solver.inputs import SOURCES
from solver.propagation.budget import CORRELATION, SCATTER, Budget
from solver.records import PARAMETERS

# One °/h/mA and one °/h in SI, from the definitions: π/180/3600 rad/s, mA = 1e-3 A.
PER_LAB = np.array([np.pi / 180 / 3600 * 1000] * 4 + [np.pi / 180 / 3600] * 4)
ROUNDING = 1e-14


@pytest.fixture
def budget() -> Budget:
    standard = np.array([np.full(8, 3.0), np.full(8, 4.0)]) * PER_LAB
    variance = np.sum(standard**2, axis=0)
    dof = np.full(8, 10.0)
    dof[3] = np.inf
    return Budget(
        basis="given",
        level=0.95,
        lines=("currents", "angles"),
        standard=standard,
        shares=standard**2 / variance,
        covariance=np.diag(variance),
        dof=dof,
        coverage_factors=np.full(8, 2.5),
        expanded=2.5 * np.sqrt(variance),
        dominating=("angles",) * 7 + (None,),
    )


def test_every_line_has_words() -> None:
    assert set(SOURCE_NAMES) == {SCATTER, *SOURCES, CORRELATION}


def test_lines_carry_shares_and_laboratory_units(budget: Budget) -> None:
    noise, angles = budget_json(budget)
    assert (noise["code"], noise["source"]) == ("currents", "noise of the mean currents")
    for name in PARAMETERS:
        assert noise["standard_uncertainties"][name] == pytest.approx(3.0, rel=ROUNDING)
        assert angles["standard_uncertainties"][name] == pytest.approx(4.0, rel=ROUNDING)
        assert noise["shares"][name] == pytest.approx(9 / 25, rel=ROUNDING)


def test_expanded_uncertainty_has_its_factor_and_degrees_of_freedom(budget: Budget) -> None:
    told = expanded_json(budget)
    assert told["kx"] == {
        "dof": 10.0,
        "coverage_factor": 2.5,
        "expanded_uncertainty": pytest.approx(12.5, rel=ROUNDING),
        "dominated_by": "angles",
    }
    assert told["kyx"]["dof"] is None  # infinite
    assert told["wk"]["dominated_by"] is None


def test_no_budget_says_nothing() -> None:
    assert budget_json(None) == []
    assert set(expanded_json(None)["kx"].values()) == {None}
