"""Parameters of a gyro from JSON: `truth.json`, a prior, or a result; and truth back to JSON."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from app.exchange.json_text import Reader, load_object
from app.exchange.json_values import dumps
from app.exchange.problems import Problems
from app.exchange.result import parameters_json
from app.exchange.si import PARAMETER_UNITS, parameter_lab, parameter_si
from solver.errors import Message
from solver.records import PARAMETERS


class Known(NamedTuple):
    """A parameter's value and standard uncertainty (None: not said), in the laboratory's unit."""

    value: float
    standard_uncertainty: float | None = None


def read_parameters(data: bytes, filename: str) -> dict[str, Known]:
    """Read ``{"parameters": {"kx": {"value": …, "standard_uncertainty": …, "unit": …}, …}}``.

    A parameter may also be a bare number, in the laboratory's unit. Its unit may be the
    laboratory's or SI's; a value of null leaves it out, and so do names of no parameter.

    Raises
    ------
    Invalid
        With every problem, each under the JSON pointer of its value as the column.
    """
    content = load_object(data, filename)
    problems = Problems(filename)
    listed = content.get("parameters")
    if not isinstance(listed, dict) or not any(name in listed for name in PARAMETERS):
        problems.note(
            Message(
                "missing-value",
                'There are no parameters. Write them as {"parameters": {"kx": {"value": 2062.65}, …}}.',
            ),
            column="/parameters",
        )
        problems.raise_if_any()
        return {}
    found = {name: _known(name, listed[name], problems) for name in PARAMETERS if name in listed}
    problems.raise_if_any()
    return {name: known for name, known in found.items() if known}


def _known(name: str, entry: Any, problems: Problems) -> Known | None:
    content = entry if isinstance(entry, dict) else {"value": entry}
    reader = Reader(content, problems, f"/parameters/{name}")
    value, u = reader.number("value"), reader.number("standard_uncertainty")
    if u is not None and u < 0:
        reader.wrong(
            "standard_uncertainty",
            Message(
                "negative-uncertainty",
                "A standard uncertainty cannot be negative (%(value)g). Write it without the sign.",
                {"value": u},
            ),
        )
    lab_unit, si_unit = PARAMETER_UNITS[name]
    unit = reader.text("unit") or lab_unit
    if unit == si_unit:
        value = None if value is None else parameter_lab(name, value)
        u = None if u is None else parameter_lab(name, u)
    elif unit != lab_unit:
        reader.wrong(
            "unit",
            Message(
                "unknown-unit",
                "The unit “%(unit)s” is not known here. Give the value in %(lab)s or %(si)s.",
                {"unit": unit[:40], "lab": lab_unit, "si": si_unit},
            ),
        )
    return None if value is None else Known(value, u)


def write_truth(truth: Mapping[str, float]) -> bytes:
    """Write `truth.json` from true parameters in laboratory units, all eight of them."""
    written = parameters_json([parameter_si(name, truth[name]) for name in PARAMETERS], None)
    for name, entry in written.items():
        del entry["standard_uncertainty"]
        entry["value"] = truth[name]
    return (dumps({"parameters": written}, indent=1) + "\n").encode()
