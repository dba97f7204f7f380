"""Addresses of things, as they stand in answers."""

from typing import Final
from urllib.parse import quote

ROOT: Final = "/api/v1"


def gyro(serial: str) -> str:
    """Address of a gyro."""
    return f"{ROOT}/gyros/{quote(serial, safe='')}"


def stand(name: str) -> str:
    """Address of a stand."""
    return f"{ROOT}/stands/{quote(name, safe='')}"


def certificate(stand_name: str, number: str) -> str:
    """Address of one version of a stand's certificate."""
    return f"{stand(stand_name)}/certificates/{quote(number, safe='')}"


def session(number: int) -> str:
    """Address of a session."""
    return f"{ROOT}/sessions/{number}"


def calibration(number: int) -> str:
    """Address of a result."""
    return f"{ROOT}/calibrations/{number}"


def job(identity: str) -> str:
    """Address of a job."""
    return f"{ROOT}/jobs/{identity}"


def kind_of_problem(kind: str) -> str:
    """Address of the words that explain a kind of problem."""
    return f"{ROOT}/docs#{kind}"
