"""The station's program, killed at every single write to its disk: the records are those of an undisturbed run.

A kill is an exception that nothing catches, raised before a write, in the middle of it or after it; from then on
nothing else is written. What the write is (a line of the journal, a block of samples, a record file) does not matter
to the test: all of them are counted.
"""

import io
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from unreal import PLACES, Room, objection

from app.station import finishing
from app.station.keeping import durable
from app.station.keeping.durable import SpoolFailed
from app.station.keeping.entries import Target

SPIKED, DISAGREEING = Target(*PLACES[2]), (PLACES[0], PLACES[1])


class Killed(BaseException):
    pass


class Power:
    """Counts the writes to the disk and fails at one of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.writes = 0
        self.fails_at: int | None = None
        self.how = "before"
        self._append, self._write = durable.append, durable.write_whole
        monkeypatch.setattr(durable, "append", self._appending)
        monkeypatch.setattr(durable, "write_whole", self._writing)

    def on(self, fails_at: int | None, how: str = "before") -> None:
        self.writes, self.fails_at, self.how = 0, fails_at, how

    def _appending(self, stream: io.BufferedWriter, data: bytes) -> None:
        if not self._fails():
            self._append(stream, data)
            return
        if self.writes == self.fails_at:
            length = {"before": 0, "half": len(data) // 2, "after": len(data)}[self.how]
            self._append(stream, data[:length])
        raise Killed

    def _writing(self, path: Path, data: bytes) -> None:
        if not self._fails():
            self._write(path, data)
            return
        if self.writes == self.fails_at:
            if self.how == "half":
                path.with_name(path.name + ".new").write_bytes(data[: len(data) // 2])
            elif self.how == "after":
                self._write(path, data)
        raise Killed

    def _fails(self) -> bool:
        self.writes += 1
        return self.fails_at is not None and self.writes >= self.fails_at


@pytest.fixture
def power(monkeypatch, no_sync):
    monkeypatch.setattr(finishing, "_POLL_S", 0.001)
    return Power(monkeypatch)


def troubled(folder: Path) -> Room:
    """A cycle in which a take fails a check and two partners disagree once, so that every kind of line is there."""
    room = Room(folder)
    room.judge.objections[SPIKED, 0] = objection("spike")
    room.judge.odd_until[DISAGREEING] = 2
    return room


def until_finished(
    room: Room, power: Power, kills: list[tuple[int, str]], *, ammeter_too: bool = False
) -> int:
    """Lives of the program, each but the last killed; how many there were."""
    for number, (fails_at, how) in enumerate(kills):
        power.on(fails_at, how)
        try:
            room.run()
        except (Killed, SpoolFailed):  # the latter where another thread was the one that was killed
            if ammeter_too:
                room.ammeter.forget()
            continue
        return number + 1
    power.on(None)
    room.run()
    return len(kills) + 1


def records(room: Room) -> dict[Target, list[np.ndarray]]:
    found = {}
    for target, contents in room.service.records.items():
        tables = [pq.read_table(io.BytesIO(content)) for content in contents]
        found[target] = [np.array([table[name] for name in ("t_s", "jx_ma", "jy_ma")]) for table in tables]
    return found


def assert_same(room: Room, undisturbed: Room) -> None:
    """Sample for sample, nothing lost or doubled.

    A take that its partner made doubtful may have been sent before that or not; the one that counts is the last.
    """
    found, expected = records(room), records(undisturbed)
    assert set(found) == set(expected)
    for target in expected:
        np.testing.assert_array_equal(found[target][-1], expected[target][-1])
        takes = 2 if target.place in DISAGREEING and not target.repeat else 1
        assert len(found[target]) <= takes, "something was doubled"
    assert len(room.service.sessions) == 1
    assert len(room.service.solved) == 1


@pytest.fixture
def undisturbed(tmp_path, power):
    room = troubled(tmp_path / "undisturbed")
    power.on(None)
    room.run()
    assert_same(room, room)
    return room, power.writes


@pytest.mark.parametrize("ammeter_too", [False, True], ids=["station", "station and ammeter"])
def test_a_kill_at_any_write_changes_no_record(tmp_path, power, undisturbed, ammeter_too):
    expected, writes = undisturbed
    assert writes > 60, "a cycle of so few writes proves little"
    for fails_at in range(1, writes + 1):
        how = ("before", "half", "after")[fails_at % 3]
        room = troubled(tmp_path / f"{fails_at}")
        assert until_finished(room, power, [(fails_at, how)], ammeter_too=ammeter_too) == 2
        assert_same(room, expected)


@pytest.mark.parametrize("apart", [4, 5, 7, 11])
def test_kills_one_after_the_other_change_no_record(tmp_path, power, undisturbed, apart):
    expected, writes = undisturbed
    kills = [(apart, ("before", "half", "after")[number % 3]) for number in range(writes)]
    room = troubled(tmp_path / "storm")
    assert until_finished(room, power, kills) > writes / apart
    assert_same(room, expected)
