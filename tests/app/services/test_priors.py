"""What a gyro is expected to be: its last sound calibration, else its type's nominal values."""

import math
from datetime import UTC, datetime, timedelta

import pytest

from app.exchange.rows import MeansRow
from app.services import calibrations, gyros, ingest, priors
from app.services.access import SYSTEM
from app.services.sessions import NewSession, find_session, open_session
from app.services.simulated import degrees
from app.services.solving import solved
from app.services.views import Nominal
from simdevice.bench import mean_currents
from simdevice.certificate import sixteen_positions
from solver.units import ma_from_ampere

NOMINALS = {"kx": Nominal(2060.0, 100.0), "wg": Nominal(0.0, 5.0)}
BEGUN = datetime(2026, 3, 1, 9, tzinfo=UTC)


def measure(work, bench, begun, *, exchanged=False, scale=1.0):
    """A solved session; with `exchanged`, its channels were; with a `scale`, the currents are in another unit."""
    session = open_session(work, NewSession("0417", "S1", started_at=begun))
    means = mean_currents(bench, sixteen_positions())
    columns = (
        (means.jy, means.jx, means.u_jy, means.u_jx)
        if exchanged
        else (means.jx, means.jy, means.u_jx, means.u_jy)
    )
    rows = [
        MeansRow(degrees(means.theta[n]), degrees(means.psi[n]),
                 *(scale * float(ma_from_ampere(column[n])) for column in columns), 60.0, 200.0)
        for n in range(16)
    ]  # fmt: skip
    ingest.save(work, session.id, [ingest.Measured(row, ingest.Source("typed")) for row in rows])
    wanted = {
        "method": "least-squares",
        "inputs": [item.id for item in calibrations.measurement.current(work.db, session.id)],
    }
    prepared = calibrations.prepare(work, session.id, wanted)
    stated = calibrations.stated(work, find_session(work, session.id), wanted)
    certificate = calibrations.stands.certificate_rows(find_session(work, session.id).certificate)
    output = solved(rows, certificate, prepared["latitude_deg"], "least-squares", stated)
    calibrations.store(work, session.id, wanted, output)
    return session.id


@pytest.fixture
def typed(lab):
    with lab.write(SYSTEM) as work:
        gyros.set_nominals(work, "GVK-6", NOMINALS)
    return lab


def expected(work, session_id):
    return priors.expectation(work, find_session(work, session_id))


def test_nothing_is_expected_of_an_unknown_gyro(lab, session_id):
    with lab.read(SYSTEM) as work:
        assert expected(work, session_id) is None


def test_a_new_gyro_is_expected_to_be_like_its_type(typed, session_id):
    with typed.read(SYSTEM) as work:
        found = expected(work, session_id)
    assert found["source"]["message"] == "nominal values of type GVK-6"
    assert found["parameters"] == {
        "kx": {"value": 2060.0, "standard_uncertainty": 100.0},
        "wg": {"value": 0.0, "standard_uncertainty": 5.0},
    }


def test_a_known_gyro_is_expected_to_be_as_it_was_with_room_to_change(typed, bench):
    with typed.write(SYSTEM) as work:
        first = measure(work, bench, BEGUN)
        later = open_session(work, NewSession("0417", "S1", started_at=BEGUN + timedelta(days=1))).id
        earlier = open_session(work, NewSession("0417", "S1", started_at=BEGUN - timedelta(days=1))).id
        found, before = expected(work, later), expected(work, earlier)
        view = calibrations.calibrations(work).items[0].result
    assert found["source"]["values"]["session"] == first
    assert before["source"]["code"] == "prior-type"  # what came later is not known yet
    kx, w0x = view.parameters["kx"], view.parameters["w0x"]
    scale = max(abs(view.parameters[name].value) for name in ("kx", "ky"))
    assert found["parameters"]["kx"]["value"] == kx.value
    assert found["parameters"]["kx"]["standard_uncertainty"] == pytest.approx(
        math.hypot(kx.u, 0.01 * scale), rel=1e-12
    )
    assert found["parameters"]["w0x"]["standard_uncertainty"] == pytest.approx(
        math.hypot(w0x.u, 1.0), rel=1e-12
    )


def test_a_blundered_calibration_is_no_expectation(typed, bench):
    with typed.write(SYSTEM) as work:
        sound = measure(work, bench, BEGUN)
        blundered = measure(work, bench, BEGUN + timedelta(days=1), exchanged=True)
        third = open_session(work, NewSession("0417", "S1", started_at=BEGUN + timedelta(days=2))).id
        found = expected(work, third)
        results = {item.id: item.result for item in calibrations.calibrations(work).items}
        told = calibrations.calibration(work, results[blundered].id).result["diagnosis"]
    assert told[0]["code"] == "channels-swapped"
    assert found["source"]["values"]["session"] == sound


def test_currents_that_may_be_in_another_unit_are_no_expectation(typed, bench):
    with typed.write(SYSTEM) as work:
        measure(work, bench, BEGUN, scale=1000.0)
        second = measure(work, bench, BEGUN + timedelta(days=30))
        assert expected(work, second)["source"]["code"] == "prior-type"
        third = measure(work, bench, BEGUN + timedelta(days=60))
        assert expected(work, third)["source"]["code"] == "prior-calibration"
