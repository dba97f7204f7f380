"""Every malformed input is refused or warned of, naming file, row, column and the cure."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from app.errors import Invalid, Problem
from app.exchange.certificate import read_certificate
from app.exchange.means import match, read_means
from app.exchange.records import read_record
from app.exchange.rows import CertificateRow

MEANS = """theta_deg,psi_deg,jx_ma,jy_ma
0,0,-0.00075,0.004536
0,90,0.003374,0.000405
0,180,-0.000709,-0.003758
0,270,-0.004832,0.000373
"""
_ANGLES = "alpha_arcsec,beta_arcsec,gamma_arcsec,u_alpha_arcsec,u_beta_arcsec,u_gamma_arcsec"
CERTIFICATE = f"""theta_deg,psi_deg,{_ANGLES}
0,0,6.9,16.4,6.6,1,1,1
0,90,-26.1,18.1,8.9,1,1,1
"""
RECORD = "t_s,jx_ma,jy_ma\n" + "".join(f"{i / 200},0.00{i % 7 + 1},-0.00{i % 5 + 1}\n" for i in range(12000))

CURES = (
    "Add", "Bring", "Call", "Check", "Choose", "Copy", "Export", "Fill", "Give", "Keep", "Leave", "Measure",
    "Mend", "Name", "Pack", "Put", "Rename", "Sample", "Save", "Separate", "Sort", "Split", "Use", "Write",
    "name the", "write", "leave",
)  # fmt: skip

Reader = Callable[[bytes, str], Any]


def lines(text: str, **changed: str) -> bytes:
    """The text with some of its lines replaced: ``l3="…"`` is the third."""
    every = text.splitlines()
    for key, line in changed.items():
        every[int(key[1:]) - 1] = line
    return ("\n".join(every) + "\n").encode()


@dataclass
class Case:
    name: str
    read: Reader
    data: bytes
    code: str
    row: int | None = None
    column: str | None = None
    says: str = ""


def means(
    name: str, data: bytes, code: str, row: int | None = None, column: str | None = None, says: str = ""
) -> Case:
    return Case(name, read_means, data, code, row, column, says)


REFUSED = [
    means("empty file", b"", "empty-file"),
    means("nothing but comments", b"# made by\n\n# hand\n", "empty-file"),
    means("header alone", lines(MEANS)[:30], "no-rows", 1),
    means("no header", lines(MEANS)[30:], "no-header", 1, says="theta_deg,psi_deg,jx_ma,jy_ma"),
    means("another file's header", b"a,b\n1,2\n", "wrong-header", 1, says="jx_ma"),
    means("a column missing", b"theta_deg,psi_deg,jx_ma\n0,0,1\n", "missing-column", 1, "jy_ma", "jy_ma"),
    means("no unit in the header", lines(MEANS, l1="theta_deg,psi_deg,jx,jy_ma"), "no-unit", 1, "jx",
          "jx_ua"),
    means("no unit of an angle", lines(MEANS, l1="theta,psi_deg,jx_ma,jy_ma"), "no-unit", 1, "theta",
          "theta_deg"),
    means("an unknown unit", lines(MEANS, l1="theta_deg,psi_deg,jx_mv,jy_ma"), "unknown-unit", 1, "jx_mv",
          "jx_a"),
    means("one quantity in two units", b"theta_deg,psi_deg,jx_ma,jx_ua,jy_ma\n0,0,1,1,1\n", "two-units", 1,
          "jx_ua"),
    means("a header name twice", b"theta_deg,psi_deg,jx_ma,jx_ma,jy_ma\n0,0,1,1,1\n", "duplicate-column", 1,
          "jx_ma"),
    means("an unnamed column", b"theta_deg,,jx_ma,jy_ma\n0,0,1,1\n", "unnamed-column", 1),
    means("text in a number", lines(MEANS, l3="0,90,about 3,0.000405"), "not-a-number", 3, "jx_ma",
          "about 3"),
    means("a unit in a cell", lines(MEANS, l3="0,90,0.0033 mA,0.000405"), "not-a-number", 3, "jx_ma"),
    means("NaN", lines(MEANS, l4="0,180,nan,-0.003758"), "nan", 4, "jx_ma"),
    means("infinity", lines(MEANS, l5="0,270,-0.004832,inf"), "infinite", 5, "jy_ma"),
    means("an empty cell", lines(MEANS, l5="0,270,,0.000373"), "empty-value", 5, "jx_ma"),
    means("decimal commas between commas", lines(MEANS, l2="0,0,-0,00075,0,004536"), "decimal-comma", 2,
          says="semicolons"),
    means("a quoted decimal comma", lines(MEANS, l2='0,0,"-0,00075",0.004536'), "decimal-comma", 2, "jx_ma",
          "semicolons"),
    means("thousands", lines(MEANS, l2="0,0,1 000.5,0.004536"), "thousands-separator", 2, "jx_ma"),
    means("a row too short", lines(MEANS, l3="0,90,0.003374"), "ragged-row", 3),
    means("a row too long", lines(MEANS, l3="0,90,0.003374,0.000405,late"), "ragged-row", 3),
    means("semicolons below commas", lines(MEANS, l3="0;90;0.003374;0.000405"), "mixed-separators", 3),
    means("an open quotation mark", lines(MEANS, l5='0,270,"-0.004832,0.000373'), "bad-quotes", 5),
    means("UTF-16", MEANS.encode("utf-16"), "not-utf8", says="UTF-8"),
    means("another encoding", MEANS.encode() + "# нуль\n".encode("cp1251"), "not-utf8", 6, says="ED"),
    means("one current 1000 times too large", lines(MEANS, l4="0,180,-0.709,-3.758"), "current-unit", 4,
          "jx_ma"),
    means("one cell 1000 times too large", lines(MEANS, l4="0,180,-0.000709,-3.758"), "current-unit", 4,
          "jy_ma"),
    means("one row 1000 times too small", lines(MEANS, l5="0,270,-0.000004832,0.000000373"), "current-unit",
          5,
          "jx_ma"),
    means("u of zero", b"theta_deg,psi_deg,jx_ma,jy_ma,u_jx_ma\n0,0,1,1,0\n", "not-positive", 2, "u_jx_ma"),
    means("a negative duration", b"theta_deg,psi_deg,jx_ma,jy_ma,duration_s\n0,0,1,1,-60\n", "not-positive",
          2,
          "duration_s"),
    means("no time", b"theta_deg,psi_deg,jx_ma,jy_ma,started_at\n0,0,1,1,yesterday\n", "bad-time", 2,
          "started_at"),
    means("a fraction of a repeat", b"theta_deg,psi_deg,jx_ma,jy_ma,repeat\n0,0,1,1,0.5\n", "not-a-count",
          2, "repeat"),
    means("a repeat twice", b"theta_deg,psi_deg,jx_ma,jy_ma,repeat\n0,0,1,1,1\n360,0,1,1,1\n",
          "duplicate-position", 3,
          "repeat"),
    means("a number beyond float64", lines(MEANS, l2="0,0,1e309,0.004536"), "too-large", 2, "jx_ma"),
    means("a number beyond reason", lines(MEANS, l2="0,0,1.1e12,0.004536"), "too-large", 2, "jx_ma"),
    Case("a sample beyond reason", read_record, lines(RECORD, l777="3.875,1e200,0.001"), "too-large", 777, "jx_ma"),
    Case("a position certified twice", read_certificate, lines(CERTIFICATE, l3="360,-360,1,1,1,1,1,1"),
         "duplicate-position", 3, "theta_deg", "row 2"),
    Case("a negative uncertainty", read_certificate, lines(CERTIFICATE, l3="0,90,1,1,1,1,-1,1"),
         "negative-uncertainty", 3, "u_beta_arcsec"),
    Case("an angle missing", read_certificate, lines(CERTIFICATE, l3="0,90,1,,1,1,1,1"), "empty-value", 3,
          "beta_arcsec"),
    Case("NaN in a certificate", read_certificate, lines(CERTIFICATE, l2="0,0,NaN,1,1,1,1,1"), "nan", 2,
          "alpha_arcsec"),
    Case("time backwards", read_record, lines(RECORD, l5000="1.0,0.001,0.001"), "time-not-increasing", 5000,
          "t_s"),
    Case("a time twice", read_record, lines(RECORD, l3="0.0,0.001,0.001"), "time-not-increasing", 3, "t_s"),
    Case("NaN in a record", read_record, lines(RECORD, l777="3.875,0.001,nan"), "nan", 777, "jy_ma"),
    Case("infinity in a record", read_record, lines(RECORD, l777="3.875,-inf,0.001"), "infinite", 777,
          "jx_ma"),
    Case("text in a record", read_record, lines(RECORD, l12001="59.995,0.001,overload"), "not-a-number",
          12001, "jy_ma"),
    Case("an interrupted record", read_record, RECORD.encode()[:-12], "ragged-row", 12001),
    Case("a record of one row", read_record, RECORD.encode()[:30], "too-few-samples", 2),
    Case("half a position", read_record, b"t_s,jx_ma,jy_ma,theta_deg\n0,1,1,0\n1,1,1,0\n", "missing-column",
          1),
]  # fmt: skip

FILE = "theta000_psi090.csv"


def only(error: Invalid) -> Problem:
    assert len(error.problems) <= 2
    return error.problems[0]


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: case.name)
def test_refused_with_file_row_column_and_cure(case: Case) -> None:
    with pytest.raises(Invalid) as caught:
        case.read(case.data, FILE)
    item = only(caught.value)
    assert item.message.code == case.code
    assert item.file == FILE
    assert item.row == case.row
    assert item.column == case.column
    assert case.says in item.message.text
    assert any(cure in item.message.text for cure in CURES)


def test_an_unnamed_record_is_refused() -> None:
    with pytest.raises(Invalid) as caught:
        read_record(RECORD.encode(), "monday.csv")
    item = only(caught.value)
    assert (item.message.code, item.file) == ("position-unknown", "monday.csv")
    assert "theta090_psi270.csv" in item.message.text


WARNED = [
    means("a further column", "\n".join(f"{line},{i and 'x'}" for i,
          line in enumerate(MEANS.split())).encode(),
          "columns-ignored", says="not used: 0"),
    means("microamperes read as mA", MEANS.replace("0.00", "").encode(), "current-unit", says="jx_ua"),
    means("amperes read as mA", MEANS.replace("0.00", "0.00000").encode(), "current-unit", says="jx_a"),
    means("a row copied", lines(MEANS, l3="0,0,-0.00075,0.004536"), "same-twice", says="row 3"),
    Case("degrees read as arcsec", read_certificate, lines(CERTIFICATE, l2="0,0,40000,1,1,1,1,1"),
          "angle-unit",
         says="alpha_deg"),
    Case("arcsec read as degrees", read_certificate, CERTIFICATE.replace("arcsec", "deg").encode(),
          "angle-unit",
         says="alpha_arcsec"),
    Case("degrees in a column of arcsec", read_certificate,
         b"theta_deg,psi_deg,alpha_arcsec,beta_arcsec,gamma_arcsec\n0,0,0.0019,0.004,0.001\n", "angle-unit",
         says="alpha_deg"),
    Case("an uncertainty missing", read_certificate, lines(CERTIFICATE, l3="0,90,1,1,1,1,,1"),
          "uncertainty-incomplete",
         says="every row"),
    Case("too short", read_record, "\n".join(RECORD.splitlines()[:9000]).encode(), "below-method",
          says="60 s"),
    Case("too slow", read_record, RECORD.replace("t_s", "t_min").encode(), "below-method", says="200 Hz"),
    Case("a gap", read_record, lines(RECORD, l12001="60.5,0.001,0.001"), "gap", says="12001"),
]  # fmt: skip


@pytest.mark.parametrize("case", WARNED, ids=lambda case: case.name)
def test_warned_with_file_and_cure(case: Case) -> None:
    _, warnings = case.read(case.data, FILE)
    (warning,) = warnings
    assert warning.code == case.code
    assert FILE in warning.text
    assert case.says in warning.text


@pytest.mark.parametrize(
    ("text", "read"),
    [(MEANS, read_means), (CERTIFICATE, read_certificate), (RECORD, read_record)],
    ids=["means", "certificate", "record"],
)
def test_what_is_in_order_has_neither_problem_nor_warning(text: str, read: Reader) -> None:
    _, warnings = read(text.encode(), FILE)
    assert warnings == []


def test_a_byte_order_mark_semicolons_and_decimal_commas_are_in_order() -> None:
    german = b"\xef\xbb\xbf" + MEANS.replace(",", ";").replace(".", ",").encode()
    assert read_means(german, FILE) == read_means(MEANS.encode(), FILE)


def test_a_measured_position_that_is_not_certified_is_named() -> None:
    rows, _ = read_means(MEANS.encode(), FILE)
    problems, warnings = match(
        rows, [CertificateRow(0.0, psi, 0, 0, 0) for psi in (0.0, 90.0, 270.0)], file=FILE
    )
    (item,) = problems
    assert (item.message.code, item.file, item.row) == ("position-not-certified", FILE, 4)
    assert "180" in item.message.text
    assert warnings == []


def test_certified_positions_without_a_measurement_are_a_warning() -> None:
    rows, _ = read_means(MEANS.encode(), FILE)
    problems, (warning,) = match(
        rows, [CertificateRow(t, p, 0, 0, 0) for t in (0.0, 90.0) for p in (0.0, 90.0, 180.0, 270.0)]
    )
    assert problems == []
    assert warning.code == "positions-missing"
    assert "90°, 0°; 90°, 90°; 90°, 180°; 90°, 270°" in warning.text


def test_many_problems_are_told_at_once_and_the_rest_counted() -> None:
    rows = "".join(f"0,{i},x,y\n" for i in range(30))
    with pytest.raises(Invalid) as caught:
        read_means(("theta_deg,psi_deg,jx_ma,jy_ma\n" + rows).encode(), FILE)
    assert len(caught.value.problems) == 21
    assert [item.row for item in caught.value.problems[:3]] == [2, 3, 4]
    last = caught.value.problems[-1]
    assert last.message.code == "more-problems"
    assert "40 more" in last.message.text


def test_a_long_record_full_of_faults_is_told_and_counted() -> None:
    broken = RECORD.replace(",0.001,", ",nan,")
    with pytest.raises(Invalid) as caught:
        read_record(broken.encode(), FILE)
    count = broken.count(",nan,")
    assert caught.value.problems[-1].message.values["count"] == count - 20
    assert [item.row for item in caught.value.problems[:3]] == [2, 9, 16]


def test_line_numbers_count_comments_and_empty_lines() -> None:
    text = "# a session\n\n" + MEANS.replace("0,90", "# repeated below\n0,90").replace("0.000405", "bad")
    with pytest.raises(Invalid) as caught:
        read_means(text.encode(), FILE)
    assert [(item.row, item.column) for item in caught.value.problems] == [(6, "jy_ma")]
