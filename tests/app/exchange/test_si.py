"""Rows to SI: against conversions written out here from the definitions of the units."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from app.errors import Invalid
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.si import (
    PARAMETER_UNITS,
    covariance_lab,
    incomplete_uncertainties,
    observations,
    parameter_lab,
    parameter_si,
)
from solver.records import PARAMETERS

# One rounding in each of the two ways of multiplying the same constants.
TWO_ROUNDINGS = 4 * np.finfo(float).eps

POSITIONS = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]
CERTIFICATE = [
    CertificateRow(theta, psi, alpha_arcsec=i + 0.5, beta_arcsec=-2.0 * i, gamma_arcsec=3.0)
    for i, (theta, psi) in enumerate(POSITIONS)
]
MEANS = [
    MeansRow(theta, psi, jx_ma=0.001 * (i + 1), jy_ma=-0.002 * (i + 1), u_jx_ma=1e-6, u_jy_ma=2e-6)
    for i, (theta, psi) in enumerate(POSITIONS)
]


def test_every_column_reaches_the_solver_in_si() -> None:
    result = observations(MEANS, CERTIFICATE, -55.7558)

    i = POSITIONS.index((90.0, 270.0))
    assert result.theta[i] == pytest.approx(math.pi / 2, rel=TWO_ROUNDINGS)
    assert result.psi[i] == pytest.approx(3 * math.pi / 2, rel=TWO_ROUNDINGS)
    assert result.alpha[i] == pytest.approx((i + 0.5) / 3600 * math.pi / 180, rel=TWO_ROUNDINGS)
    assert result.beta[i] == pytest.approx(-2.0 * i / 3600 * math.pi / 180, rel=TWO_ROUNDINGS)
    assert result.gamma[i] == pytest.approx(3.0 / 3600 * math.pi / 180, rel=TWO_ROUNDINGS)
    assert result.jx[i] == pytest.approx(1e-6 * (i + 1), rel=TWO_ROUNDINGS)
    assert result.jy[i] == pytest.approx(-2e-6 * (i + 1), rel=TWO_ROUNDINGS)
    assert result.u_jx is not None
    assert result.u_jx[i] == pytest.approx(1e-9, rel=TWO_ROUNDINGS)
    assert result.u_jy is not None
    assert result.u_jy[i] == pytest.approx(2e-9, rel=TWO_ROUNDINGS)
    assert result.latitude == pytest.approx(-55.7558 * math.pi / 180, rel=TWO_ROUNDINGS)


def test_the_order_of_the_rows_does_not_matter() -> None:
    shuffled_means, shuffled_certificate = list(MEANS), list(CERTIFICATE)
    random.Random(5).shuffle(shuffled_means)
    random.Random(6).shuffle(shuffled_certificate)

    first = observations(MEANS, CERTIFICATE, 48.1).input_hash()
    assert observations(shuffled_means, shuffled_certificate, 48.1).input_hash() == first


def test_another_current_by_one_bit_is_another_input() -> None:
    other = [replace(MEANS[0], jx_ma=math.nextafter(MEANS[0].jx_ma, 1.0)), *MEANS[1:]]
    assert (
        observations(other, CERTIFICATE, 48.1).input_hash()
        != observations(MEANS, CERTIFICATE, 48.1).input_hash()
    )


def test_a_position_is_found_within_a_millionth_of_a_degree_and_across_the_full_turn() -> None:
    means = [
        replace(row, theta_deg=row.theta_deg + 0.9e-6, psi_deg=(row.psi_deg - 0.9e-6) % 360) for row in MEANS
    ]
    assert (
        observations(means, CERTIFICATE, 48.1).input_hash()
        == observations(MEANS, CERTIFICATE, 48.1).input_hash()
    )


def test_every_row_without_certified_angles_is_named() -> None:
    means = [
        replace(MEANS[0], psi_deg=0.1, line=2),
        MEANS[1],
        replace(MEANS[2], theta_deg=1.1e-6, line=4),
    ]
    with pytest.raises(Invalid) as caught:
        observations(means, CERTIFICATE, 48.1, file="means.csv")
    found = [(item.message.code, item.file, item.row) for item in caught.value.problems]
    assert found == [("position-not-certified", "means.csv", 2), ("position-not-certified", "means.csv", 4)]


def test_uncertainties_count_only_when_every_row_has_both() -> None:
    partly = [replace(MEANS[0], u_jy_ma=None), *MEANS[1:]]
    assert observations(partly, CERTIFICATE, 48.1).u_jx is None
    warning = incomplete_uncertainties(partly)
    assert warning is not None
    assert "15 of 16" in warning.text
    assert incomplete_uncertainties(MEANS) is None
    assert incomplete_uncertainties([replace(row, u_jx_ma=None, u_jy_ma=None) for row in MEANS]) is None


def test_duration_and_rate_are_nan_where_they_are_not_given() -> None:
    means = [replace(MEANS[0], duration_s=60.0, rate_hz=200.0), *MEANS[1:]]
    result = observations(means, CERTIFICATE, 48.1)
    assert (result.duration[0], result.rate[0]) == (60.0, 200.0)
    assert np.isnan(result.duration[1:]).all()
    assert np.isnan(result.rate[1:]).all()


def test_minus_zero_gives_the_bits_of_zero() -> None:
    zeros = [replace(row, jx_ma=0.0) for row in MEANS]
    minus = [replace(row, jx_ma=-0.0) for row in MEANS]
    assert not np.signbit(observations(minus, CERTIFICATE, 48.1).jx).any()
    assert (
        observations(minus, CERTIFICATE, 48.1).input_hash()
        == observations(zeros, CERTIFICATE, 48.1).input_hash()
    )


@pytest.mark.parametrize("latitude", [90.1, -91.0, math.nan, math.inf])
def test_a_latitude_beyond_a_pole_is_refused(latitude: float) -> None:
    with pytest.raises(Invalid) as caught:
        observations(MEANS, CERTIFICATE, latitude)
    assert caught.value.problems[0].column == "latitude_deg"


def test_nothing_measured_is_refused() -> None:
    with pytest.raises(Invalid, match="no measured position"):
        observations([], CERTIFICATE, 48.1)


def test_a_scale_factor_of_ten_is_the_papers_example() -> None:
    # 10 rad/(s·A) = 10·(180/π)·3600/1000 °/h/mA = 2062.65.
    assert parameter_lab("kx", 10.0) == pytest.approx(10 * 180 / math.pi * 3.6, rel=TWO_ROUNDINGS)
    assert parameter_si("w0x", 1.0) == pytest.approx(math.pi / 180 / 3600, rel=TWO_ROUNDINGS)
    for name in PARAMETERS:
        assert parameter_si(name, parameter_lab(name, 0.7)) == pytest.approx(0.7, rel=TWO_ROUNDINGS)
    assert set(PARAMETER_UNITS) == set(PARAMETERS)


def test_covariance_in_lab_units_is_that_of_the_converted_parameters() -> None:
    rng = np.random.default_rng(3)
    samples = rng.normal(size=(50, 8))
    lab = np.column_stack(
        [[parameter_lab(name, x) for x in samples[:, i]] for i, name in enumerate(PARAMETERS)]
    )
    # Both sides are sums of 50 products in float64.
    np.testing.assert_allclose(
        covariance_lab(np.cov(samples.T)), np.cov(lab.T), rtol=1e-12, atol=1e-12 * 2063**2
    )
