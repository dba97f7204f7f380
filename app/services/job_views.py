"""Jobs and problems as they are shown, and problems as they are stored."""

from dataclasses import asdict
from typing import Any

from app.errors import Problem
from app.services.views import JobView, ProblemView
from app.store.tables import Job


def job_view(row: Job) -> JobView:
    """A job as it is shown."""
    return JobView(
        id=row.id, kind=row.kind, state=row.state, progress=row.progress, phase=row.phase,
        session=row.session_id, calibration=row.calibration_id,
        problems=tuple(ProblemView(**item) for item in row.problems or ()),
        created_at=row.created_at, created_by=row.created_by, started_at=row.started_at,
        finished_at=row.finished_at,
    )  # fmt: skip


def stored_problem(problem: Problem) -> dict[str, Any]:
    """A problem as JSON keeps it; values that JSON does not know become text."""
    values = {
        name: value if isinstance(value, (int, float, str)) else str(value)
        for name, value in problem.message.values.items()
    }
    view = ProblemView(
        problem.message.code, problem.message.template, values, problem.file, problem.row, problem.column
    )
    return asdict(view)
