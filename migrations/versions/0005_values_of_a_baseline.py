"""How many values a baseline was computed from, and how much those of one start scattered."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_BASELINE = sa.table(
    "baseline",
    sa.column("id", sa.Integer),
    sa.column("calibrations", sa.JSON),
    sa.column("count", sa.Integer),
)


def upgrade() -> None:
    op.add_column("baseline", sa.Column("count", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("baseline", sa.Column("within", sa.Double(), nullable=False, server_default="0"))
    connection = op.get_bind()
    for key, calibrations in connection.execute(sa.select(_BASELINE.c.id, _BASELINE.c.calibrations)).all():
        connection.execute(sa.update(_BASELINE).where(_BASELINE.c.id == key).values(count=len(calibrations)))


def downgrade() -> None:
    op.drop_column("baseline", "within")
    op.drop_column("baseline", "count")
