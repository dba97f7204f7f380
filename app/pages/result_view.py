"""A result as its page shows it: both methods side by side, residuals, convergence, correlations."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.exchange.json_values import message_from
from app.figures import DASH, Figure, Measured, decimals_of, figure, measured, plain, significant, superscript
from app.i18n import gettext, translate
from app.pages import labels
from app.pages.result_findings import findings, not_excluded
from app.pages.result_limits import Budget
from app.pages.result_tests import Model, MonteCarlo
from app.plots import LIMIT_SD, Change, Place, Residual, decade
from app.services.views import COVERAGE_FACTOR, CalibrationView, MeasurementView, ParameterView
from solver.records import PARAMETERS

TOLERANCE: Final = 1e-12
_FLOOR_RATE: Final = 1e-3  # °/h, and part of Kx: below, a change is judged against this size
_ITERATED: Final = ("kx", "ky", "kxy", "kyx", "wg", "wk")
_GAUGE: Final = (6.0, 82.0)
_LABELLED: Final = 3

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class ParameterRow:
    """One parameter: the main method's value with limits and verdict, the paper's beside it."""

    view: ParameterView
    shown: Measured
    limit: str
    gauge: float | None
    paper: Measured | None
    difference: Figure | None


@dataclass(frozen=True, slots=True)
class TruthRow:
    """What the simulation's gyro really was, and how far the estimate is from it."""

    name: str
    unit: str
    truth: Figure
    error: Figure
    in_expanded: str
    beyond: bool


@dataclass(frozen=True, slots=True)
class ResidualRow:
    """Residuals of one position; None where they are not known."""

    number: int
    input: MeasurementView
    x: float
    y: float
    standardised_x: float | None
    standardised_y: float | None
    beyond_x: bool
    beyond_y: bool

    @property
    def sizes(self) -> tuple[float | None, float | None]:
        """Both standardised residuals."""
        return self.standardised_x, self.standardised_y


class ResultPage:
    """Everything that the page of one result shows."""

    def __init__(self, view: CalibrationView, truth: Json | None) -> None:
        self.view = view
        both = view.method == "both"
        self.main: Json = view.result["least-squares"] if both else view.result
        self.paper: Json | None = view.result["paper"] if both else None
        self.iterated: Json | None = view.result if view.method == "paper" else self.paper
        self.method = "least-squares" if both else view.method
        self._truth = truth
        self.budget = Budget(self.main)
        self.model = Model.of(self.main)
        self.monte_carlo = MonteCarlo.of(self.main)
        self.findings = findings(self.main, view.inputs)
        self.not_excluded = not_excluded(self.main)

    @property
    def paper_error(self) -> str:
        """Why the paper's method gave nothing; empty when it did."""
        if self.paper is None or "error" not in self.paper:
            return ""
        return translate(message_from(self.paper["error"]))

    @property
    def parameters(self) -> list[ParameterRow]:
        """Both methods' parameters."""
        return [self._parameter(view) for view in self.view.summary.parameters.values()]

    def _parameter(self, view: ParameterView) -> ParameterRow:
        paper = difference = None
        if self.paper is not None and "parameters" in self.paper:
            found = self.paper["parameters"][view.name]
            value, u = found["value"], found["standard_uncertainty"]
            expanded = None if u is None else found.get("coverage_factor", COVERAGE_FACTOR) * u
            paper = measured(value, expanded)
            decimals = decimals_of(view.expanded)
            if value is not None and view.value is not None:
                difference = figure(value - view.value, 4 if decimals is None else decimals, sign=True)
        return ParameterRow(
            view, measured(view.value, view.expanded), limit_text(view.low, view.high), _gauge(view), paper,
            difference,
        )  # fmt: skip

    @property
    def warnings(self) -> list[str]:
        """What a reader must know; of the paper's method only what the main one does not say already."""
        ours: Sequence[Json] = self.main.get("warnings", ())
        codes = {item["code"] for item in ours}
        theirs = [item for item in (self.paper or {}).get("warnings", ()) if item["code"] not in codes]
        return [
            *(translate(message_from(item)) for item in ours),
            *(
                gettext("Paper’s iteration: %(text)s") % {"text": translate(message_from(item))}
                for item in theirs
            ),
        ]

    @property
    def fit(self) -> Json:
        """χ², degrees of freedom, p, rank, condition of the main method."""
        fit: Json = self.main["fit"]
        return fit

    @property
    def rounds(self) -> Sequence[Json]:
        """The paper's approximations."""
        found: Sequence[Json] = (self.iterated or {}).get("iterations") or ()
        return found

    @property
    def equations(self) -> int:
        """Observation equations: two for every measurement that went in."""
        return 2 * len(self.view.inputs)

    # ------------------------------------------------------------ residuals

    @property
    def residuals(self) -> list[ResidualRow]:
        """Residuals with the measurement that each belongs to."""
        places = sorted((row.theta_deg, row.psi_deg) for row in self.view.certificate.positions)
        numbers = {place: number for number, place in enumerate(places, start=1)}
        inputs = {(item.theta_deg, item.psi_deg, item.repeat): item for item in self.view.inputs}
        rows = []
        for item in self.main["residuals"]:
            place = (item["theta_deg"], item["psi_deg"])
            rows.append(
                ResidualRow(
                    numbers[place], inputs[(*place, item.get("repeat", 0))], item["x_deg_per_h"],
                    item["y_deg_per_h"], item["standardised_x"], item["standardised_y"],
                    _beyond(item["standardised_x"]), _beyond(item["standardised_y"]),
                )
            )  # fmt: skip
        return rows

    @property
    def exponent(self) -> int:
        """Power of ten of the residuals' axis."""
        rows = self.residuals
        return decade([value for row in rows for value in (row.x, row.y)])

    @property
    def rate_unit(self) -> str:
        """Unit of the residuals' axis: ``10⁻³ °/h``."""
        power = f"10{superscript(self.exponent)} " if self.exponent else ""
        return power + labels.unit("deg/h")

    def residual_points(self) -> Iterator[Residual]:
        """The points of the residuals' chart; only the worst carry words."""
        worst = sorted((abs(size or 0.0) for row in self.residuals for size in row.sizes), reverse=True)
        from_here = worst[_LABELLED - 1] if len(worst) >= _LABELLED else 0.0
        for place, row in enumerate(self.residuals, start=1):
            for axis, value, standardised, beyond in (
                ("x", row.x, row.standardised_x, row.beyond_x),
                ("y", row.y, row.standardised_y, row.beyond_y),
            ):
                shown = f"{self.scaled(value)} {self.rate_unit}"
                deviations = (
                    ", " + gettext("%(number)s standard deviations") % {"number": standard(standardised)}
                    if standardised is not None
                    else ""
                )
                name = gettext("Position %(number)d, θ %(theta)s°, ψ %(psi)s°, %(axis)s") % {
                    "number": row.number, "theta": plain(row.input.theta_deg, 6),
                    "psi": plain(row.input.psi_deg, 6), "axis": axis,
                }  # fmt: skip
                brief = gettext("%(number)d %(axis)s: %(value)s, %(sd)s s.d.") % {
                    "number": row.number, "axis": axis, "value": self.scaled(value),
                    "sd": standard(abs(standardised or 0.0)),
                }  # fmt: skip
                yield Residual(
                    place, "x" if axis == "x" else "y", value, beyond, f"{name}: {shown}{deviations}",
                    brief if abs(standardised or 0.0) >= from_here else "",
                    f"/measurements/{row.input.id}",
                )  # fmt: skip

    def places(self) -> list[Place]:
        """The axis of the residuals' chart."""
        return [
            Place(place, f"{plain(row.input.theta_deg, 6)}°", plain(row.input.psi_deg, 6), _spread(row))
            for place, row in enumerate(self.residuals, start=1)
        ]

    def scaled(self, value: float) -> Figure:
        """A residual in the axis's unit."""
        return figure(value * 10.0**-self.exponent, 2, sign=True)

    # ---------------------------------------------------------- convergence

    def changes(self) -> Iterator[Change]:
        """Change of every unknown of the iteration from round to round, as a part of its size."""
        rounds = self.rounds
        if not rounds:
            return
        size = {name: self._size(name) for name in _ITERATED}
        for number in range(2, len(rounds) + 1):
            for name in _ITERATED:
                before, now = rounds[number - 2].get(name), rounds[number - 1].get(name)
                if before is None or now is None:
                    continue
                relative = abs(now - before) / size[name]
                yield Change(
                    name, number, relative,
                    gettext("%(symbol)s, round %(number)d: changed by %(change)s of its size")
                    % {"symbol": labels.symbol_text(name), "number": number, "change": significant(relative, 2)},
                )  # fmt: skip

    def _size(self, name: str) -> float:
        last: Mapping[str, float | None] = self.rounds[-1]
        floor = _FLOOR_RATE * (abs(last["kx"] or 1.0) if name.startswith("k") else 1.0)
        return max(abs(last[name] or 0.0), floor)

    # --------------------------------------------------- correlation, truth

    @property
    def correlations(self) -> list[tuple[str, list[float | None]]]:
        """Correlation coefficients, row by row; None where a parameter has no uncertainty."""
        covariance = self.main["covariance"]
        deviations = [
            math.sqrt(covariance[i][i]) if covariance[i][i] else None for i in range(len(PARAMETERS))
        ]
        return [
            (name, [_ratio(covariance[i][j], deviations[i], deviations[j]) for j in range(len(PARAMETERS))])
            for i, name in enumerate(PARAMETERS)
        ]

    @staticmethod
    def order(name: str) -> int:
        """Place of a parameter among the eight."""
        return PARAMETERS.index(name)

    @property
    def truth(self) -> list[TruthRow]:
        """A simulated session's true parameters against the estimates; empty for a real one."""
        if not self._truth:
            return []
        return [
            _truth_row(view, float(self._truth[name]))
            for name, view in self.view.summary.parameters.items()
            if name in self._truth
        ]


def limit_text(low: float | None, high: float | None) -> str:
    """``±15`` or ``2055…2070``."""
    if low is None or high is None:
        return DASH
    return f"±{plain(high)}" if low == -high else f"{plain(low)}…{plain(high)}"


def standard(value: float | None) -> str:
    """A standardised residual."""
    return DASH if value is None else str(figure(value, 1))


def _gauge(view: ParameterView) -> float | None:
    if view.value is None or view.low is None or view.high is None:
        return None
    left, right = _GAUGE
    part = (view.value - view.low) / (view.high - view.low)
    return round(left + (right - left) * min(1.0, max(0.0, part)), 1)


def _beyond(standardised: float | None) -> bool:
    return standardised is not None and abs(standardised) > LIMIT_SD


def _spread(row: ResidualRow) -> float | None:
    """Standard deviation of the position's residuals: the larger of its two equations'."""
    pairs = ((row.x, row.standardised_x), (row.y, row.standardised_y))
    found = [abs(value / standardised) for value, standardised in pairs if standardised]
    return max(found, default=None)


def _ratio(value: float | None, one: float | None, other: float | None) -> float | None:
    return None if value is None or not one or not other else value / (one * other)


def _truth_row(view: ParameterView, truth: float) -> TruthRow:
    decimals = decimals_of(view.expanded)
    places = 6 if decimals is None else decimals
    if view.value is None:
        return TruthRow(view.name, view.unit, figure(truth, places), figure(None, 0), DASH, beyond=False)
    error = view.value - truth
    share = error / view.expanded if view.expanded else None
    return TruthRow(
        view.name, view.unit, figure(truth, places), figure(error, places, sign=True),
        DASH if share is None else str(figure(share, 2, sign=True)), share is not None and abs(share) > 1,
    )  # fmt: skip
