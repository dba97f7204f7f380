"""What is shown of two results compared: frozen, in laboratory units, with no tie to the database."""

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from app.services.views import ParameterView, Verdict

Agreement = Literal["agree", "differ", "undetermined"]


@dataclass(frozen=True, slots=True)
class Side:
    """One of the two results."""

    asked: str
    gyro: str
    type: str
    session: int
    calibration: int
    measured_at: datetime
    start: int
    stand: str
    certificate: str
    method: str
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Compared:
    """One parameter of both.

    Attributes
    ----------
    a, b
        Values with u, k and the limits of each gyro's type.
    difference, expanded, coverage_factor, dof
        a − b, its expanded uncertainty (95 %), k, and degrees of freedom (None without limit); None where one of
        them is not determined or has no uncertainty.
    in_expanded, e_n
        The difference in units of `expanded`, and by ISO 13528 from both stated U.
    p_value, p_holm
        Of a larger difference if both had the same value; alone, and with all parameters looked at.
    shared
        Standard uncertainty that both have in common, which was taken off.
    scatter, in_scatter
        Standard deviation of the gyro from session to session, and the difference in units of √2 of it; None for two
        gyros, or before a study.
    """

    parameter: str
    unit: str
    a: ParameterView
    b: ParameterView
    difference: float | None
    expanded: float | None
    coverage_factor: float | None
    dof: float | None
    in_expanded: float | None
    e_n: float | None
    p_value: float | None
    p_holm: float | None
    shared: float
    scatter: float | None
    in_scatter: float | None
    verdict: Agreement


@dataclass(frozen=True, slots=True)
class ComparisonView:
    """Two results compared.

    Attributes
    ----------
    common
        Codes of the budget's lines that both have in common, and what they come from.
    taken_off
        Whether that was taken off the uncertainty of the differences.
    chi2, dof, p_value
        Joint test of all parameters; None where one is not determined.
    verdict
        ``differ`` when the joint test says so at 5 %; without one, when a parameter does with all looked at.
    """

    a: Side
    b: Side
    parameters: tuple[Compared, ...]
    common: tuple[str, ...]
    taken_off: bool
    chi2: float | None
    dof: int | None
    p_value: float | None
    verdict: Agreement

    @property
    def same_gyro(self) -> bool:
        """Whether both are of one gyro."""
        return self.a.gyro == self.b.gyro
