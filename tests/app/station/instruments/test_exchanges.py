"""Answers read into values: units, flags, rows of every type."""

import re

import numpy as np
import pytest

from app.station.instruments.exchanges import Columns, Exchange, NotUnderstood, Words


def words(pattern: str, **changes) -> Words:
    return Words(re.compile(pattern, re.IGNORECASE), **changes)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("-4.5361E-06", "a", -0.0045361), ("-4.5361", "ua", -0.0045361), ("-4536.1", "na", -0.0045361),
        ("+0.0045", "ma", 0.0045), (" 7 ", "µa", 0.007),
    ],
)  # fmt: skip
def test_a_current_is_the_nearest_number_to_its_decimals_in_milliamperes(text, unit, value):
    assert words("(?P<jx>.*)", units={"jx": unit}).values(text) == {"jx": value}


def test_flags_counts_and_texts():
    answer = words("(?P<running>\\w+),(?P<label>\\d+)?,(?P<text>.*)", yes=re.compile("run", re.IGNORECASE))
    assert answer.values("RUN,12,all well") == {"running": True, "label": 12, "text": "all well"}
    assert answer.values("halt,,") == {"running": False, "label": None, "text": ""}


@pytest.mark.parametrize("line", ["", "1.5", "x", "1,2", "1e999"])
def test_a_count_is_a_whole_number(line):
    with pytest.raises(NotUnderstood):
        words("(?P<samples>.*)").values(line)


@pytest.mark.parametrize("line", ["nan", "INF", "9.91E37x", "--1", ""])
def test_what_is_no_number_is_not_understood(line):
    with pytest.raises(NotUnderstood):
        words("(?P<jx>.*)", units={"jx": "a"}).values(line)


def test_the_pattern_must_match_the_whole_line():
    with pytest.raises(NotUnderstood):
        words("(?P<homed>[01])").values("1;0")


@pytest.mark.parametrize("element", ["<f8", ">f8", "<f4", ">i4", "<i2"])
def test_a_block_of_any_type_and_order_of_bytes(element):
    rows = np.array([[0, 5, -3, 7], [1, 10, 4, -8]])
    columns = Columns(("index", "t", "jx", "jy"), {"t": "ms", "jx": "na", "jy": "ua"}, element)
    found = columns.of_block(rows.astype(element).tobytes())
    assert found["index"].tolist() == [0, 1]
    assert found["t"].tolist() == [0.005, 0.01]
    assert found["jx"].tolist() == [-3e-6, 4e-6]
    assert found["jy"].tolist() == [0.007, -0.008]


def test_amperes_in_a_block_are_multiplied_once():
    current = np.array([1.683e-6, -2.7e-6])
    found = Columns(("jx",), {"jx": "a"}, "<f8").of_block(current.tobytes())
    assert np.array_equal(found["jx"], current * 1000.0)


@pytest.mark.parametrize(
    "data", [b"1234567", np.array([1.0, np.nan]).tobytes(), np.array([np.inf, 0.0]).tobytes()]
)
def test_half_rows_and_what_is_no_number_are_not_understood(data):
    with pytest.raises(NotUnderstood):
        Columns(("jx", "jy"), {"jx": "a", "jy": "a"}, "<f8").of_block(data)


def test_an_empty_answer_has_no_rows():
    both = {"jx": "a", "jy": "a"}
    assert len(Columns(("jx", "jy"), both, "<f8").of_block(b"")["jy"]) == 0
    assert len(Columns(("jx", "jy"), both).of_text("\r")["jy"]) == 0


def test_a_line_of_numbers_row_by_row():
    found = Columns(("jx", "jy"), {"jx": "ua", "jy": "ma"}).of_text("1.1,2.2,3.3,4.4")
    assert found["jx"].tolist() == [0.0011, 0.0033]
    assert found["jy"].tolist() == [2.2, 4.4]
    with pytest.raises(NotUnderstood):
        Columns(("jx", "jy"), {"jx": "ua", "jy": "ma"}).of_text("1,2,3")


def test_what_is_sent_has_its_values_in_their_places():
    exchange = Exchange("POS {theta_deg:+08.3f};{{{psi_arcsec:.0f}}}")
    assert exchange.text({"theta_deg": 90.0, "psi_arcsec": 648000.0}) == "POS +090.000;{648000}"
