"""Baselines: proposed by the product, frozen by a person, retired by a person; never changed.

Everything that was chosen is kept: the sessions' results, the estimator, the kind of limits, the rules, the reason, who
and when; with the numbers that followed from them, so that a limit on a chart never moves by itself.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from app.errors import Conflict, Invalid, NotFound, problem
from app.exchange.si import PARAMETER_UNITS
from app.services import access
from app.services.drift import charting, events, following, series
from app.services.drift.series import SeriesTable, aware, moment
from app.services.drift.views import BaselineView, ProposedBaseline
from app.services.lab import Work
from app.services.lookup import find_gyro
from app.store import drift
from app.store.tables import Baseline
from solver.drift.control import baseline as frozen
from solver.drift.start_means import occasions, start_means
from solver.errors import SolverError
from solver.records import PARAMETERS

ESTIMATORS: Final = get_args(frozen.Estimator)
LIMITS: Final = get_args(frozen.Limits)
FEWEST: Final = 5
"""Starts of a baseline: with fewer its scatter is known to no better than a factor of three."""
PROPOSED: Final = 25
"""Starts that are proposed at the most: as many as textbooks ask for; those that follow are judged."""
_LONGEST: Final = 4000


def propose(
    work: Work, serial: str, *, method: str = "least-squares", since: datetime | None = None
) -> ProposedBaseline:
    """The first stretch of at least `FEWEST` starts that no event interrupts, at most `PROPOSED` of them.

    Raises
    ------
    Conflict
        There is no such stretch.
    """
    table = series.load(work, find_gyro(work, serial).id, method).between(since, None)
    found = _stretch(table, _breaks(work, table, serial))
    if found is None:
        raise Conflict(problem("no-baseline-yet", "There is no stretch of %(fewest)d sessions without an event yet.",
                               fewest=FEWEST))  # fmt: skip
    chosen = table.rows(found)
    parameters = {}
    for name in PARAMETERS:
        means = start_means(chosen.history(name)).history
        if len(means) >= FEWEST:
            try:
                made = frozen.freeze(means, "paule-mandel")
            except SolverError:  # values without any scatter make no baseline; the others do
                continue
            parameters[name] = {"centre": made.centre, "scatter": made.scatter, "dof": made.dof}
    return ProposedBaseline(
        serial, method, aware(chosen["measured_at"][0]), aware(chosen["measured_at"][-1]),
        tuple(chosen["calibration"].tolist()), parameters,
    )  # fmt: skip


def _breaks(work: Work, table: SeriesTable, serial: str) -> list[datetime]:
    """When a baseline must not go on: whatever was entered, another stand or certificate; not another solver."""
    told = [item for item in events.derived(table, serial) if item.kind != "solver"]
    return sorted(item.at for item in (*told, *events.of_gyro(work, serial)))


def _stretch(table: SeriesTable, breaks: Sequence[datetime]) -> NDArray[np.int64] | None:
    edges = np.searchsorted(table["measured_at"], np.array([moment(at) for at in breaks], "datetime64[us]"))
    for stretch in np.split(np.arange(len(table)), edges):
        start = occasions(table["start"][stretch])
        order = np.unique(start, return_index=True)[1]  # each start's first session
        if len(order) >= FEWEST:
            return stretch[np.isin(start, start[np.sort(order)[:PROPOSED]])]
    return None


def freeze(
    work: Work,
    serial: str,
    parameters: Sequence[str],
    calibrations: Sequence[int],
    *,
    method: str = "least-squares",
    estimator: str = "paule-mandel",
    limits: str = "prediction",
    rules: Mapping[str, Any] | None = None,
    valid_from: datetime | None = None,
    reason: str = "",
) -> tuple[BaselineView, ...]:
    """Freeze what these parameters are judged against from now on.

    Parameters
    ----------
    calibrations
        Ids of the results chosen; only results that count.
    rules
        As `charting.DEFAULT_RULES`, which are taken when there are none.
    valid_from
        From which time on sessions are judged; when none is said, from the first session chosen. Sessions
        chosen are never judged by what was made of them.

    Raises
    ------
    Forbidden
        The person's role does not judge.
    Invalid
        An unknown name or rule, a time to come, too few sessions, a result that does not count, a parameter that the
        sessions chosen do not give a baseline for.
    """
    access.require_judge(work.person)
    gyro = find_gyro(work, serial)
    chosen_rules = charting.checked(charting.DEFAULT_RULES if rules is None else rules)
    check(parameters, estimator, limits, reason)
    table = chosen(series.load(work, gyro.id, method), calibrations)
    begin = valid_from or aware(table["measured_at"][0])
    if begin > work.now:
        raise Invalid(problem("future-baseline", "A baseline that holds from a time to come judges nothing; give the "
                              "time of a session.", column="valid_from"))  # fmt: skip
    rows = [
        Baseline(
            gyro_id=gyro.id, parameter=name, method=method, valid_from=begin,
            calibrations=table["calibration"].tolist(), limits=limits, rules=chosen_rules,
            reason=reason.strip(), frozen_at=work.now, frozen_by=work.person.name,
            **numbers(table, name, estimator),
        )
        for name in parameters
    ]  # fmt: skip
    _retire_same(work, gyro.id, method, parameters, begin)
    work.db.add_all(rows)
    work.db.flush()
    following.changed(work, gyro.id, methods=[method])
    return _views(work, rows, serial)


def check(parameters: Sequence[str], estimator: str, limits: str, reason: str = "") -> None:
    """Raise `Invalid` for a name that there is not, a parameter named twice or none, a reason too long."""
    for value, known, column in (
        *((name, PARAMETERS, "parameters") for name in parameters),
        (estimator, ESTIMATORS, "estimator"),
        (limits, LIMITS, "limits"),
    ):
        if value not in known:
            raise Invalid(problem("unknown-choice", "There is no “%(value)s” here; choose among %(known)s.",
                                  column=column, value=value, known=", ".join(known)))  # fmt: skip
    if not parameters or len(set(parameters)) < len(parameters):
        raise Invalid(problem("baseline-parameters", "Name each parameter once, and at least one.",
                              column="parameters"))  # fmt: skip
    if len(reason) > _LONGEST:
        raise Invalid(problem("note-too-long", "A note has at most %(most)d characters.", column="reason",
                              most=_LONGEST))  # fmt: skip


def chosen(table: SeriesTable, calibrations: Sequence[int]) -> SeriesTable:
    """The sessions of these results; `Invalid` when one does not count, or when they are too few."""
    wanted = set(calibrations)
    unknown = sorted(wanted - set(table["calibration"].tolist()))
    if unknown:
        raise Invalid(problem("not-counting", "Result %(number)d is not one of this gyro that counts by this method.",
                              column="calibrations", number=unknown[0]))  # fmt: skip
    if len(wanted) < FEWEST:
        raise Invalid(problem("baseline-too-short", "A baseline needs at least %(fewest)d sessions; these "
                              "are %(count)d.", column="calibrations", fewest=FEWEST, count=len(wanted)))  # fmt: skip
    return table.rows(np.isin(table["calibration"], sorted(wanted)))


def numbers(table: SeriesTable, name: str, estimator: str) -> dict[str, Any]:
    """What a baseline of these sessions is for a parameter; `Invalid` when they give none."""
    means = start_means(table.history(name))
    if len(means.history) < FEWEST:
        raise Invalid(problem("baseline-undetermined", "%(parameter)s was determined in %(count)d starts of these "
                              "sessions only; a baseline needs %(fewest)d.", column="parameters",
                              count=len(means.history), parameter=name, fewest=FEWEST))  # fmt: skip
    kind: frozen.Estimator = next(item for item in ESTIMATORS if item == estimator)
    try:
        made = frozen.freeze(means.history, kind)
    except SolverError as error:
        message = error.message
        raise Invalid(
            problem(message.code, message.template, column="parameters", **message.values)
        ) from error
    return {
        "estimator": made.estimator, "centre": made.centre, "scatter": made.scatter, "dof": made.dof,
        "u_typical": made.u_typical, "within": means.within, "count": made.count,
    }  # fmt: skip


def _retire_same(work: Work, gyro_id: int, method: str, parameters: Sequence[str], begin: datetime) -> None:
    """One that begins at the same time as the new one would judge nothing any more."""
    for row in drift.baselines(work.db, gyro_id, method=method):
        if row.parameter in parameters and row.valid_from == begin:
            row.retired_at, row.retired_by = work.now, work.person.name


def retire(work: Work, baseline_id: int) -> BaselineView:
    """Judge nothing by a baseline any more; it stays to be seen.

    Raises
    ------
    Forbidden
        The person's role does not judge.
    NotFound
        There is none of that number.
    Conflict
        It was retired before.
    """
    access.require_judge(work.person)
    row = drift.baseline(work.db, baseline_id)
    if row is None:
        raise NotFound(problem("unknown-baseline", "There is no baseline %(number)d.", number=baseline_id))
    if row.retired_at is not None:
        raise Conflict(problem("baseline-retired", "This baseline was retired already."))
    row.retired_at, row.retired_by = work.now, work.person.name
    work.db.flush()
    following.changed(work, row.gyro_id, methods=[row.method])
    gyro, _ = drift.subject_names(work.db, row.gyro_id, None)
    return _views(work, [row], gyro or "")[0]


def of_gyro(
    work: Work, serial: str, *, method: str | None = None, retired: bool = False
) -> tuple[BaselineView, ...]:
    """A gyro's baselines by parameter, then by what they are valid from."""
    rows = drift.baselines(work.db, find_gyro(work, serial).id, method=method, retired=retired)
    return _views(work, rows, serial)


def _views(work: Work, rows: Sequence[Baseline], gyro: str) -> tuple[BaselineView, ...]:
    sessions = drift.sessions_of(work.db, {key for row in rows for key in row.calibrations})
    return tuple(
        BaselineView(
            id=row.id, gyro=gyro, parameter=row.parameter, unit=PARAMETER_UNITS[row.parameter][0],
            method=row.method, valid_from=row.valid_from, calibrations=tuple(row.calibrations),
            sessions=tuple(sessions[key] for key in row.calibrations), estimator=row.estimator,
            centre=row.centre, scatter=row.scatter, dof=row.dof, u_typical=row.u_typical,
            within=row.within, count=row.count, limits=row.limits, rules=row.rules, reason=row.reason,
            frozen_at=row.frozen_at, frozen_by=row.frozen_by, retired_at=row.retired_at, retired_by=row.retired_by,
        )
        for row in rows
    )  # fmt: skip
