"""What limits a result, as its page shows it: the budget of every parameter's uncertainty."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.exchange.json_values import message_from
from app.figures import Figure, decimals_of, figure, plain, significant
from app.i18n import gettext, marked, translate
from app.pages import labels
from solver.records import PARAMETERS

SOURCES: Final = {
    "scatter": marked("Scatter of the residuals"),
    "currents": marked("Noise of the means"),
    "angles": marked("Stand angles, each position"),
    "ammeter-gain": marked("Ammeter gain"),
    "ammeter-offset": marked("Ammeter offset"),
    "angles-common": marked("Stand angles, in common"),
    "level": marked("Level of the base"),
    "azimuth": marked("Azimuth of the base"),
    "latitude": marked("Latitude"),
    "gravity": marked("Gravity"),
    "temperature": marked("Temperature"),
    "correlation": marked("Correlations"),
}
"""Lines of a budget in words; pass through `gettext`."""
_MOST_BARS: Final = 5
_SMALLEST: Final = 0.005
_NOISE: Final = 1e-9
"""Of the combined uncertainty, below which a line's part is rounding of the computation."""

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Share:
    """One cell of the bars: per cent as it is printed, the bar's length, whether it is the largest of its row."""

    text: str
    length: str
    dominates: bool


@dataclass(frozen=True, slots=True)
class BudgetRow:
    """One parameter's shares, in the order of the columns; None where it is not determined."""

    name: str
    shares: Sequence[Share] | None


@dataclass(frozen=True, slots=True)
class Sum:
    """One parameter's combined uncertainty: u, effective degrees of freedom, k and U as printed."""

    name: str
    u: str
    dof: str
    k: str
    expanded: str


class Budget:
    """The budget of one method's answer."""

    def __init__(self, answer: Json) -> None:
        self._lines: Sequence[Json] = answer.get("budget") or ()
        self._parameters: Json = answer.get("parameters") or {}
        self._noise: Json = answer.get("current_noise") or {}
        self.shown = sorted(self._lines, key=self._largest, reverse=True)[:_MOST_BARS]

    def __bool__(self) -> bool:
        return bool(self._lines)

    @staticmethod
    def _largest(line: Json) -> float:
        return max((abs(share) for share in line["shares"].values() if share is not None), default=0.0)

    @property
    def heads(self) -> list[str]:
        """The largest lines, in words."""
        return [_source(line) for line in self.shown]

    @property
    def hidden(self) -> int:
        """How many lines the bars leave to the table."""
        return len(self._lines) - len(self.shown)

    @property
    def rows(self) -> list[BudgetRow]:
        """Every parameter's shares of the largest lines."""
        return [BudgetRow(name, self._shares(name)) for name in PARAMETERS]

    def _shares(self, name: str) -> Sequence[Share] | None:
        shares = [line["shares"][name] for line in self.shown]
        if any(share is None for share in shares):
            return None
        largest = max(range(len(shares)), key=lambda index: shares[index])
        return [_share(share, index == largest) for index, share in enumerate(shares)]

    @property
    def lines(self) -> list[tuple[str, list[str]]]:
        """Every line in words, with the standard uncertainty that it gives each parameter."""
        return [
            (_source(line), [self._part(name, line["standard_uncertainties"][name]) for name in PARAMETERS])
            for line in self._lines
        ]

    def _part(self, name: str, u: float | None) -> str:
        """A line's part down to the third digit of the combined u, so that points stand in one line."""
        whole = self._parameters.get(name, {}).get("standard_uncertainty")
        decimals = decimals_of(whole, 3)
        if u is None or decimals is None:
            return significant(u, 2)
        if abs(u) <= _NOISE * whole:
            return plain(0.0)
        least = 10.0**-decimals
        return f"< {figure(least, decimals)}" if abs(u) < 0.5 * least else str(figure(u, decimals))

    @property
    def sums(self) -> list[Sum]:
        """Every parameter's u, ν_eff, k and U."""
        return [_sum(name, self._parameters[name]) for name in PARAMETERS if name in self._parameters]

    @property
    def sentence(self) -> str:
        """Which line dominates which parameters."""
        by_line: dict[str, list[str]] = {}
        for name in PARAMETERS:
            line = self._parameters.get(name, {}).get("dominated_by")
            if line:
                by_line.setdefault(line, []).append(labels.symbol_text(name))
        parts = [
            gettext("%(source)s dominates %(parameters)s")
            % {"source": gettext(SOURCES[line]), "parameters": ", ".join(names)}
            for line, names in by_line.items()
        ]
        return "; ".join(parts) + "." if parts else ""

    @property
    def moderation(self) -> str:
        """Which u(J) was stated and which used, where they differ."""
        return translate(message_from(self._noise["conclusion"])) if self._noise else ""


def _source(line: Json) -> str:
    code = line["code"]
    return gettext(SOURCES[code])


def _share(share: float, dominates: bool) -> Share:
    percent = 100.0 * share
    text = "<1" if 0 <= share < _SMALLEST else str(figure(percent, 0))
    return Share(text, f"{max(0.0, min(100.0, percent)):.1f}%", dominates)


def _sum(name: str, entry: Json) -> Sum:
    dof, k = entry.get("dof"), entry.get("coverage_factor")
    unlimited = dof is None and entry.get("expanded_uncertainty") is not None
    return Sum(
        name,
        significant(entry["standard_uncertainty"], 2),
        "∞" if unlimited or (dof or 0.0) > 1e4 else plain(float(int(dof))) if dof else _dash(),
        str(_two(k)) if k else _dash(),
        significant(entry.get("expanded_uncertainty"), 2),
    )


def _two(value: float) -> Figure:
    return figure(value, 2)


def _dash() -> str:
    return str(figure(None, 0))
