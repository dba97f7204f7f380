"""Factors of a thousand, and honest currents that only look like one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.errors import Invalid
from app.exchange.means import read_means, write_means_csv
from app.exchange.plausible import USUAL_MA
from app.exchange.rows import MeansRow

EARTH_DEG_PER_H = 15.041067  # 7.292115e-5 rad/s


def currents(
    latitude_deg: float, bias_deg_per_h: float, scale: float, noise_deg_per_h: float = 0.002
) -> list[MeansRow]:
    """Sixteen positions of a gyro with a bias and nothing else, by finite rotations."""
    rng = np.random.default_rng(7)
    latitude = np.radians(latitude_deg)
    earth = EARTH_DEG_PER_H * np.array([0.0, np.cos(latitude), np.sin(latitude)])
    rows = []
    for theta in (0.0, 90.0, 180.0, 270.0):
        for psi in (0.0, 90.0, 180.0, 270.0):
            case = Rotation.from_euler("XZ", [theta, psi], degrees=True)  # geographic → case, intrinsic
            x, y, _ = (case.inv().apply(earth) - bias_deg_per_h + rng.normal(0, noise_deg_per_h, 3)) / scale
            rows.append(MeansRow(theta, psi, float(x), float(y)))
    return rows


def test_the_usual_current_is_about_seven_microamperes() -> None:
    assert pytest.approx(0.0072921, rel=1e-4) == USUAL_MA  # 7.2921e-5 rad/s over 10 rad/(s·A)


@pytest.mark.parametrize("latitude", [-90.0, -35.0, 0.0, 55.7558, 90.0])
@pytest.mark.parametrize("bias", [0.0, 0.5, 20.0])
@pytest.mark.parametrize("scale", [2062.65, -2062.65, 300.0, 15000.0])
def test_honest_currents_are_neither_refused_nor_warned_of(
    latitude: float, bias: float, scale: float
) -> None:
    _, warnings = read_means(write_means_csv(currents(latitude, bias, scale)), "means.csv")
    assert warnings == []


@pytest.mark.parametrize("latitude", [-35.0, 10.0, 55.7558])
@pytest.mark.parametrize("place", range(16))
@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_any_one_row_in_another_unit_is_refused_by_its_line(
    latitude: float, place: int, factor: float
) -> None:
    rows = currents(latitude, 0.5, 2062.65)
    wrong = rows[place]
    rows[place] = MeansRow(wrong.theta_deg, wrong.psi_deg, wrong.jx_ma * factor, wrong.jy_ma * factor)
    with pytest.raises(Invalid) as caught:
        read_means(write_means_csv(rows), "means.csv")
    assert {item.message.code for item in caught.value.problems} == {"current-unit"}
    assert {item.row for item in caught.value.problems} == {place + 2}


@pytest.mark.parametrize("limit", [0.1, 1.0, -0.9999999999999999, -1.0000000000000002, 2.5, 10.0])
def test_a_saturated_row_is_left_to_the_diagnosis(limit: float) -> None:
    rows = currents(55.7558, 0.5, 2062.65)
    rows[3] = MeansRow(rows[3].theta_deg, rows[3].psi_deg, limit, rows[3].jy_ma)
    assert len(read_means(write_means_csv(rows), "means.csv")[0]) == 16


@pytest.mark.parametrize(("factor", "cure"), [(1000.0, "jx_ua"), (0.001, "jx_a ")])
def test_a_whole_file_in_another_unit_is_warned_of_and_not_rescaled(factor: float, cure: str) -> None:
    rows = [
        MeansRow(r.theta_deg, r.psi_deg, r.jx_ma * factor, r.jy_ma * factor)
        for r in currents(55.0, 0.5, 2062.65)
    ]
    read, (warning,) = read_means(write_means_csv(rows), "means.csv")
    assert read == rows
    assert warning.code == "current-unit"
    assert cure in warning.text


def test_three_rows_are_too_few_to_tell_which_one_is_wrong() -> None:
    rows = [
        MeansRow(0.0, 0.0, 4.0, 3.0),
        MeansRow(0.0, 90.0, 0.004, 0.003),
        MeansRow(0.0, 180.0, 0.003, 0.002),
    ]
    assert len(read_means(write_means_csv(rows), "means.csv")[0]) == 3


def test_currents_of_nothing_at_all_are_left_to_the_solver() -> None:
    rows = [MeansRow(0.0, psi, 0.0, -0.0) for psi in (0.0, 90.0, 180.0, 270.0)]
    assert len(read_means(write_means_csv(rows), "means.csv")[0]) == 4
