"""Measuring the demonstration's sessions with simulated instruments, and solving them."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from functools import partial
from typing import Any

import numpy as np

from app.exchange.records import means_row, write_record_parquet
from app.exchange.rows import CertificateRow, MeansRow
from app.services import calibrations, gyros, ingest
from app.services.calibrations import TRIALS
from app.services.demonstration.equipment import LATITUDE_DEG, STAND, Era, ammeter
from app.services.demonstration.visits import Visit
from app.services.lab import Person, Work
from app.services.sessions import NewSession, find_session, open_session
from app.services.simulated import degrees, records_lab, truth_values
from app.services.solving import solved
from app.store import measurement
from simdevice.bench import Bench, mean_currents, run_session
from simdevice.certificate import sixteen_positions
from simdevice.fleet import DAY, FleetGyro
from solver.units import ma_from_ampere


@dataclass(frozen=True, slots=True)
class Solution:
    """A session that is being solved while the next ones are measured."""

    session_id: int
    at: datetime
    wanted: dict[str, Any]
    output: Future[dict[str, Any]]

    def store(self, work: Work) -> None:
        """Keep the answer, once it is there."""
        work.now = self.at
        calibrations.store(work, self.session_id, self.wanted, self.output.result())


def measure(work: Work, visit: Visit, era: Era, aside: ThreadPoolExecutor) -> Solution | None:
    """A session, solved; the last one of a gyro, whose Monte Carlo check takes its time, aside."""
    work.now = visit.at + timedelta(minutes=43)
    work.person = Person("petrova", "I. Petrova", "technician", frozenset())
    bench = visit.gyro.bench(era.stand, visit.time, visit.start, visit.number, ammeter())
    new_start = visit.start > gyros.starts(work, visit.gyro.serial)
    session = open_session(
        work,
        NewSession(
            visit.gyro.serial, STAND, started_at=visit.at, origin="simulation", new_start=new_start,
            temperature_c=round(21.5 + np.sin(visit.time / (60 * DAY)), 1), truth=truth_values(bench.gyro),
        ),
    )  # fmt: skip
    ingest.save(work, session.id, _kept(work, bench) if visit.last else _means_only(bench, visit.at))
    wanted, question = _question(work, session.id, era.rows, TRIALS if visit.last else 0)
    if visit.last:
        return Solution(session.id, work.now, wanted, aside.submit(question))
    calibrations.store(work, session.id, wanted, question())  # its gyro's next session is judged against it
    return None


def _means_only(bench: Bench, at: datetime) -> list[ingest.Measured]:
    return [ingest.Measured(row, ingest.Source("simulation")) for row in _means(bench, at)]


def _kept(work: Work, bench: Bench) -> list[ingest.Measured]:
    measured = []
    for record in records_lab(run_session(bench, sixteen_positions()).positions):
        digest = work.files.put(write_record_parquet(record), "parquet")
        row = means_row(record)
        stored = ingest.StoredRecord(digest, len(record.t_s), row.duration_s or 0.0, row.rate_hz or 0.0)
        measured.append(ingest.Measured(row, ingest.Source("simulation", digest), stored))
    return measured


def _means(bench: Bench, at: datetime) -> list[MeansRow]:
    means = mean_currents(bench, sixteen_positions())
    jx_ma, jy_ma, u_jx_ma, u_jy_ma = (
        ma_from_ampere(column).tolist() for column in (means.jx, means.jy, means.u_jx, means.u_jy)
    )
    return [
        MeansRow(
            degrees(means.theta[row]), degrees(means.psi[row]), jx_ma[row], jy_ma[row], u_jx_ma[row],
            u_jy_ma[row], means.duration, means.rate, at + timedelta(minutes=2.5 * row),
        )
        for row in range(len(means.theta))
    ]  # fmt: skip


def _question(
    work: Work, session_id: int, rows: Sequence[CertificateRow], trials: int
) -> tuple[dict[str, Any], Callable[[], dict[str, Any]]]:
    """What is asked of a session, and what answers it with no database at hand."""
    measured = measurement.current(work.db, session_id)
    wanted: dict[str, Any] = {"method": "both", "inputs": [row.id for row in measured], "trials": trials}
    stated = calibrations.stated(work, find_session(work, session_id), wanted)
    means = [calibrations.means_row(row) for row in measured]
    return wanted, partial(solved, means, rows, LATITUDE_DEG, "both", stated)


def leave_one_open(work: Work, gyro: FleetGyro, era: Era, now: datetime) -> None:
    """A session of today, twelve of sixteen positions typed: somebody is at work."""
    begun = now - timedelta(minutes=50)
    work.now = begun
    session = open_session(
        work, NewSession(gyro.serial, STAND, started_at=begun, new_start=True, temperature_c=21.6)
    )
    bench = gyro.bench(era.stand, 365 * DAY, 99, 99, ammeter())
    for row in _means(bench, begun)[:12]:
        work.now = row.started_at or begun
        typed = replace(row, jx_ma=round(row.jx_ma, 7), jy_ma=round(row.jy_ma, 7), u_jx_ma=None, u_jy_ma=None)
        ingest.save_means(work, session.id, typed, ingest.Source("typed"))
