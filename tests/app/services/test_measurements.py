from datetime import UTC, date, datetime, timedelta

import pytest

from app.errors import NotFound
from app.exchange.rows import CertificateRow, MeansRow
from app.services import access, gyros, ingest, measurements, sessions, stands
from app.services.opening import open_lab
from app.settings import Settings

PLACES = [(0.0, 0.0), (0.0, 90.0), (90.0, 0.0)]
NOW = datetime(2026, 6, 1, tzinfo=UTC)


@pytest.fixture
def work(settings: Settings):
    with open_lab(settings) as lab, lab.write(access.SYSTEM) as found:
        gyros.add_gyro(found, "A", "T")
        for name, latitude in (("S1", 56.0), ("S2", -34.0)):
            stands.add_stand(found, name, latitude)
            rows = [CertificateRow(theta, psi, 1.0, 2.0, 3.0) for theta, psi in PLACES]
            stands.add_certificate(found, name, "C", date(2000, 1, 1), date(2100, 1, 1), rows)
        yield found


def measured(work, days_ago, currents, stand="S1"):
    new = sessions.NewSession("A", stand, started_at=NOW - timedelta(days=days_ago))
    number = sessions.open_session(work, new).id
    for (theta, psi), (jx, jy) in zip(PLACES, currents, strict=False):
        ingest.save_means(work, number, MeansRow(theta, psi, jx, jy), ingest.Source("typed"))
    return number


OLD = [(0.001, 0.005), (0.004, 0.0), (-0.003, 0.002)]


def compared(work, number):
    detail = sessions.detail(work, number)
    return measurements.surprises(detail.positions, measurements.before(work, detail.session))


def test_two_percent_of_the_largest_current_is_the_limit(work):
    measured(work, 10, OLD)
    step = 0.02 * 0.005
    now = measured(work, 0, [(0.001 + 0.99 * step, 0.005), (0.004, 1.01 * step), (-0.003, 0.002)])
    found = compared(work, now)
    assert set(found) == {(0.0, 90.0, 0)}
    surprise = found[0.0, 90.0, 0]
    assert (surprise.axis, surprise.difference_ma) == ("y", pytest.approx(1.01 * step))


def test_the_worse_axis_is_told(work):
    measured(work, 10, OLD)
    now = measured(work, 0, [(0.002, 0.008)])
    assert compared(work, now)[0.0, 0.0, 0].axis == "y"


def test_the_session_before_is_the_latest_one_at_this_latitude_with_currents(work):
    measured(work, 30, OLD)
    wanted = measured(work, 20, OLD)
    measured(work, 10, OLD, "S2")
    measured(work, 5, [])
    now = measured(work, 0, OLD)
    later = measured(work, -5, OLD)
    earlier = measurements.before(work, sessions.session(work, now))
    assert earlier is not None
    assert earlier.session.id == wanted
    assert later != wanted


def test_a_first_session_is_compared_with_nothing(work):
    now = measured(work, 0, OLD)
    assert measurements.before(work, sessions.session(work, now)) is None
    assert compared(work, now) == {}


def test_revisions_of_one_position_only(work):
    number = measured(work, 0, OLD)
    again = ingest.save_means(work, number, MeansRow(0.0, 90.0, 0.1, 0.2), ingest.Source("typed")).measurement
    found = measurements.detail(work, again.id)
    assert [item.revision for item in found.revisions] == [1, 2]
    assert (found.number, found.newest.id, found.record) == (2, again.id, None)


def test_no_such_measurement(work):
    with pytest.raises(NotFound, match="There is no measurement 7"):
        measurements.detail(work, 7)
