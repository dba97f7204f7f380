"""The first laboratory: accounts, equipment, sessions, measurements, jobs, calibrations."""

import sqlalchemy as sa
from alembic import op

import app.store.tables.base

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "account",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("full_name", sa.Text(), nullable=False),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("password_hash", sa.Text(), nullable=True),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("disabled_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_account")),
        sa.UniqueConstraint("name", name=op.f("uq_account_name")),
    )
    op.create_table(
        "gyro_type",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_gyro_type")),
        sa.UniqueConstraint("name", name=op.f("uq_gyro_type_name")),
    )
    op.create_table(
        "idempotent_reply",
        sa.Column("account", sa.Text(), nullable=False),
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("fingerprint", sa.Text(), nullable=False),
        sa.Column("subject", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.PrimaryKeyConstraint("account", "key", name=op.f("pk_idempotent_reply")),
    )
    op.create_table(
        "record",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("samples", sa.Integer(), nullable=False),
        sa.Column("duration_s", sa.Double(), nullable=False),
        sa.Column("rate_hz", sa.Double(), nullable=False),
        sa.Column("source_digest", sa.Text(), nullable=False),
        sa.Column("source_name", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.PrimaryKeyConstraint("digest", name=op.f("pk_record")),
    )
    op.create_table(
        "stand",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("latitude_deg", sa.Double(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_stand")),
        sa.UniqueConstraint("name", name=op.f("uq_stand_name")),
    )
    op.create_table(
        "gyro",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("serial", sa.Text(), nullable=False),
        sa.Column("type_id", sa.Integer(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.ForeignKeyConstraint(["type_id"], ["gyro_type.id"], name=op.f("fk_gyro_type_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_gyro")),
        sa.UniqueConstraint("serial", name=op.f("uq_gyro_serial")),
    )
    with op.batch_alter_table("gyro", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_gyro_type_id"), ["type_id"], unique=False)

    op.create_table(
        "login",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("account_id", sa.Integer(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("seen_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("revoked_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.ForeignKeyConstraint(["account_id"], ["account.id"], name=op.f("fk_login_account_id")),
        sa.PrimaryKeyConstraint("digest", name=op.f("pk_login")),
    )
    op.create_table(
        "sign_in_link",
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("account_id", sa.Integer(), nullable=False),
        sa.Column("expires_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.ForeignKeyConstraint(["account_id"], ["account.id"], name=op.f("fk_sign_in_link_account_id")),
        sa.PrimaryKeyConstraint("digest", name=op.f("pk_sign_in_link")),
    )
    op.create_table(
        "stand_certificate",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("stand_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Text(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("valid_from", sa.Date(), nullable=False),
        sa.Column("valid_until", sa.Date(), nullable=False),
        sa.Column("issued_by", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["stand_id"], ["stand.id"], name=op.f("fk_stand_certificate_stand_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_stand_certificate")),
        sa.UniqueConstraint("stand_id", "number", name=op.f("uq_stand_certificate_stand_id_number")),
        sa.UniqueConstraint("stand_id", "version", name=op.f("uq_stand_certificate_stand_id_version")),
    )
    op.create_table(
        "token",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("account_id", sa.Integer(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("expires_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("revoked_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.ForeignKeyConstraint(["account_id"], ["account.id"], name=op.f("fk_token_account_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_token")),
        sa.UniqueConstraint("digest", name=op.f("uq_token_digest")),
    )
    op.create_table(
        "type_limit",
        sa.Column("type_id", sa.Integer(), nullable=False),
        sa.Column("parameter", sa.Text(), nullable=False),
        sa.Column("low", sa.Double(), nullable=False),
        sa.Column("high", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(["type_id"], ["gyro_type.id"], name=op.f("fk_type_limit_type_id")),
        sa.PrimaryKeyConstraint("type_id", "parameter", name=op.f("pk_type_limit")),
    )
    op.create_table(
        "certificate_position",
        sa.Column("certificate_id", sa.Integer(), nullable=False),
        sa.Column("theta_deg", sa.Double(), nullable=False),
        sa.Column("psi_deg", sa.Double(), nullable=False),
        sa.Column("alpha_arcsec", sa.Double(), nullable=False),
        sa.Column("beta_arcsec", sa.Double(), nullable=False),
        sa.Column("gamma_arcsec", sa.Double(), nullable=False),
        sa.Column("u_alpha_arcsec", sa.Double(), nullable=True),
        sa.Column("u_beta_arcsec", sa.Double(), nullable=True),
        sa.Column("u_gamma_arcsec", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["certificate_id"], ["stand_certificate.id"], name=op.f("fk_certificate_position_certificate_id")
        ),
        sa.PrimaryKeyConstraint(
            "certificate_id", "theta_deg", "psi_deg", name=op.f("pk_certificate_position")
        ),
    )
    op.create_table(
        "start",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("gyro_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("powered_up_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["gyro_id"], ["gyro.id"], name=op.f("fk_start_gyro_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_start")),
        sa.UniqueConstraint("gyro_id", "number", name=op.f("uq_start_gyro_id_number")),
    )
    op.create_table(
        "session",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("gyro_id", sa.Integer(), nullable=False),
        sa.Column("stand_id", sa.Integer(), nullable=False),
        sa.Column("certificate_id", sa.Integer(), nullable=False),
        sa.Column("start_id", sa.Integer(), nullable=False),
        sa.Column("latitude_deg", sa.Double(), nullable=False),
        sa.Column("origin", sa.Text(), nullable=False),
        sa.Column("started_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("temperature_c", sa.Double(), nullable=True),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.Column("truth", sa.JSON(), nullable=True),
        sa.ForeignKeyConstraint(
            ["certificate_id"], ["stand_certificate.id"], name=op.f("fk_session_certificate_id")
        ),
        sa.ForeignKeyConstraint(["gyro_id"], ["gyro.id"], name=op.f("fk_session_gyro_id")),
        sa.ForeignKeyConstraint(["stand_id"], ["stand.id"], name=op.f("fk_session_stand_id")),
        sa.ForeignKeyConstraint(["start_id"], ["start.id"], name=op.f("fk_session_start_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_session")),
    )
    with op.batch_alter_table("session", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_session_gyro_id"), ["gyro_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_session_stand_id"), ["stand_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_session_started_at"), ["started_at"], unique=False)

    op.create_table(
        "calibration",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("session_id", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("replaces_id", sa.Integer(), nullable=True),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("solver_version", sa.Text(), nullable=False),
        sa.Column("input_hash", sa.Text(), nullable=False),
        sa.Column("certificate_id", sa.Integer(), nullable=False),
        sa.Column("inputs", sa.JSON(), nullable=False),
        sa.Column("result", sa.Text(), nullable=False),
        sa.Column("result_digest", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["certificate_id"], ["stand_certificate.id"], name=op.f("fk_calibration_certificate_id")
        ),
        sa.ForeignKeyConstraint(["replaces_id"], ["calibration.id"], name=op.f("fk_calibration_replaces_id")),
        sa.ForeignKeyConstraint(["session_id"], ["session.id"], name=op.f("fk_calibration_session_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibration")),
        sa.UniqueConstraint("session_id", "revision", name=op.f("uq_calibration_session_id_revision")),
    )
    with op.batch_alter_table("calibration", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_calibration_input_hash"), ["input_hash"], unique=False)

    op.create_table(
        "measurement",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("session_id", sa.Integer(), nullable=False),
        sa.Column("theta_deg", sa.Double(), nullable=False),
        sa.Column("psi_deg", sa.Double(), nullable=False),
        sa.Column("repeat", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("jx_ma", sa.Double(), nullable=True),
        sa.Column("jy_ma", sa.Double(), nullable=True),
        sa.Column("u_jx_ma", sa.Double(), nullable=True),
        sa.Column("u_jy_ma", sa.Double(), nullable=True),
        sa.Column("duration_s", sa.Double(), nullable=True),
        sa.Column("rate_hz", sa.Double(), nullable=True),
        sa.Column("measured_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("temperature_c", sa.Double(), nullable=True),
        sa.Column("record_digest", sa.Text(), nullable=True),
        sa.Column("source_digest", sa.Text(), nullable=True),
        sa.Column("origin", sa.Text(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.CheckConstraint("(jx_ma IS NULL) = (jy_ma IS NULL)", name=op.f("ck_measurement_both_currents")),
        sa.ForeignKeyConstraint(
            ["record_digest"], ["record.digest"], name=op.f("fk_measurement_record_digest")
        ),
        sa.ForeignKeyConstraint(["session_id"], ["session.id"], name=op.f("fk_measurement_session_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_measurement")),
        sa.UniqueConstraint(
            "session_id",
            "theta_deg",
            "psi_deg",
            "repeat",
            "revision",
            name=op.f("uq_measurement_session_id_theta_deg_psi_deg_repeat_revision"),
        ),
    )
    op.create_table(
        "calibration_parameter",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("calibration_id", sa.Integer(), nullable=False),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("parameter", sa.Text(), nullable=False),
        sa.Column("value", sa.Double(), nullable=True),
        sa.Column("standard_uncertainty", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["calibration_id"], ["calibration.id"], name=op.f("fk_calibration_parameter_calibration_id")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_calibration_parameter")),
        sa.UniqueConstraint(
            "calibration_id",
            "method",
            "parameter",
            name=op.f("uq_calibration_parameter_calibration_id_method_parameter"),
        ),
    )
    op.create_table(
        "job",
        sa.Column("id", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("session_id", sa.Integer(), nullable=True),
        sa.Column("request", sa.JSON(), nullable=False),
        sa.Column("progress", sa.Double(), nullable=False),
        sa.Column("phase", sa.Text(), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("calibration_id", sa.Integer(), nullable=True),
        sa.Column("problems", sa.JSON(), nullable=True),
        sa.Column("created_at", app.store.tables.base.UtcDateTime(), nullable=False),
        sa.Column("created_by", sa.Text(), nullable=False),
        sa.Column("started_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.Column("finished_at", app.store.tables.base.UtcDateTime(), nullable=True),
        sa.ForeignKeyConstraint(["calibration_id"], ["calibration.id"], name=op.f("fk_job_calibration_id")),
        sa.ForeignKeyConstraint(["session_id"], ["session.id"], name=op.f("fk_job_session_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
    )
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_job_created_at"), ["created_at"], unique=False)
        batch_op.create_index(batch_op.f("ix_job_session_id"), ["session_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_job_state"), ["state"], unique=False)


def downgrade() -> None:
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_job_state"))
        batch_op.drop_index(batch_op.f("ix_job_session_id"))
        batch_op.drop_index(batch_op.f("ix_job_created_at"))

    op.drop_table("job")
    op.drop_table("calibration_parameter")
    op.drop_table("measurement")
    with op.batch_alter_table("calibration", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_calibration_input_hash"))

    op.drop_table("calibration")
    with op.batch_alter_table("session", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_session_started_at"))
        batch_op.drop_index(batch_op.f("ix_session_stand_id"))
        batch_op.drop_index(batch_op.f("ix_session_gyro_id"))

    op.drop_table("session")
    op.drop_table("start")
    op.drop_table("certificate_position")
    op.drop_table("type_limit")
    op.drop_table("token")
    op.drop_table("stand_certificate")
    op.drop_table("sign_in_link")
    op.drop_table("login")
    with op.batch_alter_table("gyro", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_gyro_type_id"))

    op.drop_table("gyro")
    op.drop_table("stand")
    op.drop_table("record")
    op.drop_table("idempotent_reply")
    op.drop_table("gyro_type")
    op.drop_table("account")
