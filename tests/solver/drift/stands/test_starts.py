"""Sessions averaged to starts, and how much starts scatter."""

import numpy as np
import pytest

from solver.drift.stands.starts import starts_of


def drawn(rng, gyros=8, each=60, scatter=3.0, u=1.0, repeats=1):
    """Sessions of gyros with means of their own; every start has `repeats` sessions and a scatter of its own."""
    rows = gyros * each * repeats
    gyro = np.tile(np.repeat(np.arange(gyros), 1), each * repeats)
    start = np.repeat(np.arange(each), repeats * gyros)
    level = 100.0 * rng.standard_normal((gyros, 8))
    of_start = scatter * rng.standard_normal((gyros, each, 8))
    value = level[gyro] + of_start[gyro, start] + u * rng.standard_normal((rows, 8))
    columns = {
        "time": np.arange(rows, dtype=float), "gyro": gyro, "kind": np.zeros(rows, np.int64),
        "certificate": np.zeros(rows, np.int64), "start": start, "value": value,
        "u": np.full((rows, 8), u), "signature": np.ones((rows, 8)),
    }  # fmt: skip
    return columns, of_start


def variance(starts):
    """Mean variance of a start, in the unit of the values."""
    return np.linalg.inv(starts.precision).diagonal(axis1=1, axis2=2).mean(axis=0) * starts.scale**2


@pytest.mark.parametrize("repeats", [1, 4])
def test_the_scatter_of_starts_comes_back(rng, repeats):
    columns, _ = drawn(rng, repeats=repeats)
    starts = starts_of(**columns)
    assert len(starts.time) == 8 * 60
    # From 472 differences by their median, which is 37 % efficient, and neighbours share a start: 0.1 each.
    np.testing.assert_allclose(variance(starts), 9.0 + 1.0 / repeats, rtol=0.4)


def test_jumps_and_drifts_of_some_gyros_count_little(rng):
    columns, _ = drawn(rng)
    late = columns["start"] >= 30
    columns["value"][(columns["gyro"] == 2) & late] += 300.0
    columns["value"][columns["gyro"] == 5] += 0.5 * columns["start"][columns["gyro"] == 5][:, None]
    starts = starts_of(**columns)
    np.testing.assert_allclose(variance(starts), 10.0, rtol=0.4)
    v = np.linalg.inv(starts.precision[0])
    correlation = v / np.sqrt(np.outer(v.diagonal(), v.diagonal()))
    # One difference of 472 is drawn in to 4.5: 20/472/8 of each product; their own scatter is 1/√472, four of it.
    assert np.abs(correlation - np.eye(8)).max() < 4 / np.sqrt(472) + 0.01


def test_correlated_noise_is_told(rng):
    columns, _ = drawn(rng, scatter=0.0)
    columns["value"][:, 1] += 0.8 * (columns["value"][:, 0] - columns["value"][:, 0].mean())
    starts = starts_of(**columns)
    v = np.linalg.inv(starts.precision[0])
    # 0.8/√1.64; shrunk by 16 in 488.
    assert v[0, 1] / np.sqrt(v[0, 0] * v[1, 1]) == pytest.approx(0.8 / np.sqrt(1.64), abs=0.12)


def test_starts_are_weighted_means_in_order(rng):
    columns, _ = drawn(rng, gyros=2, each=3, repeats=3)
    columns["u"] = rng.uniform(0.5, 2.0, columns["u"].shape)
    starts = starts_of(**columns)
    assert starts.session.tolist() == sorted(starts.session)
    for row, session in enumerate(starts.session):
        mine = (columns["gyro"] == columns["gyro"][session]) & (columns["start"] == columns["start"][session])
        expected = np.average(columns["value"][mine], axis=0, weights=columns["u"][mine] ** -2.0)
        np.testing.assert_allclose(starts.value[row] * starts.scale, expected, rtol=1e-12)
        assert session == np.flatnonzero(mine)[0]


def test_kinds_scatter_by_their_own_figures(rng):
    columns, _ = drawn(rng, scatter=0.0)
    columns["kind"] = columns["gyro"] % 2
    columns["value"] += np.where(columns["kind"] == 1, 5.0, 0.0)[:, None] * rng.standard_normal(
        columns["value"].shape
    )
    starts = starts_of(**columns)
    spread = np.linalg.inv(starts.precision).diagonal(axis1=1, axis2=2) * starts.scale**2
    odd = starts.gyro % 2 == 1
    np.testing.assert_allclose(spread[~odd].mean(axis=0), 1.0, rtol=0.6)
    np.testing.assert_allclose(spread[odd].mean(axis=0), 26.0, rtol=0.6)


def test_what_was_not_determined_weighs_nothing(rng):
    columns, _ = drawn(rng, gyros=3, each=10)
    columns["value"][::2, 6] = np.nan
    columns["u"][:, 3] = np.nan
    starts = starts_of(**columns)
    assert np.isfinite(starts.value).all()
    assert np.isfinite(starts.precision).all()
    blank = np.isnan(columns["value"][starts.session, 6])
    assert starts.precision[blank, 6, 6].max() < 1e-9 * starts.precision[~blank, 6, 6].min()
    # Nothing is known of u of one parameter: its scatter is all that its values show.
    assert variance(starts)[3] == pytest.approx(10.0, rel=1.0)


def test_one_start_alone_has_the_scale_of_its_noise(rng):
    columns, _ = drawn(rng, gyros=1, each=1)
    starts = starts_of(**columns)
    np.testing.assert_allclose(starts.scale, 1.0, rtol=1e-12)
