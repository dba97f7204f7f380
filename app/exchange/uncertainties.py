"""Uncertainty that all positions of a session have in common, as a laboratory states it.

A statement is a JSON object whose keys carry their units; whatever it leaves out is taken as exact::

    {"u_gain_x_ppm": 50, "u_gain_y_ppm": 50, "u_level_1_arcsec": 2, "u_azimuth_arcsec": 10,
     "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9}],
     "dof": {"azimuth": 8}, "temperature_coefficients": {"kx": 0.4}, "u_temperature_k": 0.5}

Temperature coefficients are per kelvin, in the laboratory's unit of the parameter.
"""

from collections.abc import Mapping
from typing import Any, Final

from app.errors import Invalid, Problem
from app.exchange.json_text import Reader, load_object
from app.exchange.problems import Problems
from app.exchange.si import parameter_si
from solver import units
from solver.errors import InputError, Message
from solver.inputs import COMMON, CommonUncertainty
from solver.records import PARAMETERS

_PPM: Final = 1e-6
_ARCSEC: Final = units.rad_from_arcsec(1.0)
_MA: Final = units.ampere_from_ma(1.0)
_FURTHER: Final = ("correlations", "dof", "temperature_coefficients")
LARGEST: Final = 1e9
"""Of every number of a statement."""

FEWEST_DOF: Final = 1e-3
"""Degrees of freedom are greater than nothing."""

UNCERTAINTY_KEYS: Final[Mapping[str, tuple[str, float]]] = {
    "u_gain_x_ppm": ("gain_x", _PPM),
    "u_gain_y_ppm": ("gain_y", _PPM),
    "u_offset_x_ma": ("offset_x", _MA),
    "u_offset_y_ma": ("offset_y", _MA),
    "u_alpha_common_arcsec": ("alpha", _ARCSEC),
    "u_beta_common_arcsec": ("beta", _ARCSEC),
    "u_gamma_common_arcsec": ("gamma", _ARCSEC),
    "u_level_1_arcsec": ("level_1", _ARCSEC),
    "u_level_2_arcsec": ("level_2", _ARCSEC),
    "u_azimuth_arcsec": ("azimuth", _ARCSEC),
    "u_latitude_arcsec": ("latitude", _ARCSEC),
    "u_gravity_ppm": ("gravity", _PPM),
    "u_temperature_k": ("temperature", 1.0),
}
"""Key of a statement: the solver's input and the factor to its SI unit."""

Statement = Mapping[str, Any]


def read_uncertainties(data: bytes, filename: str) -> Statement:
    """Read a statement and check it whole.

    Raises
    ------
    Invalid
        With every problem, each under the JSON pointer of its value as the column.
    """
    statement = load_object(data, filename)
    common_uncertainty(statement, filename)
    return statement


def common_uncertainty(statement: Statement, filename: str | None = None) -> CommonUncertainty:
    """Turn a statement into the solver's record.

    Raises
    ------
    Invalid
        As `read_uncertainties`.
    """
    problems = Problems(filename)
    reader = Reader(statement, problems)
    for key in statement:
        if key not in UNCERTAINTY_KEYS and key not in _FURTHER:
            known = ", ".join((*UNCERTAINTY_KEYS, *_FURTHER))
            reader.wrong(
                key,
                Message("unknown-key", "This is not known here. Choose from %(known)s.", {"known": known}),
            )
    standard = {}
    for key, (name, factor) in UNCERTAINTY_KEYS.items():
        value = reader.number(key, 0.0, LARGEST)
        if value is not None:
            standard[name] = value * factor
    correlation = _correlations(statement, reader, problems)
    dof = _numbers(statement, "dof", COMMON, reader, problems, smallest=FEWEST_DOF)
    coefficients = _numbers(statement, "temperature_coefficients", PARAMETERS, reader, problems)
    problems.raise_if_any()
    try:
        return CommonUncertainty.of(
            standard, correlation=correlation, dof=dof,
            temperature_coefficients={
                name: parameter_si(name, value) for name, value in coefficients.items()
            },
        )  # fmt: skip
    except InputError as error:
        raise Invalid(Problem(error.message, file=filename)) from error


def tidy(statement: Statement) -> dict[str, Any]:
    """The statement in the order of its keys, without what says nothing: null, an empty list or object."""
    return {
        key: statement[key]
        for key in (*UNCERTAINTY_KEYS, *_FURTHER)
        if statement.get(key) not in (None, [], {})
    }


def _correlations(statement: Statement, reader: Reader, problems: Problems) -> dict[tuple[str, str], float]:
    listed = statement.get("correlations")
    if listed is None:
        return {}
    if not isinstance(listed, list):
        reader.wrong("correlations", _not_a_correlation())
        return {}
    found: dict[tuple[str, str], float] = {}
    inner = Reader({}, problems, "/correlations")
    for number, entry in enumerate(listed):
        pair = _pair(entry)
        if pair is None:
            inner.wrong(str(number), _not_a_correlation())
            continue
        if found.keys() & {pair, pair[::-1]}:
            inner.wrong(
                str(number),
                Message("repeated-correlation", "The correlation of %(one)s and %(other)s stands there already. "
                        "Keep one of the two.", {"one": pair[0], "other": pair[1]}),
            )  # fmt: skip
            continue
        value = Reader(entry, problems, f"/correlations/{number}").number("coefficient", -1.0, 1.0)
        if value is not None:
            found[pair] = value
    return found


def _pair(entry: Any) -> tuple[str, str] | None:
    """The two inputs that an entry correlates; None when it is not written as it must be."""
    if not isinstance(entry, dict) or entry.keys() != {"between", "coefficient"}:
        return None
    pair = entry["between"]
    if not isinstance(pair, list) or len(pair) != 2 or entry["coefficient"] is None:
        return None
    one, other = pair
    known = one in COMMON and other in COMMON  # a tuple compares, so that lists and objects are no error
    return (one, other) if known and one != other else None


def _not_a_correlation() -> Message:
    return Message(
        "bad-correlation",
        'Write each correlation as {"between": ["gain_x", "gain_y"], "coefficient": 0.9}, with two of %(names)s.',
        {"names": ", ".join(COMMON)},
    )


def _numbers(
    statement: Statement,
    key: str,
    names: tuple[str, ...],
    reader: Reader,
    problems: Problems,
    smallest: float = -LARGEST,
) -> dict[str, float]:
    """An object of numbers by name, each name one of `names`."""
    listed = statement.get(key)
    if listed is None:
        return {}
    if not isinstance(listed, dict):
        reader.wrong(
            key, Message("not-an-object", "This must be an object of numbers by name, in braces { }.")
        )
        return {}
    found = {}
    inner = Reader(listed, problems, f"/{key}")
    for name in listed:
        if name not in names:
            inner.wrong(
                name,
                Message(
                    "unknown-key",
                    "This is not known here. Choose from %(known)s.",
                    {"known": ", ".join(names)},
                ),
            )
            continue
        value = inner.number(name, smallest, LARGEST)
        if value is not None:
            found[name] = value
    return found
