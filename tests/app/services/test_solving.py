"""What a result says of the currents that came in, whichever way they came."""

import json
from dataclasses import replace

import pytest

from app.exchange.rows import CertificateRow, MeansRow
from app.services.simulated import degrees
from app.services.solving import solved
from simdevice.bench import mean_currents
from simdevice.certificate import sixteen_positions
from solver.units import ma_from_ampere


@pytest.fixture
def rows(bench) -> list[MeansRow]:
    means = mean_currents(bench, sixteen_positions())
    columns = (means.jx, means.jy, means.u_jx, means.u_jy)
    return [
        MeansRow(degrees(means.theta[n]), degrees(means.psi[n]),
                 *(float(ma_from_ampere(column[n])) for column in columns), 60.0, 200.0)
        for n in range(16)
    ]  # fmt: skip


def told(rows: list[MeansRow], certified: list[MeansRow], method: str = "least-squares") -> list[dict]:
    certificate = [CertificateRow(row.theta_deg, row.psi_deg, 0.0, 0.0, 0.0) for row in certified]
    result = json.loads(solved(rows, certificate, 55.7558, method)["result"])
    answers = [result[name] for name in ("least-squares", "paper")] if method == "both" else [result]
    codes = ("current-unit", "positions-missing")
    first, *others = [[item for item in answer["warnings"] if item["code"] in codes] for answer in answers]
    assert all(other == first for other in others)
    return first


def test_nothing_of_a_whole_session(rows) -> None:
    assert told(rows, rows, "both") == []


@pytest.mark.parametrize(("factor", "word"), [(1000.0, "large"), (0.001, "small")])
def test_currents_in_another_unit(rows, factor, word) -> None:
    other = [
        replace(
            row, **{name: factor * getattr(row, name) for name in ("jx_ma", "jy_ma", "u_jx_ma", "u_jy_ma")}
        )
        for row in rows
    ]
    (warning,) = told(other, rows, "both")
    assert warning["code"] == "current-unit"
    assert word in warning["message"]


def test_a_certified_position_without_a_measurement(rows) -> None:
    (warning,) = told(rows[:-1], rows)
    assert warning["code"] == "positions-missing"
    assert f"{rows[-1].theta_deg:g}°, {rows[-1].psi_deg:g}°" in warning["message"]
