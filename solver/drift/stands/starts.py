"""A stand's sessions as starts of its gyros, and how much starts scatter.

A start is what one gyro gave under one certificate between switching on and off: its sessions averaged, weighted
by their noise. Its eight parameters p are ::

    p = course of the gyro + scatter of the start + noise,      covariance V = D·R·D,  D² = τ² + u²

τ² of each parameter comes from the differences of successive starts of each gyro, pooled over the gyros of one
kind: it makes the median of ``difference²/(u₁² + u₂² + 2τ²)`` that of χ² with one degree of freedom. A median, and
differences: steps and drifts of single gyros count little. R is the correlation of the differences over their
standard uncertainties, those longer than 99 % of normal ones drawn in (else one jump would be a correlation),
shrunk towards none where there are few.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from solver.records import Array

Whole = NDArray[np.int64]

_MEDIAN: Final = float(special.chdtri(1, 0.5))
_DRAWN_IN: Final = float(np.sqrt(special.chdtri(8, 0.01)))
_PRIOR_COUNT: Final = 16.0
"""So many differences count as much as the belief that there is no correlation."""
_EFFICIENCY: Final = 0.37
"""Of a median deviation: it is as certain as a mean square of so many fewer values."""
_UNKNOWN: Final = 1e6
"""So many scatters is a parameter uncertain that was not determined."""


@dataclass(frozen=True, slots=True)
class Starts:
    """Starts on a stand, in the order of their first sessions.

    Attributes
    ----------
    session : (m,) int array
        First session of each.
    time : (m,) array
        Of that session, s.
    gyro, certificate : (m,) int array
    value : (m, 8) array
        In units of `scale`; 0 where not determined.
    precision : (m, 8, 8) array
        V⁻¹, in units of `scale`.
    signature : (m, 8) array
        Change per rad of a turn about east, in units of `scale`.
    scale : (8,) array
        Typical standard deviation of each parameter from start to start, SI.
    dof : float
        Degrees of freedom that V is known with.
    """

    session: Whole
    time: Array
    gyro: Whole
    certificate: Whole
    value: Array
    precision: Array
    signature: Array
    scale: Array
    dof: float

    def __getitem__(self, which: Whole | NDArray[np.bool_] | slice) -> "Starts":
        """Some of the starts."""
        return Starts(
            self.session[which], self.time[which], self.gyro[which], self.certificate[which],
            self.value[which], self.precision[which], self.signature[which], self.scale, self.dof,
        )  # fmt: skip


def starts_of(
    time: Array,
    gyro: Whole,
    kind: Whole,
    certificate: Whole,
    start: Whole,
    value: Array,
    u: Array,
    signature: Array,
) -> Starts:
    """Average the sessions of each start.

    Parameters
    ----------
    time, gyro, kind, certificate, start : (n,) array
        Of sessions in the order of time; all but the first are labels.
    value, u, signature : (n, 8) array
        Parameters, their standard uncertainties from noise, and their change per rad of a turn about east;
        NaN where not determined, or not known.
    """
    session, unit = _grouped(gyro, certificate, start)
    known = np.isfinite(value)
    spread, noisy = _filled(u)
    weight = np.where(known, 1.0 / spread**2, 0.0)
    total = _summed(weight, unit)
    there = total > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(there, _summed(weight * np.where(known, value, 0.0), unit) / total, np.nan)
        noise = np.where(there & noisy, 1.0 / np.sqrt(total), 0.0)
    of = gyro[session], kind[session], certificate[session]
    deviation = np.sqrt(_scatter(mean, noise, *of) + noise**2)
    scale = np.array([_middle(column[column > 0.0]) for column in deviation.T])
    deviation = np.where(deviation > 0.0, deviation, scale)
    correlation = _correlation(mean, deviation, gyro[session], certificate[session])
    precision = np.linalg.inv(correlation) / (deviation[:, :, None] * deviation[:, None, :])
    vague = np.where(there, 1.0, 1.0 / _UNKNOWN)
    return Starts(
        session=session,
        time=time[session],
        gyro=of[0],
        certificate=of[2],
        value=np.where(there, mean, 0.0) / scale,
        precision=precision * (vague[:, :, None] * vague[:, None, :]) * np.outer(scale, scale),
        signature=np.nan_to_num(signature[session]) / scale,
        scale=scale,
        dof=max(1.0, _EFFICIENCY * len(_successive(of[0], of[2])[0]) / len(np.unique(of[1]))),
    )


def _grouped(gyro: Whole, certificate: Whole, start: Whole) -> tuple[Whole, Whole]:
    """First session of each start, in order, and the start of each session."""
    labels = np.stack((gyro, certificate, start), axis=1)
    _, first, unit = np.unique(labels, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[unit.ravel()]


def _filled(u: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Uncertainties with the typical one where none is known, and for which parameters any is, (8,)."""
    usable = np.isfinite(u) & (u > 0.0)
    typical = np.array([_middle(column[there]) for column, there in zip(u.T, usable.T, strict=True)])
    return np.where(usable, u, typical), np.asarray(usable.any(axis=0))


def _middle(values: Array) -> float:
    return float(np.median(values)) if len(values) else 1.0


def _summed(rows: Array, unit: Whole) -> Array:
    total = np.zeros((int(unit.max(initial=-1)) + 1, rows.shape[1]))
    np.add.at(total, unit, rows)
    return total


def _successive(gyro: Whole, certificate: Whole) -> tuple[Whole, Whole]:
    """Pairs of successive starts of one gyro under one certificate."""
    order = np.lexsort((np.arange(len(gyro)), certificate, gyro))
    same = (np.diff(gyro[order]) == 0) & (np.diff(certificate[order]) == 0)
    return order[:-1][same], order[1:][same]


def _scatter(mean: Array, noise: Array, gyro: Whole, kind: Whole, certificate: Whole) -> Array:
    """τ² of every start's parameters by its gyro's kind, (m, 8); of all kinds where one has too few."""
    one, other = _successive(gyro, certificate)
    square, known = (mean[other] - mean[one]) ** 2, noise[one] ** 2 + noise[other] ** 2
    found = np.tile(_excess(square, known), (len(mean), 1))
    for label in np.unique(kind):
        mine = kind[one] == label
        if mine.sum() >= _PRIOR_COUNT:
            found[kind == label] = _excess(square[mine], known[mine])
    return found


def _excess(square: Array, known: Array) -> Array:
    """τ² of each parameter, (8,), that makes the median of square/(known + 2τ²) what it should be."""
    found = np.zeros(square.shape[1])
    for column in range(len(found)):
        there = np.isfinite(square[:, column])
        s, v = square[there, column], known[there, column]
        if not len(s):
            continue
        low, high = 0.0, float(s.max()) / (2 * _MEDIAN)
        for _ in range(60):
            middle = (low + high) / 2
            if np.count_nonzero(s > _MEDIAN * (v + 2 * middle)) * 2 > len(s):
                low = middle
            else:
                high = middle
        found[column] = high if low > 0.0 else 0.0
    return found


def _correlation(mean: Array, deviation: Array, gyro: Whole, certificate: Whole) -> Array:
    """R, (8, 8), of what starts scatter by."""
    one, other = _successive(gyro, certificate)
    z = np.nan_to_num((mean[other] - mean[one]) / np.hypot(deviation[one], deviation[other]))
    length = np.linalg.norm(z, axis=1, keepdims=True)
    z = z * np.minimum(1.0, _DRAWN_IN / np.maximum(length, _DRAWN_IN))
    products = z.T @ z + _PRIOR_COUNT * np.eye(8)
    size = np.sqrt(np.diagonal(products))
    return np.asarray(products / np.outer(size, size))
