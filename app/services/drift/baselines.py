"""Baselines: proposed by the product, frozen by a person, retired by a person; never changed."""

from app.exchange.si import PARAMETER_UNITS
from app.services.drift.views import BaselineView
from app.services.finding import find_gyro
from app.services.lab import Work
from app.store import drift
from app.store.tables import Baseline


def of_gyro(
    work: Work, serial: str, *, method: str | None = None, retired: bool = False
) -> tuple[BaselineView, ...]:
    """A gyro's baselines by parameter, then by what they are valid from."""
    rows = drift.baselines(work.db, find_gyro(work, serial).id, method=method, retired=retired)
    return tuple(_view(row, serial) for row in rows)


def _view(row: Baseline, gyro: str) -> BaselineView:
    return BaselineView(
        id=row.id, gyro=gyro, parameter=row.parameter, unit=PARAMETER_UNITS[row.parameter][0],
        method=row.method, valid_from=row.valid_from, calibrations=tuple(row.calibrations),
        estimator=row.estimator, centre=row.centre, scatter=row.scatter, dof=row.dof,
        u_typical=row.u_typical, limits=row.limits, rules=row.rules, reason=row.reason,
        frozen_at=row.frozen_at, frozen_by=row.frozen_by, retired_at=row.retired_at,
        retired_by=row.retired_by,
    )  # fmt: skip
