"""Planning a session: what positions will tell, which are best, how many are worth it, and what trades for what.

The answers depend on nothing but the question, so the same question is answered from memory.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any, Final, TypeVar

import numpy as np

from app.errors import Invalid, problem
from app.exchange.planned import certified_rows, grid_positions, places_si
from app.exchange.positions import Positions
from app.exchange.rows import CertificateRow
from app.exchange.si import PARAMETER_UNITS, parameter_lab
from app.services.plan_question import COUNTS, Asked, Question, Subject, check
from app.services.plan_views import (
    Plan,
    Planned,
    PlannedParameter,
    PlannedPosition,
    Search,
    Trade,
    TradePoint,
    Worth,
)
from app.services.verdicts import judge
from solver.errors import SolverError
from solver.positions.pareto import trade_off, uncertainties
from solver.positions.planning import Circumstances, Prediction, below_method, duration_at, predict
from solver.positions.proposing import Proposal, best_counts, propose
from solver.records import PARAMETERS

TRADE_COUNT: Final = 8
TRADE_GRID_DEG: Final = 45.0
PAPERS_EIGHT: Final = tuple((theta, psi) for theta in (0.0, 90.0) for psi in (0.0, 90.0, 180.0, 270.0))
"""The positions of the paper's iteration."""

_FIELDS: Final = {
    "bad-noise": "noise_deg_per_h", "no-time": "time_s", "too-few-positions": "count",
    "too-many-positions": "count", "unknown-criterion": "criterion", "bad-nominal": "gyro",
}  # fmt: skip
_RATE: Final = "w0x"  # the figures of D and A are rates, in its unit
_K, _G = ("kx", "ky"), ("wg",)

T = TypeVar("T")


def planned(subject: Subject, *, with_counts: bool = False, with_trade: bool = False) -> Planned:
    """The plan, and if asked for the numbers of positions compared and the trade.

    Raises
    ------
    Invalid
        A question without an answer, with the field that is wrong.
    """
    question = subject.question
    return Planned(
        stand=subject.stand, certificate=subject.certificate, latitude_deg=question.latitude_deg,
        nominal_source=subject.nominal_source, plan=plan(question),
        counts=counts(question) if with_counts else (), trade=trade(question) if with_trade else None,
    )  # fmt: skip


def plan(question: Question) -> Plan:
    """What the listed positions will tell, or the best ones.

    Raises
    ------
    Invalid
        A question without an answer, with the field that is wrong.
    """
    return _told(_plan, question)


def counts(question: Question) -> tuple[Worth, ...]:
    """The best positions of each number of them, in the same total time.

    Raises
    ------
    Invalid
    """
    return _told(_counts, question)


def trade(question: Question) -> Trade:
    """What u(K) costs in u(ωg): the front of eight positions on the grid of 45°, the paper's eight marked.

    Raises
    ------
    Invalid
    """
    return _told(_trade, question)


def _told(answer: Callable[[Question], T], question: Question) -> T:
    check(question.asked)
    try:
        return answer(question)
    except SolverError as error:
        message = error.message
        raise Invalid(
            problem(message.code, message.template, column=_FIELDS.get(message.code), **message.values)
        ) from error


@lru_cache(maxsize=128)
def _plan(question: Question) -> Plan:
    asked, at = question.asked, question.circumstances()
    if asked.count is None:
        rows = question.listed()
        prediction = predict(places_si(rows), duration_at(asked.time_s, asked.moving_s, len(rows)), at)
        return _view(question, rows, prediction)
    candidates = question.candidates()
    found = _proposed(question, candidates, asked.count, at)
    return _view(question, [candidates[row] for row in found.rows], found.prediction, found, len(candidates))


def _proposed(
    question: Question, candidates: tuple[CertificateRow, ...], count: int, at: Circumstances
) -> Proposal:
    asked = question.asked
    return propose(
        places_si(candidates), count, asked.time_s, asked.moving_s, at, asked.criterion, repeats=asked.repeats
    )


@lru_cache(maxsize=128)
def _counts(question: Question) -> tuple[Worth, ...]:
    asked = question.asked
    found = best_counts(
        places_si(question.candidates()), COUNTS, asked.time_s, asked.moving_s, question.circumstances(),
        asked.criterion, repeats=asked.repeats,
    )  # fmt: skip
    useful = [item for item in found if item.determines]
    best = min(useful, key=lambda item: item.figure, default=None)
    return tuple(
        Worth(
            count=len(item.rows), duration_s=item.prediction.duration,
            below_method=below_method(item.prediction.duration),
            figure=_figure(asked.criterion, item.figure), unit=_unit(asked.criterion),
            u=_u_lab(item.prediction), best=item is best,
        )
        for item in useful
    )  # fmt: skip


@lru_cache(maxsize=64)
def _trade(question: Question) -> Trade:
    asked, at = question.asked, question.circumstances()
    grid = certified_rows(grid_positions(TRADE_GRID_DEG), question.certificate)
    duration = duration_at(asked.time_s, asked.moving_s, TRADE_COUNT)
    found = trade_off(places_si(grid), TRADE_COUNT, duration, at, _K, _G)
    front = [
        _point("front", [grid[row] for row in np.flatnonzero(counts)], u, duration)
        for counts, u in zip(found.counts, found.u, strict=True)
    ]
    compared: list[tuple[str, Iterable[CertificateRow]]] = [
        ("paper", certified_rows(PAPERS_EIGHT, question.certificate)),
        ("all", certified_rows(grid_positions(90.0), question.certificate)),
    ]
    if asked.count is None:
        compared.append(("plan", question.listed()))
    else:
        planned = _plan(question)
        chosen = [(item.theta_deg, item.psi_deg) for item in planned.positions for _ in range(item.times)]
        compared.append(("plan", certified_rows(chosen, question.certificate)))
    marked = [_marked(kind, list(rows), at, asked) for kind, rows in compared]
    return Trade(
        TRADE_COUNT, TRADE_GRID_DEG, found.exhaustive, found.tried, tuple(front),
        tuple(point for point in marked if point is not None),
    )  # fmt: skip


def _marked(kind: str, rows: list[CertificateRow], at: Circumstances, asked: Asked) -> TradePoint | None:
    """A set for comparison; None where there is no time for it, or it does not determine both."""
    if asked.time_s / len(rows) <= asked.moving_s:
        return None
    duration = duration_at(asked.time_s, asked.moving_s, len(rows))
    places = places_si(rows)
    unknown = predict(places, duration, at).undetermined[[PARAMETERS.index(name) for name in (*_K, *_G)]]
    return (
        None if unknown.any() else _point(kind, rows, uncertainties(places, duration, at, _K, _G), duration)
    )


def _point(kind: Any, rows: list[CertificateRow], u: Iterable[float], duration: float) -> TradePoint:
    u_k, u_g = (parameter_lab(name, float(value)) for name, value in zip(("kx", "wg"), u, strict=True))
    return TradePoint(kind, u_k, u_g, tuple((row.theta_deg, row.psi_deg) for row in rows), duration)


def _view(
    question: Question,
    rows: Iterable[CertificateRow],
    prediction: Prediction,
    found: Proposal | None = None,
    candidates: int = 0,
) -> Plan:
    asked, chosen = question.asked, list(rows)
    search = None
    if found is not None:
        search = Search(
            asked.criterion, _figure(asked.criterion, found.figure) if found.determines else None,
            _unit(asked.criterion), candidates,
            found.exhaustive, found.starts, found.tried,
        )  # fmt: skip
    return Plan(
        positions=_positions(chosen, question.certificate), count=len(chosen), total_s=asked.time_s,
        duration_s=prediction.duration, below_method=below_method(prediction.duration),
        parameters=tuple(_parameters(question, prediction)), rank=prediction.rank,
        condition=prediction.condition if math.isfinite(prediction.condition) else None,
        dof=2 * len(chosen) - prediction.rank, warnings=prediction.warnings,
        determined=found is None or found.determines, search=search,
    )  # fmt: skip


def _positions(
    rows: Iterable[CertificateRow], certificate: Iterable[CertificateRow]
) -> tuple[PlannedPosition, ...]:
    """Each position once, in the order of θ and ψ, with how often it is measured."""
    certified, seen = Positions(), Positions()
    for row in certificate:
        certified.put(row.theta_deg, row.psi_deg)
    times: dict[int, tuple[CertificateRow, int]] = {}
    for row in rows:
        number = seen.put(row.theta_deg, row.psi_deg)
        times[number] = (row, times[number][1] + 1 if number in times else 1)
    ordered = sorted(times.values(), key=lambda item: (item[0].theta_deg, item[0].psi_deg))
    return tuple(
        PlannedPosition(
            row.theta_deg, row.psi_deg, count, certified.find(row.theta_deg, row.psi_deg) is not None
        )
        for row, count in ordered
    )


def _parameters(question: Question, prediction: Prediction) -> Iterable[PlannedParameter]:
    budget = prediction.budget
    u = _u_lab(prediction)
    limits: Mapping[str, tuple[float, float]] = {name: (low, high) for name, low, high in question.limits}
    for index, name in enumerate(PARAMETERS):
        low, high = limits.get(name, (None, None))
        nominal, known = question.nominal[index], u[name]
        k = float(budget.coverage_factors[index])
        line = budget.dominating[index] if known is not None else None
        yield PlannedParameter(
            name=name, nominal=nominal, u=known, k=k if known is not None else None,
            expanded=None if known is None else k * known, unit=PARAMETER_UNITS[name][0], low=low, high=high,
            verdict="undetermined" if known is None else judge(nominal, known, low, high, k),
            dominating=line,
            share=None if line is None else float(budget.shares[budget.lines.index(line), index]),
        )  # fmt: skip


def _u_lab(prediction: Prediction) -> dict[str, float | None]:
    return {
        name: parameter_lab(name, float(value)) if math.isfinite(value) else None
        for name, value in zip(PARAMETERS, prediction.u, strict=True)
    }


def _figure(criterion: str, figure: float) -> float:
    return parameter_lab(criterion if criterion in PARAMETERS else _RATE, figure)


def _unit(criterion: str) -> str:
    return PARAMETER_UNITS[criterion if criterion in PARAMETERS else _RATE][0]
