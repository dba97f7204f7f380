"""Record files: named by their bytes, whole or not there."""

import hashlib
import os
from pathlib import Path

import pytest

from app.store.records import RecordFiles


@pytest.fixture
def files(tmp_path: Path) -> RecordFiles:
    (tmp_path / "records").mkdir()
    return RecordFiles(tmp_path / "records")


def test_the_name_is_the_sha256_of_the_bytes(files):
    digest = files.put(b"abc", "csv")
    # FIPS 180-2, appendix B.1: SHA-256 of "abc".
    assert digest == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert files.read(digest, "csv") == b"abc"
    assert list(files) == [(digest, files.path(digest, "csv"))]


def test_the_same_bytes_are_kept_once(files):
    digest = files.put(b"abc", "csv")
    written = files.path(digest, "csv").stat().st_mtime_ns
    assert files.put(b"abc", "csv") == digest
    assert files.path(digest, "csv").stat().st_mtime_ns == written


def test_altered_bytes_are_not_given_out(files):
    digest = files.put(b"abc", "csv")
    files.path(digest, "csv").write_bytes(b"abd")
    with pytest.raises(OSError, match="does not hold the bytes of its name"):
        files.read(digest, "csv")


def test_a_write_that_fails_leaves_nothing(files, monkeypatch):
    def full(_handle: int) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space"):
        files.put(b"abc", "csv")
    assert [path for path in files.folder.rglob("*") if path.is_file()] == []


def test_bytes_are_synced_before_they_get_their_name(files, monkeypatch):
    events: list[str] = []
    sync, replace = os.fsync, Path.replace
    monkeypatch.setattr(os, "fsync", lambda handle: (events.append("sync"), sync(handle))[1])
    monkeypatch.setattr(Path, "replace", lambda self, to: (events.append("name"), replace(self, to))[1])
    files.put(b"abc", "csv")
    assert events[:2] == ["sync", "name"]
    assert "sync" in events[2:], "the folder is synced too, or the name may be lost"


def test_a_long_record_is_named_rightly(files):
    content = bytes(range(256)) * 4096
    assert files.put(content, "parquet") == hashlib.sha256(content).hexdigest()
