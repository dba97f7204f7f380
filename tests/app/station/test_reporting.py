"""What the station tells the service about itself, and the commands that come back."""

import threading
import time
from dataclasses import dataclass, field
from datetime import UTC, datetime

import pytest
from unreal import PLACES, RATE_HZ, SAMPLES

from app.errors import problem
from app.station.contracts import Currents, Place
from app.station.controls import Command, Controls
from app.station.keeping.entries import (
    Begun,
    Commanded,
    Finding,
    Judged,
    Opened,
    Planned,
    Rejected,
    Resumed,
    Said,
    Started,
    Target,
)
from app.station.keeping.spool import Spool
from app.station.sending import reporting
from app.station.sending.client import ServerRefused, Unreachable
from app.station.sending.live import Live
from app.station.sending.reporting import Reporter
from solver.errors import Message

pytestmark = pytest.mark.usefixtures("no_sync")
TARGETS = [*(Target(*place) for place in PLACES), Target(*PLACES[0], repeat=1)]


@dataclass
class Listener:
    """The service's side; `answers` are given one after the other, the last for ever."""

    answers: list = field(default_factory=lambda: [{"commands": [], "events_seen": 0}])
    heard: list[dict] = field(default_factory=list)

    def report(self, session: int, said: dict) -> dict:
        self.heard.append(said)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        pass


@pytest.fixture
def spool(tmp_path):
    with Spool(tmp_path / "spool") as spool:
        spool.add(Begun("run-1", "0417", "S1", datetime(2026, 3, 1, tzinfo=UTC), SAMPLES, RATE_HZ))
        spool.add(Resumed())
        yield spool


@pytest.fixture
def planned(spool):
    spool.add(Planned(PLACES, "option"))
    spool.add(Opened(5))
    return spool


def reported(spool: Spool, listener: Listener, times: int, live: Live | None = None) -> Controls:
    """Report so often, without a thread."""
    controls = Controls()
    reporter = Reporter("S1-PC", spool, live or Live(), controls, lambda: listener)
    for _ in range(times):
        reporter._report(listener)
    return controls


def judged(spool: Spool, target: Target, verdict: str, *codes: str) -> None:
    number = len(spool.history.attempts)
    findings = tuple(Finding(Said(code, f"There is a {code}.", {"count": 2}), "refused") for code in codes)
    spool.add(Started(number, target, 0))
    spool.add(Judged(number, verdict, findings, 1e-3, 2e-3, "0"))


def test_before_the_session_is_open_nothing_is_told(spool):
    listener = Listener()
    reported(spool, listener, 1)
    assert listener.heard == []


def test_a_report_says_where_the_cycle_is(planned):
    judged(planned, TARGETS[0], "accepted")
    live, listener = Live(), Listener()
    live.turn_to("acquiring", TARGETS[1], 1)
    live.show(currents=Currents(1e-3, -2e-3), settled=True, fraction=0.25)
    reported(planned, listener, 1, live)
    said = listener.heard[0]
    assert (said["station"], said["run"], said["phase"]) == ("S1-PC", "run-1", "acquiring")
    assert said["position"] == {"theta_deg": 0.0, "psi_deg": 180.0, "repeat": 0, "take": 1}
    assert (said["jx_ma"], said["jy_ma"], said["settled"], said["fraction"]) == (1e-3, -2e-3, True, 0.25)
    assert [cell["state"] for cell in said["cells"]] == ["recorded", "running", "todo", "todo"]
    assert said["waiting"] == 1
    # Three records of 0.2 s are left with 30 s around each; of this one a quarter is there, and no moving is left.
    assert said["left_s"] == pytest.approx(3 * 30.2 - 30 - 0.05)


def test_what_became_of_each_position_is_shown(planned):
    for target, verdicts in zip(TARGETS, (["refused"] * 2, ["suspicious"] * 2, ["refused"]), strict=False):
        for verdict in verdicts:
            judged(planned, target, verdict)
    planned.add(Commanded(1, "skip", "done", Said("skipped", "Left out.", {}), TARGETS[3]))
    listener = Listener()
    reported(planned, listener, 1)
    # One that failed once is to be measured again.
    assert [cell["state"] for cell in listener.heard[0]["cells"]] == [
        "refused",
        "suspicious",
        "todo",
        "skipped",
    ]


def test_a_record_that_the_service_refused_is_shown_as_refused(planned):
    judged(planned, TARGETS[0], "accepted")
    planned.add(Rejected(0, Said("refused", "No.", {})))
    listener = Listener()
    reported(planned, listener, 1)
    assert listener.heard[0]["cells"][0]["state"] == "refused"


def test_events_are_told_until_the_service_has_them(planned):
    planned.note("warning", Message("late", "The clock is %(late)d s late.", {"late": 3}))
    judged(planned, TARGETS[0], "refused", "spike", "gap")
    listener = Listener([{"commands": [], "events_seen": seen} for seen in (0, 2, 3)])
    reported(planned, listener, 4)
    assert [[item["number"] for item in said["events"]] for said in listener.heard] == [
        [1, 2, 3],
        [1, 2, 3],
        [3],
        [],
    ]
    first, second = listener.heard[0]["events"][:2]
    assert (first["message"], first["template"]) == (
        "The clock is 3 s late.",
        "The clock is %(late)d s late.",
    )
    assert (first["theta_deg"], first["values"]) == (None, {"late": 3})
    assert (second["code"], second["level"], second["theta_deg"]) == ("spike", "error", 0.0)


def test_a_command_is_handed_over_once_and_its_outcome_told_while_it_is_asked(planned):
    asked = {"id": 3, "kind": "retake", "theta_deg": 0.0, "psi_deg": 180.0}
    open_ones = [{"commands": commands, "events_seen": 0} for commands in ([asked], [asked], [asked], [])]
    listener, controls = Listener(open_ones), Controls()
    reporter = Reporter("S1-PC", planned, Live(), controls, lambda: listener)
    reporter._report(listener)
    reporter._report(listener)
    assert controls.take() == Command(3, "retake", Place(0.0, 180.0))
    assert controls.take() is None
    planned.add(Commanded(3, "retake", "done", Said("retaken", "Asked for anew.", {}), TARGETS[1]))
    for _ in range(3):
        reporter._report(listener)
    assert [[item["id"] for item in said["done"]] for said in listener.heard] == [[], [], [3], [3], []]


def test_a_command_from_the_keyboard_is_not_told(planned):
    planned.add(Commanded(-12, "resume", "done", Said("resumed", "Goes on.", {})))
    listener = Listener()
    reported(planned, listener, 1)
    assert listener.heard[0]["done"] == []


def test_numbers_of_reports_grow_also_when_the_program_starts_again(planned):
    listener = Listener()
    reported(planned, listener, 3)
    planned.add(Resumed())
    reported(planned, listener, 2)
    numbers = [said["sequence"] for said in listener.heard]
    assert numbers == sorted(set(numbers))


def test_a_service_that_is_away_or_refuses_stops_nobody_and_is_told_once(planned):
    away = Unreachable(problem("unreachable", "The service does not answer."))
    refused = ServerRefused(problem("refused", "Another run reports in this session."), 409)
    reported(planned, Listener([away, refused, refused, {"commands": [], "events_seen": 0}]), 4)
    assert [event.said.text for event in planned.history.events] == ["Another run reports in this session."]


def test_it_reports_once_more_at_the_end(planned, monkeypatch):
    monkeypatch.setattr(reporting, "INTERVAL_S", 3600.0)
    listener, live = Listener(), Live()
    reporter = Reporter("S1-PC", planned, live, Controls(), lambda: listener)
    reporter.start()
    live.turn_to("finished")
    reporter.stop()
    assert [said["phase"] for said in listener.heard] == ["finished"]
    assert reporter.failed is None


def test_what_fails_in_the_thread_is_kept_for_the_cycle(planned, monkeypatch):
    monkeypatch.setattr(reporting, "INTERVAL_S", 0.001)
    listener = Listener([{"nonsense": 1}])
    reporter = Reporter("S1-PC", planned, Live(), Controls(), lambda: listener)
    reporter.start()
    deadline = time.monotonic() + 10
    while reporter.failed is None:
        assert time.monotonic() < deadline
        threading.Event().wait(0.001)
    assert isinstance(reporter.failed, KeyError)
    reporter.stop()
