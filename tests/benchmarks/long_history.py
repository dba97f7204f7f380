"""How long the history page takes of a gyro with 10,000 sessions, beside one with 100, in a database of 100,000.

Run from the top folder as ``python -m tests.benchmarks.long_history``; `--folder` keeps the database for another run.
The database is filled through its tables: sessions of sixteen measured positions with results by least squares, drawn
around constant values, with a step and a slow drift in the long history. Its studies are made by the product. Then the
service is asked over HTTP for both gyros' pages and for the same by the interface, in turn, so that other load on
the machine meets both alike; the medians and their ratio are printed.

`--sessions N` makes a smaller database: a tenth of it in the long history, a thousandth in the short one.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import sqlalchemy as sa

sys.path.insert(0, str(Path(__file__).parents[1] / "app"))

from serving import GRID, NotingQueue, running

from app.exchange.rows import CertificateRow
from app.services import access, gyros, stands
from app.services.drift import baselines, series, studying
from app.services.lab import Lab, Person
from app.services.lookup import find_gyro
from app.services.opening import open_lab
from app.settings import Settings
from app.store.tables import (
    Calibration,
    CalibrationParameter,
    DriftStudy,
    Gyro,
    Measurement,
    MeasuringSession,
    StandAttitude,
    Start,
)
from solver.records import PARAMETERS

LONG, SHORT = "LONG", "SHORT"
METROLOGIST = Person("metrologist", "", "metrologist", frozenset({"read", "upload"}))
CHUNK = 2_000
LIFE = timedelta(days=5 * 365)


def main() -> int:
    """Fill the database unless it is there, then measure."""
    wanted = _arguments()
    with ExitStack() as stack:
        folder = wanted.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        settings = Settings(data=folder)
        if not settings.records.exists():
            with open_lab(settings, NotingQueue()) as lab:
                _fill(lab, wanted.sessions)
        service = stack.enter_context(running(settings, lambda known: open_lab(known, NotingQueue())))
        with service.lab.write(access.SYSTEM) as work:
            secret = access.make_sign_in_link(work, "metrologist", timedelta(days=1))
        browser = stack.enter_context(httpx.Client(base_url=service.url, timeout=120))
        _sign_in(browser, secret)
        program = service.client()
        program.timeout = httpx.Timeout(120)
        print("| | 100 sessions, ms | 10,000 sessions, ms | ratio |\n| --- | ---: | ---: | ---: |")
        ratios = [
            _row(browser, "history page, a year", "/gyros/{}", wanted.runs),
            _row(browser, "history page, everything", "/gyros/{}?period=all", wanted.runs),
            _row(browser, "one parameter in depth", "/gyros/{}/drift/w0x?period=all", wanted.runs),
            _row(program, "interface, drift", "gyros/{}/drift", wanted.runs),
            _row(program, "interface, by month", "gyros/{}/drift?by=month", wanted.runs),
        ]
    return 0 if max(ratios[:2]) <= 3.0 else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sessions", type=int, default=100_000)
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--folder", type=Path, default=None, help="where the database is, or is kept")
    return parser.parse_args()


def _sign_in(browser: httpx.Client, secret: str) -> None:
    answer = browser.get(f"/sign-in/link/{secret}")
    assert answer.cookies, answer.text


def _row(client: httpx.Client, name: str, address: str, runs: int) -> float:
    times: dict[str, list[float]] = {SHORT: [], LONG: []}
    for run in range(runs + 1):
        for serial in (SHORT, LONG):
            begin = time.perf_counter()
            answer = client.get(address.format(serial))
            took = time.perf_counter() - begin
            answer.raise_for_status()
            if run:  # the first one warms what is kept in memory
                times[serial].append(1e3 * took)
    short, long = (statistics.median(times[serial]) for serial in (SHORT, LONG))
    print(f"| {name} | {short:.0f} | {long:.0f} | {long / short:.2f} |")
    return long / short


def _fill(lab: Lab, total: int) -> None:
    """The laboratory: gyro LONG with a tenth of all sessions, SHORT and each other one with a thousandth."""
    counts = {LONG: total // 10, SHORT: total // 1000}
    rest = total - sum(counts.values())
    counts |= {f"G{number:04d}": total // 1000 for number in range(rest * 1000 // total)}
    begin = time.perf_counter()
    with lab.write(access.SYSTEM) as work:
        access.add_account(work, "metrologist", "metrologist")
        limits = dict.fromkeys(PARAMETERS, (-1.0, 1.0))
        gyros.set_limits(work, "GVK-6", limits)
        gyros.set_interval(work, "GVK-6", 365)
        stands.add_stand(work, "S1", 55.7558)
        rows = [CertificateRow(theta, psi, 6.9, -16.4, 6.6) for theta, psi in GRID]
        stands.add_certificate(work, "S1", "C-17", date(2000, 1, 1), date(2100, 1, 1), rows)
        for serial in counts:
            gyros.add_gyro(work, serial, "GVK-6")
    with lab.write(access.SYSTEM) as work:
        ids = {row[0]: row[1] for row in work.db.execute(sa.select(Gyro.serial, Gyro.id))}
        first = 1
        for serial, count in counts.items():
            _insert(work.db.connection(), ids[serial], first, count)
            first += count
    print(f"{total} sessions in {time.perf_counter() - begin:.0f} s")
    for serial in (SHORT, LONG):
        _study(lab, serial)


def _insert(connection: sa.Connection, gyro: int, first: int, count: int) -> None:
    for begin in range(0, count, CHUNK):
        size = min(CHUNK, count - begin)
        for table, rows in _rows(gyro, first + begin, begin, size, count):
            connection.execute(sa.insert(table), rows)


def _rows(
    gyro: int, first: int, begin: int, size: int, count: int
) -> Iterator[tuple[type[Any], Sequence[dict[str, Any]]]]:
    """Everything of some sessions, numbered from `first` on; every second one begins a start."""
    draw = np.random.default_rng([gyro, begin])
    now = datetime.now(UTC)
    places = np.arange(begin, begin + size)
    times = [now - LIFE * (1.0 - (place + 1) / count) for place in places.tolist()]
    ids = range(first, first + size)
    yield (
        Start,
        [
            {"id": key, "gyro_id": gyro, "number": place + 1, "powered_up_at": at, "note": ""}
            for key, place, at in zip(ids, places.tolist(), times, strict=True)
        ],
    )
    yield (
        MeasuringSession,
        [
            {
                "id": key, "gyro_id": gyro, "stand_id": 1, "certificate_id": 1, "start_id": key - place % 2,
                "latitude_deg": 55.7558, "origin": "api", "started_at": at, "temperature_c": 21.5, "note": "",
                "created_at": at, "created_by": "petrova", "solved": True,
            }
            for key, place, at in zip(ids, places.tolist(), times, strict=True)
        ],
    )  # fmt: skip
    yield (
        Measurement,
        [
            {
                "session_id": key, "theta_deg": theta, "psi_deg": psi, "repeat": 0, "revision": 1, "jx_ma": 1e-3,
                "jy_ma": 2e-3, "origin": "api", "note": "", "created_at": at, "created_by": "petrova",
            }
            for key, at in zip(ids, times, strict=True)
            for theta, psi in GRID
        ],
    )  # fmt: skip
    yield (
        Calibration,
        [
            {
                "id": key, "session_id": key, "revision": 1, "method": "least-squares", "solver_version": "1",
                "input_hash": str(key), "certificate_id": 1, "inputs": [], "result": "{}", "result_digest": "",
                "chi2": 24.0 + spread, "fit_dof": 24, "created_at": at, "created_by": "petrova",
            }
            for key, at, spread in zip(ids, times, draw.normal(0.0, 3.0, size).tolist(), strict=True)
        ],
    )  # fmt: skip
    course = 0.1 * (places > 2 * count // 3) + 0.05 * places / count
    values = (draw.normal(0.0, 0.02, (len(PARAMETERS), size)) + course).tolist()
    yield (
        CalibrationParameter,
        [
            {
                "calibration_id": key, "method": "least-squares", "parameter": name, "value": values[row][column],
                "standard_uncertainty": 0.004, "coverage_factor": 2.0, "u_noise": 0.003,
            }
            for column, key in enumerate(ids)
            for row, name in enumerate(PARAMETERS)
        ],
    )  # fmt: skip
    yield (
        StandAttitude,
        [
            {"calibration_id": key, "azimuth_arcsec": value, "u_azimuth_arcsec": 30.0}
            for key, value in zip(ids, draw.normal(0.0, 30.0, size).tolist(), strict=True)
        ],
    )


def _study(lab: Lab, serial: str) -> None:
    """Baselines from the first sessions, and the study, as a person and the job would."""
    begin = time.perf_counter()
    with lab.write(METROLOGIST) as work:
        gyro = find_gyro(work, serial)
        work.db.add(DriftStudy(gyro_id=gyro.id, method="least-squares"))
        chosen = series.load(work, gyro.id, "least-squares")["calibration"][:25].tolist()
        baselines.freeze(work, serial, PARAMETERS, chosen, reason="the first sessions")
        studying.follow_now(work, gyro.id)
    print(f"{serial} studied in {time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    sys.exit(main())
