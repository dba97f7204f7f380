"""The interval of a gyro: by what was found at its end, however often somebody measured in between."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from laid import TECHNICIAN

from app.services import gyros
from app.services.drift import fleet, intervals, reading, studying
from app.services.drift.series import SeriesTable
from app.services.drift.views import EventView
from app.services.lab import Lab
from app.store import equipment
from app.store.tables import DriftStudy

BEGIN = datetime(2020, 1, 1, tzinfo=UTC)
DAY = timedelta(days=1)
LIMITS = {"w0x": {"low": -1.0, "high": 1.0, "repeatability": None}}
ENTRIES = {
    "w0x": {"latest": {}, "forecast": {"low": []}, "trend": {"u_slope_per_year": None}, "together": None}
}


def _table(days, values) -> SeriesTable:
    times = np.datetime64("2020-01-01", "us") + np.round(np.asarray(days) * 86400).astype("timedelta64[s]")
    return SeriesTable(
        {
            "measured_at": times, "session": np.arange(len(times)), "start": np.arange(len(times)),
            "w0x.value": np.asarray(values, float),
        }
    )  # fmt: skip


def _calm(count: int):
    return 0.02 * np.random.default_rng(1).normal(size=count)


def _days(document, method: str):
    (found,) = (item["days"] for item in document["methods"] if item["method"] == method)
    return found


@pytest.mark.parametrize("every", [7, 30, 61, 90, 300, 365])
def test_how_often_one_measures_changes_nothing(every: int) -> None:
    """Eight years well within the limits: nothing speaks against the year that is stated."""
    days = np.arange(0, 2921, every)
    found = intervals.interval(_table(days, _calm(len(days))), LIMITS, 365, ENTRIES)
    assert (found["recommended_days"], _days(found, "staircase")) == (365, 548)


def test_a_repair_ends_an_interval_without_a_finding_and_one_of_the_stand_does_not() -> None:
    days = np.arange(0, 1201, 100)

    def found(*events: EventView):
        document = intervals.interval(_table(days, np.full(13, 0.5)), LIMITS, 400, ENTRIES, events)
        return document["findings"]["days"]

    def event(kind: str, day: int, gyro: str | None = "0417"):
        return EventView(1, kind, BEGIN + day * DAY, gyro, None if gyro else "S1", "")

    assert found() == [300, 300, 300, 300]
    assert found(event("repair", 550), event("adjustment", 900)) == [300, 300]
    assert found(event("repair", 550, None), event("other", 550), event("moved", 900)) == [300] * 4


def test_the_sessions_of_one_visit_are_one_calibration_up_to_an_adjustment() -> None:
    table = _table([0, 300, 300.1, 300.2, 600], [0.0, 0.99, 1.02, 0.9, 0.1])
    found = intervals.interval(table, LIMITS, 365, ENTRIES)["findings"]
    assert found["days"] == [300, 300]
    assert found["used"] == pytest.approx([0.97, 0.1])
    adjusted = EventView(1, "adjustment", BEGIN + 300.15 * DAY, "0417", None, "")
    found = intervals.interval(table, LIMITS, 365, ENTRIES, [adjusted])["findings"]
    assert found["days"] == [300, pytest.approx(299.8)]
    assert found["used"] == pytest.approx([1.005, 0.1])


def test_what_was_not_determined_is_no_finding_unless_something_else_was_beyond() -> None:
    limits = LIMITS | {"w0y": LIMITS["w0x"]}
    table = _table([0, 300, 400, 700], [0.1, 0.1, 0.1, 2.0])
    table = table.with_columns({"w0y.value": np.array([0.3, np.nan, 0.2, np.nan])})
    found = intervals.interval(table, limits, 365, ENTRIES | {"w0y": ENTRIES["w0x"]})["findings"]
    assert (found["days"], found["used"]) == ([400, 300], [0.2, 2.0])


def test_without_an_interval_of_the_type_none_is_recommended() -> None:
    table = _table([0, 7, 14, 21], np.full(4, 0.5))
    assert intervals.interval(table, LIMITS, None, ENTRIES)["recommended_days"] is None
    assert intervals.interval(table, {}, 365, ENTRIES)["methods"] == []
    assert intervals.interval(_table([0], [0.5]), LIMITS, 365, ENTRIES)["methods"] == []


def test_the_share_within_limits_is_that_of_all_gyros_of_the_type(lab: Lab, history: list[int]) -> None:
    """Twelve monthly sessions in control, stated 90 days, so three findings; of another gyro nine of ten are beyond."""
    with lab.write(TECHNICIAN) as work:
        gyros.set_limits(work, "GVK-6", {"w0x": (-100.0, 100.0)})
        gyros.set_interval(work, "GVK-6", 90)
        studying.follow_all_now(work)
        gyros.add_gyro(work, "0418", "GVK-6")
        other = equipment.gyro(work.db, "0418")
        assert other is not None
        beyond = {"limits": {"w0x": [-100.0, 100.0]}, "days": [90.0] * 10, "used": [1.2] * 9 + [0.2]}
        row = DriftStudy(
            gyro_id=other.id, method="least-squares", changed=1, studied=1, recalibrations=beyond
        )
        work.db.add(row)
        work.db.flush()
        found = reading.gyro_drift(work, "0417").document
        assert found is not None
        judged = found["interval"]["methods"][-1]
        assert (judged["reason"]["values"]["within"], judged["reason"]["values"]["count"]) == (4, 13)
        # R = 4/13, Q near 1: by 10^(0.31 − 0.95), so halved (NCSLI RP-1, method A3)
        assert (judged["days"], found["interval"]["recommended_days"]) == (45, 30)
        fleet_of_two = fleet.fleet(work, "GVK-6")
        assert [item.recommended_days for item in fleet_of_two.gyros] == [30, None]
        row.recalibrations = beyond | {"limits": {"w0x": [-1.0, 1.0]}}  # by limits that the type had before
        work.db.flush()
        assert fleet.fleet(work, "GVK-6").gyros[0].recommended_days > 30
