"""Migrations make exactly the tables that the code uses."""

from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy.orm import Session

from app.jobs.tables import DBOS_TABLES
from app.store.database import Database
from app.store.migrate import MIGRATIONS, is_current, ours, upgrade
from app.store.tables import (
    Base,
    Calibration,
    GyroType,
    Measurement,
    Stand,
    StandCertificate,
    StationCommand,
    StationEvent,
    StationRun,
)

AT = datetime(2026, 3, 1, 9, 30, tzinfo=UTC).replace(tzinfo=None)  # as it is stored
ROWS: dict[str, dict[str, Any]] = {
    "gyro_type": {"id": 1, "name": "GVK-6", "note": "first"},
    "type_limit": {"type_id": 1, "parameter": "wg", "low": -3.5, "high": 3.5},
    "gyro": {"id": 1, "serial": "0417", "type_id": 1, "note": "", "created_at": AT},
    "start": {"id": 1, "gyro_id": 1, "number": 1, "powered_up_at": AT, "note": ""},
    "stand": {"id": 1, "name": "S1", "latitude_deg": 55.7558, "note": "pier 1", "created_at": AT},
    "stand_certificate": {
        "id": 1, "stand_id": 1, "number": "C-17", "version": 1, "valid_from": date(2026, 1, 1),
        "valid_until": date(2027, 1, 1), "issued_by": "M", "digest": "d", "created_at": AT, "created_by": "p",
    },
    "certificate_position": {
        "certificate_id": 1, "theta_deg": 0.0, "psi_deg": 90.0, "alpha_arcsec": 6.9, "beta_arcsec": -16.4,
        "gamma_arcsec": 1 / 3, "u_alpha_arcsec": 0.5, "u_beta_arcsec": None, "u_gamma_arcsec": 0.5,
    },
    "session": {
        "id": 1, "gyro_id": 1, "stand_id": 1, "certificate_id": 1, "start_id": 1, "latitude_deg": 55.7558,
        "origin": "typed", "started_at": AT, "temperature_c": 21.5, "note": "", "created_at": AT,
        "created_by": "p", "truth": None,
    },
    "measurement": {
        "id": 1, "session_id": 1, "theta_deg": 0.0, "psi_deg": 90.0, "repeat": 0, "revision": 1,
        "jx_ma": 0.0045361, "jy_ma": -0.1 / 3, "u_jx_ma": 1e-6, "u_jy_ma": 1e-6, "duration_s": 60.0,
        "rate_hz": 200.0, "origin": "typed", "note": "", "created_at": AT, "created_by": "p",
    },
    "calibration": {
        "id": 1, "session_id": 1, "revision": 1, "method": "both", "solver_version": "1.0.0", "input_hash": "h",
        "certificate_id": 1, "inputs": [1], "result": "{}", "result_digest": "d", "created_at": AT,
        "created_by": "p",
    },
    "calibration_parameter": {
        "id": 1, "calibration_id": 1, "method": "paper", "parameter": "wg", "value": 6.0,
        "standard_uncertainty": 0.01,
    },
}  # fmt: skip
"""One row in every table that the second migration touches, and in those that they need."""


@pytest.fixture(params=["0001", "0002"])
def old(request: pytest.FixtureRequest, tmp_path: Path):
    """A database as an earlier release left it, with rows."""
    database = Database(f"sqlite:///{(tmp_path / 'book.sqlite').as_posix()}")
    with database.engine.execution_options(writing=True).begin() as connection:
        config = Config()
        config.set_main_option("script_location", str(MIGRATIONS))
        config.attributes["connection"] = connection
        command.upgrade(config, request.param)
        tables = sa.MetaData()
        tables.reflect(connection)
        for name, row in ROWS.items():
            connection.execute(tables.tables[name].insert().values(row))
    yield database
    database.close()


def test_migrated_and_declared_tables_are_the_same(tmp_path: Path):
    database = Database(f"sqlite:///{(tmp_path / 'book.sqlite').as_posix()}")
    upgrade(database)
    upgrade(database)  # a second time changes nothing
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"include_name": ours, "compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
        assert set(Base.metadata.tables) <= set(sa.inspect(connection).get_table_names())
    database.close()


def test_a_database_of_an_earlier_release_keeps_its_rows(old: Database):
    assert not is_current(old)
    upgrade(old)
    assert is_current(old)
    with old.engine.begin() as connection:
        tables = sa.MetaData()
        tables.reflect(connection)
        for name, expected in ROWS.items():
            (row,) = connection.execute(sa.select(tables.tables[name])).mappings()
            assert {key: row[key] for key in expected} == expected, name
            further = {key: row[key] for key in row.keys() - expected.keys()}
            assert further.pop("solved", True), "the session has a result"
            assert set(further.values()) <= {None, False}, name
        assert connection.execute(sa.text("PRAGMA foreign_key_check")).all() == []


def test_rows_of_an_earlier_release_state_nothing_new(old: Database):
    upgrade(old)
    with Session(old.engine) as session:
        stand, certificate = session.get_one(Stand, 1), session.get_one(StandCertificate, 1)
        assert stand.uncertainty is None
        assert (certificate.u_alpha_common_arcsec, certificate.u_gamma_common_arcsec) == (None, None)
        assert [row.gamma_arcsec for row in certificate.positions] == [1 / 3]
        kind = session.get_one(GyroType, 1)
        assert ([row.high for row in kind.limits], kind.nominals) == ([3.5], [])
        assert session.get_one(Measurement, 1).dof_jx is None
        assert [row.coverage_factor for row in session.get_one(Calibration, 1).parameters] == [None]
        for table in (StationRun, StationEvent, StationCommand):
            assert session.scalars(sa.select(table)).all() == []


def test_a_downgraded_database_can_be_upgraded_again(old: Database):
    upgrade(old)
    with old.engine.execution_options(writing=True).begin() as connection:
        config = Config()
        config.set_main_option("script_location", str(MIGRATIONS))
        config.attributes["connection"] = connection
        command.downgrade(config, "0002")
        assert "station_run" not in sa.inspect(connection).get_table_names()
    upgrade(old)
    assert is_current(old)


def test_the_job_engines_tables_are_left_alone():
    assert not set(DBOS_TABLES) & set(Base.metadata.tables)
    assert not any(ours(name, "table", {}) for name in DBOS_TABLES)
