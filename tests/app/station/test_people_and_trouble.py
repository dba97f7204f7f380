"""What comes between: commands from the page, signals, an emergency stop, instruments and service that go away."""

import signal
import threading
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from unreal import PLACES, Room, true_record

from app.errors import Invalid, problem
from app.station import cycle, finishing
from app.station.clock import Deadline
from app.station.contracts import Currents, EmergencyStop, InstrumentFault, InstrumentLost, Place
from app.station.controls import Command, Controls, StopAsked
from app.station.finishing import NotFinished
from app.station.keeping import spool
from app.station.keeping.entries import Target
from app.station.keeping.spool import Spool, history_in
from app.station.sending import forwarding
from app.station.sending.client import ServerRefused, Unreachable

pytestmark = pytest.mark.usefixtures("no_sync")
LATER = Target(*PLACES[2])
CLOSING = Target(*PLACES[0], repeat=1)


@pytest.fixture
def room(tmp_path, monkeypatch):
    monkeypatch.setattr(finishing, "_POLL_S", 0.001)
    monkeypatch.setattr(cycle, "_FIRST_PAUSE_S", 0.001)
    monkeypatch.setattr(forwarding, "LONGEST_PAUSE_S", 0.002)
    return Room(tmp_path / "spool")


def at_move(room: Room, number: int, action) -> None:
    """Do something when the stand is told to move for the number-th time, counted from 0."""

    def before(place: Place) -> None:
        if len(room.stand.moves) == number and not done:
            done.append(True)
            action()

    done: list[bool] = []
    room.stand.before_move = before


def at_fetch(room: Room, number: int, action) -> None:
    """Do something before the number-th block is fetched."""
    fetches = []

    def before(first: int) -> None:
        fetches.append(first)
        if len(fetches) == number + 1:
            action()

    room.ammeter.before_fetch = before


def outcomes(room: Room) -> list[tuple[int, str]]:
    history = history_in(room.folder)
    return [(item.command, item.outcome) for item in history.commands.values()]


def lost() -> None:
    raise InstrumentLost(problem("instrument-lost", "The connection broke."))


# People


def test_a_position_that_is_skipped_while_it_is_measured_is_left_out(room):
    at_fetch(room, 4, lambda: room.controls.give([Command(7, "skip")]))
    history = room.run()
    skipped = history.attempts[1]
    assert skipped.target == Target(*PLACES[1])
    assert skipped.abandoned is not None
    assert set(room.service.records) == {Target(*PLACES[0]), LATER, CLOSING}
    assert (history.finished.reasons, history.result is not None) == ((), True)
    assert outcomes(room) == [(7, "done")]


def test_a_position_to_come_is_skipped_by_its_name(room):
    at_move(room, 1, lambda: room.controls.give([Command(1, "skip", Place(90.0, 360.0))]))
    room.run()
    assert LATER not in room.service.records


def test_a_measured_position_is_measured_again_when_asked_and_replaces_the_first(room):
    def ask() -> None:
        room.controls.give([Command(1, "retake", PLACES[1])])

    at_move(room, 3, ask)  # on the way to the third position
    history = room.run()
    assert [attempt.started.take for attempt in history.takes(Target(*PLACES[1]))] == [0, 1]
    assert len(room.service.records[Target(*PLACES[1])]) == 2
    assert history.finished.reasons == ()


def test_the_closing_record_is_made_after_the_first_position_is_measured_again(room):
    def ask() -> None:
        room.controls.give([Command(1, "retake", PLACES[0])])

    at_move(room, 4, ask)  # on the way back to close
    history = room.run()
    assert [attempt.started.take for attempt in history.takes(Target(*PLACES[0]))] == [0]
    # The closing record stands at the place that was asked for: it is that one which is begun anew.
    assert [attempt.abandoned is None for attempt in history.attempts[-2:]] == [False, True]


@pytest.mark.parametrize("command", [Command(1, "skip", Place(45.0, 0.0)), Command(1, "retake", Place(45.0, 0.0)),
                                     Command(1, "skip", PLACES[0])], ids=lambda item: item.kind)  # fmt: skip
def test_what_cannot_be_done_is_refused_with_a_reason(room, command):
    at_move(room, 2, lambda: room.controls.give([command]))
    history = room.run()
    assert outcomes(room) == [(1, "refused")]
    assert history.commands[1].said.text.endswith(".")
    assert len(room.service.records) == 4


def test_a_command_is_obeyed_once_however_often_it_is_brought(room):
    command = Command(1, "retake", PLACES[1])
    at_move(room, 3, lambda: room.controls.give([command]))
    room.run()
    room.controls = Controls()  # a program started again has forgotten what it was given
    room.controls.give([command])
    history = room.run()
    assert len(history.takes(Target(*PLACES[1]))) == 2


def test_a_pause_holds_after_the_record_until_it_ends(room):
    at_fetch(room, 0, lambda: room.controls.give([Command(1, "pause")]))
    thread = threading.Thread(target=room.run)
    thread.start()
    deadline = time.monotonic() + 10
    while (1, "done") not in outcomes(room) or not history_in(room.folder).attempts[0].judged:
        assert time.monotonic() < deadline
    time.sleep(0.05)
    assert len(history_in(room.folder).attempts) == 1
    room.controls.give([Command(2, "resume")])
    thread.join(10)
    assert len(room.service.records) == 4


def test_a_stop_from_the_page_ends_it_and_it_can_be_taken_up(room):
    at_fetch(room, 4, lambda: room.controls.give([Command(1, "stop")]))
    with pytest.raises(StopAsked, match="page"):
        room.run()
    room.controls = Controls()
    starts = list(room.ammeter.starts)
    history = room.run()
    assert history.result is not None
    # The ammeter had gone on acquiring, so the record was fetched to its end and not begun anew.
    assert room.ammeter.starts[: len(starts)] == starts
    assert len(room.ammeter.starts) == 4


@pytest.mark.parametrize("name", [name for name in ("SIGINT", "SIGTERM") if hasattr(signal, name)])
def test_signals_end_the_cycle_in_good_order(room, name):
    at_fetch(room, 4, lambda: signal.raise_signal(getattr(signal, name)))
    before = signal.getsignal(getattr(signal, name))
    with room.controls.on_signals(), pytest.raises(StopAsked, match=name):
        room.run()
    assert signal.getsignal(getattr(signal, name)) is before
    room.controls = Controls()
    assert room.run().result is not None


def test_a_moving_stand_is_stopped_when_the_cycle_ends(room, monkeypatch):
    room.stand.homed = True
    told = type(room.stand).status
    monkeypatch.setattr(type(room.stand), "status", lambda self: replace(told(self), moving=True))
    at_move(room, 0, lambda: room.controls.give([Command(1, "stop")]))
    with pytest.raises(StopAsked):
        room.run()
    assert room.stand.stops == 1


def test_a_moving_stand_whose_answers_nobody_understands_is_stopped_before_anything_else(room, monkeypatch):
    told, unclear = type(room.stand).status, []

    def muddled(self):
        if unclear and not self.stops:
            raise InstrumentFault(problem("instrument-unclear", "Answered by ?"))
        return told(self)

    monkeypatch.setattr(type(room.stand), "status", muddled)
    at_move(room, 2, lambda: unclear.append(True))
    history = room.run()
    assert room.stand.stops == 1
    assert [item.verdict for item in history.takes(Target(*PLACES[1]))] == ["refused", "accepted"]
    assert history.result is not None


def test_a_stand_that_cannot_be_understood_is_stopped_when_the_cycle_ends(room, monkeypatch):
    told, ended = type(room.stand).status, []

    def muddled(self):
        if ended:
            raise InstrumentFault(problem("instrument-unclear", "Answered by ?"))
        return told(self)

    monkeypatch.setattr(type(room.stand), "status", muddled)

    def end() -> None:
        ended.append(True)
        room.controls.stopped_by = "SIGTERM"

    at_move(room, 2, end)
    with pytest.raises(StopAsked):
        room.run()
    assert room.stand.stops == 1


def test_why_a_cycle_ended_is_in_its_log(room):
    def beyond(place: Place) -> None:
        raise Invalid(problem("beyond-travel", "The stand cannot go there."))

    room.stand.before_move = beyond
    with pytest.raises(Invalid):
        room.run()
    told = [(event.level, event.said.code) for event in history_in(room.folder).events]
    assert told == [("error", "beyond-travel")]


# Emergency stop


def press(room: Room) -> None:
    room.stand.emergency_stop = True


def test_an_emergency_stop_without_a_person_ends_it_and_spoils_no_record(room):
    at_fetch(room, 4, lambda: press(room))
    with pytest.raises(NotFinished):
        room.run()
    spoilt = history_in(room.folder).attempts[1]
    assert spoilt.abandoned is not None
    moves = list(room.stand.moves)
    with pytest.raises(NotFinished):
        room.run()
    assert room.stand.moves == moves, "nothing moves while it is pressed"
    room.stand.release()
    history = room.run()
    assert history.result is not None
    assert len(history.takes(spoilt.target)) == 1


def test_with_a_person_it_waits_for_release_and_a_word(room):
    room.options["attended"] = True

    def stop() -> None:
        press(room)
        room.stand.before_move = lambda place: None
        raise EmergencyStop(problem("emergency-stop", "It is pressed."))

    at_move(room, 2, stop)
    thread = threading.Thread(target=room.run)
    thread.start()
    deadline = time.monotonic() + 10
    while "emergency-stop" not in [event.said.code for event in history_in(room.folder).events]:
        assert time.monotonic() < deadline
    assert thread.is_alive()
    room.controls.resume()  # that word acknowledges the stop at the stand, too
    thread.join(10)
    assert not room.stand.emergency_stop
    assert len(room.service.records) == 4


# Instruments


def test_a_connection_that_breaks_in_a_record_is_taken_up_where_the_disk_ends(room):
    at_fetch(room, 4, lost)
    history = room.run()
    assert len(history.attempts) == 4
    assert [event.said.code for event in history.events] == ["instrument-lost", "instruments-back"]


def test_an_ammeter_that_forgot_begins_the_same_take_anew_with_a_new_label(room):
    def power_cut() -> None:
        room.ammeter.forget()
        lost()

    at_fetch(room, 4, power_cut)
    history = room.run()
    first, second = (attempt for attempt in history.attempts if attempt.target == Target(*PLACES[1]))
    assert first.abandoned.code == "acquisition-forgotten"
    assert first.started.take == second.started.take == 0
    assert first.acquiring.label != second.acquiring.label
    assert len(room.service.records[Target(*PLACES[1])]) == 1


def test_an_ammeter_that_somebody_else_uses_too_is_named_and_not_fought_over(room):
    def other_program(first: int) -> None:
        room.ammeter.label = 7

    room.ammeter.before_fetch = other_program
    with pytest.raises(NotFinished, match="Another program uses the ammeter"):
        room.run()
    lost = history_in(room.folder).attempts
    assert [attempt.abandoned.code for attempt in lost] == ["ammeter-taken"] * 3
    room.ammeter.before_fetch = lambda first: None
    assert room.run().result is not None


def test_acquisitions_that_are_lost_again_and_again_are_left_to_a_person(room, monkeypatch):
    monkeypatch.setattr(type(room.ammeter), "start", lambda self, label, *what: setattr(self, "label", label))
    with pytest.raises(NotFinished, match="Three acquisitions were lost"):
        room.run()
    assert {item.abandoned.code for item in history_in(room.folder).attempts} == {"acquisition-empty"}


def test_a_stand_that_lost_its_reference_is_homed_again(room):
    def power_cut() -> None:
        room.stand.homed = False
        lost()

    at_fetch(room, 4, power_cut)
    history = room.run()
    assert room.stand.homed
    assert history.attempts[1].abandoned.code == "stand-was-moved"
    assert len(room.service.records) == 4


def watched_warm_ups(room: Room, monkeypatch) -> list[object]:
    """A list that grows by each warm-up."""
    made: list[object] = []

    def warming(self):
        made.append(self)
        return Never(True)

    monkeypatch.setattr(type(room.judge), "warming", warming)
    return made


def stop_at_fetch(room: Room, number: int) -> None:
    """Let a first life of the program end when the number-th block is fetched."""
    at_fetch(room, number, lambda: room.controls.give([Command(1, "stop")]))
    with pytest.raises(StopAsked):
        room.run()
    room.controls = Controls()


@pytest.mark.parametrize(("homed", "warm_ups"), [(True, 1), (False, 2)])
def test_after_a_power_cut_the_gyro_is_warmed_up_anew(room, monkeypatch, homed, warm_ups):
    made = watched_warm_ups(room, monkeypatch)
    stop_at_fetch(room, 4)
    room.stand.homed = homed
    assert room.run().result is not None
    assert len(made) == warm_ups


def test_a_power_cut_while_the_station_goes_on_is_one_too(room, monkeypatch):
    made = watched_warm_ups(room, monkeypatch)

    def power_cut() -> None:
        room.stand.homed = False
        lost()

    at_fetch(room, 4, power_cut)
    history = room.run()
    assert len(made) == 2
    assert "maybe-cooled" in {event.said.code for event in history.events}


@pytest.mark.parametrize(("away", "warm_ups"), [(timedelta(minutes=1), 1), (timedelta(hours=1), 2)])
def test_after_a_long_break_the_gyro_is_warmed_up_anew(room, monkeypatch, away, warm_ups):
    made = watched_warm_ups(room, monkeypatch)
    stop_at_fetch(room, 4)
    later = datetime.now(UTC) + away
    monkeypatch.setattr(spool, "datetime", SimpleNamespace(now=lambda zone: later))
    history = room.run()
    assert history.result is not None
    assert len(made) == warm_ups
    # What the ammeter had acquired meanwhile is not lost by it.
    assert [attempt.abandoned for attempt in history.attempts] == [None] * 4


def test_an_instruments_fault_refuses_the_take_and_the_next_repairs_it(room):
    def stalled() -> None:
        raise InstrumentFault(problem("motor", "The motor is too hot."))

    at_move(room, 2, stalled)
    history = room.run()
    takes = history.takes(Target(*PLACES[1]))
    assert [attempt.verdict for attempt in takes] == ["refused", "accepted"]
    assert [event.said.text for event in history.events] == ["The motor is too hot."]


def test_a_fault_while_warming_up_is_tried_once_more_and_then_left_to_a_person(room):
    failures = []

    def stalled(place: Place) -> None:
        failures.append(place)
        raise InstrumentFault(problem("motor", "The motor is too hot."))

    room.stand.before_move = stalled
    with pytest.raises(NotFinished, match="too hot"):
        room.run()
    assert len(failures) == 2
    room.stand.before_move = lambda place: None
    assert room.run().result is not None


@dataclass
class Never:
    """What watches readings and never says that they are still."""

    says: bool | None

    def add(self, at_s: float, currents: Currents) -> bool | None:
        return self.says


@pytest.mark.parametrize(("says", "told"), [(False, "still creep"), (None, "too noisy to tell")])
def test_a_warm_up_without_end_says_whether_it_creeps_or_nobody_can_tell(room, monkeypatch, says, told):
    monkeypatch.setattr(Deadline, "passed", True)
    monkeypatch.setattr(type(room.judge), "warming", lambda self: Never(says))
    with pytest.raises(NotFinished, match=told):
        room.run()


@pytest.mark.parametrize(("says", "code"), [(False, "not-settled"), (None, "rest-unknown")])
def test_currents_that_do_not_settle_are_told_from_those_nobody_can_tell_of(room, monkeypatch, says, code):
    monkeypatch.setattr(Deadline, "passed", True)
    monkeypatch.setattr(type(room.judge), "settling", lambda self: Never(says))
    with pytest.raises(NotFinished):
        room.run()
    assert {event.said.code for event in history_in(room.folder).events} == {code}


def test_a_new_run_does_not_wait_for_an_instrument_that_is_not_there(room, monkeypatch):
    monkeypatch.setattr(type(room.ammeter), "identify", lambda self: lost())
    with pytest.raises(InstrumentLost):
        room.run()
    assert room.service.sessions == {}


# The service


def away() -> Unreachable:
    return Unreachable(problem("unreachable", "The service does not answer."))


def test_with_the_service_away_it_measures_and_sends_when_it_is_back(room):
    room.service.trouble = [away()] * 40
    history = room.run()
    assert history.places[:2] == (Place(0.0, 0.0), Place(0.0, 90.0))
    assert len(history.places) == 16, "the method's own positions when nobody knows better"
    assert len(room.service.records) == 17
    assert {"unreachable", "certificate-unheard", "server-back"} <= {
        event.said.code for event in history.events
    }


def test_positions_that_were_asked_for_need_no_certificate(room):
    room.service.trouble = [away()] * 3
    room.asked = PLACES[:2]
    history = room.run()
    assert history.places == PLACES[:2]
    assert "certificate-unheard" not in {event.said.code for event in history.events}


def test_places_beyond_the_travel_are_all_named_before_anything_moves_and_can_be_left_out(room):
    room.stand.beyond = PLACES[1:]
    with pytest.raises(Invalid, match=r"0/180\.\nNot to 90/0"):
        room.run()
    assert not room.stand.homed
    assert room.stand.moves == []
    assert [event.said.code for event in history_in(room.folder).events] == ["beyond-travel"] * 2
    room.asked = PLACES[:1]
    assert room.run().result is not None


def test_the_certificates_positions_are_remembered(room):
    room.run()
    (room.folder / "memory.json").rename(room.folder.parent / "memory.json")
    other = Room(room.folder.parent / "other", service=room.service)
    other.folder.mkdir()
    (room.folder.parent / "memory.json").rename(other.folder / "memory.json")
    other.service.trouble = [away()] * 3
    assert other.run().places == PLACES


def test_an_acknowledgement_that_was_lost_doubles_nothing(room, monkeypatch):
    put = type(room.service).put_record

    def answered_into_the_void(self, session, attempt, content):
        put(self, session, attempt, content)
        if self.puts % 2:
            raise away()

    monkeypatch.setattr(type(room.service), "put_record", answered_into_the_void)
    room.run()
    assert room.service.puts == 8
    assert [len(contents) for contents in room.service.records.values()] == [1, 1, 1, 1]


def test_a_record_that_the_service_refuses_is_named_and_nothing_is_computed(room, monkeypatch):
    put = type(room.service).put_record

    def uncertified(self, session, attempt, content):
        if attempt.target == LATER:
            raise ServerRefused(problem("refused", "The certificate has no such position."), 422)
        put(self, session, attempt, content)

    monkeypatch.setattr(type(room.service), "put_record", uncertified)
    history = room.run()
    assert room.service.jobs == 0
    assert [reason.values["place"] for reason in history.finished.reasons] == ["90/0"]
    assert "no such position" in history.finished.reasons[0].text


def test_a_token_that_was_withdrawn_is_told_and_nothing_is_lost(room, monkeypatch):
    def withdrawn(self, session, attempt, content):
        raise ServerRefused(problem("refused", "The token was withdrawn."), 401)

    with monkeypatch.context() as patched:
        patched.setattr(type(room.service), "put_record", withdrawn)
        with pytest.raises(NotFinished, match="withdrawn"):
            room.run()
    history = room.run()
    assert len(history.attempts) == 4
    assert history.result is not None


def test_a_calibration_that_fails_is_told_and_asked_for_again(room, monkeypatch):
    failed = {"id": "j", "state": "failed", "error": {"detail": "rank 7 instead of 8"}}
    with monkeypatch.context() as patched:
        patched.setattr(type(room.service), "job", lambda self, job: failed)
        with pytest.raises(NotFinished, match="rank 7"):
            room.run()
    assert room.run().result is not None
    assert room.service.jobs == 2


# The folder


def test_a_second_station_on_the_folder_is_refused(room):
    with Spool(room.folder), pytest.raises(Exception, match=r"Another station works on .*spool"):
        Spool(room.folder)
    Spool(room.folder).close()


@pytest.mark.parametrize(
    "ruin", [lambda path: path.write_bytes(b"?"), Path.unlink], ids=["other bytes", "gone"]
)
def test_a_record_that_the_disk_lost_is_measured_again(room, ruin):
    room.service.trouble = [away()] * 10**6
    at_move(room, 4, lambda: room.controls.give([Command(1, "stop")]))
    with pytest.raises(StopAsked):
        room.run()
    room.controls, room.service.trouble = Controls(), []
    ruin(room.folder / "records" / "000001.parquet")
    history = room.run()
    target = history.attempts[1].target
    assert [attempt.verdict for attempt in history.takes(target)] == ["refused", "accepted"]
    assert "record-damaged" in {event.said.code for event in history.events}
    assert (history.finished.reasons, history.result is not None) == ((), True)
    assert len(room.service.records[target]) == 1


def test_samples_are_those_of_the_take(room):
    history = room.run()
    with Spool(room.folder) as spool:
        blocks = spool.blocks(history.attempts[1].number)
        np.testing.assert_array_equal(blocks.columns(), true_record(PLACES[1], 0))
        blocks.close()
