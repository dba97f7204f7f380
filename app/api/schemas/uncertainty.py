"""What all positions of a session have in common: the statement of `app.exchange.uncertainties`."""

from typing import Any

from pydantic import ConfigDict, RootModel
from pydantic.config import JsonDict

from app.exchange.uncertainties import FEWEST_DOF, LARGEST, UNCERTAINTY_KEYS
from solver.inputs import COMMON
from solver.records import PARAMETERS

_EXAMPLE: JsonDict = {
    "u_gain_x_ppm": 50,
    "u_gain_y_ppm": 50,
    "u_level_1_arcsec": 2,
    "u_azimuth_arcsec": 10,
    "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9}],
    "dof": {"azimuth": 8},
}


def _number(smallest: float, largest: float) -> JsonDict:
    return {"type": "number", "minimum": smallest, "maximum": largest}


def _by_name(names: tuple[str, ...], number: JsonDict) -> JsonDict:
    return {"type": "object", "properties": dict.fromkeys(names, number), "additionalProperties": False}


_CORRELATION: JsonDict = {
    "type": "object",
    "properties": {
        "between": {
            "type": "array",
            "items": {"type": "string", "enum": list(COMMON)},
            "minItems": 2,
            "maxItems": 2,
            "uniqueItems": True,
        },
        "coefficient": _number(-1, 1),
    },
    "required": ["between", "coefficient"],
    "additionalProperties": False,
}

_PROPERTIES: JsonDict = {
    **dict.fromkeys(UNCERTAINTY_KEYS, _number(0, LARGEST)),
    "correlations": {"type": "array", "items": _CORRELATION},
    "dof": _by_name(COMMON, _number(FEWEST_DOF, LARGEST)),
    "temperature_coefficients": _by_name(PARAMETERS, _number(-LARGEST, LARGEST)),
}


class Uncertainty(RootModel[dict[str, Any]]):
    """Standard uncertainties in common to all positions of a session; what is left out is taken as exact.

    Gains in ppm, offsets in mA, angles in arcseconds, gravity in ppm, temperature in kelvin; further
    correlations, degrees of freedom, and temperature coefficients per kelvin in the parameter's unit.
    """

    # The statement is checked by `common_uncertainty` alone; this only describes it.
    model_config = ConfigDict(
        json_schema_extra={
            "properties": _PROPERTIES,
            "additionalProperties": False,
            "examples": [_EXAMPLE],
        }
    )
