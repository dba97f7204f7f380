"""What was tested of a result, as its page shows it: further terms of the model, and the Monte Carlo check."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.exchange.json_values import message_from
from app.figures import DASH, Measured, decimals_of, figure, measured, plain, significant
from app.i18n import gettext, marked, translate
from app.pages import labels
from solver.records import PARAMETERS

TERMS: Final = {
    "wn": marked("ωn, g²-sensitive drift"),
    "w0x_per_s": marked("drift of ω0x in time"),
    "w0y_per_s": marked("drift of ω0y in time"),
    "wg_split": marked("ωg of x and of y apart, half their difference"),
    "wk_split": marked("ωk of x and of y apart, half their difference"),
}
"""Further terms in words; pass through `gettext`."""
_END_DIGITS: Final = 3

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class TermRow:
    """One further term: its value with U, the F-test, whether the data support it; or why it cannot be tested."""

    name: str
    shown: Measured
    unit: str
    f: str
    p: str
    supported: bool
    reason: str


@dataclass(frozen=True, slots=True)
class Model:
    """Which further terms the data support."""

    sentence: str
    rows: Sequence[TermRow]

    @classmethod
    def of(cls, answer: Json) -> "Model | None":
        """What the answer tells of it; None when nothing was tested."""
        found = answer.get("model")
        if not found:
            return None
        return cls(translate(message_from(found["conclusion"])), [_term(item) for item in found["terms"]])


def _term(item: Json) -> TermRow:
    reason = item.get("reason")
    expanded = item.get("expanded_uncertainty")
    return TermRow(
        name=gettext(TERMS[item["term"]]),
        shown=measured(item["value"], expanded),
        unit=labels.unit(item["unit"]),
        f=DASH if item["f"] is None else significant(item["f"], 3),
        p=DASH if item["p_value"] is None else significant(item["p_value"], 2),
        supported=item["supported"],
        reason=translate(message_from(reason)) if reason else "",
    )


@dataclass(frozen=True, slots=True)
class IntervalRow:
    """One parameter's 95 % intervals by first order and by draws, their largest difference and its tolerance."""

    name: str
    unit: str
    gum: tuple[str, str]
    symmetric: tuple[str, str]
    shortest: tuple[str, str]
    difference: str
    tolerance: str
    agrees: bool


@dataclass(frozen=True, slots=True)
class MonteCarlo:
    """The propagation of distributions beside the first-order one."""

    trials: str
    seed: int
    sentence: str
    rows: Sequence[IntervalRow]

    @classmethod
    def of(cls, answer: Json) -> "MonteCarlo | None":
        """What the answer tells of it; None when it was not asked for."""
        found = answer.get("monte_carlo")
        if not found:
            return None
        rows = [
            _intervals(name, found["parameters"][name]) for name in PARAMETERS if name in found["parameters"]
        ]
        sentence = translate(message_from(found["conclusion"]))
        return cls(plain(float(found["trials"])), found["seed"], sentence, rows)


def _intervals(name: str, item: Json) -> IntervalRow:
    decimals = decimals_of(item["expanded_uncertainty"], _END_DIGITS) or 6

    def ends(key: str) -> tuple[str, str]:
        low, high = item[key]
        return str(figure(low, decimals)), str(figure(high, decimals))

    return IntervalRow(
        name=name,
        unit=labels.PARAMETER_UNITS[name],
        gum=ends("first_order"),
        symmetric=ends("symmetric"),
        shortest=ends("shortest"),
        difference=significant(item["difference"], 2),
        tolerance=significant(item["tolerance"], 2),
        agrees=item["agrees"],
    )
