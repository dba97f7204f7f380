"""Sums of squares of nested classes against dense linear algebra."""

import numpy as np
import pytest

from solver.drift.repeatability.strata import nested_groups, strata


def ragged(rng, days, starts, sessions):
    """Labels of an unbalanced history: up to so many starts of a day and sessions of a start."""
    day, start = [], []
    for number in range(days):
        for _ in range(rng.integers(1, starts + 1)):
            count = rng.integers(1, sessions + 1)
            day += [number] * count
            start += [len(set(start))] * count
    return np.array(day), np.array(start)


def test_sums_of_squares_by_dense_projections():
    rng = np.random.default_rng(3)
    day, start = ragged(rng, 7, 3, 4)
    count = len(day)
    design = np.column_stack([np.arange(count), np.arange(count) > count / 3]).astype(float)
    noise, values = rng.uniform(0.1, 2.0, count), rng.normal(size=count)
    found = strata(values, nested_groups([day, start], count), design, noise)
    classes = [np.eye(labels.max() + 1)[labels] for labels in (day, start, np.arange(count))]
    spans = [np.column_stack((np.ones(count), design, *classes[:j])) for j in range(4)]
    projections = [span @ np.linalg.pinv(span) for span in spans]
    for j in range(3):
        form = projections[j + 1] - projections[j]
        assert found.dof[j] == round(np.trace(form))
        # rounding of pseudo-inverses of a few dozen rows
        assert found.squares[j] == pytest.approx(values @ form @ values, rel=1e-9)
        assert found.noise[j] == pytest.approx(np.diag(form) @ noise, rel=1e-9)
        traces = [np.trace(form @ z @ z.T) for z in classes]
        assert found.coefficients[j] == pytest.approx(traces, abs=1e-9 * count)


def test_reach_by_dense_traces():
    rng = np.random.default_rng(4)
    day, start = ragged(rng, 6, 4, 5)
    count = len(day)
    noise, variances = rng.uniform(0.1, 2.0, count), np.array([2.0, 0.5, 0.3])
    found = strata(rng.normal(size=count), nested_groups([day, start], count), np.empty((count, 0)), noise)
    classes = [np.eye(labels.max() + 1)[labels] for labels in (day, start, np.arange(count))]
    projections = [z @ np.linalg.pinv(z) for z in (np.ones((count, 1)), *classes)]
    whole = sum(v * z @ z.T for v, z in zip(variances, classes, strict=True)) + np.diag(noise)
    for j in range(3):
        product = (projections[j + 1] - projections[j]) @ whole
        expected = np.trace(product) ** 2 / np.trace(product @ product) / found.dof[j]
        assert found.reach(j, variances, noise) == pytest.approx(expected, rel=1e-9)
