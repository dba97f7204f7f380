"""What a gyro is expected to be before it is solved: its last sound calibration, else its type's nominal values.

Some blunders turn one possible gyro into another with the same fit: exchanged channels, a wrong
sign, a wrong latitude or unit. Only such an expectation shows them.
"""

import json
from collections.abc import Mapping
from typing import Any

from app.exchange.json_values import message_json
from app.exchange.parameters import Known
from app.exchange.plausible import CODE as CURRENT_UNIT
from app.exchange.prior import widened
from app.services.gyros import nominals_of
from app.services.lab import Work
from app.services.verdicts import main_method
from app.store import results
from app.store.tables import Calibration, MeasuringSession
from solver.errors import Message

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
    """A sound result as an expectation; None when its own diagnosis found something or nothing is determined.

    A gyro that was itself not the one expected is what is expected from then on; currents that may be in another
    unit are not.
    """
    method = main_method(row)
    stored = json.loads(row.result)
    answer = stored.get(method, stored)
    if any(item["code"] != "far-from-prior" for item in answer.get("diagnosis") or ()):
        return None
    if any(item["code"] == CURRENT_UNIT for item in answer["warnings"]):
        return None
    known = {
        item.parameter: Known(item.value, item.standard_uncertainty)
        for item in row.parameters
        if item.method == method and item.value is not None and item.standard_uncertainty is not None
    }
    if not known.keys() & {"kx", "ky"}:
        return None
    source = Message(
        "prior-calibration", "calibration %(number)d, session %(session)d",
        {"number": row.id, "session": row.session_id},
    )  # fmt: skip
    return {
        "source": message_json(source),
        "parameters": {
            name: {"value": item.value, "standard_uncertainty": item.standard_uncertainty}
            for name, item in widened(known).items()
        },
    }
