"""Which blunders a session's data could hold: each as the session put right.

A hypothesis corrects the data, disbelieves some currents, or adds a drift of free size; it never
adds a parameter of the gyro. `free` counts its continuous unknowns and `members` how many of its
kind were tried: both are paid for when hypotheses are compared (`solver.blunders.diagnosis`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from solver.blunders.current_model import CurrentModel, regressors_at
from solver.geometry import case_orientation, elements
from solver.records import Array, Observations

ANGLE_FACTORS: Final = (60.0, 3600.0, 1 / 60.0, 1 / 3600.0)
"""Certificate numbers that were arcminutes or degrees and read as arcseconds, and the other way."""
QUARTERS: Final = np.array([np.pi / 2, np.pi, 3 * np.pi / 2])
"""By which a stand is indexed wrongly."""
_COURSES: Final = (np.inf, 1 / 2, 1 / 4, 1 / 8, 1 / 16)
"""Time constants of a warm-up, parts of the session; infinite is a straight line."""
_SAME_ANGLE: Final = 1e-6
_NO_EFFECT: Final = 1e-9
_TURN: Final = 2 * np.pi
_KEPT: Final = 6


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One blunder.

    Attributes
    ----------
    code
    rows
        Measurements that it speaks of.
    members
        How many hypotheses of this kind were tried.
    free
        Its continuous unknowns.
    x : (n, 5) array or None
        Regressors (`solver.blunders.current_model`) put right.
    order : (n,) int array or None
        For each row, the one whose currents belong there.
    missing : (n, 2) bool array or None
        Currents that are not believed.
    course : (n,) array or None
        Time course of a drift of both biases.
    repeated : (m,) array or None
        Readings of one channel that shall be one and the same, A; they count as data of the hypothesis.
    details
        ``channel`` (x or y), ``actual`` (θ, ψ), ``factor``, …
    """

    code: str
    rows: tuple[int, ...] = ()
    members: int = 1
    free: int = 0
    x: Array | None = None
    order: NDArray[np.int64] | None = None
    missing: NDArray[np.bool_] | None = None
    course: Array | None = None
    repeated: Array | None = None
    details: Mapping[str, Any] = field(default_factory=dict)


def measuring_order(observations: Observations) -> NDArray[np.int64]:
    """Rows as they were measured: by time where it is known, else a round of θ outer, ψ inner per repeat."""
    at = observations
    if np.isfinite(at.time).all():
        return np.argsort(at.time, kind="stable")
    return np.lexsort((at.psi, at.theta, at.repeat))


def same_place(observations: Observations) -> NDArray[np.bool_]:
    """Which rows were measured in one commanded position, (n, n)."""
    at = observations
    return _close(at.theta[:, None], at.theta) & _close(at.psi[:, None], at.psi)


def _close(one: Array, other: Array) -> NDArray[np.bool_]:
    return np.asarray(np.abs((one - other + np.pi) % _TURN - np.pi) < _SAME_ANGLE)


def _certified(observations: Observations, theta: Array, psi: Array) -> NDArray[np.int64]:
    """For commanded positions (m,) a row of the same place, whose certified angles hold there; −1 for none."""
    at = observations
    here = _close(theta[:, None], at.theta) & _close(psi[:, None], at.psi)
    return np.where(here.any(axis=1), np.argmax(here, axis=1), -1)


def _regressors(observations: Observations, theta: Array, psi: Array, angles: Array) -> Array:
    """Regressors for angles α, β, γ (..., 3) at θ, ψ (...,)."""
    alpha, beta, gamma = angles[..., 0], angles[..., 1], angles[..., 2]
    return regressors_at(elements(case_orientation(theta, psi, alpha, beta, gamma)), observations.latitude)


def _angles(observations: Observations) -> Array:
    return np.stack((observations.alpha, observations.beta, observations.gamma), axis=1)


def swaps(observations: Observations, x: Array, model: CurrentModel) -> list[tuple[float, Hypothesis]]:
    """Two measurements exchanged: the best few, with the sum of squares that each leaves."""
    one, other = np.nonzero(np.triu(~same_place(observations), 1))
    apart = np.abs(x[one] - x[other]).max(axis=1) > _NO_EFFECT
    pairs = np.stack((one, other), axis=1)[apart]
    if not len(pairs):
        return []
    squares = model.replaced(pairs, x[pairs[:, ::-1]])
    found = []
    for index in np.argsort(squares, kind="stable")[:_KEPT]:
        rows = (int(pairs[index, 0]), int(pairs[index, 1]))
        order = np.arange(len(x))
        order[list(rows)] = rows[::-1]
        found.append((float(squares[index]), Hypothesis("positions-swapped", rows, len(pairs), order=order)))
    return found


def wrong_positions(
    observations: Observations, x: Array, model: CurrentModel
) -> list[tuple[float, Hypothesis]]:
    """A measurement with θ or ψ off by 90, 180 or 270°: the best few, with the sum of squares of each.

    The certificate's angles are those of the actual position where it is among the measured ones,
    and those of the commanded one; the better of both counts.
    """
    at, n = observations, len(observations)
    theta = np.concatenate([*(at.theta + turn for turn in QUARTERS), *[at.theta] * len(QUARTERS)]) % _TURN
    psi = np.concatenate([*[at.psi] * len(QUARTERS), *(at.psi + turn for turn in QUARTERS)]) % _TURN
    row = np.tile(np.arange(n), 2 * len(QUARTERS))
    there = _certified(at, theta, psi)
    looked_up = there >= 0
    source = np.concatenate((row, there[looked_up]))
    theta, psi = np.append(theta, theta[looked_up]), np.append(psi, psi[looked_up])
    row = np.append(row, row[looked_up])
    moved = _regressors(at, theta, psi, _angles(at)[source])
    squares = model.replaced(row[:, None], moved[:, None, :])
    found = []
    for index in np.argsort(squares, kind="stable")[:_KEPT]:
        changed = x.copy()
        changed[row[index]] = moved[index]
        actual = (float(theta[index]), float(psi[index]))
        hypothesis = Hypothesis(
            "position-wrong", (int(row[index]),), len(row), x=changed, details={"actual": actual}
        )
        found.append((float(squares[index]), hypothesis))
    return found


def outliers(count: int, worst: list[tuple[int, str]]) -> Iterator[Hypothesis]:
    """Given measurements of `count` disbelieved, each in its channel: x, y or xy."""
    for row, channel in worst:
        missing = np.zeros((count, 2), dtype=np.bool_)
        missing[row] = ["x" in channel, "y" in channel]
        yield Hypothesis(
            "outlier", (row,), count if channel == "xy" else 2 * count,
            free=len(channel), missing=missing, details={"channel": channel},
        )  # fmt: skip


def courses(observations: Observations) -> Array:
    """Time courses that a warm-up may have, (5, n): a straight line first."""
    n = len(observations)
    at = observations.time
    if not np.isfinite(at).all() or not np.ptp(at) > 0:
        at = np.empty(n)
        at[measuring_order(observations)] = np.arange(n, dtype=np.float64)
    part = (at - at.min()) / max(float(np.ptp(at)), np.finfo(float).tiny)
    return np.stack([part if np.isinf(tau) else np.exp(-part / tau) for tau in _COURSES])


def warm_ups(observations: Observations) -> Iterator[Hypothesis]:
    """Both biases drifting, linearly or exponentially."""
    for tau, course in zip(_COURSES, courses(observations), strict=True):
        yield Hypothesis(
            "warm-up", (), len(_COURSES), free=2, course=course,
            details={"course": "linear" if np.isinf(tau) else "exponential"},
        )  # fmt: skip


def whole_sessions(observations: Observations, x: Array) -> list[Hypothesis]:
    """ψ or θ counted the other way, or the certificate's angles in another unit; those that change anything.

    The certificate's angles of a reversed position are those of the label, or, where it was measured
    too, those of the actual position.
    """
    at, angles = observations, _angles(observations)
    kinds: list[tuple[str, dict[str, float]]] = []
    theta, psi, turned = [], [], []
    for code, mirrored in (
        ("psi-reversed", (at.theta, -at.psi % _TURN)),
        ("theta-reversed", (-at.theta % _TURN, at.psi)),
    ):
        there = _certified(at, *mirrored)
        for certified in (angles, angles[there]) if (there >= 0).all() else (angles,):
            kinds.append((code, {}))
            theta.append(mirrored[0])
            psi.append(mirrored[1])
            turned.append(certified)
    largest = float(np.abs(angles).max())
    for factor in ANGLE_FACTORS:
        if 0 < largest * factor < np.pi:  # no misalignment is larger than half a turn
            kinds.append(("angle-unit", {"factor": factor}))
            theta.append(at.theta)
            psi.append(at.psi)
            turned.append(angles * factor)
    rows = _regressors(at, np.stack(theta), np.stack(psi), np.stack(turned))
    return [
        Hypothesis(code, members=4, x=changed, details=details)
        for (code, details), changed in zip(kinds, rows, strict=True)
        if np.abs(changed - x).max() > _NO_EFFECT
    ]
