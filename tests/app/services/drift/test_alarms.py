"""Alarms: once for each episode, kept up, answered for by a person, ended when nothing shows them any more."""

import re
from datetime import date, timedelta

import pytest
from laid import BEGIN, METROLOGIST, MONTH, TECHNICIAN, drawn, revision, session

from app.errors import Conflict, Forbidden, Invalid, NotFound
from app.exchange.rows import CertificateRow
from app.services import stands
from app.services.drift import alarms, baselines, events, reading, series
from app.services.lookup import find_gyro

SHIFT = 0.5
"""Twenty-five times the scatter: no chance makes it."""


@pytest.fixture
def judged(lab, history, follow_jobs):
    """The first ten sessions are the baseline of w0x."""
    with lab.write(METROLOGIST) as work:
        chosen = series.load(work, find_gyro(work, "0417").id, "least-squares")["calibration"][:10].tolist()
        (made,) = baselines.freeze(work, "0417", ["w0x"], chosen)
    follow_jobs()
    return made


def _shifted(lab, follow_jobs, number, shift=SHIFT):
    """One more session whose w0x lies off; its number."""
    values = drawn(number + 1)[number]
    with lab.write(TECHNICIAN) as work:
        made = session(work, number, values | {"w0x": values["w0x"] + shift})
    follow_jobs()
    return made


def _alarms(lab, **which):
    with lab.read(TECHNICIAN) as work:
        return {
            item.kind: item for item in alarms.alarms(work, gyro="0417", **which) if item.parameter == "w0x"
        }


def test_values_in_control_raise_nothing(lab, judged):
    with lab.read(TECHNICIAN) as work:
        assert alarms.alarms(work, state=None) == ()
        assert alarms.counts(work) == {}


def test_an_alarm_is_raised_by_the_first_result_and_kept_up_by_the_next(lab, judged, follow_jobs):
    first = _shifted(lab, follow_jobs, 12)
    raised = _alarms(lab)["beyond-limits"]
    assert (raised.session, raised.last_session, raised.severity) == (first, first, "serious")
    assert raised.baseline == judged.id
    last = _shifted(lab, follow_jobs, 13)
    kept = _alarms(lab)["beyond-limits"]
    assert (kept.id, kept.session, kept.last_session) == (raised.id, first, last)
    assert kept.raised_at == raised.raised_at
    with lab.read(TECHNICIAN) as work:
        (point,) = reading.gyro_drift(work, "0417", parameters=["w0x"]).parameters[0].points[-1:]
    assert "nelson-1" in point.signals
    assert point.value > point.charts["individuals_high"]


@pytest.fixture
def stepped(lab, judged, follow_jobs):
    """Five sessions more after a step; the first one's number."""
    first, *_ = [_shifted(lab, follow_jobs, number) for number in range(12, 17)]
    return first


def test_a_step_is_an_alarm(lab, stepped):
    step = _alarms(lab)["step"]
    assert step.session == stepped
    # Size by the means of both sides: 0.02·√(1/12 + 1/5) is its standard deviation, five times that the bound.
    assert step.values["size"]["value"] == pytest.approx(SHIFT, abs=5 * 0.0107)
    assert (
        0.0214 <= step.values["size"]["expanded"] < 2 * 0.0214
    )  # k = 2; the scatter is estimated, the date not sure
    assert re.match(
        r"A step of \+0\.\d{3} ± 0\.0\d\d deg/h between 20", step.detail
    )  # down to U's second digit


def test_what_is_entered_afterwards_answers_for_no_alarm(lab, stepped, follow_jobs):
    before = _alarms(lab)
    with lab.write(TECHNICIAN) as work:
        events.add(work, "repair", BEGIN + 11.5 * MONTH, "bearing", gyro="0417")
    follow_jobs()
    after = _alarms(lab)
    assert {kind: item.id for kind, item in after.items()} == {kind: item.id for kind, item in before.items()}
    assert "repair" in after["step"].detail
    (change,) = _changes(lab)
    assert change["event_kind"] == "repair"
    with lab.write(METROLOGIST) as work:
        for item in after.values():
            alarms.acknowledge(work, item.id, "repair")
        events.add(work, "other", BEGIN, gyro="0417")
    follow_jobs()
    assert _alarms(lab) == {}


def test_a_step_at_a_repair_that_is_known_is_no_alarm(lab, judged, follow_jobs):
    with lab.write(TECHNICIAN) as work:
        events.add(work, "repair", BEGIN + 11.5 * MONTH, "bearing", gyro="0417")
    for number in range(12, 17):
        _shifted(lab, follow_jobs, number)
    assert _alarms(lab) == {}
    with lab.read(TECHNICIAN) as work:
        study = reading.gyro_drift(work, "0417").document["parameters"]["w0x"]
    assert study["status"] == "no-baseline", "a repair ends the baseline"
    (change,) = study["changes"]
    assert change["event_kind"] == "repair"


def test_a_note_explains_no_step_but_stands_beside_it(lab, judged, follow_jobs):
    with lab.write(TECHNICIAN) as work:
        events.add(work, "other", BEGIN + 11.5 * MONTH, "case wiped", gyro="0417")
    for number in range(12, 17):
        _shifted(lab, follow_jobs, number)
    assert "case wiped" in _alarms(lab)["step"].detail
    (change,) = _changes(lab)
    assert change["event"] is None
    assert [item["kind"] for item in change["beside"]] == ["other"]


def test_a_stand_that_the_gyro_had_left_explains_nothing(lab, follow_jobs):
    """It was on S2 long before; S2 was moved when the gyro, on S1, stepped."""
    values = drawn(17)
    with lab.write(TECHNICIAN) as work:
        _another_stand(work)
        for number in range(4):
            session(work, number, values[number], stand="S2")
        events.add(work, "moved", BEGIN + 11.5 * MONTH, stand="S2")
        for number in range(4, 17):
            shift = SHIFT if number >= 12 else 0.0
            session(work, number, values[number] | {"w0x": values[number]["w0x"] + shift})
    follow_jobs()
    assert "no event explains it" in _alarms(lab)["step"].detail
    (change,) = _changes(lab)
    assert (change["event"], change["beside"]) == (None, [])


def test_a_stand_moved_under_the_gyro_explains_its_step(lab, judged, follow_jobs):
    with lab.write(TECHNICIAN) as work:
        events.add(work, "moved", BEGIN + 11.5 * MONTH, stand="S1")
    for number in range(12, 17):
        _shifted(lab, follow_jobs, number)
    assert "step" not in _alarms(lab)


def test_a_step_with_another_stand_says_so(lab, history, follow_jobs):
    values = drawn(17)
    with lab.write(TECHNICIAN) as work:
        _another_stand(work)
        for number in range(12, 17):
            session(work, number, values[number] | {"w0x": values[number]["w0x"] + SHIFT}, stand="S2")
    follow_jobs()
    assert _alarms(lab)["step"].detail.endswith("when the gyro came to stand S2.")
    (change,) = _changes(lab)
    assert change["event"] is None
    assert [(item["kind"], item["note"]) for item in change["beside"]] == [("stand", "S2")]


def _another_stand(work):
    stands.add_stand(work, "S2", 55.0)
    rows = [CertificateRow(0.0, 0.0, 1.0, 1.0, 1.0)]
    stands.add_certificate(work, "S2", "D-1", date(2000, 1, 1), date(2100, 1, 1), rows)


def _changes(lab):
    with lab.read(TECHNICIAN) as work:
        return reading.gyro_drift(work, "0417").document["parameters"]["w0x"]["changes"]


def test_each_episode_is_an_alarm_of_its_own(lab, judged, follow_jobs):
    first = _shifted(lab, follow_jobs, 12)
    for number in range(13, 19):
        _shifted(lab, follow_jobs, number, 0.0)
    second = _shifted(lab, follow_jobs, 19, -SHIFT)
    with lab.read(TECHNICIAN) as work:
        found = [
            item for item in alarms.alarms(work, gyro="0417", kind="beyond-limits") if item.parameter == "w0x"
        ]
    assert [(item.session, item.last_session) for item in found] == [(second, second), (first, first)]
    low, high = (item.values["value"]["value"] for item in found)
    assert high - low > SHIFT
    with lab.write(METROLOGIST) as work:
        alarms.acknowledge(work, found[1].id, "environment")
    assert _alarms(lab)["beyond-limits"].session == second


def test_a_corrected_session_closes_the_alarm_as_replaced(lab, judged, follow_jobs):
    wrong = _shifted(lab, follow_jobs, 12)
    alarm = _alarms(lab)["beyond-limits"]
    with lab.write(TECHNICIAN) as work:
        revision(work, wrong, drawn(13)[12], input_hash="corrected")
    follow_jobs()
    assert _alarms(lab) == {}
    ended = _alarms(lab, state="replaced")["beyond-limits"]
    assert ended.id == alarm.id
    assert ended.ended_at is not None
    with lab.write(METROLOGIST) as work, pytest.raises(Conflict):
        alarms.acknowledge(work, alarm.id, "operator")


def test_a_person_answers_with_a_cause_and_the_next_episode_is_a_new_alarm(lab, judged, follow_jobs):
    _shifted(lab, follow_jobs, 12)
    first = _alarms(lab)["beyond-limits"]
    with lab.write(METROLOGIST) as work:
        answered = alarms.acknowledge(work, first.id, "environment", " heating failed ")
    assert (answered.state, answered.cause, answered.note) == (
        "acknowledged",
        "environment",
        "heating failed",
    )
    assert answered.acknowledged_by == "sokolov"
    for number in range(13, 19):
        _shifted(lab, follow_jobs, number, 0.0)
    assert "beyond-limits" not in _alarms(lab), "what was answered is not raised again by a new study"
    later = _shifted(lab, follow_jobs, 19)
    second = _alarms(lab)["beyond-limits"]
    assert second.id != first.id
    assert second.session == later


@pytest.mark.parametrize(
    ("person", "cause", "note", "error"),
    [
        (TECHNICIAN, "gyro", "", Forbidden),
        (METROLOGIST, "weather", "", Invalid),
        (METROLOGIST, "other", " ", Invalid),
        (METROLOGIST, "gyro", "x" * 4001, Invalid),
    ],
    ids=["technician", "unknown-cause", "other-unsaid", "long-note"],
)
def test_what_is_no_answer(lab, judged, follow_jobs, person, cause, note, error):
    _shifted(lab, follow_jobs, 12)
    with lab.write(person) as work, pytest.raises(error):
        alarms.acknowledge(work, 1, cause, note)


def test_an_unknown_alarm(lab):
    with lab.write(METROLOGIST) as work:
        with pytest.raises(NotFound):
            alarms.acknowledge(work, 99, "gyro")
        with pytest.raises(NotFound):
            alarms.alarm(work, 99)


def test_the_worst_come_first(lab, judged, follow_jobs):
    for number in range(12, 15):
        _shifted(lab, follow_jobs, number)
    with lab.read(TECHNICIAN) as work:
        found = [item.severity for item in alarms.alarms(work)]
        assert found == sorted(found, key=alarms.SEVERITIES.index)
        assert sum(alarms.counts(work).values()) == len(found) > 1


def test_the_study_again_changes_no_alarm(lab, judged, follow_jobs):
    _shifted(lab, follow_jobs, 12)
    before = _alarms(lab)
    with lab.write(TECHNICIAN) as work:
        events.add(work, "other", BEGIN - timedelta(days=1), "delivered", gyro="0417")
    follow_jobs()
    assert _alarms(lab) == before
