"""The simulated laboratory in the laboratory's own terms: rows and units in, records out."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.exchange.rows import CertificateRow, CurrentRecord
from app.exchange.si import parameter_lab
from simdevice.bench import Bench, SimulatedPosition, run_session
from simdevice.certificate import Certificate, Position, certify
from simdevice.fleet import FleetGyro
from simdevice.gyro import Gyro
from simdevice.noise import RateNoise
from simdevice.scenarios import GVK_6, LABORATORY_AMMETER, TYPES, draw_gyro
from simdevice.stand import Stand
from solver.records import PARAMETERS
from solver.units import deg_from_rad, ma_from_ampere, rad_from_arcsec, rad_from_deg, rad_per_s_from_deg_per_h


@dataclass(frozen=True, slots=True)
class Conditions:
    """What a simulated session depends on beside certificate and latitude.

    The gyro's truth follows from its type, serial number and start, the stand's from its name; the
    seed is that of the session's noise. `noise_deg_per_h` is the standard deviation of a
    position's mean; None takes the type's own noise.
    """

    type: str
    serial: str
    stand: str
    start: int
    seed: int
    duration_s: float = 60.0
    rate_hz: float = 200.0
    noise_deg_per_h: float | None = None


def simulated_records(
    conditions: Conditions, rows: Sequence[CertificateRow], latitude_deg: float
) -> tuple[dict[str, float], list[CurrentRecord]]:
    """A session's truth in laboratory units, and its records, θ outer, ψ inner."""
    bench = bench_for(conditions, rows, latitude_deg)
    positions = [Position(rad_from_deg(row.theta_deg), rad_from_deg(row.psi_deg)) for row in rows]
    session = run_session(bench, positions, workers=1)
    return truth_values(bench.gyro), records_lab(session.positions)


def bench_for(conditions: Conditions, rows: Sequence[CertificateRow], latitude_deg: float) -> Bench:
    """The bench on which the session is measured."""
    kind = TYPES.get(conditions.type, GVK_6)
    own = _seed_of(conditions.serial)
    individual = FleetGyro(conditions.serial, kind, draw_gyro(kind, own), own)
    stand = Stand(rad_from_deg(latitude_deg), certificate_si(rows), seed=_seed_of(conditions.stand))
    bench = Bench(
        individual.truth(0.0, conditions.start), stand, LABORATORY_AMMETER, kind.noise,
        rate=conditions.rate_hz, duration=conditions.duration_s, seed=conditions.seed,
    )  # fmt: skip
    if conditions.noise_deg_per_h is None:
        return bench
    walk = rad_per_s_from_deg_per_h(conditions.noise_deg_per_h) * float(np.sqrt(conditions.duration_s))
    return replace(bench, noise=RateNoise(angle_random_walk=walk))


def certificate_si(rows: Sequence[CertificateRow]) -> Certificate:
    """A certificate as the simulator takes it; an uncertainty that is not given counts as none."""
    angles = [(row.alpha_arcsec, row.beta_arcsec, row.gamma_arcsec) for row in rows]
    u = [(row.u_alpha_arcsec or 0.0, row.u_beta_arcsec or 0.0, row.u_gamma_arcsec or 0.0) for row in rows]
    return certify(
        [rad_from_deg(row.theta_deg) for row in rows],
        [rad_from_deg(row.psi_deg) for row in rows],
        rad_from_arcsec(np.array(angles)),
        u_random=rad_from_arcsec(np.array(u)),
    )


def certificate_lab(certificate: Certificate) -> list[CertificateRow]:
    """The simulator's certificate as rows; the stated uncertainty joins both of its parts."""
    u_arcsec = np.hypot(certificate.u_random, certificate.u_systematic) / rad_from_arcsec(1.0)
    angles_arcsec = certificate.angles / rad_from_arcsec(1.0)
    return [
        CertificateRow(degrees(theta), degrees(psi), *np.round(angle, 3).tolist(),
                       *np.round(u, 3).tolist())
        for theta, psi, angle, u in zip(
            certificate.theta, certificate.psi, angles_arcsec, u_arcsec, strict=True
        )
    ]  # fmt: skip


def records_lab(positions: Sequence[SimulatedPosition]) -> list[CurrentRecord]:
    """Simulated records in laboratory units."""
    return [
        CurrentRecord(
            degrees(item.theta), degrees(item.psi), item.t, ma_from_ampere(item.jx), ma_from_ampere(item.jy),
            item.repeat,
        )
        for item in positions
    ]  # fmt: skip


def truth_values(gyro: Gyro) -> dict[str, float]:
    """A gyro's true parameters by name, in laboratory units."""
    return {name: parameter_lab(name, getattr(gyro, name)) for name in PARAMETERS}


def degrees(angle: float) -> float:
    """A commanded angle in degrees as a person writes it, without what the conversion left."""
    return round(float(deg_from_rad(angle)), 9)


def _seed_of(name: str) -> int:
    return zlib.crc32(name.encode())
