"""Due days: the last sound session plus the type's interval, counted by hand."""

from datetime import UTC, date, datetime

import pytest

from app.services import calibrations, gyros
from app.services.access import SYSTEM
from app.services.drift import due
from app.services.lab import Lab, Work
from app.services.sessions import NewSession, open_session
from solver.records import PARAMETERS

TODAY = datetime(2026, 3, 1, 12, tzinfo=UTC)


def _solved(work: Work, serial: str, at: datetime, lacking: str = "", method: str = "both") -> int:
    """A session with a result, all of whose parameters are determined but one that may be lacking."""
    session = open_session(work, NewSession(serial, "S1", started_at=at))
    names = ("least-squares", "paper") if method == "both" else (method,)
    rows = [
        {"method": name, "parameter": item, "value": None if item == lacking else 1.0,
         "standard_uncertainty": 0.1, "coverage_factor": 2.0, "u_noise": 0.1}
        for name in names
        for item in PARAMETERS
    ]  # fmt: skip
    output = {"result": f'{{"session":{session.id}}}', "input_hash": "0" * 64, "solver_version": "1.0.0",
              "parameters": rows, "fit": {"chi2": None, "fit_dof": None}, "attitude": None}  # fmt: skip
    return calibrations.store(work, session.id, {"method": method, "inputs": []}, output)


@pytest.fixture
def fleet(lab: Lab) -> Lab:
    with lab.write(SYSTEM) as work:
        gyros.set_interval(work, "GVK-6", 100)
        for serial in ("0418", "0419", "0420"):
            gyros.add_gyro(work, serial, "GVK-6")
        gyros.add_gyro(work, "D-031", "DTG-4")
        _solved(work, "0417", datetime(2025, 11, 20, tzinfo=UTC))  # 101 days before
        _solved(work, "0418", datetime(2025, 11, 21, tzinfo=UTC))  # 100 days: the last day it holds
        _solved(work, "0419", datetime(2025, 6, 1, tzinfo=UTC))
        _solved(work, "0419", datetime(2025, 12, 22, tzinfo=UTC))  # 69 days: 31 are left
        _solved(work, "D-031", datetime(2020, 1, 1, tzinfo=UTC))
    return lab


def _all(lab: Lab) -> dict[str, due.Due]:
    with lab.read(SYSTEM) as work:
        work.now = TODAY
        return {item.gyro: item for item in due.due_list(work)}


def test_a_calibration_holds_up_to_its_last_day(fleet: Lab) -> None:
    found = _all(fleet)
    assert {serial: (item.due, item.days, item.state) for serial, item in found.items()} == {
        "0417": (date(2026, 2, 28), -1, "overdue"),
        "0420": (None, None, "never"),
        "0418": (date(2026, 3, 1), 0, "due-soon"),
        "0419": (date(2026, 4, 1), 31, "valid"),
        "D-031": (None, None, "no-interval"),
    }
    assert list(found) == ["0417", "0420", "0418", "0419", "D-031"]  # the most urgent first


def test_what_is_not_determined_is_no_calibration(fleet: Lab) -> None:
    with fleet.write(SYSTEM) as work:
        _solved(work, "0417", datetime(2026, 2, 1, tzinfo=UTC), lacking="wk")
        _solved(work, "0420", datetime(2026, 2, 1, tzinfo=UTC), lacking="kx")
    found = _all(fleet)
    assert found["0417"].measured_at == datetime(2025, 11, 20, tzinfo=UTC)
    assert found["0420"].state == "never"


@pytest.mark.parametrize("method", ["paper", "robust"])
def test_the_result_s_own_method_counts(fleet: Lab, method: str) -> None:
    with fleet.write(SYSTEM) as work:
        _solved(work, "0420", datetime(2026, 2, 1, tzinfo=UTC), method=method)
    assert _all(fleet)["0420"].state == "valid"


def test_a_corrected_result_that_determines_less_takes_the_calibration_back(fleet: Lab) -> None:
    with fleet.write(SYSTEM) as work:
        number = due.due_of(work, ["0419"])["0419"].session
        assert number is not None
        rows = [{"method": "paper", "parameter": "kx", "value": None, "standard_uncertainty": None,
                 "coverage_factor": None, "u_noise": None}]  # fmt: skip
        output = {"result": "{}", "input_hash": "1" * 64, "solver_version": "1.0.0", "parameters": rows,
                  "fit": {"chi2": None, "fit_dof": None}, "attitude": None}  # fmt: skip
        calibrations.store(work, number, {"method": "paper", "inputs": []}, output)
    assert _all(fleet)["0419"].measured_at == datetime(2025, 6, 1, tzinfo=UTC)


def test_selections(fleet: Lab) -> None:
    with fleet.read(SYSTEM) as work:
        work.now = TODAY
        assert [item.gyro for item in due.due_list(work, type_name="DTG-4")] == ["D-031"]
        assert [item.gyro for item in due.urgent(work)] == ["0417", "0420", "0418"]
        assert list(due.due_of(work, ["0418", "nobody"])) == ["0418"]
        assert due.counts(due.due_list(work)) == {
            "overdue": 1, "never": 1, "due-soon": 1, "valid": 1, "no-interval": 1,
        }  # fmt: skip
