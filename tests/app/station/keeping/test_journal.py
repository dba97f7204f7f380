"""The journal, cut off anywhere by a power failure."""

import errno
import io
import json
import zlib

import pytest

from app.station.keeping import durable
from app.station.keeping.durable import SpoolFailed
from app.station.keeping.journal import Journal, encoded

ENTRIES = [{"kind": "begun", "gyro": "ГВК-6 № 0417"}, {"kind": "sent", "attempt": 3, "jx_ma": 0.1 + 0.2}, {}]


pytestmark = pytest.mark.usefixtures("no_sync")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.jsonl"


def written(path, entries) -> None:
    journal = Journal(path)
    for entry in entries:
        journal.append(entry)
    journal.close()


def test_entries_come_back_in_order(path):
    written(path, ENTRIES)
    journal = Journal(path)
    assert journal.entries == ENTRIES
    journal.close()


def test_lines_are_json_with_their_crc(path):
    written(path, ENTRIES)
    for line, entry in zip(path.read_text("utf-8").splitlines(), ENTRIES, strict=True):
        said = json.loads(line)
        assert said["entry"] == entry
        assert said["crc"] == f"{zlib.crc32(json.dumps(entry, ensure_ascii=False).encode()):08x}"


def test_cut_off_after_any_byte_it_goes_on_after_the_last_whole_line(path):
    written(path, ENTRIES)
    content, ends = path.read_bytes(), [0]
    for entry in ENTRIES:
        ends.append(ends[-1] + len(encoded(entry)))
    for length in range(len(content) + 1):
        path.write_bytes(content[:length])
        whole = sum(length >= end for end in ends) - 1
        journal = Journal(path)
        assert journal.entries == ENTRIES[:whole]
        for entry in ENTRIES[whole:]:
            journal.append(entry)
        journal.close()
        assert path.read_bytes() == content


@pytest.mark.parametrize("tail", [b"\0" * 700, b"\n\n", b'{"crc": "00000000", "entry": {}}\n', b'{"crc'])
def test_whatever_a_power_cut_left_at_the_end_is_dropped(path, tail):
    written(path, ENTRIES)
    content = path.read_bytes()
    path.write_bytes(content + tail)
    journal = Journal(path)
    assert journal.entries == ENTRIES
    journal.close()
    assert path.read_bytes() == content


def test_a_damaged_line_before_good_ones_is_no_power_cut(path):
    written(path, ENTRIES)
    content = bytearray(path.read_bytes())
    content[len(encoded(ENTRIES[0])) + 40] ^= 1
    path.write_bytes(content)
    with pytest.raises(SpoolFailed, match="Line 2 of"):
        Journal(path)
    assert path.read_bytes() == content


def test_a_full_disk_is_told_and_nothing_is_written_after_it(path, monkeypatch):
    """A line that came to half of its bytes must stay the last one."""
    journal = Journal(path)
    journal.append(ENTRIES[0])

    def full(stream: io.BufferedWriter, data: bytes) -> None:
        with durable._plainly(path):
            stream.write(data[:9])
            stream.flush()
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(durable, "append", full)
        with pytest.raises(SpoolFailed, match=r"No space left on device.*nothing measured so far is lost"):
            journal.append(ENTRIES[1])
    with pytest.raises(SpoolFailed, match="No space left on device"):
        journal.append(ENTRIES[2])
    journal.close()
    again = Journal(path)
    assert again.entries == ENTRIES[:1]
    again.close()
