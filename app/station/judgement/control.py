"""Positions whose mistakes nothing would show: neither partners half a turn away nor the fit of all the others.

The equations of a position, `partners` and the paper's eq. (10), are linear in the eight parameters,

    kx·Jx + kxy·Jy + ω0x + ωg·c − ωк·d = …,    kyx·Jx + ky·Jy + ω0y + ωк·c + ωg·d = …

with c = sin θ·sin ψ, d = sin θ·cos ψ at the commanded angles, eq. (7); what stands on the right does not depend on
the gyro. With U an orthonormal basis of what these columns span and U_p its two rows of a position, of a mistake in
that position the residuals keep the part I − U_p·U_pᵀ (Belsley, Kuh and Welsch, Regression Diagnostics, 1980, 2.1).
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from app.station.contracts import Array, Currents, Place
from app.station.judgement import partners

_LEAST: Final = 0.01
"""Of a mistake's square that the residuals must keep: a tenth of the µA that a wrong position changes is 100 nA."""
_SMALLEST: Final = 1e-9
"""Singular values below this part of the largest are rounding."""


def unseen(means: Mapping[Place, Currents]) -> tuple[Place, ...]:
    """Places of which nothing would show that they were measured in another position, in the order given."""
    alone = set(partners.without_comparison(means)) & set(_decisive(means))
    return tuple(place for place in means if place in alone)


def _decisive(means: Mapping[Place, Currents]) -> list[Place]:
    """Places that alone decide something, so that the fit follows whatever they say."""
    if not means:
        return []
    design = np.concatenate([_rows(place, currents) for place, currents in means.items()])
    sizes = np.linalg.norm(design, axis=0)
    left, singular, _ = np.linalg.svd(design / np.where(sizes > 0, sizes, 1.0), full_matrices=False)
    basis = left[:, singular > _SMALLEST * singular[0]]
    kept = (np.eye(2) - rows @ rows.T for rows in np.split(basis, len(means)))
    return [
        place for place, part in zip(means, kept, strict=True) if float(np.linalg.eigvalsh(part)[0]) < _LEAST
    ]


def _rows(place: Place, currents: Currents) -> Array:
    theta, psi = np.radians(place)
    c, d = np.sin(theta) * np.sin(psi), np.sin(theta) * np.cos(psi)
    jx, jy = currents
    return np.array([[jx, jy, 0.0, 0.0, 1.0, 0.0, c, -d], [0.0, 0.0, jx, jy, 0.0, 1.0, d, c]])
