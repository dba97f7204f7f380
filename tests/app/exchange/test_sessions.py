"""Sessions as folders and ZIP archives: written, read, broken and malicious."""

import gzip
import io
import json
import zipfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from app.errors import Invalid
from app.exchange.archive import save, zip_bytes
from app.exchange.certificate import write_certificate_csv
from app.exchange.items import is_session, open_item, read_item
from app.exchange.means import write_means_csv
from app.exchange.records import means_row, write_record_csv, write_record_parquet
from app.exchange.rows import CertificateRow, CurrentRecord, Facts, MeansRow
from app.exchange.session_folder import SessionFiles, read_session
from app.exchange.session_writing import RecordFormat, session_files

T = np.arange(12000) / 200
PLACES = [(0.0, 0.0, 0), (0.0, 90.0, 0), (0.0, 90.0, 1)]


def record(theta: float, psi: float, repeat: int = 0) -> CurrentRecord:
    rng = np.random.default_rng([int(theta), int(psi), repeat])
    return CurrentRecord(
        theta, psi, T, rng.normal(0.004, 1e-5, len(T)), rng.normal(0.001, 1e-5, len(T)), repeat=repeat
    )


RECORDS = [record(*place) for place in PLACES]
CSVS = {name: write_record_csv(item) for name, item in zip("abc", RECORDS, strict=True)}
CERTIFICATE = [CertificateRow(0.0, psi, 1.0, 2.0, 3.0) for psi in (0.0, 90.0, 180.0)]
MEANS = [MeansRow(0.0, psi, 0.001, 0.002) for psi in (90.0, 180.0)]
FACTS = Facts(
    gyro="0417",
    stand="S1",
    latitude_deg=-33.9,
    started_at=datetime(2026, 3, 1, 9, 30, tzinfo=UTC),
    temperature_c=21.5,
    further={"operator": "Ж. Иванова"},
)
TRUTH = {
    "kx": 2062.65,
    "ky": 2041.0,
    "kxy": 10.3,
    "kyx": -8.25,
    "w0x": 1.5,
    "w0y": -0.8,
    "wg": 6.0,
    "wk": 2.0,
}
FILES = session_files(FACTS, records=RECORDS, means=MEANS, certificate=CERTIFICATE, truth=TRUTH)


def described(positions: object, **more: object) -> bytes:
    return json.dumps({"positions": positions, **more}).encode()


def first(files: dict[str, bytes]) -> tuple[str, str | None, int | None, str | None]:
    with pytest.raises(Invalid) as caught:
        read_session(files, "session")
    item = caught.value.problems[0]
    return item.message.code, item.file, item.row, item.column


def assert_whole(read: SessionFiles) -> None:
    assert replace(read.facts, certificate=None) == FACTS
    assert read.facts.certificate == "certificate.csv"
    assert [(r.theta_deg, r.psi_deg, r.repeat) for r in read.records] == PLACES
    for ours, theirs in zip(RECORDS, read.records, strict=True):
        assert theirs.jx_ma.tobytes() == ours.jx_ma.tobytes()
    assert list(read.certificate) == CERTIFICATE
    assert list(read.means) == MEANS
    assert read.truth == TRUTH
    assert list(read.warnings) == []


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_session_written_is_the_session_read(kind: RecordFormat, tmp_path: Path) -> None:
    files = session_files(
        FACTS,
        records=RECORDS,
        means=MEANS,
        certificate=CERTIFICATE,
        truth=TRUTH,
        record_format=kind,
    )
    assert f"theta000_psi090_repeat1.{kind}" in files
    save(files, tmp_path / "a" / "session")
    assert_whole(open_item(tmp_path / "a" / "session"))
    assert_whole(read_session(files))
    assert_whole(read_item(zip_bytes(files), "session.zip"))
    (tmp_path / "s.zip").write_bytes(zip_bytes({f"deep/{name}": data for name, data in files.items()}))
    assert_whole(open_item(tmp_path / "s.zip"))


def test_packing_twice_gives_the_same_bytes() -> None:
    assert zip_bytes(FILES) == zip_bytes(dict(reversed(FILES.items())))


def test_records_come_before_means_of_the_same_position() -> None:
    rows = read_session(FILES).measured()
    assert rows == [*map(means_row, RECORDS), MEANS[1]]


def test_without_a_description_files_are_known_by_name_and_columns() -> None:
    files = {
        "theta000_psi000.csv": CSVS["a"],
        "records/theta000_psi090.csv.gz": gzip.compress(CSVS["b"]),
        "records/theta000_psi090_repeat1.csv": CSVS["c"],
        "stand.csv": write_certificate_csv(CERTIFICATE),
        "by-hand.csv": write_means_csv(MEANS),
        "notes.csv": b"who,what\nme,nothing\n",
        "readme.md": b"hello",
    }
    read = read_session(files)
    assert sorted((r.theta_deg, r.psi_deg, r.repeat) for r in read.records) == PLACES
    assert list(read.certificate) == CERTIFICATE
    assert list(read.means) == MEANS
    (warning,) = read.warnings
    assert (warning.code, warning.values["files"]) == ("file-ignored", "notes.csv")


def test_a_long_record_is_known_by_its_columns() -> None:
    text = "theta_deg,psi_deg,t_s,jx_ma,jy_ma\n0,0,0,1,2\n0,0,1,2,3\n0,90,0,1,2\n0,90,1,2,3\n"
    assert len(read_session({"all.csv": text.encode()}).records) == 2


def test_listed_files_need_no_position_in_their_names_and_count_repeats_in_their_order() -> None:
    entries = [{"theta_deg": 0, "psi_deg": 90, "file": name} for name in ("b.csv", "c.csv")]
    entries.insert(0, {"theta_deg": 360, "psi_deg": 0, "file": "x/a.csv"})
    files = {
        "x/a.csv": CSVS["a"],
        "b.csv": CSVS["b"],
        "c.csv": CSVS["c"],
        "theta090_psi090.csv": CSVS["c"],
        "session.json": b"\xef\xbb\xbf" + described(entries),
    }
    read = read_session(files)
    assert [(r.theta_deg, r.psi_deg, r.repeat) for r in read.records] == PLACES
    assert [warning.code for warning in read.warnings] == ["file-ignored"]


def test_a_listed_repeat_keeps_its_number_and_others_take_what_is_free() -> None:
    entries = [
        {"theta_deg": 0, "psi_deg": 0, "file": "a"},
        {"theta_deg": 0, "psi_deg": 0, "file": "b", "repeat": 0},
        {"theta_deg": 0, "psi_deg": 0, "file": "c"},
    ]
    read = read_session({**CSVS, "session.json": described(entries)})
    assert [record.repeat for record in read.records] == [1, 0, 2]


ENTRY = {"theta_deg": 0, "psi_deg": 0, "file": "a"}
BROKEN = {
    "no JSON": (b'{"gyro": "1",\n "stand" 5}', "not-json", 2, None),
    "NaN": (b'{"latitude_deg": NaN}', "not-json", None, None),
    "a key twice": (b'{"gyro": "1", "gyro": "2"}', "not-json", None, None),
    "a list": (b"[]", "not-json", None, None),
    "deep": (b'{"x": ' + b"[" * 200_000, "not-json", None, None),
    "a number of many digits": (b'{"latitude_deg": 1' + b"0" * 5000 + b"}", "not-json", None, None),
    "a huge number": (b'{"latitude_deg": 1' + b"0" * 400 + b"}", "not-a-number", None, "/latitude_deg"),
    "endless": (b" " * (4 * 2**20 + 1), "too-big", None, None),
    "not UTF-8": (b'{"gyro": "\xff"}', "not-utf8", None, None),
    "a serial without quotes": (b'{"gyro": 417}', "not-a-text", None, "/gyro"),
    "a latitude as text": (b'{"latitude_deg": "55"}', "not-a-number", None, "/latitude_deg"),
    "a latitude beyond the pole": (b'{"latitude_deg": 91}', "not-a-number", None, "/latitude_deg"),
    "no time": (b'{"started_at": "noon"}', "bad-time", None, "/started_at"),
    "colder than possible": (b'{"temperature_c": -300}', "not-a-number", None, "/temperature_c"),
    "positions no list": (described({"a": 1}), "not-a-list", None, "/positions"),
    "positions of texts": (described(["a"]), "not-a-list", None, "/positions"),
    "no file": (described([{"theta_deg": 0, "psi_deg": 0}]), "missing-value", None, "/positions/0/file"),
    "half a position": (described([ENTRY, {"theta_deg": 0, "file": "b"}]), "missing-value", None,
                        "/positions/1/psi_deg"),
    "true for a number": (described([ENTRY | {"psi_deg": True}]), "not-a-number", None, "/positions/0/psi_deg"),
    "a negative repeat": (described([ENTRY | {"repeat": -1}]), "not-a-count", None, "/positions/0/repeat"),
    "a file that is not there": (described([ENTRY | {"file": "z.csv"}]), "no-file", None, "/positions/0/file"),
    "a certificate that is not there": (described([ENTRY], certificate="c.csv"), "no-file", None, "/certificate"),
    "a way out": (described([ENTRY | {"file": "../../secret.csv"}]), "unsafe-name", None, "/positions/0/file"),
    "an absolute way out": (described([ENTRY | {"file": "/secret.csv"}]), "unsafe-name", None, "/positions/0/file"),
    "a repeat twice": (described([ENTRY | {"repeat": 1}, ENTRY | {"file": "b", "repeat": 1}]), "duplicate-position",
                       None, "/positions/1/repeat"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_description_is_named_by_line_or_pointer(name: str) -> None:
    data, code, row, column = BROKEN[name]
    assert first({**CSVS, "session.json": data}) == (code, "session.json", row, column)


def test_problems_of_several_files_come_together() -> None:
    files = {
        "theta000_psi000.csv": CSVS["a"].replace(b"\n0.005,", b"\n0.005,x"),
        "certificate.csv": b"theta_deg,psi_deg\n",
        "means.csv": b"theta_deg,psi_deg,jx_ma,jy_ma\n0,0,nan,1\n",
    }
    with pytest.raises(Invalid) as caught:
        read_session(files)
    found = {(item.file, item.message.code, item.row) for item in caught.value.problems}
    assert found == {
        ("theta000_psi000.csv", "not-a-number", 3),
        ("certificate.csv", "no-rows", 1),
        ("means.csv", "nan", 2),
    }


def test_two_files_of_one_position_or_kind_are_refused() -> None:
    assert (
        first({"theta000_psi000.csv": CSVS["a"], "x/theta0_psi0.csv": CSVS["a"]})[0] == "duplicate-position"
    )
    means = write_means_csv(MEANS)
    assert first({"means.csv": means, "currents.csv": means})[0] == "several-files"


def test_nothing_measured_is_refused() -> None:
    assert first({"certificate.csv": write_certificate_csv(CERTIFICATE)})[:2] == ("no-measurement", "session")
    assert first({})[0] == "no-measurement"


def test_a_certificates_number_in_the_description_is_no_missing_file() -> None:
    read = read_session({**CSVS, "session.json": described([ENTRY], certificate="C-17")})
    assert read.facts.certificate == "C-17"
    assert list(read.certificate) == []


def zipped(*members: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return stream.getvalue()


def test_single_files_are_items(tmp_path: Path) -> None:
    assert list(read_item(write_means_csv(MEANS), "m.csv").means) == MEANS
    assert list(read_item(write_certificate_csv(CERTIFICATE), "c.csv").certificate) == CERTIFICATE
    assert len(read_item(write_record_parquet(RECORDS[0]), "r.parquet").records) == 1
    stream = io.BytesIO()
    np.savez(stream, theta_deg=[0.0], psi_deg=[0.0], jx_ma=[0.001], jy_ma=[0.002])
    assert list(read_item(stream.getvalue(), "m.npz").means) == [MeansRow(0.0, 0.0, 0.001, 0.002)]
    for data, code in (
        (b"a,b\n1,2\n", "wrong-header"),
        (zipped(("[Content_Types].xml", b""), ("x/y", b"")), "spreadsheet"),
    ):
        with pytest.raises(Invalid) as caught:
            read_item(data, "x")
        assert caught.value.problems[0].message.code == code
    with pytest.raises(Invalid) as caught:
        open_item(tmp_path / "nothing.csv")
    assert caught.value.problems[0].message.code == "no-file"
    assert "nothing.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("names", "answer"),
    [
        (["session.json"], True),
        (["certificate.csv", "currents.csv"], True),
        (["theta000_psi000.csv.gz"], True),
        (["a.csv", "b.csv"], False),
        (["one/theta000_psi000.csv", "two/theta000_psi000.csv"], False),
    ],
)
def test_a_folder_of_items_is_no_session(names: list[str], answer: bool) -> None:
    assert bool(is_session(names)) == answer
