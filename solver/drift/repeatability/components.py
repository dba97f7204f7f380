"""What is known within a session, and the components of variance that `nested` finds."""

from dataclasses import dataclass
from typing import Final

from numpy.typing import ArrayLike

WITHIN_POSITION: Final = "within-position"
BETWEEN_POSITIONS: Final = "between-positions"
BETWEEN_SESSIONS: Final = "between-sessions"
FIXED: Final = "fixed"
"""What a level is confounded with that does not vary: the mean, or the course removed."""


@dataclass(frozen=True, slots=True)
class Within:
    """What is known of each session's own scatter.

    Attributes
    ----------
    u : (n,) array_like
        Standard uncertainty of each value by its currents' noise.
    chi2, dof : (n,) array_like or None
        Of each session's fit; without them the positions are taken to scatter as the noise says.
    u_dof : float or None
        Degrees of freedom of the noise over all sessions; None where they are many.
    """

    u: ArrayLike
    chi2: ArrayLike | None = None
    dof: ArrayLike | None = None
    u_dof: float | None = None


@dataclass(frozen=True, slots=True)
class Component:
    """One source of scatter.

    Attributes
    ----------
    source : str
    variance, sd : float or None
        In the values' unit squared, and its root; None where another row holds it or nothing does.
    low, high : float or None
        Ends of the interval of `sd`.
    dof : float or None
        Degrees of freedom of its mean square; None where it is known, not estimated.
    f, dof_below, p_value : float or None
        Its mean square against those below; `dof_below` is None where they are known. All None without a test.
    confounded_with : tuple of str
        Sources that the data do not tell from this one.
    """

    source: str
    variance: float | None
    sd: float | None
    low: float | None
    high: float | None
    dof: float | None = None
    f: float | None = None
    dof_below: float | None = None
    p_value: float | None = None
    confounded_with: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Repeatability:
    """All sources of scatter of a value.

    Attributes
    ----------
    components : tuple of Component
        From the lowest to the uppermost.
    together : Component
        Of one value, all sources that were seen: the sum of the variances.
    level : float
        Of the intervals.
    """

    components: tuple[Component, ...]
    together: Component
    level: float

    def __getitem__(self, source: str) -> Component:
        """The row of a source."""
        return next(row for row in self.components if row.source == source)
