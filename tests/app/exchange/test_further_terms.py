"""Tests of further terms as JSON: laboratory units, U, what cannot be tested."""

import numpy as np
import pytest

from app.exchange.further_terms import TERM_UNITS, model_json
from solver.errors import Message
from solver.estimators.model_comparison import ModelComparison, TermTest
from solver.estimators.terms import TERMS

PER_H = np.pi / 180 / 3600
"""One °/h in rad/s, from the definition."""


def made(term, value, u, **more):
    told = {
        "f": 4.0,
        "p_value": 0.06,
        "p_holm": 0.3,
        "delta_chi2": 4.0,
        "p_chi2": 0.05,
        "dof": 23,
        "reason": None,
    }
    return TermTest((term,), np.array([value * PER_H]), np.array([u * PER_H]), **(told | more))


def comparison(*tests):
    nothing = Message("no-further-term", "The data support no further term.")
    joint = TermTest((), np.array([]), np.array([]), 1.0, 0.5, None, None, None, 20, None)
    return ModelComparison(0.01, tests, joint, (), None, True, float("nan"), nothing)


def test_every_term_has_a_unit():
    assert set(TERM_UNITS) == set(TERMS)


def test_a_term_is_written_in_laboratory_units_with_its_expanded_uncertainty():
    told = model_json(comparison(made("wg_split", 0.5, 0.25)))
    (term,) = told["terms"]
    assert term["value"] == pytest.approx(0.5, rel=1e-14)
    # k of the normal distribution for 95 %, from tables: 1.959964
    assert term["expanded_uncertainty"] == pytest.approx(0.25 * 1.959964, rel=1e-6)
    assert (term["term"], term["unit"], term["f"], term["p_holm"]) == ("wg_split", "deg/h/g", 4.0, 0.3)
    assert (told["supported"], told["session_s"], told["chosen"]) == ([], None, None)


def test_without_stated_noise_student_gives_the_factor():
    told = model_json(comparison(made("wn", 0.5, 0.25, delta_chi2=None, p_chi2=None, dof=10)))
    # k of Student's t with 10 degrees of freedom for 95 %, from tables: 2.228
    assert told["terms"][0]["expanded_uncertainty"] == pytest.approx(0.25 * 2.228, rel=2e-4)


def test_what_cannot_be_tested_says_why():
    why = Message("term-unobservable", "Not shown.")
    told = model_json(comparison(made("wn", np.nan, np.nan, f=None, p_value=None, p_holm=None, reason=why)))
    assert told["terms"][0]["reason"] == {"code": "term-unobservable", "message": "Not shown."}
    assert told["terms"][0]["value"] is None
