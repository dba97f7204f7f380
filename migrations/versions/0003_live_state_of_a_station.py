"""Live state of a station: its runs, what they met, what they are asked to do."""

import sqlalchemy as sa
from alembic import op

import app.store.tables.base

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "station_run",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("session_id", sa.Integer(), nullable=False),
        sa.Column("run", sa.Text(), nullable=False),
        sa.Column("station", sa.Text(), nullable=False),
        sa.Column("started_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("reported_by", sa.Text(), nullable=False),
        sa.Column("sequence", sa.BigInteger(), nullable=False),
        sa.Column("sent_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("received_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("phase", sa.Text(), nullable=False),
        sa.Column("theta_deg", sa.Double(), nullable=True),
        sa.Column("psi_deg", sa.Double(), nullable=True),
        sa.Column("repeat", sa.Integer(), nullable=True),
        sa.Column("take", sa.Integer(), nullable=True),
        sa.Column("jx_ma", sa.Double(), nullable=True),
        sa.Column("jy_ma", sa.Double(), nullable=True),
        sa.Column("settled", sa.Boolean(), nullable=True),
        sa.Column("fraction", sa.Double(), nullable=True),
        sa.Column("left_s", sa.Double(), nullable=True),
        sa.Column("waiting", sa.Integer(), nullable=False),
        sa.Column("cells", sa.JSON(), nullable=False),
        sa.Column("readings", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(["session_id"], ["session.id"], name=op.f("fk_station_run_session_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_station_run")),
        sa.UniqueConstraint("session_id", "run", name=op.f("uq_station_run_session_id_run")),
    )
    op.create_table(
        "station_command",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("theta_deg", sa.Double(), nullable=True),
        sa.Column("psi_deg", sa.Double(), nullable=True),
        sa.Column("asked_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("asked_by", sa.Text(), nullable=False),
        sa.Column("answered_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("outcome", sa.Text(), nullable=True),
        sa.Column("message", sa.Text(), nullable=False),
        sa.Column("template", sa.Text(), nullable=True),
        sa.Column("values", sa.JSON(), nullable=True),
        sa.ForeignKeyConstraint(["run_id"], ["station_run.id"], name=op.f("fk_station_command_run_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_station_command")),
    )
    op.create_index(op.f("ix_station_command_run_id"), "station_command", ["run_id"])
    op.create_table(
        "station_event",
        sa.Column("run_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("level", sa.Text(), nullable=False),
        sa.Column("code", sa.Text(), nullable=False),
        sa.Column("message", sa.Text(), nullable=False),
        sa.Column("template", sa.Text(), nullable=True),
        sa.Column("values", sa.JSON(), nullable=True),
        sa.Column("theta_deg", sa.Double(), nullable=True),
        sa.Column("psi_deg", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["run_id"], ["station_run.id"], name=op.f("fk_station_event_run_id")),
        sa.PrimaryKeyConstraint("run_id", "number", name=op.f("pk_station_event")),
    )


def downgrade() -> None:
    op.drop_table("station_event")
    op.drop_index(op.f("ix_station_command_run_id"), "station_command")
    op.drop_table("station_command")
    op.drop_table("station_run")
