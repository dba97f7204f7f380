"""Files of a folder or a ZIP archive: names that lead out, sizes that lie, members that are damaged."""

import io
import os
import stat
import zipfile
from pathlib import Path

import pytest

from app.errors import Invalid
from app.exchange.archive import FolderFiles, ZipFiles, is_safe, save
from app.exchange.items import read_item
from app.exchange.session_folder import read_session


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("a.csv", True), ("x/y/a.csv", True), ("x/./a.csv", True), ("", False), ("/etc/passwd", False), ("../a", False),
        ("x/../../a", False), ("C:\\a", False), ("\\\\host\\a", False), ("a\0b", False), ("a\nb", False),
    ],
)  # fmt: skip
def test_names_that_stay_in_their_folder(name: str, safe: bool) -> None:
    assert is_safe(name) == safe


def zipped(*members: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return stream.getvalue()


def link(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    return info


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (zipped(("../theta000_psi000.csv", b"x")), "unsafe-name"),
        (zipped(("/theta000_psi000.csv", b"x")), "unsafe-name"),
        (zipped((link("theta000_psi000.csv"), b"/etc/passwd")), "unsafe-name"),
        (zipped(("a.csv", b"x"))[:-30], "damaged"),
        (b"PK\x03\x04 and nothing more", "damaged"),
        (zipped(*((f"{i}.csv", b"") for i in range(10_001))), "too-many-files"),
    ],
    ids=["way out", "absolute", "link", "cut", "no archive", "many"],
)
def test_a_malicious_or_broken_archive_is_refused(data: bytes, code: str) -> None:
    with pytest.raises(Invalid) as caught:
        read_item(data, "session.zip")
    assert (caught.value.problems[0].message.code, caught.value.problems[0].file) == (code, "session.zip")


def test_an_archive_that_claims_too_much_is_refused_unread() -> None:
    honest = zipped(("theta000_psi000.csv", b"x" * 1000))
    # Size when unpacked, in the central directory: 1000 becomes 2 GiB.
    lying = honest.replace((1000).to_bytes(4, "little"), (2**31).to_bytes(4, "little"))
    with pytest.raises(Invalid) as caught:
        ZipFiles(lying, "bomb.zip")
    assert caught.value.problems[0].message.code == "too-big"


def test_a_member_that_unpacks_to_more_than_it_says_is_damaged() -> None:
    honest = zipped(("theta000_psi000.csv", b"0" * 10**6))
    lying = honest.replace((10**6).to_bytes(4, "little"), (1000).to_bytes(4, "little"))
    with pytest.raises(Invalid) as caught:
        read_session(ZipFiles(lying, "bomb.zip"))
    assert caught.value.problems[0].message.code == "damaged"


def test_an_encrypted_member_is_refused() -> None:
    data = bytearray(zipped(("means.csv", b"x")))
    data[data.index(b"PK\x01\x02") + 8] |= 1
    with pytest.raises(Invalid) as caught:
        ZipFiles(bytes(data), "s.zip")
    assert caught.value.problems[0].message.code == "encrypted"


def test_a_folders_links_out_of_it_and_hidden_files_are_not_read(tmp_path: Path) -> None:
    outside = tmp_path / "secret.csv"
    outside.write_text("x")
    folder = tmp_path / "session"
    save({"means.csv": b"m", ".hidden/a.csv": b"h", ".b.csv": b"h", "sub/c.csv": b"c"}, folder)
    (folder / "theta000_psi000.csv").symlink_to(outside)
    (folder / "loop").symlink_to(folder)
    os.mkfifo(folder / "pipe.csv")
    assert sorted(FolderFiles(folder)) == ["means.csv", "sub/c.csv"]
    with pytest.raises(KeyError):
        FolderFiles(folder)["../secret.csv"]


def test_save_does_not_leave_its_folder(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="stay in its folder"):
        save({"../x": b""}, tmp_path / "session")
    assert not (tmp_path / "x").exists()
