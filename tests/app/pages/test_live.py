"""The live page of a session: what it says of the run, what may be asked there, how it follows."""

import html
import json
import queue
import re
import threading
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.i18n import speaking
from app.pages import live as live_page
from app.pages import live_view
from app.pages.live_map import Numbers, live_map
from app.services import access, live, sessions
from app.services.lab import Lab
from app.services.live_views import Answered, CellState, Report, RunEvent, RunView, Sentence, Spot

GRID = [(theta, psi) for theta in (0.0, 90.0, 180.0, 270.0) for psi in (0.0, 90.0, 180.0, 270.0)]
AT = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)
HERE = Spot(180.0, 180.0, 0, 0)


def cells(running: int = 10, **others: str) -> tuple[CellState, ...]:
    """States of all sixteen: recorded up to the one that runs; `p3="skipped"` changes the third."""
    states = (["recorded"] * running + ["running"] + ["todo"] * 15)[: len(GRID)]
    for name, state in others.items():
        states[int(name[1:]) - 1] = state
    return tuple(CellState(*place, 0, state) for place, state in zip(GRID, states, strict=True))


START = Report("S1-PC", "run-a", 1, AT, "acquiring", HERE, -7.41e-4, 4.4946e-3, True, 0.25, 605.0, 2, cells())


def tell(lab: Lab, session_id: int, *reports: Report, at: datetime | None = None) -> None:
    """Take reports, by default as of an hour from now: they are fresh however slow the test is."""
    for report in reports:
        with lab.write(access.SYSTEM) as work:
            work.now = at or work.now + timedelta(hours=1)
            live.report(work, session_id, report)


def run_of(lab: Lab, session_id: int) -> RunView:
    with lab.read(access.SYSTEM) as work:
        return live.run(work, session_id)


def words(text: str) -> str:
    """What stands in the page's main part."""
    main = text[text.index("<main") :] if "<main" in text else text
    return re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", " ", main)))


def event(number: int, level: str = "warning", **said: Any) -> RunEvent:
    sentence = Sentence(**({"message": "The record has a spike."} | said))
    return RunEvent(number, AT, level, "spike", sentence, 90.0, 180.0)


@pytest.fixture
def path(opened: int) -> str:
    return f"/sessions/{opened}/live"


def test_before_the_first_report_the_page_says_how_it_begins(technician: TestClient, path: str) -> None:
    page = technician.get(path)
    assert page.status_code == 200
    assert "No station measures session" in page.text
    assert "driftbook station run --gyro 0417 --stand S1" in page.text
    assert 'hx-trigger="every 3s" hx-select="#live"' in page.text
    assert "sse-connect" not in page.text


def test_the_page_says_where_the_run_is(technician: TestClient, stocked: Lab, opened: int, path: str) -> None:
    tell(stocked, opened, START)
    text = technician.get(path).text
    page = words(text)
    assert "<h1>Position 11 of 16</h1>" in text
    assert '<span class="mark ok">Settled</span> <span class="muted">recording</span>' in text
    assert "−0.7410 µA" in page  # currents in µA
    assert "4.4946 µA" in page
    assert "10:05" in page  # time left
    assert "Record 25 % · Recorded 10 of 16 · Still on the station’s disk 2" in page
    assert '<progress max="1" value="0.25"' in text
    assert "Live, updated 0 s ago" in page
    assert 'data-beat="5"' in text
    assert '<noscript><meta http-equiv="refresh" content="5"></noscript>' in text


def test_every_state_of_a_cell_is_word_and_shape(
    technician: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    states = {
        "p1": "suspicious",
        "p2": "refused",
        "p3": "skipped",
        "p4": "moving",
        "p5": "settling",
        "p6": "warming",
    }
    tell(stocked, opened, replace(START, cells=cells(**states)))
    text = technician.get(path).text
    shown = re.findall(r'class="cell (\w+)(?: here)?"[^>]*><span class="n">(\d+)</span><span class="dot"></span>'
                       r'<span class="w">([^<]+)', text)  # fmt: skip
    assert [(shape, word) for shape, _, word in shown[:11]] == [
        ("attention", "suspicious"), ("out", "refused"), ("excluded", "skipped"), ("running", "moving"),
        ("running", "settling"), ("warming", "warming up"), *[("ok", "recorded")] * 4, ("running", "recording"),
    ]  # fmt: skip
    assert [(shape, word) for shape, _, word in shown[11:]] == [("todo", "to do")] * 5
    assert re.search(r'class="cell running here" aria-current="step"><span class="n">11<', text)
    assert len(re.findall('aria-current="step"', text)) == 1


def test_a_repeat_stands_in_its_positions_cell(stocked: Lab, opened: int) -> None:
    closing = CellState(0.0, 0.0, 1, "todo")
    with stocked.read(access.SYSTEM) as work:
        numbers = Numbers(sessions.detail(work, opened).positions)
    for state, word, shape in (("todo", "1 of 2", "ok"), ("moving", "moving", "running"),
                               ("refused", "refused", "out"), ("recorded", "recorded", "ok")):  # fmt: skip
        sent = replace(START, run=f"run-{state}", cells=(*cells(), closing._replace(state=state)))
        tell(stocked, opened, sent)
        found = live_map(run_of(stocked, opened), numbers)
        first = found.rows[0][1][0]
        assert first is not None
        assert (first.word, first.shape, found.total) == (word, shape, 16)


def test_any_grid_is_a_map(stocked: Lab, opened: int) -> None:
    places = [(0.0, 0.0), (0.0, 45.0), (-90.0, 45.0)]
    tell(stocked, opened, replace(START, cells=tuple(CellState(*place, 0, "todo") for place in places)))
    with stocked.read(access.SYSTEM) as work:
        numbers = Numbers(sessions.detail(work, opened).positions)
    found = live_map(run_of(stocked, opened), numbers)
    assert found.psi_deg == (0.0, 45.0)
    shown = [[cell and cell.number for cell in row] for _, row in found.rows]
    assert shown == [[None, 17], [1, 18]]  # certified: as the session counts; others follow
    assert numbers.of(-90.0, 90.0) == 14  # a turn further it is θ 270°, ψ 90°


def test_silence_shows(technician: TestClient, stocked: Lab, opened: int, path: str) -> None:
    tell(stocked, opened, START, at=datetime.now(UTC) - timedelta(seconds=42))
    text = technician.get(path).text
    assert '<span class="mark lost">No word from the station</span>' in text
    assert re.search(r"no word since \d\d:\d\d:\d\d, (4[2-9]|5\d) s ago", text)  # however slow the test is
    assert "What it measures stays on its own disk." in words(text)
    assert 'class="readout old"' in text
    assert "No word" in technician.get("/").text  # in the navigation


def test_a_run_that_has_ended_leads_on(
    technician: TestClient, stocked: Lab, measured: int, solving: Any
) -> None:
    page = f"/sessions/{measured}/live"
    for phase, said in (("stopped", "The run was stopped."), ("failed", "The run ended before its time.")):
        tell(stocked, measured, replace(START, run=phase, phase=phase, waiting=1))
        text = technician.get(page).text
        assert said in text
        assert f'class="btn primary big" id="live-next" href="/sessions/{measured}"' in text
        assert "1 record is still on the station’s disk" in text
        assert "sse-connect" in text  # it may be taken up again
        assert "recording" not in words(text)  # nothing goes on where it was
        assert 'name="kind"' not in text.replace('type="hidden" name="kind"', "")
    result = solving(stocked, measured)
    tell(stocked, measured, replace(START, run="b", phase="finished", waiting=0))
    text = technician.get(page).text
    assert f'class="btn primary big" id="live-next" href="/results/{result}"' in text
    assert "Every record is in, and the currents are solved." in text
    assert "sse-connect" not in text
    assert "http-equiv" not in text


def test_a_run_whose_records_were_refused_is_not_complete(
    technician: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    ended = replace(START, phase="finished", position=None, waiting=0)
    tell(
        stocked, opened, replace(ended, cells=cells(running=16, p2="refused", p5="refused", p7="suspicious"))
    )
    text = words(technician.get(path).text)
    assert "No calibration was asked for: 2 records were refused. The log names why of each." in text
    assert "Finished without a calibration" in text
    assert "1 record is suspicious: the log names why" in text
    assert "Every record is in" not in text


def test_a_result_without_refused_records_says_so(
    technician: TestClient, stocked: Lab, measured: int, solving: Any
) -> None:
    solving(stocked, measured)
    ended = replace(START, phase="finished", position=None, waiting=0)
    tell(stocked, measured, replace(ended, cells=cells(running=16, p2="refused")))
    text = words(technician.get(f"/sessions/{measured}/live").text)
    assert "The currents are solved without 1 record that was refused." in text
    assert "Every record is in" not in text
    assert "Finished without" not in text


def test_a_paused_run_is_resumed(technician: TestClient, stocked: Lab, opened: int, path: str) -> None:
    tell(stocked, opened, START)
    assert 'value="pause"' in technician.get(path).text
    tell(stocked, opened, replace(START, sequence=2, phase="paused"))
    text = technician.get(path).text
    assert '<span class="mark due">Paused</span>' in text
    assert 'class="btn big primary" id="live-next" name="kind" value="resume"' in text
    assert 'value="pause"' not in text


def test_a_command_works_without_script(technician: TestClient, stocked: Lab, opened: int, path: str) -> None:
    tell(stocked, opened, START)
    answer = technician.post(f"{path}/commands", data={"kind": "retake", "cell": "0.0/90.0"})
    assert (answer.status_code, answer.headers["location"]) == (303, path)
    (asked,) = run_of(stocked, opened).commands
    assert (asked.kind, asked.theta_deg, asked.psi_deg, asked.asked_by) == ("retake", 0.0, 90.0, "irina")
    page = words(technician.get(path).text)
    assert "Take position 2 again waiting for the station irina" in page
    assert "2 to retake" in page
    done = Answered(asked.id, "refused", Sentence("The stand is locked."))
    tell(stocked, opened, replace(START, sequence=2, done=(done,)))
    assert "refused by the station The stand is locked." in words(technician.get(path).text)


def test_with_htmx_the_answer_is_nothing_or_the_reason(
    technician: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    tell(stocked, opened, START)
    with_htmx = {"hx-request": "true"}
    answer = technician.post(f"{path}/commands", data={"kind": "skip"}, headers=with_htmx)
    assert (answer.status_code, answer.text) == (200, "")
    tell(stocked, opened, replace(START, sequence=2, phase="finished"))
    refused = technician.post(f"{path}/commands", data={"kind": "stop"}, headers=with_htmx)
    assert refused.status_code == 409
    assert "has ended" in refused.text
    assert "<html" not in refused.text
    whole = technician.post(f"{path}/commands", data={"kind": "stop"})
    assert whole.status_code == 409
    assert "has ended" in whole.text
    assert "<h1>" in whole.text


@pytest.mark.parametrize(
    "sent",
    [{}, {"kind": "dance"}, {"kind": "retake"}, {"kind": "retake", "cell": "a/b"}, {"kind": "retake", "cell": "nan/0"},
     {"kind": "retake", "cell": "45.0/0.0"}, {"kind": "pause", "cell": "0.0/0.0"}],
)  # fmt: skip
def test_what_no_button_sends_is_refused(
    technician: TestClient, stocked: Lab, opened: int, path: str, sent: dict[str, str]
) -> None:
    tell(stocked, opened, START)
    assert technician.post(f"{path}/commands", data=sent).status_code == 422
    assert run_of(stocked, opened).commands == ()


def test_whoever_may_only_read_sees_and_asks_nothing(
    designer: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    tell(stocked, opened, START)
    text = designer.get(path).text
    assert "<h1>Position 11 of 16</h1>" in text
    assert "<button" not in text[text.index("<main") :]
    assert designer.post(f"{path}/commands", data={"kind": "stop"}).status_code == 403
    assert run_of(stocked, opened).commands == ()


def test_who_is_not_signed_in_sees_nothing(
    anonymous: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    tell(stocked, opened, START)
    for address in (path, f"{path}/events", f"{path}.csv"):
        assert anonymous.get(address).status_code == 303
    assert anonymous.post(f"{path}/commands", data={"kind": "stop"}).status_code == 303
    assert run_of(stocked, opened).commands == ()


def test_unknown_sessions_are_not_there(technician: TestClient, stocked: Lab, opened: int) -> None:
    for address in ("/sessions/99/live", "/sessions/99/live/events", "/sessions/99/live.csv",
                    f"/sessions/{opened}/live.csv"):  # fmt: skip
        assert technician.get(address).status_code == 404


def test_the_log_is_newest_first_and_the_last_warning_stands_out(
    technician: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    found = (
        event(1, message="First."),
        event(2, "error", message="Second."),
        event(3, "info", message="Third."),
    )
    tell(stocked, opened, replace(START, events=found))
    text = technician.get(path).text
    log = text[text.index('class="table lines stack log"') :]
    assert re.findall(r'class="what nl">(\w+)\.', log) == ["Third", "Second", "First"]
    assert re.findall(r'class="mark (\w+)">(\w+)</span></td>', log) == [
        ("ok", "Note"), ("out", "Error"), ("attention", "Warning")
    ]  # fmt: skip
    notice = words(text[text.index('class="notice bad last"') :])
    assert "Position 7" in notice[:60]
    assert "Second." in notice[:120]


def test_the_scatter_is_stated_once_it_is_known(
    technician: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    for number in range(6):
        assert "scatter not known yet" in words(technician.get(path).text) or number == 0
        tell(
            stocked,
            opened,
            replace(START, sequence=number + 1, jx_ma=1e-3 * (-0.741 + 0.001 * (-1) ** number)),
        )
    # Six readings of −0.741 ± 0.001 µA in turn: s = 0.001·√(6/5) = 0.001095, and 2 s is shown to two digits.
    assert "± 0.0022, 2 s.d. of a reading" in words(technician.get(path).text)


def test_readings_come_as_a_file(technician: TestClient, stocked: Lab, opened: int, path: str) -> None:
    tell(stocked, opened, START, replace(START, sequence=2, jx_ma=1e-3, settled=None))
    lines = technician.get(f"{path}.csv").text.splitlines()
    assert lines[0] == "at,jx_ma,jy_ma,settled"
    assert [line.split(",")[1:] for line in lines[1:]] == [
        ["-0.000741", "0.0044946", "True"], ["0.001", "0.0044946", ""]
    ]  # fmt: skip
    assert [row["jx_ma"] for row in technician.get(f"{path}.json").json()] == [-7.41e-4, 1e-3]


TEMPLATE = "There is no session %(number)d."  # any text of the catalogue with a number
RUSSIAN = "Сеанса 7 нет."


def test_what_the_station_says_is_translated_where_it_can_be() -> None:
    known = Sentence("There is no session 7.", TEMPLATE, {"number": 7})
    assert live_view.sentence(known) == "There is no session 7."
    with speaking("ru"):
        assert live_view.sentence(known) == RUSSIAN
        assert live_view.sentence(known._replace(template=None)) == known.message
        for values in (None, {}, {"number": "seven"}):
            assert live_view.sentence(known._replace(values=values)) == known.message
        wide = Sentence("Wide.", "%(number)9999999999d", {"number": 7})  # would fill the memory
        assert live_view.sentence(wide) == "Wide."


def _events(text: str) -> list[tuple[str, str]]:
    found = []
    for block in text.replace("\r\n", "\n").split("\n\n"):
        lines = block.split("\n")
        name = next((line[7:] for line in lines if line.startswith("event: ")), None)
        if name:
            found.append((name, "\n".join(line[5:].strip() for line in lines if line.startswith("data:"))))
    return found


@pytest.fixture
def seen_phase(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Waits until the stream of events has seen the run in a phase."""
    looks: queue.Queue[str] = queue.Queue()
    look = live_page.look

    def noted(*arguments: Any) -> Any:
        seen = look(*arguments)
        looks.put(seen.run.phase if seen else "")
        return seen

    def wait(phase: str) -> None:
        while looks.get(timeout=30) != phase:
            pass

    monkeypatch.setattr(live_page, "look", noted)
    return wait


def test_the_page_follows_the_run_to_its_end(
    technician: TestClient, stocked: Lab, opened: int, path: str, seen_phase: Callable[[str], None]
) -> None:
    tell(stocked, opened, replace(START, phase="settling", settled=False))

    def go_on() -> None:
        seen_phase("settling")
        tell(stocked, opened, replace(START, sequence=2, events=(event(1),)))
        seen_phase(START.phase)
        tell(stocked, opened, replace(START, sequence=3, phase="finished", position=None))

    worker = threading.Thread(target=go_on)
    worker.start()
    answer = technician.get(f"{path}/events", headers={"accept-language": "ru"})
    worker.join()
    assert answer.headers["content-type"].startswith("text/event-stream")
    found = _events(answer.text)
    told = {name: [text for key, text in found if key == name] for name, _ in found}
    assert told["said"] == ["Успокоение", "Установилось", "Завершено"]
    assert "Положение 11 из 16" in told["state"][0]
    assert ["spike" in text for text in told["log"]] == [False, True]
    assert len(told["map"]) == 2  # as it was, and when nobody can ask any more
    assert len(told["chart-x"]) >= 2
    assert json.loads(told["chart-x"][-1])["params"]["blank"] is False
    assert found[-1][0] == "end"


def test_a_stopped_run_is_followed_on(
    technician: TestClient, stocked: Lab, opened: int, path: str, seen_phase: Callable[[str], None]
) -> None:
    tell(stocked, opened, replace(START, phase="stopped"))

    def go_on() -> None:
        seen_phase("stopped")
        tell(stocked, opened, replace(START, run="run-b"))
        seen_phase(START.phase)
        tell(stocked, opened, replace(START, run="run-b", sequence=2, phase="finished"))

    worker = threading.Thread(target=go_on)
    worker.start()
    found = _events(technician.get(f"{path}/events").text)
    worker.join()
    assert [text for name, text in found if name == "said"] == ["Stopped", "Settled", "Finished"]


def test_other_pages_lead_to_the_run(technician: TestClient, stocked: Lab, opened: int, path: str) -> None:
    assert path not in technician.get("/").text
    tell(stocked, opened, START)
    today = technician.get("/").text
    assert "<h1>Position 11 of 16</h1>" in today
    assert f'class="btn primary big" href="{path}">Watch the run' in today
    assert f'sse-connect="{path}/events"' in today
    assert f'<a href="{path}">Watch</a>' in today
    assert "0 of 16, settled" in words(today) or "0 of 16, settled" in today  # the stand in the navigation
    assert f'<a href="{path}">Watch</a>' in technician.get("/sessions").text
    session = technician.get(f"/sessions/{opened}").text
    assert f'class="btn primary" href="{path}">Watch the run' in session
    tell(stocked, opened, replace(START, sequence=2, phase="failed"))
    session = technician.get(f"/sessions/{opened}").text
    assert f'class="btn" href="{path}">The station’s run' in session
    assert "sse-connect" not in technician.get("/").text


def test_a_station_says_nothing_that_a_page_would_run(
    technician: TestClient, stocked: Lab, opened: int, path: str
) -> None:
    bad = "<script>alert(1)</script>"
    tell(stocked, opened, replace(START, station=bad, events=(event(1, message=bad),)))
    text = technician.get(path).text
    assert bad not in text
    assert html.escape(bad) in text
