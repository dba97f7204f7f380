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
