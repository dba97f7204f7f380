"""The methods by which a gyro's results are followed, and the one that stands for it."""

from collections.abc import Collection
from typing import Final

METHODS: Final = ("least-squares", "generalised", "robust", "paper")


def main_method(known: Collection[str]) -> str:
    """Of the methods that a gyro has results of the first one of `METHODS`; it is shown, and raises the alarms."""
    return next((name for name in METHODS if name in known), METHODS[0])
