"""The JSON of a calibration, from records built by hand."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from app.exchange.json_values import dumps, message_from, message_json
from app.exchange.result import calibration_json
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.si import observations
from solver.calibrate import Calibration, calibrate
from solver.errors import Message
from solver.records import PARAMETERS, Estimate, Failure, Fit, Method, Observations

DEG = math.pi / 180
SCALE = DEG / 3600 * 1000  # 1 °/h/mA in rad/(s·A), from the definitions
RATE = DEG / 3600  # 1 °/h in rad/s
SIZES = np.array([SCALE] * 4 + [RATE] * 4)
ONE_ROUNDING = 1e-15  # relative: conversions multiply by constants rounded once

LAB = np.array([2062.65, 2041.0, 10.3, -8.25, 1.5, -0.8, 6.0, 2.0])
POSITIONS = [(0.0, 0.0, 0), (90.0, 270.0, 0), (90.0, 270.0, 1), (33.333333333, 12.5, 0)]


def _observations() -> Observations:
    means = [MeansRow(theta, psi, 0.001, 0.002, repeat=repeat) for theta, psi, repeat in POSITIONS]
    certificate = [
        CertificateRow(theta, psi, 1.0, 2.0, 3.0) for theta, psi, repeat in POSITIONS if not repeat
    ]
    return observations(means, certificate, 55.0)


def _estimate(method: Method = "least-squares") -> Estimate:
    n = len(POSITIONS)
    covariance = np.diag((0.5 * SIZES) ** 2)
    covariance[0, 6] = covariance[6, 0] = 0.1 * SIZES[0] * SIZES[6]
    residuals = np.arange(2.0 * n).reshape(n, 2) * RATE
    return Estimate(
        method=method,
        values=LAB * SIZES,
        covariance=covariance,
        uncertainty_basis="given",
        residuals=residuals,
        standardised=np.arange(2.0 * n).reshape(n, 2) / 10,
        outliers=np.zeros((n, 2), dtype=np.bool_),
        fit=Fit(21.0, 24, 0.6, 8, 12.5, np.ones(8), np.eye(8)),
        iterations=np.array([LAB * SIZES, LAB * SIZES]) if method == "paper" else None,
        warnings=(Message("duration-unknown", "Unknown for %(n)d positions.", {"n": 4}),),
    )


def _calibration(
    least_squares: Estimate | None = None, paper: Estimate | Failure | None = None
) -> Calibration:
    return Calibration(
        input_hash="sha256:00",
        solver_version="1.0.0",
        observations=_observations(),
        common=None,
        answers={"least-squares": least_squares or _estimate(), "paper": paper or _estimate("paper")},
    )


def test_one_method_has_the_keys_of_the_interface_in_lab_units() -> None:
    result = json.loads(dumps(calibration_json(_calibration(), "least-squares")))

    assert result["method"] == "least-squares"
    assert result["solver_version"] == "1.0.0"
    assert result["input_hash"] == "sha256:00"
    assert list(result["parameters"]) == list(PARAMETERS)
    for name, lab, size in zip(PARAMETERS, LAB, SIZES, strict=True):
        entry = result["parameters"][name]
        assert entry["value"] == pytest.approx(lab, rel=ONE_ROUNDING)
        assert entry["standard_uncertainty"] == pytest.approx(0.5, rel=ONE_ROUNDING)
        assert entry["value_si"] == lab * size
    assert result["parameters"]["kx"]["unit"] == "deg/h/mA"
    assert result["parameters"]["kx"]["unit_si"] == "rad/(s·A)"
    assert result["parameters"]["w0y"]["unit"] == "deg/h"
    assert result["parameters"]["wk"]["unit"] == "deg/h/g"
    assert result["covariance"][0][6] == pytest.approx(0.1, rel=ONE_ROUNDING)
    assert result["covariance"][3][3] == pytest.approx(0.25, rel=ONE_ROUNDING)
    assert result["covariance"][1][2] == 0
    assert result["fit"] == {"chi2": 21.0, "dof": 24, "p_value": 0.6, "rank": 8, "condition": 12.5}
    assert result["iterations"] == []
    assert result["warnings"][0]["code"] == "duration-unknown"
    assert result["warnings"][0]["message"] == "Unknown for 4 positions."
    assert result["budget"] == []  # of an estimate that came from nowhere
    assert "error" not in result


def test_residuals_name_their_positions_as_they_were_written_and_in_the_solvers_order() -> None:
    rows = calibration_json(_calibration(), "least-squares")["residuals"]
    assert [(row["theta_deg"], row["psi_deg"], row["repeat"]) for row in rows] == sorted(POSITIONS)
    assert rows[1]["x_deg_per_h"] == pytest.approx(2.0, rel=ONE_ROUNDING)
    assert rows[1]["y_deg_per_h"] == pytest.approx(3.0, rel=ONE_ROUNDING)
    assert (rows[1]["standardised_x"], rows[1]["standardised_y"]) == (0.2, 0.3)


def test_every_stand_angle_of_a_tenth_of_a_degree_comes_back_as_written() -> None:
    means = [MeansRow(i / 10, 0.0, 0.001, 0.002) for i in range(3600)]
    certificate = [CertificateRow(row.theta_deg, 0.0, 0.0, 0.0, 0.0) for row in means]
    inputs = observations(means, certificate, 0.0)
    n = len(means)
    blank = replace(
        _estimate(),
        residuals=np.zeros((n, 2)),
        standardised=np.zeros((n, 2)),
        outliers=np.zeros((n, 2), dtype=np.bool_),
    )
    calibration = replace(_calibration(blank), observations=inputs)
    rows = calibration_json(calibration, "least-squares")["residuals"]
    assert [row["theta_deg"] for row in rows] == [i / 10 for i in range(3600)]


def test_what_is_undetermined_is_null_everywhere() -> None:
    values, covariance = LAB * SIZES, np.diag(SIZES**2)
    values[2] = np.nan
    covariance[2, :] = covariance[:, 2] = np.nan
    estimate = replace(
        _estimate(),
        values=values,
        covariance=covariance,
        standardised=np.full((4, 2), np.nan),
        fit=Fit(None, 0, None, 7, math.inf, None, None),
    )
    result = json.loads(dumps(calibration_json(_calibration(least_squares=estimate), "least-squares")))
    kxy = result["parameters"]["kxy"]
    assert (kxy["value"], kxy["standard_uncertainty"], kxy["value_si"]) == (None, None, None)
    assert kxy["unit"] == "deg/h/mA"
    assert result["covariance"][2] == [None] * 8
    assert [row[2] for row in result["covariance"]] == [None] * 8
    assert result["covariance"][0][0] is not None
    assert result["residuals"][0]["standardised_x"] is None
    assert result["fit"] == {"chi2": None, "dof": 0, "p_value": None, "rank": 7, "condition": None}


def test_both_methods_stand_side_by_side_each_whole() -> None:
    calibration = _calibration()
    result = calibration_json(calibration, "both")
    assert result["method"] == "both"
    assert result["input_hash"] == "sha256:00"
    assert result["least-squares"] == calibration_json(calibration, "least-squares")
    assert result["paper"] == calibration_json(calibration, "paper")


def test_the_papers_rounds_are_listed_with_null_for_what_a_round_did_not_find() -> None:
    rounds = np.array([LAB * SIZES, LAB * SIZES])
    rounds[0, 4:6] = np.nan
    paper = replace(_estimate("paper"), iterations=rounds)
    listed = calibration_json(_calibration(paper=paper), "paper")["iterations"]
    assert list(listed[0]) == list(PARAMETERS)
    assert listed[0]["w0x"] is None
    assert listed[1]["w0x"] == pytest.approx(1.5, rel=ONE_ROUNDING)
    assert listed[0]["kx"] == pytest.approx(2062.65, rel=ONE_ROUNDING)


def test_a_method_that_failed_says_why_with_its_history_and_the_other_stands() -> None:
    why = Message("not-converged", "No convergence in %(rounds)d rounds.", {"rounds": np.int64(100)})
    failure = Failure("paper", why, np.array([LAB * SIZES]))
    result = json.loads(dumps(calibration_json(_calibration(paper=failure), "both")))
    assert result["paper"]["error"]["code"] == "not-converged"
    assert result["paper"]["error"]["message"] == "No convergence in 100 rounds."
    assert len(result["paper"]["iterations"]) == 1
    assert "parameters" not in result["paper"]
    assert result["least-squares"]["parameters"]["kx"]["value"] == pytest.approx(2062.65, rel=ONE_ROUNDING)

    silent = Failure("paper", Message("positions-missing", "Not all there."), None)
    assert calibration_json(_calibration(paper=silent), "both")["paper"]["iterations"] == []


def test_a_method_that_was_not_asked_for_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="no answer of the method paper"):
        calibration_json(replace(_calibration(), answers={}), "paper")


def test_a_message_comes_back_from_json_whole() -> None:
    message = Message("x", "%(a)s and %(b)s and %(c)s", {"a": np.float64(1.5), "b": (0, 90), "c": "č"})
    stored = json.loads(dumps(message_json(message)))
    assert stored["message"] == "1.5 and (0, 90) and č"
    back = message_from(stored)
    assert (back.code, back.template, back.values) == (
        "x",
        message.template,
        {"a": 1.5, "b": [0, 90], "c": "č"},
    )
    assert message_from({"code": "y", "message": "plain"}).text == "plain"


def test_json_never_holds_nan_and_equal_content_gives_equal_bytes() -> None:
    with pytest.raises(ValueError):
        dumps({"x": math.nan})
    first, second = (dumps(calibration_json(_calibration(), "both")) for _ in range(2))
    assert first == second
    assert "rad/(s·A)" in first


def test_a_moderated_uncertainty_is_told_as_stated_and_as_used():
    """Estimates that differ no more than their ν explains: the mean square of each channel, ν of all together."""
    u_ma = np.array([1.0, 1.1, 0.9, 1.0, 1.2, 0.8, 1.05, 0.95]) * 2e-6
    places = [(theta, psi) for theta in (0.0, 90.0) for psi in (0.0, 90.0, 180.0, 270.0)]
    certificate = [CertificateRow(theta, psi, 1.0, 2.0, 3.0) for theta, psi in places]
    drifts = np.array(
        [[1.5, -0.8]]
    )  # of a gyro with K = 2000 °/h/mA and ωg = 6 °/h/g, but for the Earth rate
    theta, psi = np.radians(places).T
    currents = (drifts + 6.0 * np.sin(theta)[:, None] * np.column_stack((np.sin(psi), np.cos(psi)))) / 2000.0
    north = 15.0 * np.cos(np.radians(55.0)) * np.column_stack((np.sin(psi), np.cos(psi)))
    currents -= north * np.cos(theta)[:, None] / 2000.0

    def result(dof: float | None) -> dict:
        means = [
            MeansRow(*place, *pair, u_jx_ma=u, u_jy_ma=2 * u, dof_jx=dof, dof_jy=dof)
            for place, pair, u in zip(places, currents.tolist(), u_ma.tolist(), strict=True)
        ]
        calibration = calibrate(observations(means, certificate, 55.0), "least-squares")
        return json.loads(dumps(calibration_json(calibration, "least-squares")))

    noise = result(10.0)["current_noise"]
    np.testing.assert_allclose(noise["x"]["u_ma"], u_ma, rtol=ONE_ROUNDING)
    assert noise["y"]["dof"] == [10.0] * 8
    np.testing.assert_allclose(noise["x"]["u_used_ma"], np.sqrt(np.mean(u_ma**2)), rtol=1e-12)
    np.testing.assert_allclose(noise["y"]["u_used_ma"], 2 * np.sqrt(np.mean(u_ma**2)), rtol=1e-12)
    np.testing.assert_allclose(noise["x"]["dof_used"], 80.0, rtol=1e-12)
    assert noise["x"]["u_counted_ma"] == noise["x"]["u_used_ma"]  # equal weights: nothing to allow for
    assert "used 2.01e-06 mA with ν 80" in noise["conclusion"]["message"]
    assert "current_noise" not in result(None)
