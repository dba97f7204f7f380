"""Baselines: choose sessions, see the limits that they give and how often these alarm for nothing, freeze them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Query, Request, Response

from app import figures
from app.errors import AppError, Conflict
from app.pages import drift_labels, drift_words
from app.pages.alarms import may_judge
from app.pages.base import Reader, TheLab, Writer, local_path, render, see
from app.pages.drift_panels import ORDER
from app.pages.drift_tables import by_session
from app.pages.forms import Form, Sent
from app.pages.history import Day
from app.services import gyros
from app.services.drift import baselines, previewing, reading
from app.services.drift.views import DriftPoint, ProposedBaseline
from app.services.lab import Lab, Person, Work
from solver.drift.control.run_rules import RULES

router = APIRouter()

_MOST: Final = 60
"""Sessions to choose among; the days narrow them."""
_LISTED: Final = ("w0x", "w0y", "wg", "wk")
_CHARTS: Final = ("ewma", "cusum")


@dataclass(frozen=True, slots=True)
class Choice:
    """What a person has chosen, as it stands in the address; nothing before the first look."""

    method: str = "least-squares"
    begin: Annotated[Day, Query(alias="from")] = None
    until: Day = None
    result: Annotated[tuple[int, ...], Query()] = ()
    parameter: Annotated[tuple[str, ...], Query()] = ()
    estimator: str = "paule-mandel"
    limits: str = "prediction"
    rule: Annotated[tuple[str, ...], Query()] = ()
    look: bool = False

    @property
    def rules(self) -> dict[str, Any]:
        """As a baseline keeps them."""
        return rules_of(self.rule)


Chosen = Annotated[Choice, Depends()]
Rows = Sequence[tuple[DriftPoint, Mapping[str, DriftPoint]]]


def rules_of(names: Sequence[str]) -> dict[str, Any]:
    """Names of run rules and of charts as a baseline keeps them; charts with the product's own settings."""
    single = [name for name in names if name not in _CHARTS]
    return {"individuals": single} | {name: {} for name in _CHARTS if name in names}


@router.get("/gyros/{serial}/baseline")
def page(request: Request, person: Reader, lab: TheLab, serial: str, chosen: Chosen) -> Response:
    """Choose, and look at what was chosen."""
    return _page(request, lab, person, serial, chosen)


@router.post("/gyros/{serial}/baseline")
def freeze(request: Request, person: Writer, lab: TheLab, serial: str, sent: Sent) -> Response:
    """Freeze what was looked at."""
    texts = {name: [item for item in sent.getlist(name) if isinstance(item, str)] for name in _REPEATED}
    form = Form.of(sent, "method", "estimator", "limits", "reason")
    chosen = Choice(
        method=form.value("method"), result=tuple(int(item) for item in texts["result"] if item.isdecimal()),
        parameter=tuple(texts["parameter"]), estimator=form.value("estimator"), limits=form.value("limits"),
        rule=tuple(texts["rule"]), look=True,
    )  # fmt: skip
    try:
        with lab.write(person) as work:
            baselines.freeze(
                work, serial, chosen.parameter, chosen.result, method=chosen.method, estimator=chosen.estimator,
                limits=chosen.limits, rules=chosen.rules, reason=form.value("reason"),
            )  # fmt: skip
    except AppError as error:
        return _page(request, lab, person, serial, chosen, form.with_problems(*error.problems), error.status)
    return see(f"/gyros/{serial}?method={chosen.method}")


@router.post("/baselines/{number}/retirement")
def retire(person: Writer, lab: TheLab, number: int, sent: Sent) -> Response:
    """Judge by it no more."""
    with lab.write(person) as work:
        found = baselines.retire(work, number)
    wanted = sent.get("next")
    return see(local_path(wanted if isinstance(wanted, str) else None, f"/gyros/{found.gyro}/baseline"))


_REPEATED: Final = ("result", "parameter", "rule")


def _page(
    request: Request, lab: Lab, person: Person, serial: str, chosen: Choice, form: Form | None = None,
    status: int = 200,
) -> Response:  # fmt: skip
    form = form or Form({"reason": ""})
    with lab.read(person) as work:
        gyro = gyros.gyro(work, serial)
        proposed = _proposed(work, serial, chosen)
        rows = _sessions(work, serial, chosen, proposed)
        known = sorted(
            baselines.of_gyro(work, serial, method=chosen.method),
            key=lambda line: (ORDER.index(line.parameter), line.valid_from),
        )
        previewed = None
        if chosen.look:
            try:
                previewed = _look(work, serial, chosen)
            except AppError as error:
                status = max(status, error.status)
                form = form if form.problems else form.with_problems(*error.problems)
    return render(
        request, "baselines/page.html", status=status, gyro=gyro, chosen=chosen, form=form, rows=rows, known=known,
        picked=set(chosen.result) if chosen.look else set(proposed.calibrations if proposed else ()),
        parameters=chosen.parameter if chosen.look else ORDER, rules=chosen.rule if chosen.look else _DEFAULT,
        order=ORDER, listed=_LISTED, every_rule=(*RULES, *_CHARTS), estimators=baselines.ESTIMATORS,
        kinds=baselines.LIMITS, previewed=previewed, fewest=baselines.FEWEST, most=_MOST, judges=may_judge(person),
        said=None if previewed is None else list(_said(previewed)), drift=drift_labels, words=drift_words,
        measured=figures.measured,
    )  # fmt: skip


_DEFAULT: Final = ("nelson-1", "ewma")


def _look(work: Work, serial: str, chosen: Choice) -> previewing.Previewed:
    return previewing.preview(
        work, serial, chosen.parameter, chosen.result, method=chosen.method, estimator=chosen.estimator,
        limits=chosen.limits, rules=chosen.rules,
    )  # fmt: skip


def _proposed(work: Work, serial: str, chosen: Choice) -> ProposedBaseline | None:
    if chosen.look:
        return None
    try:
        return baselines.propose(work, serial, method=chosen.method, since=_midnight(chosen.begin))
    except Conflict:  # no stretch is long enough yet: the sessions are shown, and none is ticked
        return None


def _sessions(work: Work, serial: str, chosen: Choice, proposed: ProposedBaseline | None) -> Rows:
    """Sessions to choose among, the oldest first."""
    since = _midnight(chosen.begin) or (proposed.since if proposed else None)
    until = _midnight(chosen.until and chosen.until + timedelta(days=1))
    found = reading.gyro_drift(
        work, serial, method=chosen.method, parameters=ORDER, since=since, until=until, most=None
    )
    everything = list(reversed(by_session(found.parameters, 10**6)))
    picked = set(chosen.result)
    first = next((place for place, (point, _) in enumerate(everything) if point.calibration in picked), 0)
    return everything[first if picked and since is None else 0 :][:_MOST]


def _midnight(day: date | None) -> datetime | None:
    return None if day is None else datetime.combine(day, time(), UTC)


@dataclass(frozen=True, slots=True)
class Line:
    """A parameter's preview with the digits that its scatter bears."""

    parameter: str
    unit: str
    centre: str
    scatter: str
    low: str
    high: str
    count: int
    judged: int
    beyond: int


def _said(previewed: previewing.Previewed) -> Iterator[Line]:
    for item in previewed.parameters:
        places = figures.decimals_of((item.high - item.low) / 2.0) or 4
        centre, scatter, low, high = (
            str(figures.figure(value, places + extra))
            for value, extra in ((item.centre, 0), (item.scatter, 0), (item.low, 0), (item.high, 0))
        )
        yield Line(
            item.parameter, item.unit, centre, scatter, low, high, item.count, item.judged, item.beyond
        )
