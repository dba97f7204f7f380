"""Alembic's environment: `app.store.migrate` hands over an open connection."""

from alembic import context

from app.store.migrate import ours
from app.store.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    include_name=ours,
    render_as_batch=True,
    compare_type=True,
)
with context.begin_transaction():
    context.run_migrations()
