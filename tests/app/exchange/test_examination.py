"""Findings as JSON: positions in degrees, the details of their kind, members of their class."""

import numpy as np

from app.exchange.examination import diagnosis_json
from solver.blunders.diagnosis import Diagnosis, Finding
from solver.errors import Message


def test_a_finding_is_written_as_the_interface_has_it() -> None:
    quarter = np.pi / 2
    message = Message("position-wrong", "At %(place)s.", {"place": "θ 90° ψ 0°"})
    finding = Finding(
        code="position-wrong",
        message=message,
        positions=((quarter, 0.0), (quarter, 3 * quarter, 1)),
        chi2_before=9100.0,
        chi2_after=21.3,
        details={
            "actual": (quarter, 2 * quarter),
            "channel": "x",
            "factor": 60.0,
            "equivalents": ({"code": "outlier", "positions": ((0.0, quarter),)},),
        },
        advice=Message("separate", "Measure it again."),
    )
    told = diagnosis_json(Diagnosis((finding,), (Message("not-excluded", "Perhaps."),)))
    assert told["not_excluded"] == [{"code": "not-excluded", "message": "Perhaps."}]
    (found,) = told["diagnosis"]
    assert found == {
        "code": "position-wrong",
        "positions": [[90.0, 0.0], [90.0, 270.0, 1]],
        "actual": [90.0, 180.0],
        "channel": "x",
        "factor": 60.0,
        "equivalents": [{"code": "outlier", "positions": [[0.0, 90.0]]}],
        "chi2_before": 9100.0,
        "chi2_after": 21.3,
        "message": "At θ 90° ψ 0°.",
        "template": "At %(place)s.",
        "values": {"place": "θ 90° ψ 0°"},
        "advice": {"code": "separate", "message": "Measure it again."},
    }


def test_without_stated_noise_there_is_no_chi_square() -> None:
    finding = Finding("outlier", Message("outlier", "One."), ((0.0, 0.0),), None, None)
    (found,) = diagnosis_json(Diagnosis((finding,)))["diagnosis"]
    assert (found["chi2_before"], found["chi2_after"], found["advice"]) == (None, None, None)


def test_currents_and_drifts_come_in_laboratory_units() -> None:
    one_deg_per_h = np.pi / 180 / 3600
    details = {"channel": "y", "value": 2e-6, "limit": 5e-6, "drift": (one_deg_per_h, -2 * one_deg_per_h)}
    finding = Finding("channel-stuck", Message("x", "Stuck."), (), 1.0, 1.0, details)
    (found,) = diagnosis_json(Diagnosis((finding,)))["diagnosis"]
    assert (found["value_ma"], found["limit_ma"]) == (2e-3, 5e-3)
    assert (found["drift_x_deg_per_h"], found["drift_y_deg_per_h"]) == (1.0, -2.0)
    assert {"value", "limit", "drift"}.isdisjoint(found)
