"""The simulated laboratory deviates from what is assumed by as much as is stated."""

import numpy as np
import pytest

from app.exchange.rows import CertificateRow
from app.services.simulated import (
    Conditions,
    ammeter_off,
    bench_for,
    certificate_lab,
    common_lab,
    deviations,
)
from simdevice.ammeter import Ammeter
from simdevice.certificate import draw_certificate, sixteen_positions
from solver.inputs import COMMON
from solver.units import rad_from_arcsec, rad_from_deg

CONDITIONS = Conditions("GVK-6", "0417", "S1", 1, seed=5)
ROWS = [
    CertificateRow(theta, psi, 6.9, -16.4, 6.6, 0.5, 0.5, 0.5) for theta in (0.0, 90.0) for psi in (0.0, 90.0)
]
STATEMENT = {
    "u_gain_x_ppm": 20, "u_gain_y_ppm": 20, "u_offset_x_ma": 5e-7, "u_level_1_arcsec": 2, "u_azimuth_arcsec": 10,
    "u_latitude_arcsec": 1, "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9}],
}  # fmt: skip


def test_a_certificate_states_its_random_and_its_common_part_apart() -> None:
    certificate = draw_certificate(
        1, u_random=rad_from_arcsec(0.5), u_systematic=rad_from_arcsec(np.array([0.3, 0.2, 0.0]))
    )
    rows = certificate_lab(certificate)
    assert {(row.u_alpha_arcsec, row.u_beta_arcsec, row.u_gamma_arcsec) for row in rows} == {(0.5, 0.5, 0.5)}
    assert common_lab(certificate) == (0.3, 0.2, 0.0)


def test_deviations_are_drawn_with_the_stated_size_and_correlation() -> None:
    """Of 4000 draws a standard deviation is good to 1/√8000 = 1.1 %, r = 0.9 to (1 − r²)/√4000 = 0.003.

    Accepted is 4.5 times as much.
    """
    drawn = [deviations(seed, STATEMENT) for seed in range(4000)]
    columns = {name: np.array([item[name] for item in drawn]) for name in COMMON}
    arcsec = np.pi / 648_000
    expected = dict.fromkeys(COMMON, 0.0) | {
        "gain_x": 20e-6, "gain_y": 20e-6, "offset_x": 5e-10, "level_1": 2 * arcsec, "azimuth": 10 * arcsec,
        "latitude": arcsec,
    }  # fmt: skip
    for name, std in expected.items():
        assert np.std(columns[name]) == pytest.approx(std, rel=0.05), name
    assert np.corrcoef(columns["gain_x"], columns["gain_y"])[0, 1] == pytest.approx(0.9, abs=0.0135)


def test_the_ammeter_reads_what_its_deviation_says() -> None:
    """A reading J stands for (1 + gain)·J + offset, as the solver's derivatives count it."""
    off = dict.fromkeys(COMMON, 0.0) | {"gain_x": 1e-3, "offset_x": 2e-9, "offset_y": -3e-9}
    made = ammeter_off(Ammeter(), off)
    true = np.array([1e-6, -4e-6])
    for axis, channel in zip("xy", made.channels, strict=True):
        reading = channel.read(true, np.zeros(2))
        assumed = (1 + off[f"gain_{axis}"]) * reading + off[f"offset_{axis}"]
        assert assumed == pytest.approx(true, rel=1e-14, abs=0)  # a few roundings


def test_a_bench_deviates_as_stated_and_only_then() -> None:
    exact = bench_for(CONDITIONS, ROWS, 55.7558)
    assert exact.stand.latitude == rad_from_deg(55.7558)
    assert exact.stand.base == (0.0, 0.0, 0.0)
    assert [channel.gain for channel in exact.ammeter.channels] == [1.0, 1.0]
    assert not exact.stand.certificate.u_systematic.any()
    made = bench_for(CONDITIONS, ROWS, 55.7558, {**STATEMENT, "u_beta_common_arcsec": 0.3})
    assert made.stand.latitude != exact.stand.latitude
    assert [bool(angle) for angle in made.stand.base] == [True, False, True]
    assert [channel.gain != 1.0 for channel in made.ammeter.channels] == [True, True]
    assert made.stand.certificate.u_systematic == pytest.approx([0.0, rad_from_arcsec(0.3), 0.0], rel=1e-15)
    place = sixteen_positions()[0]
    assert (made.stand.misalignment(place) != exact.stand.misalignment(place)).tolist() == [
        False,
        True,
        False,
    ]
    again = bench_for(CONDITIONS, ROWS, 55.7558, {**STATEMENT, "u_beta_common_arcsec": 0.3})
    assert (again.stand.base, again.ammeter) == (made.stand.base, made.ammeter), "a stand's truth is its own"


def test_a_latitude_stays_on_the_earth() -> None:
    for serial in range(8):  # half of them would leave it
        conditions = Conditions("GVK-6", "0417", f"S{serial}", 1, seed=5)
        made = bench_for(conditions, ROWS, 90.0, {"u_latitude_arcsec": 3600})
        assert abs(made.stand.latitude) <= np.pi / 2
