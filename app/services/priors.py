"""What a gyro is expected to be before it is solved: its last sound calibration, else its type's nominal values.

Some blunders turn one possible gyro into another with the same fit: exchanged channels, a wrong
sign, a wrong latitude or unit. Only such an expectation shows them.
"""

import json
import math
from collections.abc import Mapping
from typing import Any, Final

from app.exchange.json_values import message_json
from app.services.gyros import nominals_of
from app.services.lab import Work
from app.services.verdicts import main_method
from app.store import results
from app.store.tables import Calibration, MeasuringSession
from solver.errors import Message

_CHANGE: Final = {"k": 0.01, "w0": 1.0, "w": 1.0}
"""How far a gyro may have changed since its last calibration (standard deviation): 1 % of the larger scale
factor for a K, 1 °/h for a fixed drift, which differs from start to start, 1 °/h/g for a g-sensitive one.
Far more than a sound gyro changes, far less than any of those blunders does."""

Prior = Mapping[str, Any]
"""``{"source": message, "parameters": {"kx": {"value": …, "standard_uncertainty": …}, …}}`` in laboratory units."""


def expectation(work: Work, session: MeasuringSession) -> Prior | None:
    """What the session's gyro is expected to be; None when nothing is known of it."""
    for row in results.earlier_calibrations(work.db, session.gyro_id, session.started_at):
        found = _from_calibration(row)
        if found is not None:
            return found
    nominals = nominals_of(session.gyro.type)
    if not nominals:
        return None
    source = Message("prior-type", "nominal values of type %(type)s", {"type": session.gyro.type.name})
    return {
        "source": message_json(source),
        "parameters": {
            name: {"value": item.value, "standard_uncertainty": item.u} for name, item in nominals.items()
        },
    }


def _from_calibration(row: Calibration) -> Prior | None:
    """A sound result as an expectation; None when its own diagnosis found something or nothing is determined."""
    stored = json.loads(row.result)
    method = main_method(row)
    if stored.get(method, stored).get("diagnosis"):
        return None
    known = {
        item.parameter: (item.value, item.standard_uncertainty)
        for item in row.parameters
        if item.method == method and item.value is not None and item.standard_uncertainty is not None
    }
    scale = max((abs(known[name][0]) for name in ("kx", "ky") if name in known), default=0.0)
    if not scale:
        return None
    source = Message(
        "prior-calibration", "calibration %(number)d, session %(session)d",
        {"number": row.id, "session": row.session_id},
    )  # fmt: skip
    return {
        "source": message_json(source),
        "parameters": {
            name: {"value": value, "standard_uncertainty": math.hypot(u, _change(name, scale))}
            for name, (value, u) in known.items()
        },
    }


def _change(name: str, scale: float) -> float:
    if name.startswith("k"):
        return _CHANGE["k"] * scale
    return _CHANGE["w0" if name.startswith("w0") else "w"]
