"""A stand's study against a truth that was drawn: who changed, when, by how much."""

import json
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from stand_tables import BEGIN, sessions, stored, turned

from app.services.access import SYSTEM
from app.services.drift import alarms, events, stand_findings, stand_study, studying
from app.services.drift.views import EventView
from app.services.lab import Lab
from app.store import drift

SERIALS = ["0412", "0417", "0419", "0423"]
MONTHS = 20
AT = 41
"""The first session after the change: the second gyro's of the eleventh month."""


def _study(table, happened=()):
    return stand_study.study(table, "S1", ["0412"], happened)


def _said(document, verdict):
    return [item for item in document["findings"] if item["verdict"] == verdict]


@pytest.fixture(scope="module")
def quiet():
    return sessions(SERIALS, MONTHS, 20260301)


def test_nothing_is_found_where_nothing_happened(quiet) -> None:
    document, _ = _study(quiet)
    assert document["findings"] == []
    assert (document["sessions"], document["gyros"], document["check"]) == (80, SERIALS, ["0412"])
    assert list(stand_findings.alarms(document)) == []


@pytest.mark.parametrize(
    ("turn", "direction", "u"),
    # u of a step between n = 41 and m = 39 sessions of standard uncertainty s: s·√(1/41 + 1/39)
    [({"azimuth": 60.0}, "azimuth", 31.0), ({"north": 60.0}, "level-north", 22.0)],
)
def test_a_turn_of_an_arcminute_is_the_stand_s(quiet, turn, direction, u) -> None:
    document, _ = _study(turned(quiet, AT, **turn))
    (found,) = _said(document, "stand")
    assert found["direction"] == direction
    expected = u * (1 / 41 + 1 / 39) ** 0.5
    assert abs(found["size_arcsec"] - 60.0) < 3.5 * expected  # wrong once in two thousand draws; one was made
    assert expected <= found["u_arcsec"] < 2 * expected  # the date is not quite known
    assert found["probability"] > 0.99
    at = datetime.fromisoformat(found["since"]), datetime.fromisoformat(found["until"])
    true = quiet["measured_at"][AT].item().replace(tzinfo=UTC)
    assert at[0] - timedelta(days=45) < true <= at[1] + timedelta(days=45)
    (alarm,) = stand_findings.alarms(document)
    assert alarm.kind == f"stand-{direction}"
    assert alarm.values["size"]["value"] == found["size_arcsec"]
    assert alarm.values["size"]["expanded"] == 2 * found["u_arcsec"]


def test_a_tilt_about_east_is_the_stand_s_when_all_gyros_show_it(quiet) -> None:
    document, columns = _study(turned(quiet, AT, east=120.0))
    (found,) = _said(document, "stand")
    assert found["direction"] == "level-east"
    assert abs(found["size_arcsec"] - 120.0) < 4 * found["u_arcsec"]
    east = columns["level_east_arcsec"]
    step = np.mean(east[AT:]) - np.mean(east[:AT])
    assert step == pytest.approx(120.0, abs=25.0)  # u of one session's estimate is about 30″, of the step 7″


def test_one_gyro_s_own_jump_is_not_the_stand_s(quiet) -> None:
    value = np.where((quiet["gyro"] == "0423") & (np.arange(80) >= AT), 0.5, 0.0) + quiet["w0y.value"]
    document, _ = _study(quiet.with_columns({"w0y.value": value}))
    assert _said(document, "stand") == []
    (found,) = _said(document, "gyro")
    assert found["gyro"] == "0423"
    # scatter 0.02 and noise 0.002 °/h, about ten sessions on either side: u = 0.009 °/h; 4 u
    assert found["shift"]["w0y"]["value"] == pytest.approx(0.5, abs=0.04)
    assert list(stand_findings.alarms(document)) == []


def test_an_event_explains_a_turn(quiet) -> None:
    table = turned(quiet, AT, azimuth=90.0)
    at = quiet["measured_at"][AT].item().replace(tzinfo=UTC) - timedelta(hours=9)
    moved = EventView(7, "moved", at, None, "S1", "to the new pier")
    document, _ = _study(table, (moved,))
    assert [item["event"] for item in _said(document, "stand")] == [7]
    assert [item.explained for item in stand_findings.alarms(document)] == [True]


def test_the_smallest_turn_falls_with_the_fleet(quiet) -> None:
    few, _ = _study(sessions(SERIALS[:2], MONTHS, 1))
    many, _ = _study(quiet)
    assert many["detectable"]["azimuth_arcsec"] < few["detectable"]["azimuth_arcsec"]
    assert many["detectable"]["level_north_arcsec"] < many["detectable"]["azimuth_arcsec"]


def test_a_stand_with_one_gyro_and_one_without_attitude() -> None:
    alone, columns = _study(sessions(["0417"], 2, 3))
    assert alone["findings"] == []
    assert np.isnan(columns["z.w0x"]).all()  # two sessions make no course
    table = sessions(SERIALS, 4, 5)
    blind = {name: np.full(16, np.nan) for name in table.columns if name.endswith("arcsec")}
    document, _ = _study(table.with_columns(blind))
    assert document["detectable"]["azimuth_arcsec"] is None
    json.dumps(document, allow_nan=False)


def test_no_session_at_all() -> None:
    document, _ = _study(sessions([], 0, 1))
    assert (document["sessions"], document["findings"], document["detectable"]) == (0, [], None)


def test_through_the_database(lab: Lab) -> None:
    table = turned(sessions(["0412", "0417", "0419"], 12, 11), 18, azimuth=150.0)
    with lab.write(SYSTEM) as work:
        stored(work, table, "S1")
        studying.follow_all_now(work)
        (row,) = drift.studies(work.db, None, 1, whole=True)
        document = json.loads(row.document or "")
        assert row.studied == row.changed
        assert document["sessions"] == 36
        assert [item["direction"] for item in _said(document, "stand")] == ["azimuth"]
        (alarm,) = alarms.alarms(work, stand="S1")
        assert (alarm.kind, alarm.severity) == ("stand-azimuth", "serious")
    with lab.write(SYSTEM) as work:
        work.now = BEGIN + timedelta(days=400)
        events.add(work, "moved", alarm.at, stand="S1")
        studying.follow_all_now(work)
        assert [item.id for item in alarms.alarms(work, stand="S1")] == [
            alarm.id
        ]  # it still wants its answer
