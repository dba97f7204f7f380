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
    "wn": marked("g²-sensitive drift ωn"),
    "drift_x": marked("drift of ω0x over the session"),
    "drift_y": marked("drift of ω0y over the session"),
    "wg_split": marked("half of what ωg differs from x to y"),
    "wk_split": marked("half of what ωk differs from x to y"),
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
        rows = [_term(item, item["term"] in found["supported"]) for item in found["terms"]]
        return cls(translate(message_from(found["conclusion"])), rows)


def _term(item: Json, supported: bool) -> TermRow:
    reason, term = item.get("reason"), item["term"]
    expanded = item.get("expanded_uncertainty")
    return TermRow(
        name=gettext(TERMS[term]),
        shown=measured(item["value"], expanded),
        unit=labels.unit(item["unit"]),
        f=DASH if item["f"] is None else significant(item["f"], 3),
        p=DASH if item["p_holm"] is None else significant(item["p_holm"], 2),
        supported=supported,
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
