"""Cheap alarms: whether to search for blunders, and which measurements look worst.

From the one fit of the data as given, with S the projection onto what its design does not span, W the
whitening and e the whitened residuals, a free error in direction δ of the currents lowers the sum of
squares by (δᵀ·Wᵀ·e)²/(δᵀ·Wᵀ·S·W·δ) (Baarda's data snooping), and a free combination of several directions
by the quadratic form with the inverse of their matrix. Exact, without another fit.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import special

from solver.blunders.hypotheses import courses
from solver.blunders.hypothesis_fit import UNTOLD, Fitted
from solver.blunders.hypothesis_score import LEAST_FREEDOM, LEVEL, Session
from solver.constants import EARTH_RATE
from solver.error_model import scale_matrix
from solver.records import Array

GROSS: Final = 2e-3 * EARTH_RATE
"""Scatter of the rates without stated noise that is worth a search, 0.03 °/h, rad/s."""
NOTICED: Final = 30.0
"""Errors of a single current that should show at the latest, in units of u."""
_POWER: Final = 1.645
_SINGULAR: Final = 1e-9
_COURSES: Final = 5
_WORST: Final = 3
_WORST_BOTH: Final = 2


@dataclass(frozen=True, slots=True)
class Suspicion:
    """Whether to search, and (row, channel) of the worst measurements, channel x, y or xy."""

    search: bool
    worst: list[tuple[int, str]]


def suspect(session: Session) -> Suspicion:
    """Look at the fit of the data as given."""
    fitted, good = session.good.fitted, session.good
    overall = session.improbable(good, LEVEL)
    if fitted is None:
        return _by_deletion(session)
    single, both = _deletions(fitted)
    n = len(both)
    worst = [(int(i) // 2, "xy"[int(i) % 2]) for i in np.argsort(-single, kind="stable")[:_WORST]]
    worst += [(int(i), "xy") for i in np.argsort(-both, kind="stable")[:_WORST_BOTH]]
    falls = [(float(single.max()), 1, 2 * n), (float(both.max()), 2, n)]
    falls += [(fall, 2, _COURSES) for fall in _drifts(session, fitted)]
    alarm = any(_chance(session, fall, free) * members < LEVEL for fall, free, members in falls)
    gross = not session.told and good.best.dof > 0 and np.sqrt(good.best.variance) * UNTOLD > GROSS
    return Suspicion(bool(overall or alarm or gross), worst)


def hidden(session: Session) -> list[tuple[int, str]]:
    """Measurements, (row, channel) with channel x, y or xy, of which an error of `NOTICED` u may not show.

    An error of δ·u lowers the sum of squares by δ²·r once it is taken out, r the measurement's redundancy
    (Baarda), and is noticed with a probability of 95 % where that is past the threshold by 1.6 deviations.
    """
    n = len(session.x)
    chance, freedom = LEVEL / (2 * n), session.good.best.dof - 1
    if freedom < (0 if session.told else LEAST_FREEDOM):
        return [(row, "xy") for row in range(n)]
    least = -special.ndtri(chance / 2) if session.told else -special.stdtrit(freedom, chance / 2)
    faint = _redundancies(session).reshape(n, 2) < ((least + _POWER) / NOTICED) ** 2
    return [
        (int(row), "".join(np.array(["x", "y"])[faint[row]])) for row in np.flatnonzero(faint.any(axis=1))
    ]


def _redundancies(session: Session) -> Array:
    """Part of each current's error, squared and over u, that stays in the residuals, (2n,)."""
    fitted = session.good.fitted
    if fitted is not None:
        g, size = _redundancy(fitted)
        return np.asarray(np.diagonal(g) * (session.u.ravel() ** 2 if session.told else 1.0 / size))
    weighted = session.model.rows[:, None] * np.sqrt(session.model.weights)[..., None]
    u, s, _ = np.linalg.svd(np.swapaxes(weighted, 0, 1), full_matrices=False)
    spanned = np.sum(np.where(s > _SINGULAR * s[:, :1], 1.0, 0.0)[:, None] * u**2, axis=-1)
    return np.asarray(1.0 - spanned.T).ravel()


def _by_deletion(session: Session) -> Suspicion:
    """Where the scale factors do not show: the largest residuals of the currents."""
    size = np.abs(session.rest) * np.sqrt(session.model.weights)
    worst = [(int(i) // 2, "xy"[int(i) % 2]) for i in np.argsort(-size.ravel(), kind="stable")[:_WORST]]
    worst += [(int(i), "xy") for i in np.argsort(-size.sum(axis=1), kind="stable")[:_WORST_BOTH]]
    return Suspicion(
        session.good.best.dof > 0 and (not session.told or session.improbable(session.good, LEVEL)), worst
    )


def _deletions(fitted: Fitted) -> tuple[Array, Array]:
    """Falls of the sum of squares without each current, (2n,), and without each position's both, (n,)."""
    g, size = _redundancy(fitted)
    b = _dense(fitted.whitening).T @ fitted.rest
    diagonal = np.diagonal(g)
    single = np.where(diagonal > _SINGULAR * size, b**2 / np.maximum(diagonal, _SINGULAR * size), 0.0)
    n = len(b) // 2
    row = np.arange(n)
    blocks = g.reshape(n, 2, n, 2)[row, :, row, :]
    values, vectors = np.linalg.eigh(blocks / size.reshape(n, 2).mean(axis=1)[:, None, None])
    along = np.vecmat(b.reshape(n, 2), vectors) ** 2 / size.reshape(n, 2).mean(axis=1)[:, None]
    both = np.sum(np.where(values > _SINGULAR, along / np.maximum(values, _SINGULAR), 0.0), axis=1)
    return single, both


def _redundancy(fitted: Fitted) -> tuple[Array, Array]:
    """Wᵀ·S·W (2n, 2n), and the diagonal of Wᵀ·W."""
    w = _dense(fitted.whitening)
    spanned = fitted.span.T @ w
    return w.T @ w - spanned.T @ spanned, np.einsum("ij,ij->j", w, w)


def _drifts(session: Session, fitted: Fitted) -> list[float]:
    """Falls of the sum of squares with a drift of both biases, for each course."""
    inverse = np.linalg.inv(scale_matrix(fitted.values))
    columns = _dense(fitted.whitening) @ np.kron(courses(session.observations)[..., None], inverse)
    columns = columns - fitted.span @ (fitted.span.T @ columns)
    values, vectors = np.linalg.eigh(np.swapaxes(columns, 1, 2) @ columns)
    seen = values > _SINGULAR * np.maximum(values[:, -1:], np.finfo(float).tiny)
    along = np.vecmat(np.vecmat(fitted.rest, columns), vectors) ** 2
    falls = np.sum(np.where(seen, along / np.where(seen, values, 1.0), 0.0), axis=1)
    return [float(fall) for fall in falls]


def _dense(whitening: Array) -> Array:
    """Blocks (n, 2, 2) as one matrix (2n, 2n)."""
    if whitening.ndim == 2:
        return whitening
    n = len(whitening)
    dense = np.zeros((n, 2, n, 2))
    dense[np.arange(n), :, np.arange(n), :] = whitening
    return dense.reshape(2 * n, 2 * n)


def _chance(session: Session, fall: float, free: int) -> float:
    """Probability of such a fall in good data."""
    if session.told:
        return float(special.chdtrc(free, fall))
    freedom, rest = session.good.best.dof - free, session.good.best.squares - fall
    if freedom < 1:
        return 1.0
    return float(special.fdtrc(free, freedom, (fall / free) / (rest / freedom))) if rest > 0 else 0.0
