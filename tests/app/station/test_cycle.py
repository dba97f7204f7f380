"""The automated cycle on instruments that obey at once."""

import io

import numpy as np
import pyarrow.parquet as pq
import pytest
from unreal import PLACES, Room, objection, true_record

from app.station.keeping.entries import Target

CLOSING = Target(*PLACES[0], repeat=1)


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path / "spool")


def samples(content: bytes) -> np.ndarray:
    table = pq.read_table(io.BytesIO(content))
    return np.array([table[name].to_numpy() for name in ("t_s", "jx_ma", "jy_ma")])


def test_every_position_is_measured_once_and_the_first_again(room):
    history = room.run()
    assert room.ammeter.starts == [*((place, 0) for place in PLACES), (PLACES[0], 1)]
    assert list(room.service.records) == [*(Target(*place) for place in PLACES), CLOSING]
    for target, contents in room.service.records.items():
        assert len(contents) == 1
        np.testing.assert_array_equal(samples(contents[0]), true_record(target.place, target.repeat))
    assert history.result == "/api/v1/calibrations/7"
    assert history.finished.reasons == ()


def test_what_fails_a_check_once_is_measured_again_and_told(room):
    target = Target(*PLACES[1])
    room.judge.objections[target, 0] = objection("spike")
    history = room.run()
    assert [attempt.verdict for attempt in history.takes(target)] == ["refused", "accepted"]
    np.testing.assert_array_equal(samples(room.service.records[target][0]), true_record(PLACES[1], 1))
    assert [event.said.code for event in history.events] == ["spike"]
    assert history.result is not None
    # Between the takes the stand went elsewhere, so that the second is indexed anew.
    assert room.stand.moves[2:5] == [PLACES[1], PLACES[0], PLACES[1]]


def test_what_fails_twice_is_refused_by_name_and_nothing_is_computed(room):
    target = Target(*PLACES[1])
    room.judge.objections |= {(target, take): objection("stuck") for take in range(9)}
    history = room.run()
    assert len(history.takes(target)) == 2
    assert target not in room.service.records
    assert room.service.jobs == 0
    assert history.result is None
    assert [reason.text for reason in history.finished.reasons] == [
        "0/180 is not in the session: There is a stuck."
    ]
    assert [(event.level, event.said.code) for event in history.events[-1:]] == [
        ("error", "position-missing")
    ]


def test_a_calibration_without_the_refused_one_is_asked_for_when_told(room):
    target = Target(*PLACES[1])
    room.judge.objections |= {(target, take): objection("stuck") for take in range(9)}
    room.options["leave_out"] = True
    history = room.run()
    assert history.result is not None
    assert len(history.finished.reasons) == 1


def test_partners_that_disagree_are_both_measured_again(room):
    pair = PLACES[:2]
    room.judge.odd_until[pair] = 2
    history = room.run()
    assert [len(history.takes(Target(*place))) for place in PLACES] == [2, 2, 1]
    assert [event.said.code for event in history.events] == ["partner", "partner"]
    assert history.result is not None
    # The first position's later take is what the closing record is compared with.
    assert history.attempts[-1].target == CLOSING


def test_partners_that_disagree_for_good_are_refused(room):
    pair = PLACES[:2]
    room.judge.odd_until[pair] = 9
    history = room.run()
    assert [len(history.takes(Target(*place))) for place in PLACES] == [2, 2, 1]
    assert room.service.jobs == 0
    named = [reason.text for reason in history.finished.reasons]
    assert named == [f"{place} is not in the session: They disagree." for place in ("0/0", "0/180")]


def test_a_suspicious_take_is_sent_when_the_next_is_no_better(room):
    target = Target(*PLACES[2])
    noise = objection("noise")._replace(verdict="suspicious")
    room.judge.objections |= {(target, take): noise for take in range(9)}
    history = room.run()
    np.testing.assert_array_equal(samples(room.service.records[target][0]), true_record(PLACES[2], 1))
    assert history.result is not None
    # It is used, and said to be suspicious to the end.
    assert [event.said.code for event in history.events] == ["noise", "noise", "position-suspicious"]
    assert [reason.text for reason in history.finished.reasons] == ["90/0 is suspicious: There is a noise."]


def test_positions_of_which_nothing_would_show_a_mistake_are_named_when_there_is_a_result(room):
    room.judge.alone = PLACES[:2]
    history = room.run()
    (reason,) = history.finished.reasons
    assert reason.code == "position-unseen"
    assert reason.values == {"places": "0/0, 0/180"}
    assert [(event.level, event.said) for event in history.events] == [("warning", reason)]
