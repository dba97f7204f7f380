"""The worked cases: scipy's rotations give the stored currents, and the pack sees a wrong solver."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.validation import worked
from app.validation.numbers import load
from solver import calibrate

CASES = {case["key"]: case for case in load("worked")["cases"]}
EARTH_DEG_PER_H = np.rad2deg(7.292115e-5) * 3600


def felt(case):
    """Earth rate, °/h, and specific force, g, along the case axes: intrinsic turns of scipy."""
    rows = np.array(case["rows"])
    turn = Rotation.from_euler("XZ", rows[:, :2], degrees=True) * Rotation.from_euler(
        "XYZ", rows[:, 2:5] / 3600, degrees=True
    )
    latitude = np.deg2rad(case["latitude_deg"])
    rate = turn.inv().apply(EARTH_DEG_PER_H * np.array([0, np.cos(latitude), np.sin(latitude)]))
    return rate, turn.inv().apply([0.0, 0.0, 1.0]), rows[:, 5:].T


@pytest.mark.parametrize("key", ["moscow", "petersburg", "sydney"])
def test_the_stored_currents_balance_rate_and_drift(key):
    case = CASES[key]
    rate, up, (jx, jy) = felt(case)
    q = case["truth"]
    left_x = q["kx"] * jx + q["kxy"] * jy + q["w0x"] + q["wg"] * up[:, 0] - q["wk"] * up[:, 1]
    left_y = q["kyx"] * jx + q["ky"] * jy + q["w0y"] + q["wk"] * up[:, 0] + q["wg"] * up[:, 1]
    # scipy's rotations of angles in radians: some units of 1e-16 of 15 °/h
    np.testing.assert_allclose(np.stack((left_x, left_y)), rate[:, :2].T, atol=2e-13)


def test_the_noisy_case_by_numpy():
    case = CASES["noisy"]
    rate, up, (jx, jy) = felt(case)
    zero, one = np.zeros(16), np.ones(16)
    x = np.column_stack((jx, zero, jy, zero, one, zero, up[:, 0], -up[:, 1]))
    y = np.column_stack((zero, jy, zero, jx, zero, one, up[:, 1], up[:, 0]))
    found = np.linalg.lstsq(np.vstack((x, y)), np.concatenate((rate[:, 0], rate[:, 1])))[0]
    np.testing.assert_allclose(found, case["least_squares"], rtol=1e-10)  # numpy's own rounding
    truth = np.array(list(case["truth"].values()))
    u = np.array(case["standard_uncertainties"])
    assert (np.abs(found - truth) < 4 * u).all()


def test_every_case_holds():
    found = worked.group(lambda fraction, what: None)
    assert [(case.name, case.error) for case in found.cases if not case.passed] == []
    assert len(found.cases) == 5


def test_a_solver_that_is_wrong_by_a_part_in_ten_to_the_eighth_fails(monkeypatch):
    def off(observations, method):
        return calibrate.calibrate(replace(observations, jx=observations.jx * (1 + 1e-8)), method)

    monkeypatch.setattr(worked, "calibrate", off)
    cases = worked.group(lambda fraction, what: None).cases
    assert not any(case.passed for case in cases[:4])
    assert cases[4].passed  # wrong, but the same bits


def test_a_solver_that_is_not_the_same_twice_fails(monkeypatch):
    noise = np.random.default_rng(1)

    def restless(observations, method):
        shaken = observations.jx * (1 + 1e-15 * noise.standard_normal(len(observations)))
        return calibrate.calibrate(replace(observations, jx=shaken), method)

    monkeypatch.setattr(worked, "calibrate", restless)
    assert not worked.group(lambda fraction, what: None).cases[4].passed
