"""What limits a result, as JSON in laboratory units: the budget of its uncertainty."""

from typing import Any, Final

Json = dict[str, Any]

SOURCE_NAMES: Final = {
    "scatter": "scatter of the residuals",
    "currents": "noise of the mean currents",
    "angles": "certified angles, each position",
    "ammeter-gain": "gain of the ammeter",
    "ammeter-offset": "offset of the ammeter",
    "angles-common": "certified angles, in common",
    "level": "level of the base",
    "azimuth": "azimuth of the base",
    "latitude": "latitude",
    "gravity": "gravity",
    "temperature": "temperature",
    "correlation": "correlations between these",
}
"""Lines of a budget in words."""
