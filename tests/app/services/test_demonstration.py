"""The demonstration laboratory shows what it says: each gyro's story is found, and told once."""

import numpy as np
import pytest

from app.services import calibrations, demonstration, gyros, history, overview, sessions, stands
from app.services.access import SYSTEM
from app.services.drift import alarms, due, reading
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
    # 0423's quadrature drift jumps by 0.6 °/h/g once; starts scatter by 0.02.
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


def test_each_story_is_an_alarm_and_told_once(built):
    with built.read(SYSTEM) as work:
        found = alarms.alarms(work, state=None)
        told = {(item.gyro or item.stand, item.parameter, item.kind) for item in found}
        late = {item.gyro for item in due.urgent(work) if item.state == "overdue"}
    assert len(told) == len(found), "no finding is told twice, by two methods say"
    assert {("0417", "w0x", "trend"), ("0417", "wg", "trend"), ("0417", "wk", "limit-ahead")} <= told
    assert {("0423", "wk", "step"), ("0423", "wk", "out-of-limits"), ("0423", "w0y", "step")} <= told
    assert any(gyro == "D-034" and kind == "repeatability" for gyro, _, kind in told)
    assert ("S1", None, "stand-azimuth") in told
    # The steady gyro, and the repaired one, whose step the repair explains.
    assert not {
        (gyro, kind) for gyro, _, kind in told if gyro in ("0412", "0419") and kind in ("step", "trend")
    }
    assert late == {"D-034"}
    (answered,) = [item for item in found if item.state == "acknowledged"]
    assert (answered.gyro, answered.parameter, answered.kind, answered.cause) == (
        "0423",
        "w0y",
        "step",
        "gyro",
    )


def test_the_courses_are_those_of_the_simulated_gyros(built):
    with built.read(SYSTEM) as work:
        studies = {
            serial: reading.gyro_drift(work, serial).document["parameters"]
            for serial in ("0417", "0419", "0423", "D-031")
        }
    drifting, ageing = studies["0417"]["w0x"]["trend"], studies["D-031"]["w0y"]["trend"]
    # 4 standard uncertainties: a chance of 6e-5, of a slope of 0.6 °/h a year and a time constant of 60 days.
    assert drifting["model"] == "linear"
    # Removing the drift leaves what two sessions and two starts of one day tell of their scatter.
    assert all(part["sd"] is not None for part in studies["0417"]["w0x"]["components"])
    assert abs(drifting["slope_per_year"] - 0.6) < 4 * drifting["u_slope_per_year"]
    assert ageing["model"] == "exponential"
    assert 30 < ageing["time_constant_days"] < 120
    (jump,) = [change for change in studies["0423"]["wk"]["changes"] if change["kind"] == "step"]
    assert abs(jump["size"] - 0.6) < 4 * jump["u"]
    (repair,) = studies["0419"]["w0x"]["changes"]
    assert repair["event"] is not None
    assert abs(repair["size"] - 0.3) < 4 * repair["u"]
