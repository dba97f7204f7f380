"""What a gyro is expected to be, and how far a fit lies from it.

A prior is a normal distribution over some of the eight parameters: the type's nominal values with
their spread, or the gyro's last calibration with its drift since. Where it says nothing (NaN), it
takes no part. The squared distance of a fit q̂ of covariance C from it,

    D² = (q̂ − q₀)ᵀ·(C₀ + C)⁻¹·(q̂ − q₀),

over the parameters that both know, is what joint least squares over data and prior adds to χ².

A prior can be wrong itself: the gyro has changed, or is another one. Then all hypotheses are far from it, and
that one is less far than another says nothing. So explanations are compared by `Prior.cost`: D², or, where it is
less, what D² comes to when the prior's spread is stretched to fit by one unknown factor.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from solver.errors import InputError, Message
from solver.records import PARAMETERS, Array

COUPLING: Final = 0.2
"""Cross-coupling of a DTG's torquers, beside their scale factors: percents in practice, with room."""
_STRETCHED: Final = 10.0
"""Price of the unknown factor, as of any free unknown (`solver.blunders.hypothesis_score.OCCAM`)."""


@dataclass(frozen=True, slots=True)
class Prior:
    """Expected parameters, SI, in the order of `PARAMETERS`.

    Attributes
    ----------
    values : (8,) array
        NaN where nothing is said.
    standard_uncertainties : (8,) array
        NaN where nothing is said; otherwise positive.
    covariance : (8, 8) array, optional
        Instead of independent standard uncertainties; only what `values` says counts.
    source
        Where it comes from, for people.
    """

    values: Array
    standard_uncertainties: Array
    covariance: Array | None = None
    source: str = ""
    says: NDArray[np.bool_] = field(init=False, repr=False)
    """Parameters that the prior speaks of, (8,)."""
    matrix: Array = field(init=False, repr=False)
    """C₀, (8, 8); zero where nothing is said."""

    def __post_init__(self) -> None:
        u = self.standard_uncertainties
        if self.values.shape != (len(PARAMETERS),) or u.shape != (len(PARAMETERS),):
            raise InputError(Message("bad-prior", "A prior has a value and a standard uncertainty for each of the "
                                     "eight parameters, or none."))  # fmt: skip
        for name, value, uncertainty in zip(PARAMETERS, self.values, u, strict=True):
            if (
                np.isnan(value) != np.isnan(uncertainty)
                or np.isinf(value)
                or uncertainty <= 0
                or np.isinf(uncertainty)
            ):
                raise InputError(
                    Message("bad-prior", "The prior of %(name)s needs a value and a positive standard uncertainty.",
                            {"name": name})
                )  # fmt: skip
        says = np.isfinite(self.values)
        matrix = np.diag(np.nan_to_num(u) ** 2) if self.covariance is None else self.covariance
        object.__setattr__(self, "says", says)
        object.__setattr__(self, "matrix", np.where(np.outer(says, says), matrix, 0.0))

    def with_coupling(self) -> "Prior":
        """The same, with what the names say: a channel's own scale factor outweighs the cross-coupling.

        Where both scale factors are given and a cross-coupling is not, it is taken as zero with a
        standard uncertainty of `COUPLING` times the geometric mean of the scale factors. Without that, exchanged
        channels could not be told from currents in another unit.
        """
        kx, ky = self.values[:2]
        silent = np.isnan(self.values[2:4])
        if not (np.isfinite(kx) and np.isfinite(ky) and silent.any()):
            return self
        u = COUPLING * float(np.sqrt(abs(kx * ky)))
        added = np.zeros(len(PARAMETERS), dtype=np.bool_)
        added[2:4] = silent
        covariance = None if self.covariance is None else self.matrix + np.diag(np.where(added, u**2, 0.0))
        return Prior(
            np.where(added, 0.0, self.values),
            np.where(added, u, self.standard_uncertainties),
            covariance,
            self.source,
        )

    def distance(self, values: Array, covariance: Array, known: NDArray[np.bool_]) -> tuple[float, int]:
        """D² of a fit and the number of parameters that it compares.

        Parameters
        ----------
        values : (8,) array
        covariance : (8, 8) array
            C.
        known : (8,) bool array
            Parameters that the fit determines.
        """
        compared = np.flatnonzero(self.says & known)
        if not len(compared):
            return 0.0, 0
        apart = (values - self.values)[compared]
        both = (self.matrix + covariance)[np.ix_(compared, compared)]
        scale = np.sqrt(np.diagonal(both))
        distance = (apart / scale) @ np.linalg.solve(both / np.outer(scale, scale), apart / scale)
        return float(distance), len(compared)

    def cost(self, distance: float) -> float:
        """D² as explanations are compared by it.

        With the prior's spread stretched by s, −2·ln of its density is m·ln s² + D²/s², least at s² = D²/m.
        """
        count = int(self.says.sum())
        if distance <= count:
            return distance
        return min(distance, count * (1.0 + float(np.log(distance / count))) + _STRETCHED)

    def fits(self, distance: float) -> bool:
        """Whether D² counts as it is: without a stretched spread."""
        return self.cost(distance) == distance

    def apart(self, values: Array, covariance: Array, known: NDArray[np.bool_]) -> Array:
        """Differences of a fit from what is expected in their standard uncertainties, (8,); NaN: not compared."""
        u = np.sqrt(np.diagonal(self.matrix + covariance))
        compared = self.says & known
        return np.where(compared, (values - self.values) / np.where(compared, u, 1.0), np.nan)
