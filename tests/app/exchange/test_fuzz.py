"""Whatever the bytes: an answer or an `AppError` that says what and where, never anything else."""

import gzip
import io
import json
import random
from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import AppError
from app.exchange import csv_table
from app.exchange.archive import zip_bytes
from app.exchange.certificate import read_certificate
from app.exchange.items import read_item
from app.exchange.means import read_means
from app.exchange.parameters import read_parameters
from app.exchange.records import read_record, write_record_csv, write_record_parquet
from app.exchange.rows import CurrentRecord, Facts, MeansRow
from app.exchange.session_json import read_session_json
from app.exchange.session_writing import session_files

READERS = [read_means, read_certificate, read_record, read_item, read_session_json, read_parameters]
RECORD = CurrentRecord(90.0, 0.0, np.arange(40) / 200, np.linspace(0, 1, 40), np.linspace(1, 0, 40))
MEANS = b"theta_deg;psi_deg;jx_ma;jy_ma;u_jx_ma\n0;0;0,1;2;1\n# x\n0;90;1e-3;-2;1\n0;180;1;2;\n"


def npz() -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(
        stream, t_s=RECORD.t_s, jx_ma=RECORD.jx_ma, jy_ma=RECORD.jy_ma, theta_deg=90, psi_deg=0
    )
    return stream.getvalue()


SESSION = session_files(Facts(gyro="1"), records=[RECORD], means=[MeansRow(0.0, 0.0, 1.0, 2.0)])
SEEDS = {
    "means": MEANS,
    "csv": write_record_csv(RECORD),
    "parquet": write_record_parquet(RECORD),
    "npz": npz(),
    "gzip": gzip.compress(MEANS),
    "zstd": bytes(pa.compress(MEANS, codec="zstd", asbytes=True)),
    "zip": zip_bytes(SESSION),
    "json": SESSION["session.json"],
}


def try_all(data: bytes, readers: list[Callable[[bytes, str], object]]) -> None:
    for read in readers:
        try:
            read(data, "theta000_psi000.bin")
        except AppError as error:
            check(error)


def check(error: AppError) -> None:
    assert error.problems
    for item in error.problems:
        assert item.message.code
        assert item.text
        assert "%(" not in item.text


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.binary(max_size=300))
def test_random_bytes(data: bytes) -> None:
    try_all(data, READERS)
    for magic in (b"\x1f\x8b", b"\x28\xb5\x2f\xfd", b"PAR1", b"PK\x03\x04", b"\xef\xbb\xbf"):
        try_all(magic + data, READERS[:4])


@settings(deadline=None)
@given(st.text(st.sampled_from('0123456789.,;-+eE \t\n\r"#_xnaif∞−\ufeff'), max_size=120))
def test_random_cells_below_an_honest_header(body: str) -> None:
    for header in (
        "theta_deg,psi_deg,jx_ma,jy_ma,repeat",
        "t_s;jx_ma;jy_a",
        "t_min\tjx_ma\tjy_ua\ttheta_rad\tpsi_deg",
    ):
        try_all(f"{header}\n{body}".encode(), READERS[:4])


@pytest.mark.parametrize("name", SEEDS)
def test_honest_files_with_some_bytes_changed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_table, "FAST_FROM_BYTES", 100)
    rng = random.Random(name)
    for _ in range(150):
        data = bytearray(SEEDS[name])
        for _ in range(rng.choice((1, 1, 3, 10))):
            where = rng.randrange(len(data))
            match rng.randrange(3):
                case 0:
                    data[where] = rng.randrange(256)
                case 1:
                    del data[where : where + rng.randrange(1, 20)]
                case _:
                    data[where:where] = data[: rng.randrange(20)]
            if not data:
                break
        try_all(bytes(data), READERS)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
keys = [
    "gyro",
    "stand",
    "latitude_deg",
    "certificate",
    "started_at",
    "temperature_c",
    "positions",
    "parameters",
]
entries = st.dictionaries(
    st.sampled_from(["theta_deg", "psi_deg", "file", "repeat", "kx", "wg"]), json_values, max_size=4
)


@settings(deadline=None)
@given(
    st.dictionaries(st.sampled_from(keys), json_values | entries | st.lists(entries, max_size=2), max_size=5)
)
def test_random_descriptions(content: dict[str, object]) -> None:
    try_all(json.dumps(content).encode(), [read_session_json, read_parameters])
