"""The demonstration laboratory shows what it says: one gyro drifts, one jumps, the others are steady."""

import numpy as np
import pytest

from app.services import calibrations, demonstration, gyros, history, overview, sessions, stands
from app.services.access import SYSTEM
from app.services.opening import open_lab
from app.settings import Settings


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The laboratory, built once: a year of sessions takes its time."""
    with open_lab(Settings(data=tmp_path_factory.mktemp("demo") / "data")) as lab:
        demonstration.build(lab)
        yield lab


def test_the_year_shows_the_drifting_and_the_jumping_gyro(built):
    with built.read(SYSTEM) as work:
        verdicts = {item.serial: item.last_result.verdict for item in gyros.gyros(work).items}
        w0x = {name: values(work, name, "w0x") for name in ("0412", "0417")}
        wk = values(work, "0423", "wk")
        open_session = overview.overview(work).current.session
        last = sessions.detail(work, demonstration.SESSIONS * len(verdicts))
    assert len(verdicts) == 6
    assert verdicts["0423"] == "fails"
    # 0417 drifts by 0.6 °/h over the year; starts scatter by 0.03 °/h, so two means differ by 0.02 °/h.
    assert w0x["0417"][-3:].mean() - w0x["0417"][:3].mean() > 0.3
    assert abs(w0x["0412"][-3:].mean() - w0x["0412"][:3].mean()) < 0.1
    # 0423's quadrature drift jumps by 0.5 °/h/g once; starts scatter by 0.02.
    assert np.sum(np.abs(np.diff(wk)) > 0.3) == 1
    assert (open_session.positions_measured, open_session.positions_total) == (12, 16)
    assert all(item.measurement.record for item in last.positions), "the latest session has its full records"


def values(work, serial, parameter):
    (series,) = history.history(work, serial, parameter=parameter)
    return np.array([point.value for point in series.points])


def test_uncertainty_and_nominal_values_are_stated_and_true(built):
    """What is stated goes into the results, and the simulated truth lies where it says."""
    with built.read(SYSTEM) as work:
        stand, certificates = stands.stand(work, "S1"), stands.certificates(work, "S1")
        kinds = {kind.name: kind for kind in gyros.types(work)}
        latest = [calibrations.calibration(work, gyro.last_result.id) for gyro in gyros.gyros(work).items]
        truths = [(item.session.type, sessions.detail(work, item.session.id).truth) for item in latest]
    assert {"u_gain_x_ppm", "u_azimuth_arcsec", "u_temperature_k"} <= set(stand.uncertainty)
    for certificate in certificates:
        assert certificate.common == (0.3, 0.3, 0.3)
        assert {row.u_beta_arcsec for row in certificate.positions} == {0.5}
    for item in latest:
        codes = {line["code"] for line in item.result["least-squares"]["budget"]}
        assert {"ammeter-gain", "ammeter-offset", "angles-common", "azimuth"} <= codes
    assert {len(kind.nominals) for kind in kinds.values()} == {8}
    for kind, truth in truths:
        for name, nominal in kinds[kind].nominals.items():
            # Of 48 parameters one lies beyond 4.5 standard deviations with a chance of 0.03 %.
            assert abs(truth[name] - nominal.value) < 4.5 * nominal.u, (kind, name)
