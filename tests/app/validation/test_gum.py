"""The GUM's examples: the data belong to the printed values, by another route, and the pack sees errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from app.validation import gum
from app.validation.numbers import load
from solver.propagation import uncertainty

DATA = load("gum")


def silently(fraction, what):
    """Nobody watches."""


def places(printed):
    return len(printed.partition(".")[2])


def test_h2_by_every_observation():
    """H.2.4, table H.4: R, X and Z of each set of observations, then their means, u and correlations."""
    data = DATA["h2"]
    v, i, phi = (np.array(data[name]) for name in ("voltage_v", "current_ma", "phase_rad"))
    z = 1e3 * v / i * np.stack((np.cos(phi), np.sin(phi), np.ones(5)))
    u = z.std(axis=1, ddof=1) / 5**0.5
    r = np.corrcoef(z)
    assert [f"{item:.3f}" for item in z.mean(axis=1)] == data["values"]
    assert [f"{item:.3f}" for item in u] == data["u_values"]
    assert [f"{r[pair]:.3f}" for pair in ((0, 1), (0, 2), (1, 2))] == data["r_values"]


def test_h3_by_scipy():
    data = DATA["h3"]
    t, b = np.array(data["temperature_c"]), np.array(data["correction_c"])
    line = stats.linregress(t - 20, b)
    assert f"{line.intercept:.4f}" == data["y1"]
    assert f"{line.intercept_stderr:.4f}" == data["u_y1"]
    assert f"{line.slope:.5f}" == data["y2"]
    assert f"{line.stderr:.5f}" == data["u_y2"]
    assert [f"{line.intercept + line.slope * (x - 20):.4f}" for x in t] == data["predicted_c"]


def test_h5_f_quantiles():
    data = DATA["h5"]
    assert stats.f.ppf([0.95, 0.975], 9, 40) == pytest.approx([data["f_95"], data["f_975"]], abs=5e-3)


@pytest.mark.parametrize("level", ["95", "99"])
def test_g2_by_scipy(level):
    printed = DATA["g2"][level]
    values = stats.t.ppf(0.5 + float(level) / 200, DATA["g2"]["dof"])
    assert [f"{value:.{places(text)}f}" for value, text in zip(values, printed, strict=True)] == printed


def test_every_example_holds():
    found = gum.group(silently)
    assert [case.name for case in found.cases if not case.passed] == []
    assert len(found.cases) == 5


def test_an_engine_that_forgets_correlations_fails(monkeypatch):
    def forgetful(sensitivity, covariance, *more):
        return uncertainty.propagate(sensitivity, np.diag(np.diagonal(covariance)), *more)

    monkeypatch.setattr(gum, "propagate", forgetful)
    failed = [case.name for case in gum.group(silently).cases if not case.passed]
    assert [name[:3] for name in failed] == ["H.2", "H.3"]


def test_an_engine_that_forgets_degrees_of_freedom_fails(monkeypatch):
    def forgetful(sensitivity, covariance, dof=None):
        found = uncertainty.propagate(sensitivity, covariance)
        return replace(found, dof=np.full_like(found.dof, 1e9))

    monkeypatch.setattr(gum, "propagate", forgetful)
    failed = [case.name for case in gum.group(silently).cases if not case.passed]
    assert [name[:3] for name in failed] == ["H.1", "H.2", "H.3"]
