"""A demonstration laboratory: six gyros of two types, a stand with two certificates, a year of sessions.

Each gyro has its story (`simdevice.fleet.demonstration_fleet`), the stand's base turns and nobody has
noticed, and the people have repaired, frozen baselines and answered for an alarm. The latest session of each
gyro keeps its full records of currents, the older ones their means. Everything goes in through the same
services as a real laboratory's data, and every result is solved from them.
"""

from app.services.demonstration.laboratory import DEMO_ACCOUNT, build
from app.services.demonstration.visits import SESSIONS

__all__ = ["DEMO_ACCOUNT", "SESSIONS", "build"]
