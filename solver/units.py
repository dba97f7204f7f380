"""Laboratory units to SI and back: the only place where a conversion factor stands.

Every function takes a number or an array of any shape and returns the same shape. The
laboratory's units are: degrees and arcseconds for angles, mA for currents, °/h for rates,
°/h/g for g-sensitive drift, °/h/mA for scale factors.
"""

from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", float, NDArray[np.float64])

ARCSEC_PER_DEG: Final = 3600.0
SECONDS_PER_HOUR: Final = 3600.0
MILLIAMPERE_PER_AMPERE: Final = 1000.0
_RAD_PER_DEG: Final = np.pi / 180.0
_RAD_PER_ARCSEC: Final = np.pi / (180.0 * ARCSEC_PER_DEG)
_RAD_PER_S_PER_DEG_PER_H: Final = np.pi / (180.0 * SECONDS_PER_HOUR)


def rad_from_deg(angle: Number) -> Number:
    """Degrees to rad."""
    return angle * _RAD_PER_DEG


def deg_from_rad(angle: Number) -> Number:
    """Rad to degrees."""
    return angle / _RAD_PER_DEG


def rad_from_arcsec(angle: Number) -> Number:
    """Arcseconds to rad."""
    return angle * _RAD_PER_ARCSEC


def arcsec_from_rad(angle: Number) -> Number:
    """Rad to arcseconds."""
    return angle / _RAD_PER_ARCSEC


def ampere_from_ma(current: Number) -> Number:
    """MA to A."""
    return current / MILLIAMPERE_PER_AMPERE


def ma_from_ampere(current: Number) -> Number:
    """A to mA."""
    return current * MILLIAMPERE_PER_AMPERE


def rad_per_s_from_deg_per_h(rate: Number) -> Number:
    """°/h to rad/s; also °/h/g to rad/s per g."""
    return rate * _RAD_PER_S_PER_DEG_PER_H


def deg_per_h_from_rad_per_s(rate: Number) -> Number:
    """Rad/s to °/h; also rad/s per g to °/h/g."""
    return rate / _RAD_PER_S_PER_DEG_PER_H


def scale_from_deg_per_h_per_ma(scale: Number) -> Number:
    """°/h/mA to rad/(s·A)."""
    return scale * (_RAD_PER_S_PER_DEG_PER_H * MILLIAMPERE_PER_AMPERE)


def deg_per_h_per_ma_from_scale(scale: Number) -> Number:
    """Rad/(s·A) to °/h/mA."""
    return scale / (_RAD_PER_S_PER_DEG_PER_H * MILLIAMPERE_PER_AMPERE)
