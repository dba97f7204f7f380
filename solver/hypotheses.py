"""Which blunders a session's data could hold: each as the session put right.

A hypothesis corrects the data, disbelieves some currents, or adds a drift of free size; it never
adds a parameter of the gyro. `free` counts its continuous unknowns and `members` how many of its
kind were tried: both are paid for when hypotheses are compared (`solver.diagnosis`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from solver.current_model import CurrentModel, regressors_at
from solver.geometry import case_orientation, elements
from solver.records import Array, Observations

ANGLE_FACTORS: Final = (60.0, 3600.0, 1 / 60.0, 1 / 3600.0)
"""Certificate numbers that were arcminutes or degrees and read as arcseconds, and the other way."""
QUARTERS: Final = (np.pi / 2, np.pi, 3 * np.pi / 2)
"""By which a stand is indexed wrongly."""
_SAME_ANGLE: Final = 1e-6
_NO_EFFECT: Final = 1e-9
_TURN: Final = 2 * np.pi
_COURSES: Final = (np.inf, 1 / 2, 1 / 4, 1 / 8, 1 / 16)
"""Time constants of a warm-up, parts of the session; infinite is a straight line."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One blunder.

    Attributes
    ----------
    code
    observations
        The session put right, rows as given.
    rows
        Measurements that it speaks of.
    members
        How many hypotheses of this kind were tried.
    free
        Its continuous unknowns.
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
    observations: Observations
    rows: tuple[int, ...] = ()
    members: int = 1
    free: int = 0
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


def same_place(observations: Observations, one: int, other: int) -> bool:
    """Whether two rows were measured in one commanded position."""
    at = observations
    return _close(at.theta[one] - at.theta[other]) and _close(at.psi[one] - at.psi[other])


def _close(angle: float) -> bool:
    return bool(abs((angle + np.pi) % _TURN - np.pi) < _SAME_ANGLE)


def swaps(observations: Observations, x: Array, model: CurrentModel) -> list[tuple[float, Hypothesis]]:
    """Every two measurements exchanged, with the sum of squares that each leaves; costs one batch."""
    n = len(observations)
    one, other = np.triu_indices(n, 1)
    apart = np.abs(x[one] - x[other]).max(axis=1) > _NO_EFFECT
    pairs = np.stack((one, other), axis=1)[apart]
    if not len(pairs):
        return []
    squares = model.replaced(pairs, x[pairs[:, ::-1]])
    return [
        (float(square), _swap(observations, int(p), int(r), len(pairs)))
        for square, (p, r) in _best(squares, pairs, lambda pair: not same_place(observations, *pair))
    ]


_KEPT: Final = 8


def _best(squares: Array, items: Any, accept: Any) -> Iterator[tuple[float, Any]]:
    """Pick the few best, best first."""
    left = _KEPT
    for index in np.argsort(squares, kind="stable"):
        if left and accept(items[index]):
            left -= 1
            yield squares[index], items[index]


def _swap(observations: Observations, one: int, other: int, members: int) -> Hypothesis:
    order = np.arange(len(observations))
    order[[one, other]] = other, one
    at = observations
    corrected = replace(
        at, jx=at.jx[order], jy=at.jy[order],
        u_jx=None if at.u_jx is None else at.u_jx[order], u_jy=None if at.u_jy is None else at.u_jy[order],
    )  # fmt: skip
    return Hypothesis("positions-swapped", corrected, (one, other), members)


@dataclass(frozen=True, slots=True)
class _Place:
    """Where one measurement might really have been made: angles (θ, ψ, α, β, γ)."""

    row: int
    angles: tuple[float, float, float, float, float]


def wrong_positions(observations: Observations, model: CurrentModel) -> list[tuple[float, Hypothesis]]:
    """Every measurement with θ or ψ off by 90, 180 or 270°, with the sum of squares that each leaves.

    The certificate's angles are those of the actual position where it is among the measured ones,
    and those of the commanded one; the better of both counts.
    """
    places = list(_places(observations))
    if not places:
        return []
    angles = np.array([place.angles for place in places])
    x = regressors_at(elements(case_orientation(*angles.T)), observations.latitude)
    index = np.array([[place.row] for place in places])
    squares = model.replaced(index, x[:, None, :])
    return [
        (float(square), _moved(observations, place, len(places)))
        for square, place in _best(squares, places, lambda _: True)
    ]


def _places(observations: Observations) -> Iterator[_Place]:
    at = observations
    for row in range(len(at)):
        own = (float(at.alpha[row]), float(at.beta[row]), float(at.gamma[row]))
        for turn in QUARTERS:
            for theta, psi in (
                (at.theta[row] + turn, at.psi[row]),
                (at.theta[row], at.psi[row] + turn),
            ):
                where = (float(theta % _TURN), float(psi % _TURN))
                yield _Place(row, (*where, *own))
                certified = _certified(at, *where)
                if certified is not None and certified != own:
                    yield _Place(row, (*where, *certified))


def _certified(observations: Observations, theta: float, psi: float) -> tuple[float, float, float] | None:
    """α, β, γ of a commanded position, if it is among the measured ones."""
    at = observations
    here = (np.abs((at.theta - theta + np.pi) % _TURN - np.pi) < _SAME_ANGLE) & (
        np.abs((at.psi - psi + np.pi) % _TURN - np.pi) < _SAME_ANGLE
    )
    if not here.any():
        return None
    row = int(np.argmax(here))
    return float(at.alpha[row]), float(at.beta[row]), float(at.gamma[row])


def _moved(observations: Observations, place: _Place, members: int) -> Hypothesis:
    columns = {}
    for name, value in zip(("theta", "psi", "alpha", "beta", "gamma"), place.angles, strict=True):
        column = getattr(observations, name).copy()
        column[place.row] = value
        columns[name] = column
    corrected = replace(observations, **columns)
    return Hypothesis(
        "position-wrong", corrected, (place.row,), members, details={"actual": place.angles[:2]}
    )


def outliers(observations: Observations, rows: list[tuple[int, str]]) -> Iterator[Hypothesis]:
    """Given measurements disbelieved, each in its channel: x, y or xy."""
    n = len(observations)
    for row, channel in rows:
        missing = np.zeros((n, 2), dtype=np.bool_)
        missing[row] = ["x" in channel, "y" in channel]
        yield Hypothesis(
            "outlier", observations, (row,), n if channel == "xy" else 2 * n,
            free=len(channel), missing=missing, details={"channel": channel},
        )  # fmt: skip


def courses(observations: Observations) -> list[tuple[float, Array]]:
    """Time courses that a warm-up may have: time constant as part of the session, and course (n,)."""
    n = len(observations)
    at = observations.time
    if not np.isfinite(at).all() or not np.ptp(at) > 0:
        at = np.empty(n)
        at[measuring_order(observations)] = np.arange(n, dtype=np.float64)
    part = (at - at.min()) / max(float(np.ptp(at)), 1.0 if n == 1 else 0.0)
    return [(tau, part if np.isinf(tau) else np.exp(-part / tau)) for tau in _COURSES]


def warm_ups(observations: Observations) -> Iterator[Hypothesis]:
    """Both biases drifting, linearly or exponentially."""
    for tau, course in courses(observations):
        yield Hypothesis(
            "warm-up", observations, (), len(_COURSES), free=2, course=course,
            details={"course": "linear" if np.isinf(tau) else "exponential",
                     "time_constant_part": None if np.isinf(tau) else tau},
        )  # fmt: skip


def angle_units(observations: Observations) -> Iterator[Hypothesis]:
    """The certificate's numbers in another unit; nothing where all are zero."""
    at = observations
    largest = max(float(np.abs(angle).max()) for angle in (at.alpha, at.beta, at.gamma))
    if not largest:
        return
    for factor in ANGLE_FACTORS:
        if largest * factor < np.pi:  # no misalignment is larger than half a turn
            corrected = replace(at, alpha=at.alpha * factor, beta=at.beta * factor, gamma=at.gamma * factor)
            yield Hypothesis("angle-unit", corrected, members=len(ANGLE_FACTORS), details={"factor": factor})


def reversals(observations: Observations) -> Iterator[Hypothesis]:
    """θ or ψ counted the other way; the certificate's angles of the actual position or of the label."""
    at = observations
    for code, theta, psi in (
        ("psi-reversed", at.theta, -at.psi % _TURN),
        ("theta-reversed", -at.theta % _TURN, at.psi),
    ):
        turned = replace(at, theta=theta, psi=psi)
        yield Hypothesis(code, turned, members=4)
        found = [_certified(at, float(t), float(p)) for t, p in zip(theta, psi, strict=True)]
        known = [item for item in found if item is not None]
        if len(known) == len(at):
            alpha, beta, gamma = np.array(known).T
            looked_up = replace(turned, alpha=alpha, beta=beta, gamma=gamma)
            if not all(
                np.array_equal(getattr(at, n), getattr(looked_up, n)) for n in ("alpha", "beta", "gamma")
            ):
                yield Hypothesis(code, looked_up, members=4)
