"""Gyros, their types and their starts."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Final

from app.errors import Conflict, Invalid, problem
from app.services import verdicts
from app.services.drift import following
from app.services.lab import Work
from app.services.lookup import find_gyro
from app.services.names import checked_name
from app.services.views import GyroView, Nominal, Page, TypeView
from app.store import equipment, results
from app.store.tables import Calibration, Gyro, GyroType, Start, TypeLimit, TypeNominal
from solver.records import PARAMETERS

LONGEST_INTERVAL_DAYS: Final = 3660
"""Ten years: what is longer was mistyped."""


def add_gyro(work: Work, serial: str, type_name: str, note: str = "", *, check: bool = False) -> GyroView:
    """Register a gyro; an unknown type is created empty. A `check` gyro watches the stands."""
    serial, type_name = checked_name(serial, "serial"), checked_name(type_name, "type")
    if equipment.gyro(work.db, serial) is not None:
        raise Conflict(
            problem("gyro-exists", "There is a gyro %(serial)s already.", column="serial", serial=serial)
        )
    kind = equipment.gyro_type(work.db, type_name) or GyroType(name=type_name, note="")
    row = Gyro(serial=serial, type=kind, note=note, check=check, created_at=work.now)
    work.db.add(row)
    work.db.flush()
    return _gyro_view(row, None)


def change_gyro(
    work: Work, serial: str, *, type_name: str | None, note: str | None, check: bool | None = None
) -> GyroView:
    """Correct a gyro's type or note, or make it a check gyro; None leaves it."""
    row = find_gyro(work, serial)
    if type_name is not None:
        name = checked_name(type_name, "type")
        row.type = equipment.gyro_type(work.db, name) or GyroType(name=name, note="")
    if note is not None:
        row.note = note
    if check is not None:
        row.check = check
    work.db.flush()
    if type_name is not None:
        following.changed(work, row.id)
    return gyro(work, serial)


def gyro(work: Work, serial: str) -> GyroView:
    """One gyro with its latest result."""
    row = find_gyro(work, serial)
    return _gyro_view(row, results.newest_of_gyros(work.db, [row.id]).get(row.id))


def gyros(
    work: Work, *, type_name: str | None = None, after: str | None = None, limit: int = 50
) -> Page[GyroView]:
    """Gyros by serial number, each with its latest result."""
    rows = equipment.gyros(work.db, type_name=type_name, after=after, limit=limit + 1)
    newest = results.newest_of_gyros(work.db, [row.id for row in rows[:limit]])
    items = tuple(_gyro_view(row, newest.get(row.id)) for row in rows[:limit])
    return Page(items, items[-1].serial if len(rows) > limit else None)


def types(work: Work) -> tuple[TypeView, ...]:
    """Every type with its limits and the number of its gyros."""
    return tuple(
        TypeView(
            kind.name,
            kind.note,
            count,
            {item.parameter: (item.low, item.high) for item in kind.limits},
            nominals_of(kind),
            kind.interval_days,
            {item.parameter: item.repeatability for item in kind.limits if item.repeatability is not None},
        )
        for kind, count in equipment.types_with_counts(work.db)
    )


def set_limits(
    work: Work,
    type_name: str,
    limits: Mapping[str, tuple[float, float]],
    note: str = "",
    repeatability: Mapping[str, float] | None = None,
) -> None:
    """Enter a type's limits, in laboratory units; they replace the ones before.

    `repeatability` is the largest standard deviation that a parameter may have from session to session;
    None leaves what was entered for the parameters that still have limits.

    Raises
    ------
    Invalid
        An unknown parameter, a lower limit that is not below the upper one, a largest standard deviation
        that is not positive or whose parameter has no limits.
    """
    spread = repeatability or {}
    for parameter, (low, high) in limits.items():
        if parameter not in PARAMETERS:
            raise Invalid(problem("unknown-parameter", "There is no parameter “%(name)s”.",
                                  column=parameter, name=parameter))  # fmt: skip
        if not low < high:
            raise Invalid(
                problem("bad-limit", "The lower limit must be below the upper one.", column=parameter)
            )
    _check_repeatability(spread, limits)
    kind = _find_or_add_type(work, type_name, note)
    if repeatability is None:
        spread = {
            item.parameter: item.repeatability for item in kind.limits if item.repeatability is not None
        }
    kind.limits.clear()
    work.db.flush()
    kind.limits.extend(
        TypeLimit(parameter=name, low=low, high=high, repeatability=spread.get(name))
        for name, (low, high) in limits.items()
    )
    work.db.flush()
    following.changed_type(work, kind.id)


def _check_repeatability(spread: Mapping[str, float], limits: Mapping[str, tuple[float, float]]) -> None:
    for parameter, largest in spread.items():
        if parameter not in limits:
            raise Invalid(problem("repeatability-without-limits", "Give the limits of this parameter too.",
                                  column=parameter))  # fmt: skip
        if not 0 < largest < float("inf"):
            raise Invalid(problem("bad-repeatability", "The largest standard deviation must be greater than "
                                  "zero.", column=parameter))  # fmt: skip


def set_interval(work: Work, type_name: str, days: int | None) -> None:
    """Enter how many days a calibration of the type's gyros holds; None: nobody says.

    Raises
    ------
    Invalid
        Less than a day, or more than ten years.
    """
    if days is not None and not 1 <= days <= LONGEST_INTERVAL_DAYS:
        raise Invalid(problem("bad-interval", "An interval has 1 to %(most)d days.", column="interval_days",
                              most=LONGEST_INTERVAL_DAYS))  # fmt: skip
    kind = _find_or_add_type(work, type_name)
    kind.interval_days = days
    work.db.flush()
    following.changed_type(work, kind.id)


def set_nominals(work: Work, type_name: str, nominals: Mapping[str, Nominal]) -> None:
    """Enter what the type's parameters are expected to be; they replace those before.

    Raises
    ------
    Invalid
        An unknown parameter, or a standard uncertainty that is not positive.
    """
    for parameter, nominal in nominals.items():
        if parameter not in PARAMETERS:
            raise Invalid(problem("unknown-parameter", "There is no parameter “%(name)s”.",
                                  column=parameter, name=parameter))  # fmt: skip
        if not nominal.u > 0:
            raise Invalid(problem("bad-uncertainty", "The standard uncertainty of a nominal value must be "
                                  "greater than zero.", column=parameter))  # fmt: skip
    kind = _find_or_add_type(work, type_name)
    kind.nominals.clear()
    work.db.flush()
    kind.nominals.extend(
        TypeNominal(parameter=name, value=item.value, standard_uncertainty=item.u, per_kelvin=item.per_kelvin)
        for name, item in nominals.items()
    )
    work.db.flush()


def nominals_of(kind: GyroType) -> dict[str, Nominal]:
    """What the type's parameters are expected to be, by name."""
    return {
        item.parameter: Nominal(item.value, item.standard_uncertainty, item.per_kelvin)
        for item in kind.nominals
    }


def _find_or_add_type(work: Work, type_name: str, note: str = "") -> GyroType:
    name = checked_name(type_name, "type")
    kind = equipment.gyro_type(work.db, name) or GyroType(name=name, note=note)
    work.db.add(kind)
    return kind


def add_start(work: Work, row: Gyro, powered_up_at: datetime, note: str = "") -> Start:
    """Count a new power-up of the gyro."""
    last = equipment.last_start(work.db, row.id)
    start = Start(gyro_id=row.id, number=last.number + 1 if last else 1,
                  powered_up_at=powered_up_at.astimezone(UTC), note=note)  # fmt: skip
    work.db.add(start)
    work.db.flush()
    return start


def starts(work: Work, serial: str) -> int:
    """How often the gyro has been powered up, as far as it was counted here."""
    last = equipment.last_start(work.db, find_gyro(work, serial).id)
    return last.number if last else 0


def _gyro_view(row: Gyro, newest: Calibration | None) -> GyroView:
    session = newest.session if newest else None
    return GyroView(
        serial=row.serial, type=row.type.name, note=row.note, created_at=row.created_at,
        last_session=session.id if session else None,
        last_measured_at=session.started_at if session else None,
        last_stand=session.stand.name if session else None,
        last_result=verdicts.summary(newest) if newest else None, check=row.check,
    )  # fmt: skip
