"""Sums of squares of an unbalanced nested classification beside fixed effects; it knows nothing of gyros.

    y = X·β + Σ_k Z_k·b_k + d,    b_k ~ N(0, σ_k²),    d_i ~ N(0, v_i)

with Z_k the groups of level k, each group of k within one of k − 1, level 0 all values together and the
lowest level every value by itself. P_j is the projection onto the columns of X and Z_j; the sum of squares of
level j is what its groups explain beyond level j − 1 and X::

    SS_j = yᵀ·(P_j − P_{j−1})·y
    E SS_j = Σ_{k ≥ j} σ_k²·tr[(P_j − P_{j−1})·Z_k·Z_kᵀ] + Σ_i v_i·(P_j − P_{j−1})_ii

Levels above j drop out, as does X: Henderson's method III in the order of nesting, which is his method I where X
is a mean alone (C. R. Henderson, Biometrics 9, 1953, 226-252; S. R. Searle, G. Casella, C. E. McCulloch,
Variance Components, 1992, ch. 5). Since P_j = G_j + Q_j·Q_jᵀ with G_j the groups' means and Q_j
an orthonormal basis of what they leave of X, sums over the groups are all there is to compute.

How far a sum of squares follows χ²
    In a balanced design SS_j/E MS_j follows χ² with ν_j = rank(P_j) − rank(P_{j−1}); in others its two
    first moments are those of χ² with ν_j·ρ_j, ρ_j ≤ 1 (F. E. Satterthwaite, Biometrics Bull. 2, 1946,
    110-114)::

        ν_j·ρ_j = 2·(E SS_j)²/Var SS_j = tr(A·Σ)²/tr(A·Σ·A·Σ),   A = G_j − G_{j−1}

    where X, a few columns, is left out of A for ρ, not for ν.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.errors import InputError, Message
from solver.records import Array

Groups = NDArray[np.int64]
"""Number of the group of each value, from 0 without gaps, (n,)."""
_ROUNDING: Final = 1e-10


def nested_groups(labels: list[ArrayLike], count: int) -> list[Groups]:
    """Number the groups of each level: all together, then each level within those above it, then each by itself.

    Parameters
    ----------
    labels
        Outermost first, each (n,). The same label in two groups of the level above names two groups.
    count
        n.

    Raises
    ------
    InputError
        When a level has not one label for each value.
    """
    levels = [np.zeros(count, np.int64)]
    for level in labels:
        names = np.asarray(level)
        if names.shape != (count,):
            raise InputError(_LABELS)
        numbers = np.unique(names, return_inverse=True)[1].astype(np.int64)
        both = levels[-1] * (int(numbers.max(initial=0)) + 1) + numbers
        levels.append(np.unique(both, return_inverse=True)[1].astype(np.int64))
    return [*levels, np.arange(count, dtype=np.int64)]


@dataclass(frozen=True, slots=True)
class Strata:
    """The levels' sums of squares and what they expect.

    Attributes
    ----------
    groups : list of (n,) array
        Level 0, then the s levels whose variances are sought.
    squares, dof : (s,) array
        SS_j and ν_j.
    coefficients : (s, s) array
        E SS_j = Σ_k coefficients[j, k]·σ_k² + noise[j]; upper triangular.
    noise : (s,) array
        Σ_i v_i·(P_j − P_{j−1})_ii.
    """

    groups: list[Groups]
    squares: Array
    dof: Array
    coefficients: Array
    noise: Array

    def reach(self, level: int, variances: Array, noise: Array) -> float:
        """ρ of one level, counted from 0.

        Parameters
        ----------
        variances : (s,) array
            σ_k² of the levels; those above do not matter.
        noise : (n,) array
            v_i.
        """
        upper, own = self.groups[level], self.groups[level + 1]
        one = np.ones(len(own))
        total = noise.copy()
        sums = np.bincount(own, total)
        for groups, variance in zip(self.groups[level + 1 :], variances[level:], strict=True):
            sizes = np.bincount(groups)
            sums = sums + variance * np.bincount(own, sizes[groups].astype(float))
        size = np.bincount(own, one)
        parent = np.empty(len(size), np.int64)
        parent[own] = upper
        above, size_above = np.bincount(parent, sums), np.bincount(upper, one)
        trace = np.sum(sums / size) - np.sum(above / size_above)
        squared = (
            np.sum((sums / size) ** 2)
            - 2.0 * np.sum(sums**2 / (size * size_above[parent]))
            + np.sum((above / size_above) ** 2)
        )
        dof = len(size) - len(size_above)
        return float(min(1.0, trace**2 / (dof * squared))) if squared > 0.0 else 1.0


def strata(values: Array, groups: list[Groups], design: Array, noise: Array) -> Strata:
    """Take the sums of squares of levels that each split the one before.

    Parameters
    ----------
    values : (n,) array
    groups
        Level 0 first, the lowest last.
    design : (n, p) array
        X without the mean; p may be 0.
    noise : (n,) array
        v_i.
    """
    count = len(values)
    centred = values - values.mean()
    fits, ranks, noises = [], [], []
    traces = np.full((len(groups), len(groups)), float(count))
    for j, own in enumerate(groups):
        size = np.bincount(own).astype(float)
        basis = _basis(design - _means(design, own, size)[own])
        fits.append(_means(centred[:, None], own, size)[own, 0] + basis @ (basis.T @ centred))
        ranks.append(len(size) + basis.shape[1])
        leverage = 1.0 / size[own] + np.sum(basis**2, axis=1)
        noises.append(float(noise @ leverage))
        for k in range(j + 1, len(groups)):
            traces[j, k] = _trace(own, size, groups[k], basis)
    squares = np.array([float(np.sum((b - a) ** 2)) for a, b in pairwise(fits)])
    return Strata(
        groups=groups,
        squares=squares,
        dof=np.diff(np.array(ranks, float)),
        coefficients=np.diff(traces, axis=0)[:, 1:],
        noise=np.diff(np.array(noises)),
    )


def _means(columns: Array, groups: Groups, size: Array) -> Array:
    sums = np.zeros((len(size), columns.shape[1]))
    np.add.at(sums, groups, columns)
    return sums / size[:, None]


def _basis(columns: Array) -> Array:
    """Orthonormal, of the columns' span; columns that the groups explain but for rounding do not count."""
    if columns.shape[1] == 0:
        return columns
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(u[:, s > _ROUNDING * np.sqrt(len(columns))])


def _trace(own: Groups, size: Array, finer: Groups, basis: Array) -> float:
    """tr(P·Z·Zᵀ) of a finer level's Z."""
    sizes = np.bincount(finer).astype(float)
    squares = np.bincount(own, sizes[finer], len(size))  # Σ n_a² over the finer groups a of each group
    along = np.zeros((len(sizes), basis.shape[1]))
    np.add.at(along, finer, basis)
    return float(np.sum(squares / size) + np.sum(along**2))


_LABELS = Message("nested-labels", "Every level of a nested analysis needs one label for each value.")
