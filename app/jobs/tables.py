"""DBOS's tables, which share our SQLite file (on PostgreSQL they have the schema ``dbos``)."""

from typing import Final

DBOS_TABLES: Final = frozenset(
    {
        "application_versions",
        "dbos_migrations",
        "notifications",
        "operation_outputs",
        "queues",
        "streams",
        "workflow_events",
        "workflow_events_history",
        "workflow_input",
        "workflow_output",
        "workflow_schedules",
        "workflow_status",
    }
)
"""For Alembic's ``include_name``: autogenerate would drop them, and no table of ours may have these names."""
