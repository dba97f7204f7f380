"""Parameters from JSON: truth, priors, results."""

import json
import math

import pytest

from app.errors import Invalid
from app.exchange.parameters import Known, read_parameters, write_truth
from solver.records import PARAMETERS

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


def read(parameters: object) -> dict[str, Known]:
    return read_parameters(json.dumps({"parameters": parameters}).encode(), "prior.json")


def test_truth_comes_back_to_the_last_bit_with_its_value_in_si() -> None:
    data = write_truth(TRUTH)
    assert read_parameters(data, "truth.json") == {name: Known(value) for name, value in TRUTH.items()}
    kx = json.loads(data)["parameters"]["kx"]
    assert list(json.loads(data)["parameters"]) == list(PARAMETERS)
    assert (kx["unit"], kx["unit_si"]) == ("deg/h/mA", "rad/(s·A)")
    assert kx["value_si"] == pytest.approx(
        2062.65 * math.pi / 180 / 3.6, rel=1e-15
    )  # one rounding more or less


def test_values_in_either_unit_bare_or_with_their_uncertainty() -> None:
    found = read(
        {
            "kx": {"value": 10.0, "standard_uncertainty": 1.0, "unit": "rad/(s·A)"},
            "w0x": {"value": 1.5, "standard_uncertainty": 0.1, "unit": "deg/h"},
            "wg": 6,
            "wk": {"value": None, "standard_uncertainty": None},
            "further": "x",
        }
    )
    assert set(found) == {"kx", "w0x", "wg"}
    assert found["kx"].value == pytest.approx(10 * 180 / math.pi * 3.6, rel=1e-15)
    assert found["kx"].standard_uncertainty == pytest.approx(180 / math.pi * 3.6, rel=1e-15)
    assert found["w0x"] == Known(1.5, 0.1)
    assert found["wg"] == Known(6.0, None)


@pytest.mark.parametrize(
    ("entry", "code", "column"),
    [
        ({"value": "10"}, "not-a-number", "/parameters/kx/value"),
        (
            {"value": 1, "standard_uncertainty": -1},
            "negative-uncertainty",
            "/parameters/kx/standard_uncertainty",
        ),
        ({"value": 1, "unit": "deg/s"}, "unknown-unit", "/parameters/kx/unit"),
        ("10", "not-a-number", "/parameters/kx/value"),
        ([1], "not-a-number", "/parameters/kx/value"),
    ],
)
def test_what_is_wrong_is_named_by_pointer(entry: object, code: str, column: str) -> None:
    with pytest.raises(Invalid) as caught:
        read({"kx": entry})
    (item,) = caught.value.problems
    assert (item.message.code, item.file, item.column) == (code, "prior.json", column)


@pytest.mark.parametrize("parameters", [None, [], {}, {"k": 1}])
def test_no_parameter_at_all_is_refused(parameters: object) -> None:
    with pytest.raises(Invalid, match="no parameters"):
        read(parameters)
