"""Results of gyro 0417 laid into the database as a job would leave them."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from app.services import access
from app.services.drift import following
from app.services.lab import Person, Work
from app.services.sessions import NewSession, find_session, open_session
from app.store.tables import Calibration, CalibrationParameter
from solver.records import PARAMETERS

BEGIN = datetime(2021, 1, 4, 8, 0, tzinfo=UTC)
MONTH = timedelta(days=30)
SCATTER, NOISE = 0.02, 0.003
METROLOGIST = Person("sokolov", "A. Sokolov", "metrologist", frozenset(access.ROLES["metrologist"]))
TECHNICIAN = Person("petrova", "I. Petrova", "technician", frozenset(access.ROLES["technician"]))
Values = Mapping[str, float]


def revision(
    work: Work,
    session_id: int,
    values: Values,
    *,
    methods: Sequence[str] = ("least-squares",),
    input_hash: str = "first",
) -> int:
    """Lay in a further result of a session, and tell the studies of it as `calibrations.store` does."""
    session = find_session(work, session_id)
    number = 1 + work.db.query(Calibration).filter_by(session_id=session_id).count()
    row = Calibration(
        session_id=session_id, revision=number, method="both", solver_version="2.0.0",
        input_hash=f"{session_id}-{input_hash}", certificate_id=session.certificate_id, inputs=[], result="{}",
        result_digest="", chi2=24.0, fit_dof=24, created_at=work.now, created_by="petrova",
        parameters=[
            CalibrationParameter(
                method=method, parameter=name, value=values.get(name), standard_uncertainty=0.004,
                coverage_factor=2.0, u_noise=NOISE,
            )
            for method in methods
            for name in PARAMETERS
        ],
    )  # fmt: skip
    work.db.add(row)
    work.db.flush()
    following.changed(work, session.gyro_id, methods=methods)
    return row.id


def session(work: Work, number: int, values: Values, *, stand: str = "S1", **how: Any) -> int:
    """Open a session, one a month, each with a start of its own, and lay in its result; its number."""
    new = NewSession("0417", stand, new_start=True, started_at=BEGIN + number * MONTH)
    session_id = open_session(work, new).id
    revision(work, session_id, values, **how)
    return session_id


def drawn(count: int, seed: int = 1) -> list[dict[str, float]]:
    """Values of so many sessions in control: 10·n for the n-th parameter, scattering by `SCATTER`."""
    draw = np.random.default_rng(seed)
    return [
        {name: 10.0 * place + float(draw.normal(0.0, SCATTER)) for place, name in enumerate(PARAMETERS)}
        for _ in range(count)
    ]
