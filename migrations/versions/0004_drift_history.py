"""Drift history: events, baselines, alarms, studies, and what they are computed from."""

import sqlalchemy as sa
from alembic import op

import app.store.tables.base

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_ADDED = (
    ("gyro_type", sa.Column("interval_days", sa.Integer(), nullable=True)),
    ("type_limit", sa.Column("repeatability", sa.Double(), nullable=True)),
    ("gyro", sa.Column("check", sa.Boolean(), nullable=False, server_default=sa.false())),
    ("calibration", sa.Column("chi2", sa.Double(), nullable=True)),
    ("calibration", sa.Column("fit_dof", sa.Integer(), nullable=True)),
    ("calibration_parameter", sa.Column("u_noise", sa.Double(), nullable=True)),
)
_SESSIONS_OF = ("gyro_id", "stand_id")


def upgrade() -> None:
    for table, column in _ADDED:
        op.add_column(table, column)
    _unsolved()
    for column in _SESSIONS_OF:
        op.drop_index(op.f(f"ix_session_{column}"), "session")
        op.create_index(op.f(f"ix_session_{column}_started_at"), "session", [column, "started_at"])
    _attitude()
    _event()
    _baseline()
    _alarm()
    _study()


def _unsolved() -> None:
    op.add_column("session", sa.Column("solved", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.execute("UPDATE session SET solved = true WHERE id IN (SELECT session_id FROM calibration)")
    where = sa.text("NOT solved")
    op.create_index("ix_session_unsolved", "session", ["id"], sqlite_where=where, postgresql_where=where)


def _attitude() -> None:
    op.create_table(
        "stand_attitude",
        sa.Column("calibration_id", sa.Integer(), nullable=False),
        sa.Column("azimuth_arcsec", sa.Double(), nullable=True),
        sa.Column("u_azimuth_arcsec", sa.Double(), nullable=True),
        sa.Column("level_north_arcsec", sa.Double(), nullable=True),
        sa.Column("u_level_north_arcsec", sa.Double(), nullable=True),
        sa.Column("correlation", sa.Double(), nullable=True),
        sa.Column("dof", sa.Double(), nullable=True),
        sa.Column("u_certificate_azimuth_arcsec", sa.Double(), nullable=True),
        sa.Column("u_certificate_level_north_arcsec", sa.Double(), nullable=True),
        sa.Column("level_east", sa.JSON(), nullable=True),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibration.id"], name=op.f("fk_stand_attitude_calibration_id")
        ),
        sa.PrimaryKeyConstraint("calibration_id", name=op.f("pk_stand_attitude")),
    )


def _event() -> None:
    op.create_table(
        "event",
        sa.Column("id", sa.Integer(), nullable=False),
        *_subject("event"),
        sa.Column("happened_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.Column("withdrawn_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("withdrawn_by", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_event")),
    )
    _indexed("event")


def _baseline() -> None:
    op.create_table(
        "baseline",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("gyro_id", sa.Integer(), nullable=False),
        sa.Column("parameter", sa.Text(), nullable=False),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("valid_from", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("calibrations", sa.JSON(), nullable=False),
        sa.Column("estimator", sa.Text(), nullable=False),
        sa.Column("centre", sa.Double(), nullable=False),
        sa.Column("scatter", sa.Double(), nullable=False),
        sa.Column("dof", sa.Double(), nullable=False),
        sa.Column("u_typical", sa.Double(), nullable=False),
        sa.Column("limits", sa.Text(), nullable=False),
        sa.Column("rules", sa.JSON(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("frozen_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("frozen_by", sa.Text(), nullable=False),
        sa.Column("retired_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("retired_by", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["gyro_id"], ["gyro.id"], name=op.f("fk_baseline_gyro_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_baseline")),
    )
    op.create_index(op.f("ix_baseline_gyro_id"), "baseline", ["gyro_id"])


def _alarm() -> None:
    op.create_table(
        "alarm",
        sa.Column("id", sa.Integer(), nullable=False),
        *_subject("alarm"),
        sa.Column("parameter", sa.Text(), nullable=True),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("severity", sa.Text(), nullable=False),
        sa.Column("baseline_id", sa.Integer(), nullable=True),
        sa.Column("calibration_id", sa.Integer(), nullable=False),
        sa.Column("last_calibration_id", sa.Integer(), nullable=False),
        sa.Column("template", sa.Text(), nullable=False),
        sa.Column("values", sa.JSON(), nullable=False),
        sa.Column("raised_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("ended_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("acknowledged_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("acknowledged_by", sa.Text(), nullable=True),
        sa.Column("cause", sa.Text(), nullable=True),
        sa.Column("note", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["baseline_id"], ["baseline.id"], name=op.f("fk_alarm_baseline_id")),
        sa.ForeignKeyConstraint(["calibration_id"], ["calibration.id"], name=op.f("fk_alarm_calibration_id")),
        sa.ForeignKeyConstraint(
            ["last_calibration_id"], ["calibration.id"], name=op.f("fk_alarm_last_calibration_id")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alarm")),
        sa.UniqueConstraint(
            "gyro_id", "stand_id", "parameter", "method", "kind", "calibration_id",
            name=op.f("uq_alarm_gyro_id_stand_id_parameter_method_kind_calibration_id"),
        ),
    )  # fmt: skip
    _indexed("alarm")
    op.create_index(op.f("ix_alarm_state"), "alarm", ["state"])


def _study() -> None:
    op.create_table(
        "drift_study",
        sa.Column("id", sa.Integer(), nullable=False),
        *_subject("drift_study"),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("changed", sa.Integer(), nullable=False),
        sa.Column("studied", sa.Integer(), nullable=False),
        sa.Column("studied_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("solver_version", sa.Text(), nullable=True),
        sa.Column("document", sa.Text(), nullable=True),
        sa.Column("series", sa.LargeBinary(), nullable=True),
        sa.Column("job_id", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_drift_study")),
        sa.UniqueConstraint("gyro_id", "method", name=op.f("uq_drift_study_gyro_id_method")),
        sa.UniqueConstraint("stand_id", "method", name=op.f("uq_drift_study_stand_id_method")),
    )


def _subject(table: str) -> tuple[sa.schema.SchemaItem, ...]:
    """A gyro or a stand, one of them."""
    return (
        sa.Column("gyro_id", sa.Integer(), nullable=True),
        sa.Column("stand_id", sa.Integer(), nullable=True),
        sa.CheckConstraint("(gyro_id IS NULL) <> (stand_id IS NULL)", name=op.f(f"ck_{table}_one_subject")),
        sa.ForeignKeyConstraint(["gyro_id"], ["gyro.id"], name=op.f(f"fk_{table}_gyro_id")),
        sa.ForeignKeyConstraint(["stand_id"], ["stand.id"], name=op.f(f"fk_{table}_stand_id")),
    )


def _indexed(table: str) -> None:
    for column in ("gyro_id", "stand_id"):
        op.create_index(op.f(f"ix_{table}_{column}"), table, [column])


def downgrade() -> None:
    for table in ("drift_study", "alarm", "baseline", "event", "stand_attitude"):
        op.drop_table(table)
    op.drop_index("ix_session_unsolved", "session")
    op.drop_column("session", "solved")
    for column in reversed(_SESSIONS_OF):
        op.drop_index(op.f(f"ix_session_{column}_started_at"), "session")
        op.create_index(op.f(f"ix_session_{column}"), "session", [column])
    for table, column in reversed(_ADDED):
        op.drop_column(table, column.name)
