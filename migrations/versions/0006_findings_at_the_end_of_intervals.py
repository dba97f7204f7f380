"""What a gyro's calibrations found at the end of intervals, beside its study: the type's interval goes by them all."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("drift_study", sa.Column("recalibrations", sa.JSON(), nullable=True))
    op.execute("UPDATE drift_study SET changed = changed + 1 WHERE gyro_id IS NOT NULL")


def downgrade() -> None:
    op.drop_column("drift_study", "recalibrations")
