"""The live state of a station: what reports change and what they do not, and what becomes of commands."""

import threading
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from app.errors import Conflict, Invalid, NotFound
from app.services import live, overview, sessions
from app.services.access import SYSTEM
from app.services.lab import Lab
from app.services.live_views import FORGOTTEN_AFTER, Answered, CellState, Report, RunEvent, Sentence, Spot
from app.services.sessions import NewSession, open_session

AT = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
FIRST, SECOND = Spot(0.0, 0.0, 0, 0), Spot(0.0, 90.0, 0, 0)
CELLS = (
    CellState(0.0, 0.0, 0, "recorded"),
    CellState(0.0, 90.0, 0, "running"),
    CellState(0.0, 0.0, 1, "todo"),
)
START = Report("S1-PC", "run-a", 1, AT, "acquiring", SECOND, 0.0045, -0.0021, True, 0.5, 90.0, 1, CELLS)


def happened(number: int, message: str = "A spike.") -> RunEvent:
    return RunEvent(number, AT, "warning", "spike", Sentence(message), 0.0, 0.0)


def tell(lab: Lab, session_id: int, *reports: Report, at: datetime | None = None):
    """The answer to the last of these reports, taken at that time."""
    for report in reports:
        with lab.write(SYSTEM) as work:
            work.now = at or work.now
            answer = live.report(work, session_id, report)
    return answer


def ask(lab: Lab, session_id: int, kind, theta_deg: float | None = None, psi_deg: float | None = None):
    with lab.write(SYSTEM) as work:
        return live.command(work, session_id, kind, theta_deg, psi_deg)


def seen(lab: Lab, session_id: int, at: datetime | None = None):
    with lab.read(SYSTEM) as work:
        work.now = at or work.now
        return live.run(work, session_id)


def everything(lab: Lab) -> dict[str, list]:
    """Every row of the station's tables."""
    with lab.read(SYSTEM) as work:
        return {
            name: work.db.execute(sa.text(f"SELECT * FROM {name}")).all()
            for name in ("station_run", "station_event", "station_command")
        }


def test_a_report_replaces_the_one_before(lab, session_id):
    tell(
        lab,
        session_id,
        START,
        replace(START, sequence=2, phase="moving", position=FIRST, settled=None, waiting=0),
    )
    run = seen(lab, session_id)
    assert (run.sequence, run.phase, run.position, run.settled, run.waiting) == (2, "moving", FIRST, None, 0)
    assert run.cells == CELLS
    assert len(everything(lab)["station_run"]) == 1


@pytest.mark.parametrize("sequence", [4, 5])
def test_a_report_that_is_not_newer_changes_nothing(lab, session_id, sequence):
    """Sent again, or overtaken by a later one: the answer is the present one."""
    told = tell(lab, session_id, replace(START, sequence=5, events=(happened(1),)))
    before = everything(lab)
    late = replace(START, sequence=sequence, phase="failed", events=(happened(1, "Otherwise."), happened(2)))
    assert tell(lab, session_id, late) == told
    assert everything(lab) == before
    assert told.sequence == 5


def test_events_are_kept_once_and_asked_for_until_seen(lab, session_id):
    assert tell(lab, session_id, replace(START, events=(happened(1), happened(2)))).events_seen == 2
    again = replace(START, sequence=2, events=(happened(2, "Told otherwise."), happened(3)))
    assert tell(lab, session_id, again).events_seen == 3
    assert tell(lab, session_id, replace(START, sequence=3)).events_seen == 3
    assert [(item.number, item.said.message) for item in seen(lab, session_id).events] == [
        (3, "A spike."), (2, "A spike."), (1, "A spike.")
    ]  # fmt: skip


def test_one_event_twice_in_a_report_is_one(lab, session_id):
    assert tell(lab, session_id, replace(START, events=(happened(1), happened(1)))).events_seen == 1


def test_two_runs_number_their_events_by_themselves(lab, session_id):
    tell(lab, session_id, replace(START, events=(happened(1), happened(2))))
    assert tell(lab, session_id, replace(START, run="run-b", events=(happened(1, "B."),))).events_seen == 1
    assert [item.said.message for item in seen(lab, session_id).events] == ["B."]


def test_the_run_heard_of_last_is_the_present_one(lab, session_id):
    """Whatever the stands' clocks say, and however far the run before had come."""
    earlier = replace(START, run="run-b", sequence=1, sent_at=AT - timedelta(days=1))
    tell(lab, session_id, replace(START, sequence=90), earlier)
    assert seen(lab, session_id).run == "run-b"
    with pytest.raises(Conflict) as refused:
        tell(lab, session_id, replace(START, sequence=91))
    assert refused.value.problems[0].message.code == "run-superseded"
    assert (seen(lab, session_id).run, seen(lab, session_id).sequence) == ("run-b", 1)


def test_sessions_do_not_mix(lab, session_id):
    with lab.write(SYSTEM) as work:
        other = open_session(work, NewSession("0417", "S1")).id
    tell(lab, session_id, START)
    tell(lab, other, replace(START, sequence=7, waiting=3))  # the same run's name
    assert [seen(lab, number).waiting for number in (session_id, other)] == [1, 3]


def test_reports_of_many_at_once_are_one_run(lab, session_id):
    """A retried first report may arrive beside the first one; whichever order, the newest stays."""
    failed = []

    def report(sequence: int) -> None:
        try:
            tell(lab, session_id, replace(START, sequence=sequence, events=(happened(1), happened(sequence))))
        except Exception as error:  # a thread's error would be lost
            failed.append(error)

    threads = [threading.Thread(target=report, args=(number,)) for number in range(2, 10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failed == []
    assert seen(lab, session_id).sequence == 9
    numbers = [item.number for item in seen(lab, session_id).events]
    assert len(set(numbers)) == len(numbers)
    assert {1, 9} <= set(numbers)


def test_readings_are_of_the_present_position_and_bounded(lab, session_id, monkeypatch):
    monkeypatch.setattr(live, "MOST_READINGS", 20)  # five minutes' worth would be 300 transactions
    tell(lab, session_id, replace(START, position=FIRST))
    for number in range(live.MOST_READINGS + 20):
        tell(lab, session_id, replace(START, sequence=2 + number, jx_ma=1e-3 * number))
    readings = seen(lab, session_id).readings
    assert len(readings) == live.MOST_READINGS
    assert readings[-1].jx_ma == 1e-3 * (live.MOST_READINGS + 19)
    assert readings[0].jx_ma == 1e-3 * 20
    assert [item.at for item in readings] == sorted(item.at for item in readings)
    last = tell(lab, session_id, replace(START, sequence=5000, jx_ma=None)).sequence
    assert len(seen(lab, session_id).readings) == live.MOST_READINGS  # no reading is none of 0
    tell(lab, session_id, replace(START, sequence=last + 1, position=replace_take(SECOND)))
    assert len(seen(lab, session_id).readings) == 1  # a further attempt begins anew


def replace_take(spot: Spot) -> Spot:
    return spot._replace(take=spot.take + 1)


def test_age_and_silence_are_counted_by_our_clock(lab, session_id):
    heard = datetime.now(UTC)
    tell(lab, session_id, replace(START, sent_at=AT - timedelta(days=900)), at=heard)
    assert seen(lab, session_id, heard + timedelta(seconds=3)).age_s == pytest.approx(
        3.0, abs=1e-6
    )  # clock's step
    assert not seen(lab, session_id, heard + timedelta(seconds=5)).silent
    assert seen(lab, session_id, heard + timedelta(seconds=6)).silent
    tell(lab, session_id, replace(START, sequence=2, phase="finished"), at=heard)
    assert not seen(lab, session_id, heard + timedelta(hours=6)).silent


def test_a_command_is_answered_once(lab, session_id):
    tell(lab, session_id, START)
    asked, new = ask(lab, session_id, "pause")
    assert (new, asked.state, asked.asked_by) == (True, "open", SYSTEM.name)
    assert ask(lab, session_id, "pause") == (asked, False)
    told = tell(lab, session_id, replace(START, sequence=2))
    assert [(item.id, item.kind) for item in told.commands] == [(asked.id, "pause")]
    done = Answered(asked.id, "done", Sentence("The cycle waits."))
    assert tell(lab, session_id, replace(START, sequence=3, done=(done,))).commands == ()
    first = seen(lab, session_id).commands[0]
    otherwise = Answered(asked.id, "refused", Sentence("No."))
    tell(lab, session_id, replace(START, sequence=4, done=(otherwise, done)))
    assert seen(lab, session_id).commands == (first,)
    assert (first.state, first.said.message) == ("done", "The cycle waits.")
    assert ask(lab, session_id, "pause")[1]  # answered: asked again it is a new one


def test_an_answer_to_another_runs_command_is_no_answer(lab, session_id):
    with lab.write(SYSTEM) as work:
        other = open_session(work, NewSession("0417", "S1")).id
    tell(lab, session_id, START)
    tell(lab, other, START)
    asked, _ = ask(lab, session_id, "stop")
    tell(lab, other, replace(START, sequence=2, done=(Answered(asked.id, "done", Sentence("")),)))
    assert [item.state for item in seen(lab, session_id).commands] == ["open"]


def test_a_skip_without_a_position_is_about_the_present_one(lab, session_id):
    tell(lab, session_id, START)
    asked, _ = ask(lab, session_id, "skip")
    assert (asked.theta_deg, asked.psi_deg) == (0.0, 90.0)
    tell(lab, session_id, replace(START, sequence=2, position=None))
    with pytest.raises(Conflict, match="no position now"):
        ask(lab, session_id, "skip")


@pytest.mark.parametrize(
    ("kind", "theta_deg", "psi_deg", "code"),
    [
        ("retake", 45.0, 0.0, "position-not-in-run"),
        ("retake", float("nan"), 0.0, "position-not-in-run"),
        ("retake", None, 0.0, "no-position-named"),
        ("pause", 0.0, 0.0, "whole-run"),
        ("stop", None, 0.0, "whole-run"),
    ],
)
def test_commands_need_their_position(lab, session_id, kind, theta_deg, psi_deg, code):
    tell(lab, session_id, START)
    with pytest.raises(Invalid) as refused:
        ask(lab, session_id, kind, theta_deg, psi_deg)
    assert refused.value.problems[0].message.code == code
    assert everything(lab)["station_command"] == []


def test_what_an_ended_run_did_not_answer_has_lapsed(lab, session_id):
    tell(lab, session_id, START)
    ask(lab, session_id, "pause")
    asked, _ = ask(lab, session_id, "stop")
    tell(
        lab,
        session_id,
        replace(START, sequence=2, phase="stopped", done=(Answered(asked.id, "done", Sentence("")),)),
    )
    assert {item.kind: item.state for item in seen(lab, session_id).commands} == {
        "pause": "lapsed",
        "stop": "done",
    }
    with pytest.raises(Conflict, match="has ended"):
        ask(lab, session_id, "resume")


def test_a_stopped_run_that_is_taken_up_again_lives(lab, session_id):
    tell(lab, session_id, replace(START, phase="stopped"), replace(START, sequence=2))
    assert not seen(lab, session_id).ended
    assert ask(lab, session_id, "pause")[1]


def test_a_new_run_does_not_get_the_commands_of_the_one_before(lab, session_id):
    tell(lab, session_id, START)
    ask(lab, session_id, "stop")
    assert tell(lab, session_id, replace(START, run="run-b")).commands == ()
    assert seen(lab, session_id).commands == ()


def test_nothing_is_there_before_the_first_report(lab, session_id):
    with lab.read(SYSTEM) as work:
        assert live.find(work, session_id) is None
        assert live.state_mark(work, session_id) == ""
        assert sessions.session(work, session_id).station is None
        for number in (session_id, 99):
            with pytest.raises(NotFound):
                live.run(work, number)


def test_the_mark_tells_every_change(lab, session_id):
    marks = set()

    def note() -> None:
        with lab.read(SYSTEM) as work:
            marks.add(live.state_mark(work, session_id))

    note()
    tell(lab, session_id, START)
    note()
    asked, _ = ask(lab, session_id, "pause")
    note()
    tell(lab, session_id, replace(START, sequence=2, done=(Answered(asked.id, "done", Sentence("")),)))
    note()
    tell(lab, session_id, replace(START, run="run-b"))
    note()
    assert len(marks) == 5


def test_a_report_asks_for_no_job_and_leaves_no_other_row(lab, session_id, queue):
    def counts() -> dict[str, int]:
        with lab.read(SYSTEM) as work:
            names = [
                name for name in sa.inspect(lab.database.engine).get_table_names() if name != "station_run"
            ]
            return {name: work.db.scalar(sa.text(f'SELECT COUNT(*) FROM "{name}"')) for name in names}

    before = counts()
    tell(lab, session_id, START, replace(START, sequence=2))
    assert counts() == before
    assert queue.queued == []


def test_the_session_at_a_station_comes_first(lab, session_id):
    with lab.write(SYSTEM) as work:
        later = open_session(work, NewSession("0417", "S1")).id
    tell(lab, session_id, START)
    with lab.read(SYSTEM) as work:
        assert overview.overview(work).current.session.id == session_id
        brief = sessions.session(work, session_id).station
        assert (brief.phase, brief.settled, brief.left_s, brief.under_way) == ("acquiring", True, 90.0, True)
        work.now += FORGOTTEN_AFTER
        assert overview.overview(work).current.session.id == later
    tell(lab, session_id, replace(START, sequence=2, phase="failed"))
    with lab.read(SYSTEM) as work:
        assert overview.overview(work).current.session.id == later
