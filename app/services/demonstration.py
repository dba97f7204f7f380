"""A demonstration laboratory: six gyros of two types, a stand with two certificates, a year of sessions.

Gyro 0417 drifts, 0423 jumps; the latest session of each gyro keeps its full records of currents,
the older ones their means. Everything goes in through the same services as a real laboratory's
data, and every result is solved from them.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any, Final

import numpy as np

from app.exchange.records import means_row, write_record_parquet
from app.exchange.rows import CertificateRow, MeansRow
from app.exchange.si import parameter_lab
from app.exchange.uncertainties import Statement
from app.services import access, calibrations, gyros, ingest, stands
from app.services.calibrations import TRIALS
from app.services.drift import studying
from app.services.lab import Lab, Person, Work
from app.services.sessions import NewSession, find_session, open_session
from app.services.simulated import (
    ammeter_off,
    certificate_lab,
    common_lab,
    degrees,
    deviations,
    records_lab,
    truth_values,
)
from app.services.solving import solved
from app.services.views import Nominal
from app.store import measurement
from simdevice.ammeter import Ammeter
from simdevice.bench import Bench, mean_currents, run_session
from simdevice.certificate import draw_certificate, sixteen_positions
from simdevice.fleet import DAY, FleetGyro, demonstration_fleet
from simdevice.scenarios import LABORATORY_AMMETER, TYPES
from simdevice.stand import Stand
from solver.records import PARAMETERS
from solver.units import ma_from_ampere, rad_from_deg

SEED: Final = 2026
LATITUDE_DEG: Final = 55.7558
SESSIONS: Final = 13
"""Sessions of each gyro over the year."""
DEMO_ACCOUNT: Final = "sokolov"
_PEOPLE: Final = (("petrova", "I. Petrova", "technician"), (DEMO_ACCOUNT, "A. Sokolov", "metrologist"),
                  ("orlova", "N. Orlova", "quality"))  # fmt: skip
_LIMITS: Final = {
    "GVK-6": {"kx": (1980.0, 2140.0), "ky": (1960.0, 2120.0), "kxy": (-25.0, 25.0), "kyx": (-25.0, 25.0),
              "w0x": (-6.0, 6.0), "w0y": (-6.0, 6.0), "wg": (-15.0, 15.0), "wk": (-2.5, 2.5)},
    "DTG-4": {"kx": (790.0, 860.0), "ky": (790.0, 870.0), "kxy": (-20.0, 20.0), "kyx": (-20.0, 20.0),
              "w0x": (-14.0, 14.0), "w0y": (-14.0, 14.0), "wg": (-25.0, 25.0), "wk": (-12.0, 12.0)},
}  # fmt: skip
_UNCERTAINTY: Final[Statement] = {
    "u_gain_x_ppm": 20, "u_gain_y_ppm": 20, "u_offset_x_ma": 5e-7, "u_offset_y_ma": 5e-7,
    "u_level_1_arcsec": 2, "u_level_2_arcsec": 2, "u_azimuth_arcsec": 10, "u_latitude_arcsec": 1,
    "u_gravity_ppm": 5, "u_temperature_k": 0.3,
    "correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9}], "dof": {"azimuth": 8},
}  # fmt: skip
"""Of stand S1; what is uncertain here really deviates, by an amount drawn from it."""
_PER_KELVIN: Final = {
    "GVK-6": {"kx": -0.4, "ky": -0.4, "w0x": 0.004, "w0y": 0.004},
    "DTG-4": {"kx": -0.17, "ky": -0.17, "w0x": 0.01, "w0y": 0.01},
}


@dataclass(frozen=True, slots=True)
class _Visit:
    """One session of one gyro: when, in which start, its number, and whether its records are kept."""

    gyro: FleetGyro
    at: datetime
    time: float
    start: int
    number: int
    last: bool


@dataclass(frozen=True, slots=True)
class _Solution:
    """A session that is being solved while the next ones are measured."""

    session_id: int
    at: datetime
    wanted: dict[str, Any]
    output: Future[dict[str, Any]]

    def store(self, work: Work) -> None:
        work.now = self.at
        calibrations.store(work, self.session_id, self.wanted, self.output.result())


def build(lab: Lab, now: datetime | None = None) -> None:
    """Fill an empty laboratory; one transaction, so that an interrupted build leaves nothing."""
    now = (now or datetime.now(UTC)).replace(microsecond=0)
    with lab.write(access.SYSTEM) as work:
        work.queue = studying.NoJobs()
        for name, full_name, role in _PEOPLE:
            access.add_account(work, name, role, full_name=full_name)
        fleet = demonstration_fleet(SEED)
        for kind, limits in _LIMITS.items():
            gyros.set_limits(work, kind, limits)
            gyros.set_nominals(work, kind, _nominals(kind))
        for item in fleet:
            gyros.add_gyro(work, item.serial, item.kind.name)
        certified = _equip(work, now)
        with ThreadPoolExecutor(2) as aside:
            for solution in [
                _measure(work, visit, *_stand_at(certified, visit.at), aside) for visit in _visits(fleet, now)
            ]:
                if solution is not None:
                    solution.store(work)
        studying.follow_all_now(work)
        _leave_one_open(work, fleet[2], certified[-1][1], certified[-1][2], now)


def _nominals(kind: str) -> dict[str, Nominal]:
    """What the simulated type's gyros are drawn from, as a laboratory would round it."""
    made = TYPES[kind]
    return {
        name: Nominal(
            round(parameter_lab(name, getattr(made.nominal, name)), 2),
            float(f"{parameter_lab(name, made.spread[name]):.2g}"),
            _PER_KELVIN[kind].get(name),
        )
        for name in PARAMETERS
    }


def _equip(work: Work, now: datetime) -> list[tuple[datetime, Stand, list[CertificateRow]]]:
    """Stand S1 with two successive certificates; each as (valid from, true stand, rows)."""
    off = deviations(SEED, _UNCERTAINTY)
    base = (off["level_1"], off["level_2"], off["azimuth"])
    latitude = rad_from_deg(LATITUDE_DEG) + off["latitude"]
    first = Stand(latitude, draw_certificate(SEED), base, seed=SEED)
    stands.add_stand(work, "S1", LATITUDE_DEG, "Room 12, pier 1")
    stands.state_uncertainty(work, "S1", _UNCERTAINTY)
    certified = []
    for number, stand, begin in (
        ("C-16", first, now - timedelta(days=500)),
        ("C-17", first.recertified(SEED + 1), now - timedelta(days=160)),
    ):
        rows = certificate_lab(stand.certificate)
        end = (begin + timedelta(days=365)).date()
        stands.add_certificate(
            work,
            "S1",
            number,
            begin.date(),
            end,
            rows,
            "Regional metrology centre",
            common_lab(stand.certificate),
        )
        certified.append((begin, stand, rows))
    return certified


def _stand_at(
    certified: Sequence[tuple[datetime, Stand, list[CertificateRow]]], at: datetime
) -> tuple[Stand, list[CertificateRow]]:
    _, stand, rows = [item for item in certified if item[0].date() <= at.date()][-1]
    return stand, rows


def _ammeter() -> Ammeter:
    return ammeter_off(LABORATORY_AMMETER, deviations(SEED, _UNCERTAINTY))


def _visits(fleet: Sequence[FleetGyro], now: datetime) -> Iterator[_Visit]:
    """Every session of the year in the order of time; a gyro is switched on anew for most of them."""
    shuffle = random.Random(SEED)
    visits = []
    for place, gyro in enumerate(fleet):
        start = 0
        for number in range(SESSIONS):
            day = 4 + (number + place / len(fleet)) * 360 / SESSIONS
            at = now - timedelta(days=365 - round(day), hours=-shuffle.randrange(7) + now.hour - 9,
                                 minutes=shuffle.randrange(60))  # fmt: skip
            start += shuffle.random() < 0.8 or not number
            visits.append(_Visit(gyro, at, day * DAY, start, number, number == SESSIONS - 1))
    yield from sorted(visits, key=lambda visit: visit.at)


def _measure(
    work: Work, visit: _Visit, stand: Stand, rows: Sequence[CertificateRow], aside: ThreadPoolExecutor
) -> _Solution | None:
    """A session, solved; the last one of a gyro, whose Monte Carlo check takes its time, aside."""
    work.now = visit.at + timedelta(minutes=43)
    work.person = Person("petrova", "I. Petrova", "technician", frozenset())
    bench = visit.gyro.bench(stand, visit.time, visit.start, visit.number, _ammeter())
    new_start = visit.start > gyros.starts(work, visit.gyro.serial)
    session = open_session(
        work,
        NewSession(
            visit.gyro.serial, "S1", started_at=visit.at, origin="simulation", new_start=new_start,
            temperature_c=round(21.5 + np.sin(visit.time / (60 * DAY)), 1), truth=truth_values(bench.gyro),
        ),
    )  # fmt: skip
    ingest.save(work, session.id, _kept(work, bench) if visit.last else _means_only(bench, visit.at))
    wanted, question = _question(work, session.id, rows, TRIALS if visit.last else 0)
    if visit.last:
        return _Solution(session.id, work.now, wanted, aside.submit(question))
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


def _leave_one_open(
    work: Work, gyro: FleetGyro, stand: Stand, rows: Sequence[CertificateRow], now: datetime
) -> None:
    """A session of today, twelve of sixteen positions typed: somebody is at work."""
    begun = now - timedelta(minutes=50)
    work.now = begun
    session = open_session(
        work, NewSession(gyro.serial, "S1", started_at=begun, new_start=True, temperature_c=21.6)
    )
    bench = gyro.bench(stand, 365 * DAY, 99, 99, _ammeter())
    for row in _means(bench, begun)[:12]:
        work.now = row.started_at or begun
        typed = replace(row, jx_ma=round(row.jx_ma, 7), jy_ma=round(row.jy_ma, 7), u_jx_ma=None, u_jy_ma=None)
        ingest.save_means(work, session.id, typed, ingest.Source("typed"))
