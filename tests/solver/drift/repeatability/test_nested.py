"""Components of variance against published tables, dense linear algebra and simulated truth."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.repeatability.components import Within
from solver.drift.repeatability.nested import nested_components
from solver.errors import InputError
from solver.variance_components import variance_components


def numbers(text):
    return np.array(text.split(), float)


TURNIPS = numbers(
    "3.28 3.09 3.52 3.48 2.88 2.80 2.46 2.44 1.87 1.92 2.19 2.19 "
    "2.77 2.66 3.74 3.44 2.55 2.55 3.78 3.87 4.07 4.12 3.31 3.31"
)
"""Calcium of 2 samples of 3 leaves of 4 plants: Snedecor & Cochran, Statistical Methods, 1967, p. 286, as in
SAS/STAT User's Guide, The NESTED Procedure, example 'Variability of Calcium Concentration in Turnip Greens'."""

PASTES = numbers(
    "62.8 62.6 60.1 62.3 62.7 63.1 60.0 61.4 57.5 56.9 61.1 58.9 58.7 57.5 63.9 63.1 65.4 63.7 57.1 56.4 "
    "56.9 58.6 64.7 64.5 55.1 55.1 54.7 54.2 58.8 57.5 63.4 64.9 59.3 58.1 60.5 60.0 62.5 62.6 61.0 58.7 "
    "56.9 57.7 59.2 59.4 65.2 66.0 64.8 64.1 54.8 54.8 64.0 64.0 57.7 56.8 58.3 59.3 59.2 59.2 58.9 56.6"
)
"""Strength of 2 samples of 3 casks of 10 batches: Davies & Goldsmith, Statistical Methods in Research and
Production, 4th ed., 1972, table 6.5; lme4's data set Pastes."""

DYESTUFF = numbers(
    "1545 1440 1440 1520 1580 1540 1555 1490 1560 1495 1595 1550 1605 1510 1560 "
    "1445 1440 1595 1465 1545 1595 1630 1515 1635 1625 1520 1455 1450 1480 1445"
)
"""Yield of 5 preparations of 6 batches: Davies & Goldsmith, 1972, table 6.3; Box & Tiao, 1973, table 5.1.2."""

DYESTUFF_2 = numbers(
    "7.298 3.846 2.434 9.566 7.990 5.220 6.556 0.608 11.788 -0.892 0.110 10.386 13.434 5.510 8.166 "
    "2.212 4.852 7.092 9.288 4.980 0.282 9.014 4.458 9.446 7.198 1.722 4.782 8.106 0.758 3.758"
)
"""The generated example of Box & Tiao, Bayesian Inference in Statistical Analysis, 1973, table 5.1.4."""


def ragged(rng, days, starts, sessions):
    """Labels of an unbalanced history: up to so many starts of a day and sessions of a start."""
    day, start = [], []
    for number in range(days):
        for _ in range(rng.integers(1, starts + 1)):
            count = rng.integers(1, sessions + 1)
            day += [number] * count
            start += [len(set(start))] * count
    return np.array(day), np.array(start)


def test_turnips():
    """SAS/STAT, PROC NESTED: components 0.365223, 0.161060, 0.006654; F 7.67 (p 0.0097) and 49.41 (< .0001)."""
    labels = {"plant": np.repeat(range(4), 6), "leaf": np.tile(np.repeat(range(3), 2), 4)}
    found = nested_components(TURNIPS, labels, lowest="error")
    assert [row.source for row in found.components] == ["error", "leaf", "plant"]
    assert [round(row.variance, 6) for row in found.components] == [0.006654, 0.161060, 0.365223]
    assert [row.dof for row in found.components] == [12, 8, 3]
    assert (round(found["plant"].f, 2), round(found["plant"].p_value, 4)) == (7.67, 0.0097)
    assert round(found["leaf"].f, 2) == 49.41
    assert found["leaf"].p_value < 1e-4
    assert round(found.together.variance, 6) == 0.532938  # "Total" of the same table
    assert found["error"].f is None


def test_pastes_and_dyestuff_as_by_reml():
    """Balanced and positive, so that the analysis of variance gives the REML estimates that lme4 prints.

    Bates, Mächler, Bolker, Walker, lme4: Pastes 8.434 (cask in batch), 1.657 (batch), 0.678; Dyestuff 1764.05, 2451.25.
    """
    batch, cask = np.repeat(range(10), 6), np.repeat(range(30), 2)
    found = nested_components(PASTES, {"batch": batch, "cask": cask}, lowest="residual")
    assert [round(row.variance, 3) for row in found.components] == [0.678, 8.434, 1.657]
    found = nested_components(DYESTUFF, {"batch": np.repeat(range(6), 5)}, lowest="residual")
    assert [round(row.variance, 2) for row in found.components] == [2451.25, 1764.05]


def test_a_negative_component_is_zero_and_its_interval_is_kept():
    """Box & Tiao, 1973, table 5.1.4: mean squares 8.3365 between the batches and 14.9459 within."""
    found = nested_components(DYESTUFF_2, {"batch": np.repeat(range(6), 5)}, lowest="residual")
    assert found["batch"].variance == 0.0
    assert found["batch"].low == 0.0
    assert found["batch"].high > 0.0
    assert round(found["batch"].f, 4) == round(8.3365 / 14.9459, 4)
    assert round(found["residual"].variance, 4) == 14.9459


def test_nist_furnace_case_study():
    """NIST/SEMATECH e-Handbook, 3.5.1.4: 21 runs, 4 locations, 2 wafers; SS 61,442.29, 36,014.5, 10,155.

    Only the sums of squares count, so that any values with these will do. Printed: F 5.37404 and 4.72864,
    p 0.0000001 and 3.85e-11; components 312.55694, 225.38294, 120.89286.
    """
    rng = np.random.default_rng(1)
    raw = rng.normal(size=(21, 4, 2))
    run = raw.mean(axis=(1, 2), keepdims=True) - raw.mean()
    place = raw.mean(axis=2, keepdims=True) - raw.mean(axis=(1, 2), keepdims=True)
    wafer = raw - raw.mean(axis=2, keepdims=True)
    parts = [(run, 61442.29), (place, 36014.5), (wafer, 10155.0)]
    values = 563.0 + sum(part * (want / np.sum((part + 0 * raw) ** 2)) ** 0.5 for part, want in parts)
    labels = {"run": np.repeat(range(21), 8), "location": np.tile(np.repeat(range(4), 2), 21)}
    found = nested_components(values.ravel(), labels, lowest="within")
    # the printed components follow from unrounded sums; those printed have seven and six digits
    printed = {"run": 312.55694, "location": 225.38294, "within": 120.89286}
    assert {row.source: row.variance for row in found.components} == pytest.approx(printed, rel=1e-5)
    assert found["run"].f == pytest.approx(5.37404, abs=2e-5)
    assert found["location"].f == pytest.approx(4.72864, abs=2e-5)
    assert round(found["run"].p_value, 7) == 0.0000001
    assert found["location"].p_value == pytest.approx(3.85e-11, rel=2e-3)


def test_the_gum_example_and_the_balanced_analysis():
    """JCGM 100:2008, H.5, table H.9: five observations of each day; s_W 85 µV, s_B 43 µV, F 2.25 of rounded values."""
    means = np.array([172, 116, 13, 144, 106, 31, 60, 125, 163, 41.0])
    spreads = np.array([60, 77, 111, 101, 67, 93, 80, 73, 88, 86.0])
    pattern = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    table = means[:, None] + spreads[:, None] * pattern / pattern.std(ddof=1)
    found = nested_components(table.ravel(), {"between-days": np.repeat(range(10), 5)}, lowest="within")
    assert (round(found["within"].sd), round(found["between-days"].sd)) == (85, 43)
    assert found["between-days"].f == pytest.approx(2.25, abs=0.02)  # 5·57²/85² = 2.248
    balanced = variance_components(table)
    assert found["between-days"].variance == pytest.approx(balanced.variance_between, rel=1e-12)
    assert found["between-days"].p_value == pytest.approx(balanced.p_value, rel=1e-9)


def test_the_error_of_the_looms():
    """Montgomery, Design and Analysis of Experiments, example 3.11: 6.96 between looms, 1.90 within, F 15.68."""
    looms = numbers("98 97 99 96 91 90 93 92 96 95 97 95 95 96 99 98")
    found = nested_components(looms, {"loom": np.repeat(range(4), 4)}, lowest="error")
    assert [round(row.variance, 2) for row in found.components] == [1.90, 6.96]
    assert round(found["loom"].f, 2) == 15.68
    # one mean square alone: the exact interval SSE/χ²
    error = found["error"]
    assert error.low**2 == pytest.approx(22.75 / stats.chi2.ppf(0.975, 12), rel=1e-9)
    assert error.high**2 == pytest.approx(22.75 / stats.chi2.ppf(0.025, 12), rel=1e-9)


CASES = {
    "balanced": (np.repeat(range(8), 4), np.repeat(range(16), 2), (1.0, 0.7, 0.5), False),
    "ragged": (*ragged(np.random.default_rng(5), 8, 4, 4), (1.0, 0.7, 0.5), True),
    "no days": (*ragged(np.random.default_rng(6), 10, 3, 3), (0.0, 1.0, 0.5), True),
}
ROUNDS = 400


@pytest.mark.parametrize("case", CASES)
def test_components_and_intervals_of_simulated_histories(case):
    """Fixed effects removed, noise of unequal sizes: right on average, 95 % covered."""
    day, start, truth, uneven = CASES[case]
    count, excess = len(day), 1.44
    rng = np.random.default_rng(7)
    u = 0.5 * rng.choice([0.5, 1.0, 2.0], count) if uneven else np.full(count, 0.5)
    design = np.column_stack([np.arange(count) / count, np.arange(count) > count / 2]).astype(float)
    sources = ("between-days", "between-starts", "between-sessions", "between-positions")
    wanted = np.sqrt([*np.square(truth), np.mean(u**2) * (excess - 1.0)])
    missed, significant = np.zeros(4), 0
    mean = np.zeros(4)
    for _ in range(ROUNDS):
        parts = [
            rng.normal(0.0, sd, n)
            for sd, n in zip(truth, (day.max() + 1, start.max() + 1, count), strict=True)
        ]
        values = parts[0][day] + parts[1][start] + parts[2] + rng.normal(0.0, u * excess**0.5)
        within = Within(u, excess * rng.chisquare(24, count), np.full(count, 24))
        labels = {"between-days": day, "between-starts": start}
        found = nested_components(values + design @ [3.0, -2.0], labels, within, design=design)
        rows = [found[source] for source in sources]
        mean += np.array([row.variance for row in rows]) / ROUNDS
        # to the last bit: an interval that ends at zero holds a component of zero
        missed += [
            not row.low <= sd + 1e-12 or not sd - 1e-12 <= row.high
            for row, sd in zip(rows, wanted, strict=True)
        ]
        significant += found["between-days"].p_value < 0.05
    # 5 % of 400 are 20 ± 4.4; four standard deviations, and one percent for the approximation itself
    assert np.all(missed <= 20 + 4 * 4.4 + 4), missed
    if truth[0] == 0.0:
        assert significant <= 20 + 4 * 4.4 + 4
    else:  # four standard errors of a variance with five degrees of freedom, more than zero for negatives adds
        assert np.all(np.abs(mean - wanted**2) <= 4 * (2 / 5) ** 0.5 * (wanted**2 + 0.5) / ROUNDS**0.5), mean


def test_what_is_known_within_the_sessions():
    rng = np.random.default_rng(8)
    u, chi2 = np.full(12, 0.2), np.full(12, 36.0)
    found = nested_components(
        rng.normal(size=12), {"between-days": np.repeat(range(4), 3)}, Within(u, chi2, np.full(12, 24))
    )
    within, positions = found["within-position"], found["between-positions"]
    assert (within.sd, within.low, within.high, within.dof, within.f) == pytest.approx(
        (0.2, 0.2, 0.2, None, None)
    )
    assert positions.variance == pytest.approx(0.04 * (36 / 24 - 1))
    assert (positions.f, positions.dof, positions.dof_below) == (1.5, 288, None)
    assert positions.p_value == pytest.approx(stats.chi2.sf(12 * 36, 288), rel=1e-9)
    # χ² of the scatter: (c·ν/χ²_p − 1)·u²
    ends = [0.04 * (432 / stats.chi2.ppf(p, 288) - 1) for p in (0.975, 0.025)]
    assert [positions.low**2, positions.high**2] == pytest.approx(ends, rel=1e-9)


def test_sessions_are_tested_against_what_is_known_within():
    values = np.array([1.0, 2.0, 4.0, 4.5, 0.0, 0.3])
    found = nested_components(values, {}, Within(np.full(6, 0.5), np.full(6, 30.0), np.full(6, 20)))
    sessions, variance = found["between-sessions"], values.var(ddof=1)
    assert sessions.variance == pytest.approx(variance - 0.25 * 1.5)
    assert (sessions.f, sessions.dof, sessions.dof_below) == pytest.approx((variance / 0.375, 5, 120))
    assert sessions.p_value == pytest.approx(stats.f.sf(variance / 0.375, 5, 120), rel=1e-9)


def test_without_a_fit_positions_are_confounded_with_the_noise():
    found = nested_components([1.0, 2.0, 4.0], {}, Within([0.1, 0.1, 0.1]))
    assert found["within-position"].confounded_with == ("between-positions",)
    assert found["between-positions"].variance is None


def test_values_without_any_scatter():
    found = nested_components([2.0, 2.0, 2.0], {}, Within([0.0, 0.0, 0.0]))
    assert [row.sd for row in found.components] == [0.0, None, 0.0]
    assert (found["between-sessions"].f, found.together.high) == (None, 0.0)


def test_ten_thousand_sessions_are_a_matter_of_a_moment():
    """No array of sessions by sessions: such would take 800 MB."""
    count = 10_000
    rng = np.random.default_rng(11)
    labels = {"between-days": np.arange(count) // 6, "between-starts": np.arange(count) // 2}
    design = rng.normal(size=(count, 4))
    values = rng.normal(0, 0.3, count) + rng.normal(0, 2, count // 2)[labels["between-starts"]]
    found = nested_components(values, labels, Within(np.full(count, 0.1)), design=design)
    assert found["between-starts"].low < 2.0 < found["between-starts"].high


def test_one_session_of_each_start():
    rng = np.random.default_rng(9)
    labels = {"between-days": np.repeat(range(5), 2), "between-starts": np.arange(10)}
    found = nested_components(rng.normal(size=10), labels, Within(np.full(10, 0.1)))
    assert found["between-starts"].confounded_with == ("between-sessions",)
    assert found["between-starts"].variance is not None
    assert found["between-sessions"].variance is None
    assert found["between-sessions"].confounded_with == ("between-starts",)
    order = ["within-position", "between-positions", "between-sessions", "between-starts", "between-days"]
    assert [row.source for row in found.components] == order


def test_one_start_of_each_day_with_one_session():
    found = nested_components([1.0, 2.0, 4.0], {"between-days": [1, 2, 3], "between-starts": [7, 8, 9]})
    assert found["between-days"].variance == pytest.approx(np.var([1, 2, 4], ddof=1))
    rest = ("between-starts", "between-sessions", "within-position", "between-positions")
    assert found["between-days"].confounded_with == rest
    assert all(found[name].variance is None for name in rest)


def test_one_day_only():
    labels = {"between-days": [1, 1, 1, 1], "between-starts": [1, 1, 2, 2]}
    found = nested_components([1.0, 2.0, 4.0, 4.4], labels, Within(np.full(4, 0.1)))
    assert found["between-days"].variance is None
    assert found["between-days"].confounded_with == ("fixed",)
    assert found["between-starts"].dof == 1


def test_days_that_the_course_uses_up():
    labels = {"between-days": [1, 1, 1, 2, 2, 2]}
    step = [[0.0], [0.0], [0.0], [1.0], [1.0], [1.0]]
    values = np.array([1.0, 2.0, 1.5, 7.0, 7.7, 8.0])
    found = nested_components(values, labels, design=step)
    assert found["between-days"].confounded_with == ("fixed",)
    pooled = (values[:3].var(ddof=1) + values[3:].var(ddof=1)) / 2
    assert found["between-sessions"].variance == pytest.approx(pooled)
    assert found["between-sessions"].dof == 4


def test_a_type_pools_its_gyros_each_about_a_mean_of_its_own():
    rng = np.random.default_rng(10)
    gyro, day = np.repeat(range(3), 20), np.tile(np.repeat(range(5), 4), 3)
    values = rng.normal(size=60) + np.array([0.0, 100.0, -50.0])[gyro] + rng.normal(0, 2, 15)[gyro * 5 + day]
    pooled = nested_components(values, {"between-gyros": gyro, "between-days": day})
    single = [nested_components(values[gyro == g], {"between-days": day[gyro == g]}) for g in range(3)]
    for source in (
        "between-days",
        "between-sessions",
    ):  # balanced: the mean of the gyros' own, none of them negative
        assert pooled[source].variance == pytest.approx(
            np.mean([one[source].variance for one in single]), rel=1e-9
        )
    assert (pooled["between-days"].dof, pooled["between-gyros"].dof) == (12, 2)


def test_what_cannot_be_used_is_refused():
    with pytest.raises(InputError, match="two sessions"):
        nested_components([1.0], {})
    with pytest.raises(InputError, match="one label for each"):
        nested_components([1.0, 2.0], {"between-days": [1]})
    with pytest.raises(InputError, match="finite values"):
        nested_components([1.0, np.nan], {})
    with pytest.raises(InputError, match="one row for each"):
        nested_components([1.0, 2.0], {}, design=[[1.0]])
    with pytest.raises(InputError, match="none of them negative"):
        nested_components([1.0, 2.0], {}, Within([0.1, -0.1]))
    with pytest.raises(InputError, match="none of them negative"):
        nested_components([1.0, 2.0], {}, Within([0.1, 0.1], [1.0], [2.0]))
