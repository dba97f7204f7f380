"""What a gyro is expected to be, read from a file and turned to SI."""

import json

import numpy as np
import pytest

from app.errors import Invalid
from app.exchange.prior import prior_si, read_prior

PER_MA = np.pi / 180 / 3600 * 1000
"""One °/h/mA in rad/(s·A), from the definitions."""


def read(**parameters):
    return read_prior(json.dumps({"parameters": parameters}).encode(), "prior.json")


def test_what_is_not_said_stays_unsaid():
    prior = prior_si(
        read(kx={"value": 2000, "standard_uncertainty": 100}, wg={"value": 0, "standard_uncertainty": 5})
    )
    assert list(prior.says) == [True, False, False, False, False, False, True, False]
    assert prior.values[0] == pytest.approx(2000 * PER_MA, rel=1e-15)
    assert prior.standard_uncertainties[6] == pytest.approx(5 * PER_MA / 1000, rel=1e-15)


def test_a_value_without_uncertainty_says_nothing():
    known = read(kx={"value": 2000, "standard_uncertainty": 100}, ky={"value": 2000})
    assert list(known) == ["kx"]


@pytest.mark.parametrize("entry", [{"value": 2000}, {"value": 2000, "standard_uncertainty": 0}])
def test_nothing_that_could_be_tested_is_refused_with_the_cure(entry):
    with pytest.raises(Invalid, match="standard_uncertainty") as caught:
        read(kx=entry)
    assert caught.value.problems[0].file == "prior.json"
    assert caught.value.problems[0].column == "/parameters"


def test_a_result_says_what_the_gyro_was_and_a_gyro_changes():
    """1 % of the larger scale factor, 1 °/h from start to start, 1 °/h/g: `widened`, added to the result's own u."""
    found = {
        name: {"value": value, "standard_uncertainty": u}
        for name, value, u in [("kx", 2000.0, 0.25), ("kxy", 5.0, 0.25), ("w0x", 1.0, 0.75), ("wg", 3.0, 1.0)]
    }
    result = json.dumps({"solver_version": "1.1.0", "parameters": found}).encode()
    known = read_prior(result, "last.json")
    assert [item.value for item in known.values()] == [2000.0, 5.0, 1.0, 3.0]
    assert {name: item.standard_uncertainty for name, item in known.items()} == pytest.approx(
        {"kx": (20**2 + 0.25**2) ** 0.5, "kxy": (20**2 + 0.25**2) ** 0.5, "w0x": 1.25, "wg": 2**0.5}
    )  # 0.75, 1 and 1.25 are a right triangle
    assert read(**found)["kx"].standard_uncertainty == 0.25  # a prior of its own means what it says
