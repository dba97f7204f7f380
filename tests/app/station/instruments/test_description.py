"""A station's file: what it says, and every mistake in it named by file, table and key."""

import tomllib

import pytest

from app.errors import Invalid
from app.station.instruments.description import SIMULATED, read_station, station_file

GOOD = SIMULATED.read_text(encoding="utf-8")


def problems_of(text: str) -> dict[str, str]:
    """Column and sentence of every problem of a file."""
    with pytest.raises(Invalid) as caught:
        read_station(text.encode(), "station.toml")
    assert all(item.file == "station.toml" for item in caught.value.problems)
    found: dict[str, str] = {}
    for item in caught.value.problems:
        found[item.column or ""] = f"{found.get(item.column or '', '')} {item.message.text}".strip()
    return found


def changed(old: str, new: str) -> str:
    comments, keys = GOOD.split("\n[stand]\n")
    text = f"[stand]\n{keys}"
    assert old in text
    return comments + "\n" + text.replace(old, new, 1)


def test_the_simulated_instruments_file_is_whole():
    read = station_file(SIMULATED)
    assert read.stand.connection.address == "TCPIP0::127.0.0.1::5025::SOCKET"
    assert read.ammeter.connection.address == "TCPIP0::127.0.0.1::5026::SOCKET"
    assert (read.stand.connection.name, read.ammeter.connection.name) == ("stand", "ammeter")
    assert (read.stand.theta.smallest_deg, read.stand.theta.largest_deg) == (-360.0, 360.0)
    assert read.ammeter.largest_ma == 1.0
    assert (read.recording.duration_s, read.recording.rate_hz) == (60.0, 200.0)  # the method's rule
    assert set(read.types) == {"GVK-6", "DTG-4"}


def test_addresses_may_be_given_beside_the_file():
    read = station_file(SIMULATED, stand_address="GPIB0::9::INSTR", ammeter_address="GPIB0::10::INSTR")
    assert read.stand.connection.address == "GPIB0::9::INSTR"
    assert read.ammeter.connection.address == "GPIB0::10::INSTR"


def test_every_key_that_may_be_left_out_has_the_value_of_the_simulated_file():
    """So that the comments there and the defaults in the program say the same."""
    optional = ("[recording]", "[checks]")
    content = tomllib.loads(GOOD)
    for table in optional:
        content.pop(table.strip("[]"))
    text = GOOD
    for table in optional:
        begin = text.index(f"\n{table}\n")
        rest = text[begin + 1 :]
        end = next((at for at in range(1, len(rest)) if rest[at] == "[" and rest[at - 1] == "\n"), len(rest))
        text = text[:begin] + "\n" + rest[end:]
    assert tomllib.loads(text) == content
    lacking, whole = read_station(text.encode(), "s"), station_file(SIMULATED)
    assert lacking.recording == whole.recording
    assert lacking.checks == whole.checks


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(Invalid, match=r"none\.toml: This file cannot be read: .* Check its name"):
        station_file(tmp_path / "none.toml")


def test_what_is_no_toml_is_named_by_line():
    with pytest.raises(Invalid) as caught:
        read_station(b"[stand]\naddress = TCPIP\n", "station.toml")
    (item,) = caught.value.problems
    assert (item.message.code, item.row) == ("not-toml", 2)
    with pytest.raises(Invalid, match="not UTF-8"):
        read_station("[stand]\naddress = 'Ж'".encode("cp1251"), "station.toml")
    with pytest.raises(Invalid, match="more than 1 MiB"):
        read_station(b"#" * (2**20 + 1), "station.toml")


def test_an_empty_file_lacks_every_table():
    found = problems_of("")
    assert set(found) == {"stand", "ammeter", "settling", "warm_up"}
    assert all("is missing" in text for text in found.values())


MISTAKES = [
    ("[stand]\naddress", "[stand]\nadress", "stand.adress", "Was “address” meant?"),
    ("[checks]", "[chekcs]", "chekcs", "Was “checks” meant?"),
    ("timeout_s = 5", "timeout_s = '5'", "stand.timeout_s", "a number from 0.01 to 600"),
    ("timeout_s = 5", "timeout_s = 0", "stand.timeout_s", "a number from 0.01 to 600"),
    ("identity = 'Driftbook,SIM-STAND,.*'", "identity = '('", "stand.identity", "no regular expression"),
    ("identity = 'Driftbook,SIM-STAND,.*'", "identity = 5", "stand.identity", "must be a text"),
    ("theta_deg = [-360, 360]", "theta_deg = [360, -360]", "stand.limits.theta_deg", "the smaller one first"),
    ("theta_deg = [-360, 360]", "theta_deg = 360", "stand.limits.theta_deg", "two numbers in brackets"),
    ("{theta_deg:.4f},{psi_deg:.4f}", "{theta:.4f},{psi_deg}", "stand.commands.move", "known of {theta}"),
    ("{theta_deg:.4f},{psi_deg:.4f}", "{theta_deg:.4f}", "stand.commands.move", "Put one of {psi_arcsec}"),
    ("{theta_deg:.4f},{psi_deg:.4f}", "{theta_deg:d},{psi_deg}", "stand.commands.move", "not written well"),
    ("{theta_deg:.4f},{psi_deg:.4f}", "{theta_deg,{psi_deg}", "stand.commands.move", "not written well"),
    ("{theta_deg:.4f},{psi_deg:.4f}", "{theta_deg.real},{psi_deg}", "stand.commands.move", "{theta_deg.real}"),
    ('home = "AXIS:HOME"', "home = 7", "stand.commands.home", "a text to send, or a table"),
    ('home = "AXIS:HOME"', "", "stand.commands.home", "is missing"),
    ('stop = "ABORt"', "stop = []", "stand.commands.stop", "a text to send, or a table"),
    ("(?P<homed>[01])", "(?P<home>[01])", "stand.commands.status", "the value home here"),
    ("(?P<homed>[01])", "([01])", "stand.commands.status", "gives no homed"),
    ('unit = "deg" }', 'unit = "A" }', "stand.commands.status[0].unit", "unit of theta must be one of deg,"),
    (', unit = "A" }', " }", "ammeter.commands.reading.unit", "unit of jx must be one of a,"),
    ('jy = "A" } }', 'jy = "V" } }', "ammeter.commands.fetch.units.jy", "unit of jy must be one of a,"),
    ('jy = "A" } }', 'jz = "A", jy = "A" } }', "ammeter.commands.fetch.units.jz", "not known here"),
    ('block = "<f8"', 'block = "double"', "ammeter.commands.fetch.block", "<f8, >f4, <i4"),
    ('columns = ["index", "t", "jx", "jy"]', 'columns = "jx"', "ammeter.commands.fetch.columns", "in brackets"),
    ("{first},{most}", "{first}", "ammeter.commands.fetch", "Put one of {last}, {last_from_one}, {most}"),
    ("COUNt {samples}", "COUNt 100", "ammeter.commands.start", "Put one of {duration_s}, {samples}"),
    ("largest_ma = 1.0", "largest_ma = -1", "ammeter.limits.largest_ma", "a number not below 0"),
    ("confidence = 0.99", "confidence = 99", "settling.confidence", "from 0.5 to 0.999999"),
    ("window_s = 2\n", "window_s = 0\n", "settling.window_s", "a number from"),
    ("noise_na = 123", "noise = 123", 'types.GVK-6.noise', "Was “noise_na” meant?"),
    ('[types."GVK-6"]', '[types]\n"G V" = 3\n[types."GVK-6"]', 'types."G V"', "must be a table"),
    ("false_alarm = 1e-6", "false_alarm = 0", "checks.false_alarm", "a number from"),
    ("rate_hz = 200", "rate_hz = true", "recording.rate_hz", "must be a number"),
    ('address = "TCPIP0::127.0.0.1::5025::SOCKET"', 'address = "A::SOCKET"\nread_termination = ""',
     "stand.read_termination", "Give what ends a line"),
    ('[stand.commands]', '[stand.visa_attributes]\nVI_ATTR_ASRL_BAUT = 1\n[stand.commands]',
     "stand.visa_attributes.VI_ATTR_ASRL_BAUT", "Was “VI_ATTR_ASRL_BAUD” meant?"),
    ('[stand.commands]', '[stand.visa_attributes]\nVI_ATTR_ASRL_BAUD = "fast"\n[stand.commands]',
     "stand.visa_attributes.VI_ATTR_ASRL_BAUD", "true, false or a whole number"),
    ('none = \'[+-]?0\' }', 'none = "*" }', "stand.commands.errors.none", "no regular expression"),
    ('"(?P<text>.*)"\', none', '"(?P<words>.*)"\', none', "stand.commands.errors.answer", "code, text"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "column", "says"),
    MISTAKES,
    ids=[f"{number}-{mistake[2]}" for number, mistake in enumerate(MISTAKES)],
)
def test_a_mistake_is_named_by_its_key_and_says_the_cure(old, new, column, says):
    found = problems_of(changed(old, new))
    assert column in found, found
    assert says in found[column]


def test_all_mistakes_are_named_at_once():
    text = changed("homing_s = 300", "homing_s = -3").replace("largest_ma = 1.0", "largest = 1.0")
    assert set(problems_of(text)) == {
        "stand.times.homing_s",
        "ammeter.limits.largest",
        "ammeter.limits.largest_ma",
    }


@pytest.mark.parametrize("key", ["homed", "emergency_stop"])
def test_what_an_instrument_cannot_tell_must_be_said(key):
    line = next(line for line in GOOD.splitlines() if f"(?P<{key}>" in line)
    assert "stand.commands.status" in problems_of(GOOD.replace(line, ""))
    read = read_station(GOOD.replace(line, f"{{ assume = {{ {key} = true }} }},").encode(), "station.toml")
    assert read.stand.status.assumed == {key: True}
    assert problems_of(GOOD.replace(line, f"{{ assume = {{ {key} = 1 }} }},")) == {
        f"stand.commands.status[{3 if key == 'emergency_stop' else 2}].assume.{key}": (
            "This must be true or false, without quotation marks."
        ),
        "stand.commands.status": f"The answer gives no {key}. Name a group: (?P<{key}>…).",
    }
