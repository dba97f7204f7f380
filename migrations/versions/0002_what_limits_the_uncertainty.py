"""What limits the uncertainty, and what a gyro is expected to be."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_ADDED = (
    ("calibration_parameter", ("coverage_factor",)),
    ("measurement", ("dof_jx", "dof_jy")),
    ("stand_certificate", ("u_alpha_common_arcsec", "u_beta_common_arcsec", "u_gamma_common_arcsec")),
)


def upgrade() -> None:
    op.create_table(
        "type_nominal",
        sa.Column("type_id", sa.Integer(), nullable=False),
        sa.Column("parameter", sa.Text(), nullable=False),
        sa.Column("value", sa.Double(), nullable=False),
        sa.Column("standard_uncertainty", sa.Double(), nullable=False),
        sa.Column("per_kelvin", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["type_id"], ["gyro_type.id"], name=op.f("fk_type_nominal_type_id")),
        sa.PrimaryKeyConstraint("type_id", "parameter", name=op.f("pk_type_nominal")),
    )
    op.add_column("stand", sa.Column("uncertainty", sa.JSON(), nullable=True))
    for table, columns in _ADDED:
        for column in columns:
            op.add_column(table, sa.Column(column, sa.Double(), nullable=True))


def downgrade() -> None:
    for table, columns in reversed(_ADDED):
        for column in columns:
            op.drop_column(table, column)
    op.drop_column("stand", "uncertainty")
    op.drop_table("type_nominal")
