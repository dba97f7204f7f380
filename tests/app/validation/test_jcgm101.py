"""The examples of JCGM 101: exact values where there are any, and the pack sees a poor engine."""

import numpy as np
import pytest
from scipy import stats

from app.validation import jcgm101
from app.validation.numbers import load
from solver.propagation import monte_carlo

DATA = load("jcgm101")


def test_rectangular_sum_exactly():
    """9.2.3.3: the sum of four equal rectangular quantities; 97.5 % quantile of Irwin-Hall, n = 4."""
    # beyond three of four widths the distribution function is 1 − (4 − x)⁴/24
    quantile = (4 - (24 * 0.025) ** 0.25 - 2) * 2 * 3**0.5
    assert f"{quantile:.2f}" == DATA["additive"]["rectangular"]["symmetric"][1]


@pytest.mark.parametrize("case", DATA["loss"]["cases"][:3], ids=lambda case: str(case["x1"]))
def test_uncorrelated_loss_exactly(case):
    """9.4: (δY)/u² is χ² with two degrees of freedom, non-central by (x₁/u)²."""
    square = DATA["loss"]["u"] ** 2 * 1e6
    exact = stats.ncx2(2, (case["x1"] / DATA["loss"]["u"]) ** 2) if case["x1"] else stats.chi2(2)
    assert f"{square * exact.mean():.0f}" == case["y"]
    assert f"{square * exact.std():.0f}" == case["u"]
    start = np.linspace(0, 0.0499, 2000)
    low, high = square * exact.ppf(start), square * exact.ppf(start + 0.95)
    best = np.argmin(high - low)
    # the document's ends are of a Monte Carlo run of its own
    u = float(case["u"])
    assert [low[best], high[best]] == pytest.approx([float(item) for item in case["shortest"]], abs=0.02 * u)


def test_correlated_loss_exactly():
    """9.4.3: the variance of X₁² + X₂² for normal quantities with correlation r."""
    u = DATA["loss"]["u"]
    for case in DATA["loss"]["cases"][3:]:
        variance = 4 * u**4 * (1 + case["r"] ** 2) + 4 * case["x1"] ** 2 * u**2
        assert f"{variance**0.5 * 1e6:.0f}" == pytest.approx(case["u"])


def test_every_example_holds_for_another_seed_too():
    found = jcgm101.group(lambda fraction, what: None, 11)
    assert [check.name for case in found.cases for check in case.checks if not check.passed] == []
    assert [case.error for case in found.cases if case.error] == []
    assert len(found.cases) == 6


def test_an_engine_with_too_wide_draws_fails(monkeypatch):
    class Wide:
        def __init__(self, rng):
            self._rng = rng

        def __getattr__(self, name):
            return lambda *given, **named: 1.05 * getattr(self._rng, name)(*given, **named)

    def wide(model, **options):
        return monte_carlo.run(lambda rng, count: model(Wide(rng), count), **options)

    monkeypatch.setattr(jcgm101, "run", wide)
    assert not any(case.passed for case in jcgm101.group(lambda fraction, what: None, 1).cases)
