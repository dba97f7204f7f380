"""Formats and their wrappings: compression, Parquet, npz, and files made to do harm."""

import gzip
import io
import zipfile
from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from app.errors import Invalid
from app.exchange import columnar, compression, csv_table
from app.exchange.formats import kind_of, open_table
from app.exchange.means import read_means
from app.exchange.records import read_record
from app.exchange.rows import MeansRow

MEANS = b"theta_deg,psi_deg,jx_ma,jy_ma\n0,0,-0.00075,0.004536\n0,90,0.003374,0.000405\n"
ROWS = [MeansRow(0.0, 0.0, -0.00075, 0.004536), MeansRow(0.0, 90.0, 0.003374, 0.000405)]
COLUMNS = {
    "theta_deg": np.array([0.0, 0.0]),
    "psi_deg": np.array([0, 90]),
    "jx_ma": np.array([-0.00075, 0.003374]),
    "jy_ma": np.array([0.004536, 0.000405]),
}


def zstd(data: bytes) -> bytes:
    return bytes(pa.compress(data, codec="zstd", asbytes=True))


def parquet(columns: dict[str, object]) -> bytes:
    stream = io.BytesIO()
    pq.write_table(pa.table(columns), stream)
    return stream.getvalue()


def npz(**columns: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **columns)
    return stream.getvalue()


def code_of(read: Callable[[bytes, str], object], data: bytes) -> str:
    with pytest.raises(Invalid) as caught:
        read(data, "file.bin")
    assert caught.value.problems[0].file == "file.bin"
    return caught.value.problems[0].message.code


@pytest.mark.parametrize("pack", [bytes, gzip.compress, zstd], ids=["plain", "gzip", "zstd"])
@pytest.mark.parametrize("data", [MEANS, parquet(COLUMNS), npz(**COLUMNS)], ids=["csv", "parquet", "npz"])
def test_one_table_in_every_format_is_one_table(data: bytes, pack: Callable[[bytes], bytes]) -> None:
    assert read_means(pack(data), "means") == (ROWS, [])


@pytest.mark.parametrize(
    "header",
    ["theta_deg,psi_deg,jx_ua,jy_ua", "Theta_Deg;PSI_DEG;JX_UA;JY_UA", "theta_deg\tpsi_deg\tjx_µa\tjy_μa"],
)
def test_header_in_any_case_separator_and_micro_sign(header: str) -> None:
    mark = next(mark for mark in ";\t," if mark in header)
    body = "\n0,0,-0.75,4.536\n0,90,3.374,0.405\n".replace(",", mark)
    assert read_means((header + body).encode(), "means.csv") == (ROWS, [])


def test_columns_of_parquet_in_other_types_and_units() -> None:
    data = parquet(
        {
            "theta_deg": pa.array([0, 0], pa.int8()),
            "psi_rad": pa.array([0.0, np.pi / 2]),
            "jx_a": pa.array(["-7.5e-7", "3,374e-6"]).dictionary_encode(),
            "jy_ua": pa.array([4.536, 0.405]),
            "started_at": pa.array([0, None], pa.timestamp("ns", "UTC")),
            "further": pa.array([[1], [2]]),
        }
    )
    rows, _ = read_means(data, "means.parquet")
    assert [(row.psi_deg, row.jx_ma, row.jy_ma) for row in rows] == [
        (0.0, -0.00075, 0.004536),
        (90.0, 0.003374, 0.000405),
    ]
    assert rows[0].started_at is not None
    assert rows[0].started_at.isoformat() == "1970-01-01T00:00:00+00:00"
    assert rows[1].started_at is None


def test_rows_of_parquet_are_numbered_from_one_and_a_null_is_an_empty_cell() -> None:
    data = parquet(COLUMNS | {"jx_ma": pa.array([0.001, None]), "jy_ma": pa.array([np.nan, 1.0])})
    with pytest.raises(Invalid) as caught:
        read_means(data, "means.parquet")
    found = [(item.message.code, item.row, item.column) for item in caught.value.problems]
    assert found == [("empty-value", 2, "jx_ma"), ("nan", 1, "jy_ma")]


def test_one_value_of_npz_counts_for_every_row() -> None:
    columns = COLUMNS | {"theta_deg": np.array(0.0)}
    assert read_means(npz(**columns), "means.npz") == (ROWS, [])


def test_big_endian_and_single_precision_arrays() -> None:
    columns = {name: column.astype(">f8") for name, column in COLUMNS.items()}
    assert read_means(npz(**columns), "means.npz") == (ROWS, [])
    single = read_means(npz(**{name: column.astype("f4") for name, column in COLUMNS.items()}), "x.npz")[0]
    assert single[0].jx_ma == float(np.float32(-0.00075))


@pytest.mark.parametrize("size", [0.5, 0.9, 0.99])
@pytest.mark.parametrize(
    "data",
    [gzip.compress(MEANS), zstd(MEANS), parquet(COLUMNS), npz(**COLUMNS)],
    ids=["gzip", "zstd", "parquet", "npz"],
)
def test_a_file_cut_short_is_damaged(data: bytes, size: float) -> None:
    assert code_of(read_means, data[: int(len(data) * size)]) in {"damaged", "not-a-table"}


def test_a_compressed_nothing_is_empty() -> None:
    assert code_of(read_means, gzip.compress(b"")) == "empty-file"


@pytest.mark.parametrize("pack", [gzip.compress, zstd])
def test_a_decompression_bomb_is_refused_before_it_bursts(
    pack: Callable[[bytes], bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    bomb = pack(b"0" * (64 * 2**20))
    assert len(bomb) < 2**17
    with pytest.raises(Invalid) as caught:
        compression.unpack(bomb, "bomb", limit=2**22)
    assert caught.value.problems[0].message.code == "too-big"
    assert "4 MiB" in caught.value.problems[0].message.text


def test_parquet_of_more_rows_than_fit_is_refused_before_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    zeros = np.zeros(2**20)
    data = parquet({"t_s": zeros, "jx_ma": zeros})
    assert len(data) < 2**15  # five hundred times smaller than what it unfolds to
    monkeypatch.setattr(columnar, "LARGEST_BYTES", 2**23)
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *_, **__: pytest.fail("it was read"))
    assert code_of(open_table, data) == "too-big"


def test_an_npy_header_that_claims_more_than_there_is_is_damaged() -> None:
    honest = io.BytesIO()
    np.lib.format.write_array(honest, np.zeros(4))
    lying = honest.getvalue().replace(b"(4,)", b"(4000000000000,)".ljust(4))
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("jx_ma.npy", lying)
    assert code_of(open_table, stream.getvalue()) == "damaged"


def test_npz_is_never_unpickled() -> None:
    stream = io.BytesIO()
    np.savez(stream, jx_ma=np.array([object()], dtype=object), allow_pickle=True)
    assert code_of(open_table, stream.getvalue()) == "damaged"


def test_arrays_of_several_lengths_or_dimensions() -> None:
    assert code_of(open_table, npz(jx_ma=np.zeros(2), jy_ma=np.zeros(3))) == "ragged-columns"
    assert code_of(open_table, npz(jx_ma=np.zeros((2, 2)))) == "not-a-column"
    assert code_of(open_table, npz(jx_ma=np.zeros(2, dtype=complex))) == "not-a-column"
    assert code_of(open_table, npz(jx_ma=np.zeros(0))) == "no-rows"


def test_a_spreadsheet_or_another_archive_is_told_what_to_do() -> None:
    for member, code in (("[Content_Types].xml", "spreadsheet"), ("notes.txt", "not-a-table")):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            archive.writestr(member, "x")
        assert code_of(open_table, stream.getvalue()) == code


def test_a_table_of_positions_cannot_be_endless() -> None:
    data = parquet({name: np.zeros(100_001) for name in COLUMNS})
    assert code_of(read_means, data) == "too-many-rows"


@pytest.mark.parametrize(
    ("header", "kind"),
    [
        (b"theta_deg,psi_deg,alpha_deg,beta_deg,gamma_deg", "certificate"),
        (b"theta_deg,psi_deg,jx_ma,jy_ma", "means"),
        (b"t_s,jx_ma,jy_ma", "record"),
        (b"t_s,theta_deg,psi_deg,jx_ma,jy_ma", "record"),
        (b"a,b", None),
    ],
)
def test_the_kind_of_a_file_is_told_from_its_columns(header: bytes, kind: str | None) -> None:
    row = b"\n" + b",".join([b"1"] * header.count(b",")) + b",1\n"
    assert kind_of(open_table(header + row, "x.csv")) == kind


MESSY = [
    "t_s,jx_ma,jy_ma\n0,1,2\n0.005,1.5,2.5\n",
    "t_s;jx_ma;jy_ma\n0;1,5;-2\n0,005;1e-3;2,5\n",
    "# made by a stand\nt_s,jx_ma,jy_ma\n0,1,2\n\n# a pause\n0.005,1,2\n",
    '"t_s","jx_ma","jy_ma"\n"0","1","2"\n0.005,1,2\n',
    "t_s,jx_ma,jy_ma\r\n0,1,2\r\n0.005, 1 ,+2\r\n",
    "t_s,jx_ma,jy_ma\r0,1,2\r0.005,1,2\r",
    "t_s,jx_ma,jy_ma,\n0,1,2,\n0.005,1,2,\n",
    "t_s,jx_ma,jy_ma\n0,1,2\n0.005,1,2",
    "t_s,jx_ma,jy_ma\n0,1,2\n0.005,1,2\n,,\n,,\n",
    "t_s,jx_ua,jy_a\n0,1,2e-3\n0.005,1e3,0.001\n",
    "t_s,jx_ma,jy_ma\n0,−1,2\n0.005,1,\u00a02\n",
]


@pytest.mark.parametrize("text", MESSY)
def test_both_ways_through_csv_read_the_same(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name = "theta000_psi000.csv"
    monkeypatch.setattr(csv_table, "FAST_FROM_BYTES", 2**40)
    (slow,), slow_warnings = read_record(text.encode(), name)
    monkeypatch.setattr(csv_table, "FAST_FROM_BYTES", 0)
    (fast,), fast_warnings = read_record(text.encode(), name)
    assert len(slow.t_s) == 2
    for column in ("t_s", "jx_ma", "jy_ma"):
        assert getattr(fast, column).tobytes() == getattr(slow, column).tobytes()
    assert fast_warnings == slow_warnings


@pytest.mark.parametrize(
    "text",
    [
     "t_s,jx_ma,jy_ma\n0,1,2\n1,2\n", "t_s,jx_ma,jy_ma\n0,1,2\n1,2,nan\n", "t_s,jx_ma,jy_ma\n0,1,2\n1,x,3\n",
     "1,2\n3,4\n",
     "t_s,t_s\n0,1\n", "t_s,jx_ma,jy_ma\n", "t_s,jx_ma,jy_ma\n0,1,2\n1,,3\n", "t_s,jx_ma,jy_ma\n\n0,1,2\n1,1_0,3\n"],
)  # fmt: skip
def test_both_ways_through_csv_find_the_same_problems(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for size in (2**40, 0):
        monkeypatch.setattr(csv_table, "FAST_FROM_BYTES", size)
        with pytest.raises(Invalid) as caught:
            read_record(text.encode(), "theta000_psi000.csv")
        found.append([item.text for item in caught.value.problems])
    assert found[0] == found[1]


def test_the_quick_way_is_taken_for_a_plain_large_record() -> None:
    text = "t_s,jx_ma,jy_ma\n" + "0.005,1,2\n" * 10_000
    assert csv_table._read_fast(text.encode(), "x.csv") is not None
