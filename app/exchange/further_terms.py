"""What further terms of the error model the data support, as JSON in laboratory units."""

from typing import Final

import numpy as np

from app.exchange.json_values import Json, finite, message_json
from solver import units
from solver.estimators.model_comparison import ModelComparison, TermTest
from solver.propagation.uncertainty import coverage_factor

TERM_UNITS: Final = {
    "wn": "deg/h/g2",
    "drift_x": "deg/h",
    "drift_y": "deg/h",
    "wg_split": "deg/h/g",
    "wk_split": "deg/h/g",
}
"""Unit of each term; the drifts count over the whole session."""


def model_json(comparison: ModelComparison) -> Json:
    """Write every term's own test, the joint one, those that the data support, and the conclusion."""
    duration = None if comparison.time_assumed else finite(comparison.duration)
    return {
        "conclusion": message_json(comparison.verdict),
        "level": comparison.level,
        "supported": list(comparison.supported),
        "session_s": duration,
        "terms": [{**_test(test), **_values(test)[0]} for test in comparison.tests],
        "joint": {**_test(comparison.joint), "terms": _values(comparison.joint)},
        "chosen": None if comparison.chosen is None else _values(comparison.chosen),
    }


def _test(test: TermTest) -> Json:
    return {
        "f": finite(test.f),
        "dof": test.dof,
        "p_value": finite(test.p_value),
        "p_holm": finite(test.p_holm),
        "delta_chi2": finite(test.delta_chi2),
        "p_chi2": finite(test.p_chi2),
        "reason": None if test.reason is None else message_json(test.reason),
    }


def _values(test: TermTest) -> list[Json]:
    freedom = np.inf if test.delta_chi2 is not None else float(max(test.dof, 1))
    k = float(coverage_factor(freedom))
    told = zip(test.terms, test.values, test.standard_uncertainties, strict=True)
    return [
        {
            "term": term,
            "value": finite(units.deg_per_h_from_rad_per_s(float(value))),
            "standard_uncertainty": finite(units.deg_per_h_from_rad_per_s(float(u))),
            "expanded_uncertainty": finite(k * units.deg_per_h_from_rad_per_s(float(u))),
            "unit": TERM_UNITS[term],
        }
        for term, value, u in told
    ]
