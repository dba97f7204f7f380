"""Two results compared as a table: one row for each parameter, the same for pages and programs."""

from datetime import datetime
from typing import Final

from app.services.drift.comparing_views import ComparisonView

Cell = float | int | str | datetime | None

COLUMNS: Final = (
    "parameter", "unit", "session_a", "session_b", "value_a", "u_a", "k_a", "value_b", "u_b", "k_b", "difference",
    "expanded_uncertainty", "coverage_factor", "in_expanded", "e_n", "p_value", "p_holm", "shared_u", "verdict",
)  # fmt: skip


def rows(found: ComparisonView) -> list[dict[str, Cell]]:
    """A row for each parameter, in the order of `COLUMNS`."""
    return [
        {
            "parameter": item.parameter, "unit": item.unit, "session_a": found.a.session,
            "session_b": found.b.session, "value_a": item.a.value, "u_a": item.a.u, "k_a": item.a.k,
            "value_b": item.b.value, "u_b": item.b.u, "k_b": item.b.k, "difference": item.difference,
            "expanded_uncertainty": item.expanded, "coverage_factor": item.coverage_factor,
            "in_expanded": item.in_expanded, "e_n": item.e_n, "p_value": item.p_value, "p_holm": item.p_holm,
            "shared_u": item.shared, "verdict": item.verdict,
        }
        for item in found.parameters
    ]  # fmt: skip
