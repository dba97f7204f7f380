"""Every blunder named, and silence when the data are good."""

import numpy as np
import pytest

from solver.diagnosis import diagnose
from tests.solver.blundered import INVISIBLE, VISIBLE, Study, good, prior, right


@pytest.mark.parametrize("name", [*VISIBLE, *INVISIBLE])
def test_a_blunder_is_named(name):
    study = Study(misalignment=300.0 if name == "angle-unit" else 60.0)
    made, truth = {**VISIBLE, **INVISIBLE}[name](study.draw(np.random.default_rng(11)))
    diagnosis = diagnose(made, prior=prior() if name in INVISIBLE else None)
    assert right(diagnosis, truth)


def test_good_data_are_left_alone():
    observations, _ = good(Study().draw(np.random.default_rng(3)))
    assert not diagnose(observations).findings
    assert not diagnose(observations, prior=prior()).findings
