"""Very many solutions with weights that are prepared once: for the propagation of distributions.

`FixedWeights` is weighted least squares whose weights stay those of given parameters; `FixedRows` solves
any fixed combinations of the equations: the whole inverse root of a covariance
(`solver.rate_noise.root_inverse`) for generalised least squares, the paper's combinations
(`solver.successive.combination`) for its method. Both take blocks as `solver.batch.Stand.block` makes
them and give the answer alone. Reweighting each draw by its own K would change it by about
u(K)/K of a part of its own deviation.

The normal equations are solved as they stand: their rounding of about ε·κ² of the answer (`solver.block`)
is nothing beside a draw's scatter unless κ exceeds some 1e4, which an observable session does not.
"""

from dataclasses import dataclass

import numpy as np

from solver.block import JX, JY, RX, RY, C, D, Weighted, inverse_scales, sums_of
from solver.records import Array


@dataclass(frozen=True, slots=True)
class FixedWeights:
    """Weights of both channels, the same for every draw.

    Attributes
    ----------
    g : (2, 2, 1) array
        K⁻¹, or the identity for equal weights.
    u : (n, 2) array or None
        Standard uncertainties of Jx and Jy, A; None for equal weights.
    """

    g: Array
    u: Array | None

    @classmethod
    def of(cls, values: Array, u_currents: Array | None) -> "FixedWeights":
        """Weights by parameters (8,) and u(J) (n, 2); equal ones without u(J)."""
        if u_currents is None:
            return cls(np.eye(2)[:, :, None], None)
        return cls(inverse_scales(values[:, None]), u_currents)

    def solve(self, z: Array) -> Array:
        """Parameters (B, 8) of a block z (7, n, B)."""
        if self.u is None or np.array_equal(self.u[:, 0], self.u[:, 1]):
            both = (sums_of(z, None if self.u is None else self.u[:, :1]),) * 2
        else:
            both = (sums_of(z, self.u[:, :1]), sums_of(z, self.u[:, 1:]))
        return Weighted(both, self.g).values().T


@dataclass(frozen=True, slots=True)
class FixedRows:
    """Fixed combinations of the equations, solved by least squares (exactly where there are eight).

    Attributes
    ----------
    rows : (k, 2n) array
    """

    rows: Array

    def solve(self, z: Array) -> Array:
        """Parameters (B, 8) of a block z (7, n, B)."""
        count, (_, positions, sessions) = len(self.rows), z.shape
        x, y = self.rows[:, ::2], self.rows[:, 1::2]
        both = np.concatenate((x, y)) @ z[[JX, JY, C, D, RX, RY]].transpose(1, 0, 2).reshape(positions, -1)
        on_x, on_y = both.reshape(2, count, 6, sessions).transpose(0, 2, 1, 3)
        design = np.empty((count, 8, sessions))
        design[:, 0], design[:, 3], design[:, 2], design[:, 1] = on_x[0], on_y[0], on_x[1], on_y[1]
        design[:, 4], design[:, 5] = x.sum(axis=1)[:, None], y.sum(axis=1)[:, None]
        design[:, 6], design[:, 7] = on_x[2] + on_y[3], on_y[2] - on_x[3]
        right_side = (on_x[4] + on_y[5]).T[:, :, None]
        stack = design.transpose(2, 0, 1)
        lengths = np.sqrt(np.einsum("kps,kps->ps", design, design)).T
        scaled = stack / lengths[:, None, :]
        if count == 8:
            answer = np.linalg.solve(scaled, right_side)
        else:
            turned = scaled.transpose(0, 2, 1)
            answer = np.linalg.solve(turned @ scaled, turned @ right_side)
        return np.asarray(answer[:, :, 0] / lengths)
