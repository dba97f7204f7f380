"""Physical constants, SI."""

from typing import Final

EARTH_RATE: Final = 7.292115e-5
"""Angular velocity of the Earth, rad/s (GRS 80 / WGS 84 defining constant)."""
