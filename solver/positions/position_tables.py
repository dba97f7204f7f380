"""What each candidate position adds to the information: the tables of `solver.positions.position_search`."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.error_model import design_matrix
from solver.geometry import commanded, elements
from solver.inputs import by_angles, by_common
from solver.least_squares import column_scale
from solver.positions.planning import Circumstances, Places, elements_at, whitened
from solver.positions.position_search import Tables
from solver.records import PARAMETERS, Array, Observations

_SAME_ORIENTATION: Final = 9
"""Decimals of a, b, c, d to which twins agree."""


def tables_of(candidates: Places, duration: float, at: Circumstances) -> Tables:
    """What each candidate adds to the information, for `solver.positions.position_search`."""
    jx, jy = at.currents(candidates)
    whitening = at.whitening(duration)
    design = whitened(whitening, design_matrix(elements_at(candidates), jx, jy))
    scale = 1.0 / column_scale(design)
    rows = (design * scale).reshape(-1, 2, len(PARAMETERS))
    transposed = rows.transpose(0, 2, 1)
    own, common = _uncertain(candidates, jx, jy, at, transposed @ whitening)
    information = (transposed @ rows).reshape(len(candidates), -1)
    return Tables(information, own, common, scale, _twins(candidates))


def _uncertain(
    candidates: Places, jx: Array, jy: Array, at: Circumstances, weights: Array
) -> tuple[Array | None, Array | None]:
    """How uncertain angles and common inputs enter, by the weights (n, 8, 2) of each candidate's residuals."""
    observed = _in_this_order(candidates, jx, jy, at)
    own = common = None
    u_angles = np.stack((candidates.u_alpha, candidates.u_beta, candidates.u_gamma), axis=1)
    if u_angles.any():
        effect = weights @ (by_angles(observed, at.parameters) * u_angles[:, None, :])
        own = (effect @ effect.transpose(0, 2, 1)).reshape(len(candidates), -1)
    if at.common.standard.any():
        variances, vectors = np.linalg.eigh(at.common.covariance)
        root = vectors * np.sqrt(np.maximum(variances, 0.0))
        shown = by_common(observed, at.parameters, at.common).reshape(len(candidates), 2, -1)
        common = (weights @ shown @ root).reshape(len(candidates), -1)
    return own, common


def _in_this_order(places: Places, jx: Array, jy: Array, at: Circumstances) -> Observations:
    """Every candidate once, not sorted as `Observations.sorted_from` would."""
    n = len(places)
    none, infinite = np.zeros(n), np.full(n, np.inf)
    return Observations(
        theta=places.theta, psi=places.psi, repeat=np.zeros(n, np.int64), alpha=places.alpha,
        beta=places.beta, gamma=places.gamma, jx=jx, jy=jy, u_jx=None, u_jy=None, duration=none, rate=none,
        time=none, u_alpha=places.u_alpha, u_beta=places.u_beta, u_gamma=places.u_gamma, dof_jx=infinite,
        dof_jy=infinite, latitude=at.latitude,
    )  # fmt: skip


def _twins(places: Places) -> NDArray[np.int64]:
    """One number for positions whose commanded orientation has the same a, b, c, d, as θ + 180°, ψ + 180° has."""
    nominal = elements(commanded(places.theta, places.psi))
    key = np.round(np.stack((nominal.a, nominal.b, nominal.c, nominal.d), axis=1), _SAME_ORIENTATION) + 0.0
    twins: NDArray[np.int64] = np.unique(key, axis=0, return_inverse=True)[1].ravel()
    return twins
