"""The five methods of ILAC-G24 and what follows from them together."""

import numpy as np
import pytest
from scipy import stats

from solver.drift.recalibrating.recalibration import (
    Check,
    Evidence,
    Findings,
    Outlook,
    Use,
    control_chart,
    in_service,
    in_use,
    recommend,
    staircase,
    statistical,
)
from solver.errors import InputError


@pytest.mark.parametrize(
    ("days", "used", "advice", "code"),
    [
        ([365, 365], [0.5, 0.79], 548, "staircase-longer"),
        ([365, 365], [0.5, 0.81], 365, "staircase-stays"),
        ([365, 365], [0.9, 0.2], 365, "staircase-stays"),
        ([365, 365], [1.2, 0.2], 365, "staircase-stays"),
        ([365], [0.2], 365, "staircase-stays"),
        ([365, 365, 365], [0.2, 0.2, 1.01], 274, "staircase-beyond"),
        ([365, 100], [0.2, 1.4], 91, "staircase-beyond"),
        ([365, 900], [0.2, 1.4], 274, "staircase-beyond"),
        ([30, 30, 30], [0.1, 0.1, 0.1], None, "staircase-none"),
        ([], [], None, "staircase-none"),
    ],
)
def test_staircase(days, used, advice, code):
    found = staircase(365, Findings(days, used))
    assert (found.days, found.reason.code) == (advice, code)


def test_early_findings_do_not_make_the_interval_longer_nor_hide_those_that_count():
    found = staircase(365, Findings([365, 30, 360, 30], [0.5, 0.9, 0.6, 0.95]))
    assert found.days == 548


def test_findings_of_a_history_with_more_calibrations_than_intervals():
    """Monthly, the interval a year: every tenth month ends one, a value beyond the limit ends its own."""
    days = np.arange(0, 1501, 30)
    used = np.full(51, 0.5)
    found = Findings.of_history(days, used, 365)
    assert found.days.tolist() == [300] * 5
    used[[20, 21]] = (
        1.2  # at 600 days, ending the second interval, and still at 630: no interval begins there
    )
    found = Findings.of_history(days[::-1], used[::-1], 365)  # the order does not matter
    assert found.days.tolist() == [300, 300, 300, 300]
    assert found.used.tolist() == [0.5, 1.2, 0.5, 0.5]
    used[[20, 21]], used[23] = 0.5, 1.2
    assert Findings.of_history(days, used, 365).days.tolist() == [300, 300, 90, 300, 300]


def test_a_repair_ends_an_interval_without_a_finding():
    found = Findings.of_history(np.arange(0, 1201, 100), np.full(13, 0.5), 400, breaks=[550.0, 900.0])
    # begun at 0, 300, after the repair at 600, and at 900, which comes after the repair of that very time
    assert found.days.tolist() == [300, 300]


def test_findings_of_several_gyros():
    both = Findings.together([Findings([365], [0.2]), Findings([90, 91], [0.3, 2.0])])
    assert (both.days.tolist(), both.used.tolist()) == ([365, 90, 91], [0.2, 0.3, 2.0])
    assert len(Findings.together([]).days) == 0


def test_frequent_calibrations_do_not_shorten_the_interval():
    """Five years of monthly calibrations well within limits: nothing speaks against the year there is."""
    history = Findings.of_history(np.arange(0, 1830, 30), np.full(61, 0.5), 365)
    found = recommend(Evidence(365, own=history, of_type=Findings.together([history] * 10)))
    assert found.days == 548


def test_the_stairs_end():
    assert staircase(1826, Findings([1826, 1826], [0.1, 0.1])).days == 1826
    assert staircase(7, Findings([7], [2.0])).days == 7


def test_control_chart_on_the_nasa_example():
    """NASA-HDBK-8739.19-5, tables 7-2 to 7-4: 140.1 days until the 90 % band of 10.03 + drift meets 11 (or 9).

    As in sandialabs/suncal, test/test_interval.py, test_variables; the handbook's fit, through zero, is made here.
    """
    time = np.array([70.0, 86.0, 104.0, 135.0, 167.0, 173.0])
    change = np.array([0.1, 0.11, 0.251, 0.299, 0.403, 0.615])
    columns = np.column_stack((time, time**2))
    b, rest = np.linalg.lstsq(columns, change)[:2]
    assert (round(b[0], 8), round(b[1], 8)) == (0.00015741, 0.00001674)  # table 7-3
    days = np.linspace(0, 400, 4001)
    ahead = np.column_stack((days, days**2))
    residual = rest[0] / 4
    spread = residual * np.einsum("ij,jk,ik->i", ahead, np.linalg.inv(columns.T @ columns), ahead)
    half = stats.t.ppf(0.95, 4) * np.sqrt(0.28**2 + residual + spread)
    course = 10.03 + ahead @ b
    found = control_chart([Outlook("standard", days, course - half, course + half, 9.0, 11.0)], 400)
    assert round(found.days, 1) == 140.1
    upper = control_chart([Outlook("standard", days, course - half, course + half, None, 11.0)], 400)
    assert upper.days == found.days


def test_control_chart_takes_the_first_parameter():
    days = np.array([0.0, 100.0])
    calm = Outlook("Kx", days, [-1, -1], [1, 1], -2.0, 2.0)
    drifting = Outlook("w0y", days, [0, 1], [1, 3], None, 2.0)
    found = control_chart([calm, drifting], 100)
    assert found.days == pytest.approx(50)
    assert found.reason.values["parameter"] == "w0y"
    assert (control_chart([calm], 100).days, control_chart([], 100).days) == (100, None)
    over = control_chart([Outlook("w0y", days, [0, 1], [3, 3], None, 2.0)], 100)
    assert (over.days, over.reason.code) == (0.0, "chart-over")


def gyro_by_starts(per_start, counted="starts"):
    rng = np.random.default_rng(1)
    days, used = np.sort(rng.uniform(0, 900, 25)), np.cumsum(rng.poisson(6, 25))
    value = per_start * used + rng.normal(0, 0.1, 25)
    return Use("w0x", days, used, value, -20.0, 20.0, 0.15, counted, "°/h")


def test_in_use_time():
    """Each start 0.05, at 0.15 starts a day: from some 7.5 to 20 there are 250 starts or 1,650 days, less the band."""
    use = gyro_by_starts(0.05)
    found = in_use([use], 5000)
    left = 20 - 0.05 * use.used[-1]
    assert 0.8 * left / 0.05 / 0.15 < found.days < left / 0.05 / 0.15
    assert found.reason.code == "use-limit-starts"
    assert found.reason.values["uses"] == int(0.15 * found.days)
    assert in_use([gyro_by_starts(0.05, "hours")], 5000).reason.code == "use-limit-hours"
    assert in_use([use], 500).days == 500  # no end in sight
    assert in_use([], 500).reason.code == "use-none"


def test_in_use_time_only_where_the_use_matters():
    found = in_use([gyro_by_starts(0.0)], 5000)
    assert (found.days, found.reason.code) == (None, "use-none-follows")


def test_a_check_in_time_finds_the_drift_before_the_limit():
    """A value drifts to its limit, checks of noise u call beyond 1.96·u: 95 % do before the limit."""
    u, margin, drift = 0.1, 1.0, 0.004
    found = in_service([Check("w0x", u, margin, drift, "°/h")], 5000)
    assert found.interval_of == "check"
    # by hand: (1 − (1.959964 + 1.644854)·0.1)/0.004
    assert found.days == pytest.approx(159.88, abs=0.01)
    rng = np.random.default_rng(2)
    called = 0
    for first in rng.uniform(0, found.days, 4000):
        moments = np.arange(first, margin / drift, found.days)
        called += np.any(np.abs(drift * moments + rng.normal(0, u, len(moments))) > 1.96 * u)
    assert called / 4000 >= 0.95 - 4 * (0.05 * 0.95 / 4000) ** 0.5


def test_a_check_that_is_too_coarse():
    found = in_service([Check("w0x", 0.1, 1.0, 0.001), Check("wg", 0.3, 1.0, 0.0)], 5000)
    assert (found.days, found.reason.code) == (None, "check-blind")
    assert found.reason.values["parameter"] == "wg"
    assert in_service([Check("w0x", 0.1, 1.0, 0.0)], 5000).days == 5000


def test_statistical():
    one = statistical(365, Findings([365] * 20, [0.5] * 15 + [1.5] * 5), None)
    assert (round(one.days), one.reason.code) == (231, "findings-change")  # as in test_reliability, asset 1
    assert statistical(365, Findings([365] * 20, [0.5] * 19 + [1.5]), None).reason.code == "findings-stand"
    several = statistical(365, None, Findings([90, 180, 365, 730] * 10, [0.5] * 36 + [1.5] * 4))
    assert several.reason.code == "findings-model"
    assert several.days < 730
    assert statistical(365, Findings([365] * 4, [0.5] * 4), None).days is None


def test_no_model_looks_further_than_twice_what_was_seen():
    found = statistical(365, Findings([100, 200] * 100, [0.5] * 200), None)
    assert found.days == 400


def test_the_shortest_decides():
    days = np.array([0.0, 1000.0])
    evidence = Evidence(
        365,
        own=Findings([365, 365], [0.5, 0.5]),
        outlooks=[Outlook("w0y", days, [0, 0], [0, 10], None, 4.0)],
        checks=[Check("w0y", 0.1, 4.0, 0.05)],
    )
    found = recommend(evidence)
    assert [one.method for one in found.methods] == [
        "staircase",
        "control-chart",
        "in-use",
        "in-service",
        "statistical",
    ]
    advice = {one.method: one.days for one in found.methods}
    assert advice["staircase"] == 548
    assert advice["control-chart"] == pytest.approx(400)
    assert advice["in-service"] < 100  # of checks: does not count
    assert (found.days, found.reason.code) == (365, "interval-chart")
    assert found.reason.values["wanted"] == 400


@pytest.mark.parametrize(
    ("meets", "now", "days", "code"),
    [
        (1000.0, 548, 730, "interval-chart"),
        (1000.0, 365, 730, "interval-doubled"),
        (1000.0, 91, 122, "interval-doubled"),
        (800.0, 400, 730, "interval-chart"),
        (450.0, 400, 400, "interval-chart"),
        (40.0, 365, 30, "interval-chart"),
        (3.0, 365, 0, "interval-over"),
    ],
)
def test_rounded_down_and_no_more_than_doubled(meets, now, days, code):
    outlook = Outlook("w0y", [0.0, meets, 2 * meets], [0, 0, 0], [0, 4, 8], None, 4.0)
    found = recommend(Evidence(now, outlooks=[outlook]))
    assert (found.days, found.reason.code) == (days, code)


def test_without_evidence_the_interval_stays():
    found = recommend(Evidence(365))
    assert (found.days, found.reason.code) == (365, "interval-none")
    assert all(one.days is None and one.reason.text for one in found.methods)


def test_every_reason_reads_with_its_numbers():
    days = np.array([0.0, 1000.0])
    for used in (0.5, 0.9, 1.3):
        for length in (180, 365):
            evidence = Evidence(
                365,
                own=Findings([365, length] * 6, [0.6, used] * 6),
                outlooks=[Outlook("w0y", days, [0, 0], [0, 10 * used], None, 4.0)],
                uses=[gyro_by_starts(0.05)],
                checks=[Check("w0y", 0.1, used, 0.05, "°/h")],
            )
            found = recommend(evidence)
            texts = [one.reason.text for one in found.methods] + [found.reason.text]
            assert all("%(" not in text and text.endswith(".") for text in texts)
            assert f"{found.days} days" in texts[-1] or found.days == 0


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="positive number of days"):
        recommend(Evidence(0))
    with pytest.raises(InputError, match="length in days"):
        staircase(365, Findings([365], [-0.1]))
    with pytest.raises(InputError, match="length in days"):
        staircase(365, Findings([365, 0], [0.1, 0.1]))
    with pytest.raises(InputError, match="length in days"):
        staircase(365, Findings([365], [0.1, 0.1]))
    with pytest.raises(InputError, match="length in days"):
        Findings.of_history([365], [0.1, 0.1], 365)
    with pytest.raises(InputError, match="as many ends"):
        control_chart([Outlook("w0x", [0.0], [0.0, 1.0], [0.0], None, 1.0)], 100)
    with pytest.raises(InputError, match="not negative"):
        in_service([Check("w0x", -0.1, 1.0, 0.1)], 100)


def test_findings_within_the_limits_speak_for_no_shorter_interval():
    """Findings of 300 days count as found after a year; of different lengths, they are too few for a model."""
    same = statistical(365, Findings([300] * 6, [0.5] * 6), None)
    assert (same.days, same.reason.code) == (365, "findings-stand")
    late = statistical(90, Findings([98, 99, 98, 98, 97], [0.5] * 5), None)
    assert (late.days, late.reason.values["days"]) == (90, 90)
    mixed = statistical(365, Findings([300, 300, 300, 600, 620, 330], [0.5] * 6), None)
    assert (mixed.days, mixed.reason.code) == (365, "findings-all-within")
    beyond = statistical(365, Findings([300, 300, 300, 600, 620, 330], [0.5] * 5 + [1.5]), None)
    assert (beyond.days < 365, beyond.reason.code) == (True, "findings-model")
