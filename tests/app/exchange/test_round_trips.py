"""What is written reads back bit by bit, in every format, order and unit."""

import io
import random
import struct
from datetime import UTC, datetime, timedelta, timezone
from decimal import Decimal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from hypothesis import given, settings
from hypothesis import strategies as st

from app.exchange.certificate import read_certificate, write_certificate_csv
from app.exchange.means import read_means, write_means_csv
from app.exchange.records import read_record, write_record_csv, write_record_parquet
from app.exchange.rows import CertificateRow, CurrentRecord, MeansRow
from app.exchange.si import observations

number = st.floats(-1e6, 1e6)
sample = st.floats(-1e12, 1e12)
positive = st.floats(1e-300, 1e6)
tenths = st.integers(0, 3599)
moment = st.datetimes(timezones=st.just(UTC))


def bits(value: object) -> object:
    return struct.pack("<d", value) if isinstance(value, float) else value


def same(a: object, b: object, names: tuple[str, ...]) -> bool:
    return all(bits(getattr(a, name)) == bits(getattr(b, name)) for name in names)


@st.composite
def certificates(draw: st.DrawFn) -> list[CertificateRow]:
    places = draw(st.lists(st.tuples(tenths, tenths), min_size=1, max_size=8, unique=True))
    u = st.none() | st.floats(0, 100)
    return [
        CertificateRow(t / 10, p / 10, *(draw(number) for _ in range(3)), *(draw(u) for _ in range(3)))
        for t, p in places
    ]


@st.composite
def mean_rows(draw: st.DrawFn) -> list[MeansRow]:
    places = draw(st.lists(st.tuples(tenths, tenths), min_size=1, max_size=3, unique=True))
    maybe = st.none() | positive
    return [
        MeansRow(
            t / 10,
            p / 10,
            draw(number),
            draw(number),
            *(draw(maybe) for _ in range(4)),
            draw(st.none() | moment),
            draw(st.none() | number),
            draw(st.integers(0, 9)),
        )
        for t, p in places
    ]


def shuffled(csv: bytes, seed: int) -> bytes:
    """The same table with its columns in another order."""
    rows = [line.split(",") for line in csv.decode().splitlines()]
    order = list(range(len(rows[0])))
    random.Random(seed).shuffle(order)
    return "\n".join(",".join(row[i] for i in order) for row in rows).encode()


@given(certificates(), st.integers(0, 99))
def test_a_certificate_comes_back_from_csv(rows: list[CertificateRow], seed: int) -> None:
    written = write_certificate_csv(rows)
    for data in (written, shuffled(written, seed)):
        back, _ = read_certificate(data, "certificate.csv")
        assert len(back) == len(rows)
        assert all(same(a, b, CertificateRow.__match_args__) for a, b in zip(rows, back, strict=True))


@given(mean_rows(), st.integers(0, 99))
def test_means_come_back_from_csv(rows: list[MeansRow], seed: int) -> None:
    names = tuple(name for name in MeansRow.__match_args__ if name != "line")
    written = write_means_csv(rows)
    for data in (written, shuffled(written, seed)):
        back, _ = read_means(data, "means.csv")
        assert len(back) == len(rows)
        assert all(same(a, b, names) for a, b in zip(rows, back, strict=True))


def test_a_time_keeps_its_offset() -> None:
    started = datetime(2026, 3, 1, 9, 30, tzinfo=timezone(timedelta(hours=3)))
    (row,), _ = read_means(
        write_means_csv([MeansRow(0.0, 0.0, 0.001, 0.001, started_at=started)]), "means.csv"
    )
    assert row.started_at == started
    assert row.started_at.utcoffset() == timedelta(hours=3)


@st.composite
def records(draw: st.DrawFn) -> CurrentRecord:
    n = draw(st.integers(2, 30))
    values = st.lists(sample, min_size=n, max_size=n)
    times = sorted(draw(st.sets(st.integers(0, 10**6), min_size=n, max_size=n)))
    return CurrentRecord(
        draw(tenths) / 10, draw(tenths) / 10, np.array(times) / 7.0, np.array(draw(values)), np.array(draw(values)),
        repeat=draw(st.integers(0, 3)), started_at=draw(st.none() | moment), temperature_c=draw(st.none() | number),
    )  # fmt: skip


@settings(deadline=None)
@given(records())
def test_a_record_comes_back_from_csv_and_parquet(record: CurrentRecord) -> None:
    (csv,), _ = read_record(
        write_record_csv(record),
        "x.csv",
        theta_deg=record.theta_deg,
        psi_deg=record.psi_deg,
        repeat=record.repeat,
    )
    (parquet,), _ = read_record(write_record_parquet(record), "x.parquet")
    for back in (csv, parquet):
        for name in ("t_s", "jx_ma", "jy_ma"):
            assert getattr(back, name).tobytes() == getattr(record, name).tobytes()
        assert (back.theta_deg, back.psi_deg, back.repeat) == (
            record.theta_deg,
            record.psi_deg,
            record.repeat,
        )
    assert (parquet.started_at, parquet.temperature_c) == (record.started_at, record.temperature_c)
    assert write_record_parquet(record) == write_record_parquet(parquet)


text_number = st.floats(-1e12, 1e12).map(repr) | st.decimals(-10, 10, places=9).map(str)


@settings(deadline=None)
@given(st.lists(text_number, min_size=2, max_size=50), st.sampled_from([",", ";"]))
def test_samples_are_what_pythons_float_makes_of_the_text(texts: list[str], mark: str) -> None:
    rows = "".join(f"{i}{mark}{text}{mark}0\n" for i, text in enumerate(texts))
    padding = "# so long that it is read in one sweep\n" * 2000
    for data in (f"t_s{mark}jx_ma{mark}jy_ma\n{rows}", f"{padding}t_s{mark}jx_ma{mark}jy_ma\n{rows}"):
        (record,), _ = read_record(data.encode(), "theta000_psi000.csv")
        assert record.jx_ma.tobytes() == np.array([float(text) for text in texts]).tobytes()


@settings(deadline=None, max_examples=25)  # each reads nine files
@given(st.lists(st.decimals(-1, 1, places=12), min_size=2, max_size=30))
def test_a_record_in_amperes_has_the_bits_of_the_same_decimals_in_milliamperes(
    currents: list[Decimal],
) -> None:
    padding = "# so long that it is read in one sweep\n" * 2000
    expected = np.array([float(current) for current in currents]).tobytes()
    for unit, power in (("ma", 0), ("a", -3), ("ua", 3), ("na", 6)):
        shifted = [current.scaleb(power) for current in currents]
        for text in ("{:f}", "{:e}"):
            rows = "".join(f"{i},{text.format(value)},0\n" for i, value in enumerate(shifted))
            (record,), _ = read_record(
                f"{padding}t_s,jx_{unit},jy_ma\n{rows}".encode(), "theta000_psi000.csv"
            )
            assert record.jx_ma.tobytes() == expected
        stream = io.BytesIO()
        floats = [float(value) for value in shifted]
        columns = {"t_s": range(len(floats)), f"jx_{unit}": floats, "jy_ma": [0.0] * len(floats)}
        pq.write_table(pa.table({name: list(column) for name, column in columns.items()}), stream)
        (record,), _ = read_record(stream.getvalue(), "theta000_psi000.parquet")
        assert record.jx_ma.tobytes() == expected


def test_the_same_means_in_any_unit_order_and_format_have_one_input_hash() -> None:
    rng = random.Random(4)
    places = [(t, p) for t in (0, 90, 180, 270) for p in (0, 90, 180, 270)]
    currents = [
        (Decimal(rng.randint(-5000, 5000)).scaleb(-6), Decimal(rng.randint(-5000, 5000)).scaleb(-6))
        for _ in places
    ]
    certificate = [CertificateRow(t, p, rng.uniform(-50, 50), 1.0, 2.0) for t, p in places]
    rows = list(zip(places, currents, strict=True))
    hashes = set()
    for unit, power in (("ma", 0), ("ua", 3), ("a", -3)):
        for turn in (0, 360, -360):
            rng.shuffle(rows)
            lines = [
                f"{t + turn};{p};{x.scaleb(power)!s};{y.scaleb(power)!s}".replace(".", ",")
                for (t, p), (x, y) in rows
            ]
            text = "\n".join([f"theta_deg;psi_deg;jx_{unit};jy_{unit}", *lines])
            means, _ = read_means(text.encode(), "means.csv")
            hashes.add(observations(means, certificate, 55.7558).input_hash())
    assert len(hashes) == 1
