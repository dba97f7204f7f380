"""The gyro's truth and the currents that hold it still.

In rate mode with an integrating loop the rotor does not deflect, so the case rate is met by the
torquers and the drift together (paper, eq. (3) without the deflection terms; spec letters in
`solver`'s package docstring, n = specific force in g)::

    kx·Jx  + kxy·Jy = ωx − (w0x + wg·nx − wk·ny + wn·nx·nz)
    kyx·Jx + ky·Jy  = ωy − (w0y + wk·nx + wg·ny + wn·ny·nz)

Two equations, two currents: solved in closed form, element by element, so that a current has the
same bits whether it is computed alone or with others.
"""

from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Gyro:
    """True parameters of one gyro.

    Attributes
    ----------
    kx, ky, kxy, kyx
        Torquer scale factors and cross-coupling, rad/(s·A); `kxy` multiplies Jy in the x equation.
    w0x, w0y
        Drift that does not depend on acceleration, rad/s.
    wg, wk
        g-sensitive drift, direct and quadrature, rad/s per g.
    wn
        g²-sensitive drift, rad/s per g².

    Raises
    ------
    ValueError
        When a value is not finite, or the torquers cannot turn the rotor about both axes
        (kx·ky = kxy·kyx).
    """

    kx: float
    ky: float
    kxy: float
    kyx: float
    w0x: float
    w0y: float
    wg: float
    wk: float
    wn: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not np.isfinite(value):
                raise ValueError(f"The gyro's {item.name} is {value}: give a finite number.")
        if self.kx * self.ky == self.kxy * self.kyx:
            raise ValueError("The gyro's torquers act about one axis only: kx·ky equals kxy·kyx.")

    @property
    def values(self) -> Array:
        """What the method estimates, (8,): kx ky kxy kyx w0x w0y wg wk."""
        return np.array(astuple(self)[:8])

    def shifted(self, changes: Mapping[str, float]) -> "Gyro":
        """The gyro with `changes` (name of a parameter → SI amount) added.

        Raises
        ------
        ValueError
            When a name is not a parameter.
        """
        unknown = set(changes) - {item.name for item in fields(self)}
        if unknown:
            raise ValueError(f"A gyro has no parameter {', '.join(sorted(unknown))}.")
        return replace(self, **{name: getattr(self, name) + amount for name, amount in changes.items()})

    def drift(self, specific_force: Array) -> tuple[Array, Array]:
        """Drift about x and y (paper, eq. (3), no deflection).

        Parameters
        ----------
        specific_force : (..., 3) array
            Along the case axes, g.

        Returns
        -------
        (...) array, (...) array
            rad/s.
        """
        nx, ny, nz = np.moveaxis(np.asarray(specific_force, dtype=np.float64), -1, 0)
        return (
            self.w0x + self.wg * nx - self.wk * ny + self.wn * nx * nz,
            self.w0y + self.wk * nx + self.wg * ny + self.wn * ny * nz,
        )

    def currents_for(self, rate_x: Array, rate_y: Array) -> tuple[Array, Array]:
        """Torquer currents, A, that precess the rotor at the given rates, rad/s; any one shape."""
        determinant = self.kx * self.ky - self.kxy * self.kyx
        return (
            (self.ky * rate_x - self.kxy * rate_y) / determinant,
            (self.kx * rate_y - self.kyx * rate_x) / determinant,
        )

    def steady_currents(self, rate: Array, specific_force: Array) -> tuple[Array, Array]:
        """Steady currents at a case rate and specific force.

        Parameters
        ----------
        rate : (..., 3) array
            Of the case against inertial space, along the case axes, rad/s.
        specific_force : (..., 3) array
            Along the case axes, g (+1 on an axis that points up).

        Returns
        -------
        jx, jy : (...) arrays
            A.
        """
        rate = np.asarray(rate, dtype=np.float64)
        drift_x, drift_y = self.drift(specific_force)
        return self.currents_for(rate[..., 0] - drift_x, rate[..., 1] - drift_y)
