"""Two results side by side: what they differ by, in units of the uncertainty of the difference.

What the currents' noise gives differs from session to session. What both results have in common (the same
certificate's angles, the same ammeter, the same base) moves both alike when the gyro is the same, and is
then taken off the uncertainty of the difference: its covariance is the sum over the shared lines of the budget of
u_a·u_b. Two gyros feel the same error each in its own way, so that nothing is taken off for them. The
joint test of all parameters takes nothing off either, which makes it hold back.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from app.errors import Invalid, NotFound, problem
from app.exchange.json_values import Json
from app.services import verdicts
from app.services.drift import due
from app.services.drift.comparing_views import Agreement, Compared, ComparisonView, Side
from app.services.lab import Work
from app.services.lookup import find_gyro
from app.services.views import ParameterView
from app.store import fleet, results
from app.store.tables import Calibration
from solver.drift.comparing import comparison
from solver.drift.comparing.comparison import Difference
from solver.estimators.model_comparison import holm
from solver.records import PARAMETERS

SUBJECTS: Final = ("session", "result", "gyro")
"""What can be compared: ``session:78``, ``result:91``, ``gyro:0417`` (its last sound calibration)."""
SIGNIFICANT: Final = 0.05
_OF_CERTIFICATE: Final = ("angles", "angles-common")
_OF_STAND: Final = ("ammeter-gain", "ammeter-offset", "level", "azimuth", "latitude", "gravity")
_LARGEST_ID: Final = 2**31 - 1


def compare(work: Work, a: str, b: str) -> ComparisonView:
    """Compare two sessions, results or gyros.

    Parameters
    ----------
    a, b
        As `SUBJECTS`.

    Raises
    ------
    Invalid
        A subject that is none of them, or the same result twice.
    NotFound
        A session, result or gyro that is not there or has no result.
    """
    rows = (_find(work, a, "a"), _find(work, b, "b"))
    if rows[0].id == rows[1].id:
        raise Invalid(
            problem("same-result", "Both are the same result. Choose two different ones.", column="b")
        )
    side_a, side_b = _side(a, rows[0]), _side(b, rows[1])
    answers = tuple(_answer(row) for row in rows)
    common = _common(side_a, side_b, answers)
    same = side_a.gyro == side_b.gyro
    scatter = _scatter(work, rows[0]) if same else {}
    views = [verdicts.summary(row).parameters for row in rows]
    differences = {name: _difference(views, answers, name, common if same else ()) for name in PARAMETERS}
    adjusted = _holm(differences)
    joint = _joint(answers) if all(differences.values()) else None
    parameters = tuple(
        _compared(name, (views[0][name], views[1][name]), differences[name], adjusted.get(name),
                  _shared(answers, name, common if same else ()), scatter.get(name))
        for name in PARAMETERS
        if name in views[0] and name in views[1]
    )  # fmt: skip
    return ComparisonView(
        side_a, side_b, parameters, common, same and bool(common),
        joint.chi2 if joint else None, joint.dof if joint else None, joint.p_value if joint else None,
        _together(parameters, joint.p_value if joint else None),
    )  # fmt: skip


def _find(work: Work, asked: str, column: str) -> Calibration:
    kind, _, name = asked.strip().partition(":")
    if kind == "gyro" and name:
        gyro = find_gyro(work, name)
        last = due.due_of(work, [gyro.serial])[gyro.serial].calibration
        row = None if last is None else results.calibration(work.db, last)
    elif kind in SUBJECTS and name.isascii() and name.isdecimal() and int(name) <= _LARGEST_ID:
        find = results.last_calibration if kind == "session" else results.calibration
        row = find(work.db, int(name))
    else:
        raise Invalid(problem("bad-subject", "“%(text)s” cannot be compared. Write session:78, result:91 or gyro:0417.",
                              column=column, text=asked[:60]))  # fmt: skip
    if row is None:
        raise NotFound(
            problem("nothing-to-compare", "%(subject)s has no result.", column=column, subject=asked)
        )
    return row


def _side(asked: str, row: Calibration) -> Side:
    session = row.session
    return Side(
        asked, session.gyro.serial, session.gyro.type.name, session.id, row.id, session.started_at,
        session.start.number, session.stand.name, session.certificate.number, verdicts.main_method(row),
        verdicts.summary(row).verdict,
    )  # fmt: skip


def _answer(row: Calibration) -> Json:
    document: Json = json.loads(row.result)
    return document.get(verdicts.main_method(row), {}) if row.method == "both" else document


def _common(a: Side, b: Side, answers: Sequence[Json]) -> tuple[str, ...]:
    """Lines of both budgets that come from the same thing."""
    if a.stand != b.stand:
        return ()
    codes = (*_OF_STAND, *(_OF_CERTIFICATE if a.certificate == b.certificate else ()))
    lines = [_lines(answer) for answer in answers]
    return tuple(code for code in lines[0] if code in codes and code in lines[1])


def _lines(answer: Json) -> dict[str, Mapping[str, float | None]]:
    return {line["code"]: line["standard_uncertainties"] for line in answer.get("budget") or ()}


def _shared(answers: Sequence[Json], name: str, common: Sequence[str]) -> float:
    """Covariance of what both have in common."""
    a, b = (_lines(answer) for answer in answers)
    return sum((a[code].get(name) or 0.0) * (b[code].get(name) or 0.0) for code in common)


def _difference(
    views: Sequence[Mapping[str, ParameterView]], answers: Sequence[Json], name: str, common: Sequence[str]
) -> Difference | None:
    a, b = (view.get(name) for view in views)
    if a is None or b is None or a.value is None or b.value is None or not a.u or not b.u:
        return None
    # In a budget with correlated lines the shared ones may exceed the whole.
    covariance = min(_shared(answers, name, common), 0.99 * a.u * b.u)
    return comparison.compare(
        a.value, a.u, b.value, b.u, covariance=covariance, coverage_factors=(a.k, b.k),
        dof=(_dof(answers[0], name), _dof(answers[1], name)),
    )  # fmt: skip


def _dof(answer: Json, name: str) -> float | None:
    found: float | None = answer.get("parameters", {}).get(name, {}).get("dof")
    return found


def _holm(differences: Mapping[str, Difference | None]) -> dict[str, float]:
    known = {name: item.p_value for name, item in differences.items() if item is not None}
    return dict(zip(known, holm(list(known.values())), strict=True))


def _joint(answers: Sequence[Json]) -> comparison.JointDifference | None:
    values, covariances = [], []
    for answer in answers:
        matrix = np.array(answer.get("covariance") or [], np.float64)
        if matrix.shape != (len(PARAMETERS),) * 2 or not np.isfinite(matrix).all():
            return None
        values.append([answer["parameters"][name]["value"] for name in PARAMETERS])
        covariances.append(matrix)
    return comparison.compare_jointly(values[0], covariances[0], values[1], covariances[1])


def _scatter(work: Work, row: Calibration) -> dict[str, float]:
    """The gyro's standard deviation from session to session, as its study found it."""
    found = fleet.studies_of(work.db, [row.session.gyro_id], verdicts.main_method(row))
    if not found or found[0].document is None:
        return {}
    studied: Mapping[str, Any] = json.loads(found[0].document)["parameters"]
    known = {name: (item.get("together") or {}).get("sd") for name, item in studied.items()}
    return {name: sd for name, sd in known.items() if sd}


def _compared(
    name: str,
    views: tuple[ParameterView, ParameterView],
    found: Difference | None,
    p_holm: float | None,
    covariance: float,
    scatter: float | None,
) -> Compared:
    a, b = views
    if found is None:
        return Compared(
            name, a.unit, a, b, difference=None, expanded=None, coverage_factor=None, dof=None, in_expanded=None,
            e_n=None, p_value=None, p_holm=None, shared=covariance**0.5, scatter=scatter, in_scatter=None,
            verdict="undetermined",
        )  # fmt: skip
    return Compared(
        name, a.unit, a, b, difference=found.value, expanded=found.expanded,
        coverage_factor=found.coverage_factor, dof=found.dof, in_expanded=found.in_expanded, e_n=found.e_n,
        p_value=found.p_value, p_holm=p_holm, shared=covariance**0.5, scatter=scatter,
        in_scatter=found.value / (2**0.5 * scatter) if scatter else None,
        verdict="agree" if abs(found.in_expanded) <= 1.0 else "differ",
    )  # fmt: skip


def _together(parameters: Sequence[Compared], p_value: float | None) -> Agreement:
    known = [item.p_holm for item in parameters if item.p_holm is not None]
    if not known:
        return "undetermined"
    return "differ" if (min(known) if p_value is None else p_value) < SIGNIFICANT else "agree"
