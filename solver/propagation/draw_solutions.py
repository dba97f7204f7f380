"""The parameters of every draw of a session's inputs: the estimate repeated a million times.

An estimate is the solution of eight equations that are linear in the observation equations,
``L·(right_side − design·q) = 0``, with

- L = designᵀ·P for least squares with fixed weights P = WᵀW: the design is the draw's own, so that
  errors in the design (the currents stand in it) have their full effect, not only that of first order;
- a constant L for the paper's method (`solver.successive.combination`).

The design consists of few features, ``f = (Jx, Jy, nx, ny, 1)``, each of which stands in one column
per channel. All sums over positions therefore come from ``Σ f·P·g`` over pairs of features, which
are a third of the products that the design itself would need, and the 8×8 matrices follow by one
multiplication with a constant matrix. The same multiplication brings them to the basis T in which
the matrix of the undisturbed inputs is the identity; a draw's differs little from it, elimination
needs no pivots, and only the difference from the estimate is solved for.

The products lose about ε·κ² of that difference, κ the condition number of the scaled, whitened
design. Where κ exceeds `MOST_CONDITION` (10·ε·κ² times a difference of 50 u is then 1e-9 u), and for a
draw that is far from the undisturbed inputs, the design is formed and factorised orthogonally.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from solver.error_model import design_matrix
from solver.errors import InputError, Message, SolverError
from solver.geometry import elements_of
from solver.inputs import CommonUncertainty
from solver.propagation.input_draws import Drawn, InputDraws, input_draws
from solver.records import PARAMETERS, Array, Observations

MOST_CONDITION: Final = 100.0
"""Largest condition number for which the products of features are trusted."""
_FAR: Final = 0.5
"""A draw's matrix differs from the identity by no more than this (Frobenius norm), or it is far."""
_TOGETHER: Final = 512
"""Draws worked on at once: what they need fits the second-level cache."""
_X, _Y = 0, 1
_ONE: Final = 4
_COLUMNS: Final = (
    ((_X, 0, 1.0),), ((_Y, 1, 1.0),), ((_X, 1, 1.0),), ((_Y, 0, 1.0),),
    ((_X, _ONE, 1.0),), ((_Y, _ONE, 1.0),),
    ((_X, 2, 1.0), (_Y, 3, 1.0)), ((_X, 3, -1.0), (_Y, 2, 1.0)),
)  # fmt: skip
"""Each parameter's column of the design: (channel, feature, sign), feature in Jx, Jy, nx, ny, 1."""

Solve = Callable[[Array, Array], Array]
"""Features (4, n, m) and residuals at the estimate (2, n, m) → change of the parameters (8, m)."""


@dataclass(frozen=True, slots=True)
class SessionModel:
    """Parameters from drawn inputs: a model for `solver.propagation.monte_carlo`. Make it with `session_model`."""

    inputs: InputDraws
    values: Array
    temperature_coefficients: Array
    solve: Solve

    def __call__(self, rng: np.random.Generator, count: int) -> Array:
        """Draw `count` times; (count, 8)."""
        values = np.empty((8, count))
        for first in range(0, count, _TOGETHER):
            part = values[:, first : first + _TOGETHER]
            drawn = self.inputs.apply(self.inputs.errors(rng, part.shape[1]))
            part[:] = self.parameters(drawn)
        return values.T

    def parameters(self, drawn: Drawn) -> Array:
        """Solve the observation equations of every draw; (8, m)."""
        with np.errstate(invalid="ignore", over="ignore"):  # such draws are looked at one by one
            values = self.values[:, None] + self.solve(drawn.features, _residuals(drawn, self.values))
        values -= self.temperature_coefficients[:, None] * drawn.temperature
        return values


def session_model(
    observations: Observations,
    values: Array,
    *,
    common: CommonUncertainty | None = None,
    u_currents: Array | None = None,
    scatter: tuple[float, float] | None = None,
    inflation: float = 1.0,
    widening: Array | None = None,
    whitening: Array | None = None,
    rows: Array | None = None,
) -> SessionModel:
    """Make the model of one session and one way to estimate.

    Parameters
    ----------
    observations
    values : (8,) array
        The estimate.
    common, u_currents, scatter, inflation, widening
        The uncertain inputs: see `solver.propagation.input_draws.input_draws`.
    whitening : (n, 2, 2) or (2n, 2n) array, optional
        W of least squares, by position or whole: rows that W multiplies have unit variance. Without
        it every equation has the same weight.
    rows : (8, 2n) array, optional
        L of another estimator that is linear in the observation equations, the paper's
        `solver.successive.combination` or any gain; `whitening` does not count then.

    Raises
    ------
    InputError
        When a parameter is not determined: there is nothing to draw then.
    """
    if not np.isfinite(values).all():
        raise InputError(
            Message("monte-carlo-unobservable", "A Monte Carlo evaluation needs every parameter to be determined "
                    "by the positions. Not determined here: %(names)s.",
                    {"names": ", ".join(np.array(PARAMETERS)[~np.isfinite(values)])})
        )  # fmt: skip
    design = design_matrix(elements_of(observations), observations.jx, observations.jy)
    solve = (
        _by_rows(rows, design)
        if rows is not None
        else _by_weights(_whole(whitening, design), whitening, design)
    )
    inputs = input_draws(observations, values, common, u_currents, scatter, inflation, widening)
    coefficients = (common or CommonUncertainty()).temperature_coefficients
    return SessionModel(inputs, np.array(values, np.float64), coefficients, solve)


def _whole(whitening: Array | None, design: Array) -> Array:
    """W as (2n, 2n)."""
    if whitening is None:
        return np.eye(len(design))
    if whitening.ndim == 2:
        return whitening
    n = len(whitening)
    whole = np.zeros((n, 2, n, 2))
    whole[np.arange(n), :, np.arange(n), :] = whitening
    return whole.reshape(2 * n, 2 * n)


def _residuals(drawn: Drawn, values: Array) -> Array:
    """Right side minus left side at the estimate, (2, n, m)."""
    kx, ky, kxy, kyx, w0x, w0y, wg, wk = values
    coefficients = np.array([[kx, kxy, wg, -wk], [kyx, ky, wk, wg]])
    left = coefficients @ drawn.features.reshape(4, -1)
    rest = drawn.rates - left.reshape(drawn.rates.shape)
    rest[0] -= w0x
    rest[1] -= w0y
    return rest


def _by_weights(whitening: Array, given: Array | None, design: Array) -> Solve:
    """Least squares with fixed weights."""
    whitened = whitening @ design
    scale = np.linalg.norm(whitened, axis=0)
    condition = float(np.linalg.cond(whitened / scale))

    def orthogonal(features: Array, rest: Array) -> Array:
        solved = [
            np.linalg.lstsq(whitening @ d / scale, whitening @ e)[0] for d, e in _designs(features, rest)
        ]
        return np.asarray(np.array(solved).T / scale[:, None])

    if not condition <= MOST_CONDITION:
        return orthogonal
    basis = np.linalg.inv(np.linalg.qr(whitened / scale, mode="r")) / scale[:, None]
    n = len(design) // 2
    weights = (
        (whitening.T @ whitening).reshape(n, 2, n, 2).transpose(1, 3, 0, 2)
    )  # P by channels, (2, 2, n, n)
    sums = np.stack([weights[0, 0].sum(0), weights[0, 1].sum(0), weights[0, 1].sum(1), weights[1, 1].sum(0)])
    matrix, constant = _assembly(basis, sums.sum(axis=1)[[0, 1, 3]])
    to_right = np.zeros((8, 10))  # from Σ f·P·e, feature by feature and channel, to Tᵀ·Dᵀ·P·e
    for parameter, terms in enumerate(_COLUMNS):
        for channel, feature, sign in terms:
            to_right[parameter, 2 * feature + channel] = sign
    to_right = basis.T @ to_right
    weigh = _weigher(weights, diagonal=given is None or given.ndim == 3)

    def solve(features: Array, rest: Array) -> Array:
        m = features.shape[-1]
        pairs = np.empty((64, m))
        for block, (one, other) in enumerate(((_X, _X), (_X, _Y), (_Y, _Y))):
            out = pairs[16 * block : 16 * block + 16].reshape(4, 4, m)
            np.einsum("fnm,gnm->fgm", features, weigh(features, one, other), out=out)
        np.matmul(sums, features, out=pairs[48:].reshape(4, 4, m))
        system = (matrix @ pairs + constant[:, None]).reshape(8, 8, m)
        weighed = np.stack((weigh(rest[0], _X, _X) + weigh(rest[1], _X, _Y),
                            weigh(rest[0], _Y, _X) + weigh(rest[1], _Y, _Y)))  # fmt: skip
        products = np.empty((10, m))
        np.einsum("fnm,cnm->fcm", features, weighed, out=products[:8].reshape(4, 2, m))
        np.add.reduce(weighed, axis=1, out=products[8:])
        return _solved(system, to_right @ products, basis, features, rest, orthogonal)

    return solve


def _weigher(weights: Array, *, diagonal: bool) -> Callable[[Array, int, int], Array]:
    """Apply the weights between two channels to (…, n, m)."""
    if not diagonal:
        return lambda values, one, other: weights[one, other] @ values
    by_position = np.einsum("abnn->abn", weights)[..., None]
    return lambda values, one, other: values * by_position[one, other]


def _assembly(basis: Array, constants: Array) -> tuple[Array, Array]:
    """Matrix (64, 64) and constant (64,) that make Tᵀ·N·T from the sums over pairs of features.

    The sums' order is that of `_by_weights`: pairs xx, xy, yy of (first, second) feature, then sums
    of each feature with 1 for xx, xy (1 in x), xy (1 in y), yy.
    """
    normal, constant = np.zeros((8, 8, 64)), np.zeros((8, 8))
    for i, j in np.ndindex(8, 8):
        for one in _COLUMNS[i]:
            for other in _COLUMNS[j]:
                (a, f, s), (b, g, t) = sorted((one, other))  # x before y
                if f == _ONE and g == _ONE:
                    constant[i, j] += constants[a + b]
                elif f == _ONE:
                    normal[i, j, 48 + 4 * g + _sum_of(a, b, one_first=True)] += s * t
                elif g == _ONE:
                    normal[i, j, 48 + 4 * f + _sum_of(a, b, one_first=False)] += s * t
                else:
                    normal[i, j, 16 * (a + b) + 4 * f + g] += s * t
    changed = np.einsum("ki,klp,lj->ijp", basis, normal, basis)
    return changed.reshape(64, 64), (basis.T @ constant @ basis).ravel()


def _sum_of(a: int, b: int, *, one_first: bool) -> int:
    if a == b:
        return 0 if a == _X else 3
    return 1 if one_first else 2


def _by_rows(rows: Array, design: Array) -> Solve:
    """Estimators with constant L."""
    scale = np.linalg.norm(design, axis=0)
    first = rows @ design / scale
    gain = np.linalg.solve(first, rows)  # L·design·T is then the identity for the undisturbed inputs
    n = len(design) // 2
    by_channel = gain.reshape(8, n, 2).transpose(2, 0, 1)  # (2, 8, n)
    assembly = np.zeros((8, 8, 2, 8, 4))  # (row, column) from (channel, row, feature)
    constant = np.zeros((8, 8))
    for column, terms in enumerate(_COLUMNS):
        for channel, feature, sign in terms:
            for row in range(8):
                if feature == _ONE:
                    constant[row, column] += sign * by_channel[channel, row].sum() / scale[column]
                else:
                    assembly[row, column, channel, row, feature] += sign / scale[column]
    matrix = assembly.transpose(0, 1, 4, 2, 3).reshape(64, 64)
    flat = by_channel.reshape(16, n)

    def orthogonal(features: Array, rest: Array) -> Array:
        solved = [np.linalg.solve(rows @ d / scale, rows @ e) for d, e in _designs(features, rest)]
        return np.asarray(np.array(solved).T / scale[:, None])

    def solve(features: Array, rest: Array) -> Array:
        sums = (flat @ features).reshape(64, -1)
        system = (matrix @ sums + constant.ravel()[:, None]).reshape(8, 8, -1)
        right = by_channel[0] @ rest[0] + by_channel[1] @ rest[1]
        return _solved(system, right, np.diag(1.0 / scale), features, rest, orthogonal)

    return solve


def _solved(
    system: Array, right: Array, basis: Array, features: Array, rest: Array, orthogonal: Solve
) -> Array:
    """T·system⁻¹·right for every draw (last axis), orthogonally where the system is far from the identity."""
    system[np.arange(8), np.arange(8)] -= 1.0
    far = ~(np.einsum("ijm,ijm->m", system, system) <= _FAR**2)  # also where it is NaN
    system[np.arange(8), np.arange(8)] += 1.0
    if far.any():
        system[:, :, far] = np.eye(8)[:, :, None]
    values = basis @ _eliminate(system, right)
    if far.any():
        values[:, far] = orthogonal(features[:, :, far], rest[:, :, far])
    return np.asarray(values)


def _eliminate(system: Array, right: Array) -> Array:
    """Solve (8, 8, m) systems near the identity for (8, m), in place."""
    size = len(system)
    for k in range(size - 1):
        factor = system[k + 1 :, k] / system[k, k]
        system[k + 1 :, k + 1 :] -= factor[:, None] * system[k, k + 1 :]
        right[k + 1 :] -= factor * right[k]
    for k in range(size - 1, -1, -1):
        right[k] /= system[k, k]
        right[:k] -= system[:k, k] * right[k]
    return right


def _designs(features: Array, rest: Array) -> list[tuple[Array, Array]]:
    """The design (2n, 8) and residuals (2n,) of every draw, x and y of a position after one another."""
    if not (np.isfinite(features).all() and np.isfinite(rest).all()):
        raise SolverError(
            Message("draw-not-finite", "A draw of the inputs is not a finite number. Check the stated "
                    "uncertainties: one of them is far too large.")
        )  # fmt: skip
    n, m = features.shape[1:]
    design = np.zeros((m, n, 2, 8))
    for parameter, terms in enumerate(_COLUMNS):
        for channel, feature, sign in terms:
            design[:, :, channel, parameter] = 1.0 if feature == _ONE else sign * features[feature].T
    return list(zip(design.reshape(m, 2 * n, 8), rest.transpose(2, 1, 0).reshape(m, 2 * n), strict=True))
