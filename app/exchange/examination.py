"""What an examination of a session found, as JSON in laboratory units: blunders, and what was not excluded."""

from collections.abc import Mapping, Sequence
from typing import Any

from app.exchange.json_values import Json, finite, message_json
from solver import units
from solver.blunders.diagnosis import Diagnosis, Finding


def diagnosis_json(diagnosis: Diagnosis) -> Json:
    """Write `diagnosis`, best explanation first, and `not_excluded`.

    Positions are [θ, ψ], or [θ, ψ, repeat] where a position was repeated, in degrees.
    """
    return {
        "diagnosis": [_finding(finding) for finding in diagnosis.findings],
        "not_excluded": [message_json(message) for message in diagnosis.not_excluded],
    }


def _finding(finding: Finding) -> Json:
    return {
        "code": finding.code,
        "positions": _positions(finding.positions),
        **_details(finding.details),
        "chi2_before": finite(finding.chi2_before),
        "chi2_after": finite(finding.chi2_after),
        **message_json(finding.message),
        "advice": None if finding.advice is None else message_json(finding.advice),
    }


def _details(details: Mapping[str, Any]) -> Json:
    """Write a finding's details in laboratory units, members of its class likewise."""
    plain: Json = {}
    for name, value in details.items():
        if name == "positions":
            plain[name] = _positions(value)
        elif name == "actual":
            plain[name] = _positions([value])[0]
        elif name == "equivalents":
            plain[name] = [_details(item) for item in value]
        elif name in ("value", "limit"):
            plain[f"{name}_ma"] = finite(units.ma_from_ampere(float(value)))
        elif name == "drift":
            plain["drift_x_deg_per_h"], plain["drift_y_deg_per_h"] = (
                finite(units.deg_per_h_from_rad_per_s(float(rate))) for rate in value
            )
        else:
            plain[name] = finite(value) if isinstance(value, float) else value
    return plain


def _positions(places: Sequence[Sequence[float]]) -> list[list[float]]:
    """Write each place as [θ, ψ] in degrees, and the number of its repeat where there is one."""
    return [[*(angle_deg(angle) for angle in place[:2]), *map(int, place[2:])] for place in places]


def angle_deg(angle_rad: float) -> float:
    """Stand angle in degrees as it was written: rounding takes off what the two conversions left."""
    return round(units.deg_from_rad(float(angle_rad)), 11) % 360.0
