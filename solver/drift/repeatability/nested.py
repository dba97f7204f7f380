"""Repeatability in variance components: day ⊃ start ⊃ session ⊃ position ⊃ what the currents do within one.

A value of one session, of one gyro or of several of a type, is::

    value = fixed + (gyro) + day + start + session + positions + noise

The two lowest are not repeated, they are known for each session: u², what the currents' noise within a
position gives the parameter, and by the fit's χ²/ν, pooled over the sessions, how much more the positions scatter
about the fit than that: c = Σχ²/Σν, within-position u², between-positions u²·(c − 1), together c·u². The
levels above are estimated from the sums of squares of `solver.drift.repeatability.strata`, each mean square

    MS_j = SS_j/ν_j,   E MS_j = Σ_{k ≥ j} e_jk·σ_k² + e_j0·c

set equal to its expectation and solved: unbiased. A negative estimate becomes zero, its interval stays. A start
belongs to the day of its power-up. In the words of the classic torque-to-balance test, between-sessions is the
operating instability, between-starts and between-days the shutdown instability.

Tests
    F = MS_j/D with D = Σ_{i > j} w_i·MS_i that combination of the mean squares below whose expectation
    is that of MS_j when σ_j² = 0; one mean square in a balanced design. Degrees of freedom of D by
    Satterthwaite (`mean_squares.effective_dof`), those of MS_j by its two moments at σ_j² = 0. The
    lowest estimated level is tested against c·u², between-positions by c against 1.

Intervals
    Modified large-sample bounds of `mean_squares`, each mean square with the degrees of freedom
    that its two moments have at the estimates, below zero taken to be zero: a variance is not
    negative, so that this costs no coverage.

What the data do not separate
    With one session of each start, starts and sessions are one source: the uppermost name holds it,
    `Component.confounded_with` names the others, whose own rows have no numbers. With one day only, days are
    confounded with the fixed part, and no number is invented for them.

What all sessions share is not here, an error of the stand's certificate, say: it shifts all values alike. Where
errors of the stand's angles raise χ², they repeat from session to session with the same positions, and c·u² is more
than the sessions can show: take χ² with the certificate's uncertainties in its weights.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solver.drift.repeatability.components import (
    BETWEEN_POSITIONS,
    BETWEEN_SESSIONS,
    FIXED,
    WITHIN_POSITION,
    Component,
    Repeatability,
    Within,
)
from solver.drift.repeatability.mean_squares import bounds, effective_dof, tail_of_f
from solver.drift.repeatability.strata import Groups, Strata, nested_groups, strata
from solver.errors import InputError, Message
from solver.records import Array

__all__ = ["Component", "Repeatability", "Within", "nested_components"]


def nested_components(
    values: ArrayLike,
    labels: Mapping[str, ArrayLike],
    within: Within | None = None,
    *,
    design: ArrayLike | None = None,
    lowest: str = BETWEEN_SESSIONS,
    level: float = 0.95,
) -> Repeatability:
    """Estimate the components of variance.

    Parameters
    ----------
    values : (n,) array_like
        One of each session.
    labels : mapping of str to (n,) array_like
        Names of the sources above the session, uppermost first, with the group of each value:
        ``{"between-days": day, "between-starts": start}``. With gyros uppermost each has a mean of its own,
        and the rows below are pooled over the type.
    within : Within, optional
        Without it the lowest level holds the noise as well and is not tested.
    design : (n, p) array_like, optional
        Fixed effects to be removed, beside the mean: steps, a drift.
    lowest : str
        Name of the level of single values.
    level : float
        Probability of the intervals.

    Raises
    ------
    InputError
        When there are fewer than two values, lengths differ, or a number is not finite or negative.
    """
    measured = np.asarray(values, np.float64)
    columns = np.empty((len(measured), 0)) if design is None else np.asarray(design, np.float64)
    _check(measured, columns)
    noise = _Noise.of(within, len(measured))
    groups, rows = _separate(nested_groups(list(labels.values()), len(measured)), (*labels, lowest))
    table = strata(measured, groups, columns, noise.variances)
    table, rows = _estimable(table, rows)
    if within is None and lowest == BETWEEN_SESSIONS and rows.held:
        rows = rows.below((WITHIN_POSITION, BETWEEN_POSITIONS))
    return _solve(table, rows, noise, level)


@dataclass(frozen=True, slots=True)
class _Rows:
    """Names of each estimated level, uppermost level and name first, and of what is not seen at all."""

    held: tuple[tuple[str, ...], ...]
    unseen: tuple[str, ...]

    def below(self, names: tuple[str, ...]) -> "_Rows":
        """The lowest level holds others as well."""
        return _Rows((*self.held[:-1], self.held[-1] + names), self.unseen)


@dataclass(frozen=True, slots=True)
class _Noise:
    """Variances u² and, by the fits, the factor c with its degrees of freedom.

    `given` is False where nothing is known within the sessions, `fitted` where no fit says what c is.
    """

    variances: Array
    factor: float
    dof: float
    u_dof: float
    given: bool
    fitted: bool

    @classmethod
    def of(cls, within: Within | None, count: int) -> "_Noise":
        if within is None:
            return cls(np.zeros(count), 1.0, np.inf, np.inf, False, False)
        u = np.asarray(within.u, np.float64)
        u_dof = np.inf if within.u_dof is None else within.u_dof
        if u.shape != (count,) or not np.isfinite(u).all() or (u < 0.0).any() or not u_dof > 0.0:
            raise InputError(_NOISE)
        if within.chi2 is None or within.dof is None:
            return cls(u**2, 1.0, u_dof, u_dof, True, False)
        chi2, dof = np.asarray(within.chi2, np.float64), np.asarray(within.dof, np.float64)
        if chi2.shape != u.shape or dof.shape != u.shape or not (chi2 >= 0.0).all() or not (dof >= 0.0).all():
            raise InputError(_NOISE)
        total = float(dof.sum())
        if total == 0.0:
            return cls(u**2, 1.0, u_dof, u_dof, True, False)
        return cls(u**2, float(chi2.sum()) / total, total, u_dof, True, True)

    @property
    def mean(self) -> float:
        """u² on average."""
        return float(self.variances.mean())


def _separate(groups: list[Groups], names: tuple[str, ...]) -> tuple[list[Groups], _Rows]:
    """Keep the levels that split the one above; the others' names go to it."""
    kept, held, unseen = [groups[0]], list[tuple[str, ...]](), list[str]()
    for name, own in zip(names, groups[1:], strict=True):
        if own.max() > kept[-1].max():
            kept.append(own)
            held.append((name,))
        elif held:
            held[-1] += (name,)
        else:
            unseen.append(name)
    return kept, _Rows(tuple(held), tuple(unseen))


def _estimable(table: Strata, rows: _Rows) -> tuple[Strata, _Rows]:
    """Leave out levels without a degree of freedom beside the fixed effects.

    What is above such a level cannot be told from it, nor from the fixed effects.
    """
    empty = np.flatnonzero(table.dof < 0.5)
    if len(empty) == 0:
        return table, rows
    first = int(empty[-1]) + 1
    unseen = (*rows.unseen, *(name for names in rows.held[:first] for name in names))
    kept = Strata(
        groups=table.groups[first:],
        squares=table.squares[first:],
        dof=table.dof[first:],
        coefficients=table.coefficients[first:, first:],
        noise=table.noise[first:],
    )
    return kept, _Rows(rows.held[first:], unseen)


def _solve(table: Strata, rows: _Rows, noise: _Noise, level: float) -> Repeatability:
    """Equate mean squares to expectations; the last mean square is c."""
    count = len(table.dof)
    squares = np.append(table.squares / np.maximum(table.dof, 1.0), noise.factor)
    expected = np.eye(count + 1)
    expected[:count, :count] = table.coefficients / np.maximum(table.dof, 1.0)[:, None]
    expected[:count, count] = table.noise / np.maximum(table.dof, 1.0)
    combinations = np.linalg.inv(expected)
    estimates = np.maximum(combinations @ squares, 0.0)
    spread = noise.factor * noise.variances
    dof = np.append(table.dof, noise.dof)
    reach = np.array([table.reach(j, estimates[:count], spread) for j in range(count)])
    effective = np.append(table.dof * reach, noise.dof)

    lines = [_unseen(name) for name in rows.unseen]
    for j, names in enumerate(rows.held):
        row = _component(names[0], combinations[j], squares, effective, level)
        test = _test(table, j, expected, squares, effective, estimates, spread)
        lines += [_merged(row, names, float(dof[j]), test)]
        lines += [_elsewhere(name, names) for name in names[1:]]
    lowest = _known(noise, level) if noise.given else ()
    whole = combinations[:count].sum(axis=0)
    whole[count] += noise.mean
    together = _component("together", whole, squares, effective, level)
    return Repeatability((*lowest, *reversed(lines)), together, level)


def _component(source: str, weights: Array, squares: Array, dof: Array, level: float) -> Component:
    low, high = bounds(weights, squares, dof, level)
    variance = max(0.0, float(weights @ squares))
    freedom = effective_dof(weights, squares, dof)
    return Component(
        source=source,
        variance=variance,
        sd=variance**0.5,
        low=max(0.0, low) ** 0.5,
        high=max(0.0, high) ** 0.5,
        dof=freedom if np.isfinite(freedom) else None,
    )


def _test(
    table: Strata,
    j: int,
    expected: Array,
    squares: Array,
    effective: Array,
    estimates: Array,
    spread: Array,
) -> tuple[float | None, float | None, float | None]:
    """F, the denominator's degrees of freedom (None: known), p."""
    weights = np.asarray(np.linalg.solve(expected[j + 1 :, j + 1 :].T, expected[j, j + 1 :]), np.float64)
    below = float(weights @ squares[j + 1 :])
    if (
        not below > 0.0
    ):  # a combination that came out negative: what none of the components less than zero gives
        below = float(expected[j, j + 1 :] @ estimates[j + 1 :])
    if not below > 0.0:
        return None, None, None
    dof_below = effective_dof(weights, squares[j + 1 :], effective[j + 1 :], below)
    null = estimates[: len(table.dof)].copy()
    null[j] = 0.0
    f = float(squares[j]) / below
    p_value = tail_of_f(f, float(table.dof[j]) * table.reach(j, null, spread), dof_below)
    return f, dof_below if np.isfinite(dof_below) else None, p_value


def _known(noise: _Noise, level: float) -> tuple[Component, ...]:
    """Within a position and between positions."""
    squares = np.array([noise.mean * noise.factor, noise.mean])
    dof = np.array([noise.dof, noise.u_dof])
    within = _component(WITHIN_POSITION, np.array([0.0, 1.0]), squares, dof, level)
    if not noise.fitted:
        return _merged(
            within, (WITHIN_POSITION, BETWEEN_POSITIONS), within.dof, (None, None, None)
        ), _elsewhere(BETWEEN_POSITIONS, (WITHIN_POSITION, BETWEEN_POSITIONS))
    between = _component(BETWEEN_POSITIONS, np.array([1.0, -1.0]), squares, dof, level)
    p_value = tail_of_f(noise.factor, noise.dof, noise.u_dof)
    below = noise.u_dof if np.isfinite(noise.u_dof) else None
    return within, _merged(between, (BETWEEN_POSITIONS,), noise.dof, (noise.factor, below, p_value))


def _merged(
    row: Component,
    names: tuple[str, ...],
    dof: float | None,
    test: tuple[float | None, float | None, float | None],
) -> Component:
    f, dof_below, p_value = test
    return Component(
        row.source, row.variance, row.sd, row.low, row.high, dof, f, dof_below, p_value, names[1:]
    )


def _elsewhere(name: str, names: tuple[str, ...]) -> Component:
    return Component(name, None, None, None, None, confounded_with=tuple(n for n in names if n != name))


def _unseen(name: str) -> Component:
    return Component(name, None, None, None, None, confounded_with=(FIXED,))


def _check(values: Array, design: Array) -> None:
    if values.ndim != 1 or len(values) < 2:
        raise InputError(_TOO_FEW)
    if design.ndim != 2 or len(design) != len(values):
        raise InputError(_DESIGN)
    if not (np.isfinite(values).all() and np.isfinite(design).all()):
        raise InputError(_NOT_FINITE)


_TOO_FEW = Message("nested-too-few", "Components of variance need two sessions at least.")
_DESIGN = Message("nested-design", "Fixed effects need one row for each session.")
_NOT_FINITE = Message("nested-not-finite", "Components of variance need finite values and fixed effects.")
_NOISE = Message(
    "nested-noise",
    "What is known within the sessions needs one finite number for each session, none of them negative.",
)
