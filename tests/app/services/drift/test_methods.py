"""Which method stands for a gyro, and raises its alarms."""

from laid import SCATTER, TECHNICIAN, drawn, session

from app.services.drift import gyro_study, methods, series
from app.services.lab import Lab
from app.services.lookup import find_gyro


def test_the_first_of_those_there_are() -> None:
    assert methods.main_method(["paper", "robust"]) == "robust"
    assert methods.main_method(methods.METHODS[::-1]) == "least-squares"
    assert methods.main_method([]) == "least-squares"


def test_alarms_are_raised_by_the_method_that_is_shown(lab: Lab) -> None:
    """A step by fifty standard deviations after six of twelve sessions, by two methods."""
    values = [
        {name: value + (number >= 6) * 50.0 * SCATTER for name, value in item.items()}
        for number, item in enumerate(drawn(12))
    ]
    with lab.write(TECHNICIAN) as work:
        for number, item in enumerate(values):
            session(work, number, item, methods=("paper", "robust"))
        payload = gyro_study.prepare(work, find_gyro(work, "0417").id)
    found = gyro_study.studied(payload, lambda _part, _phase: None)
    assert series.decode(found["paper"]["series"])["session"].tolist() == list(range(1, 13))
    assert [name for name, made in found.items() if made["findings"]] == ["robust"]
