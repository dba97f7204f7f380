"""The simulated laboratory in the laboratory's own terms: rows and units in, records out."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.exchange.rows import CertificateRow, CurrentRecord
from app.exchange.si import parameter_lab
from app.exchange.uncertainties import Statement, common_uncertainty
from app.services.views import CommonAngles, Nominal
from simdevice.ammeter import Ammeter
from simdevice.bench import Bench, SimulatedPosition, run_session
from simdevice.certificate import Certificate, Position, certify
from simdevice.fleet import FleetGyro
from simdevice.gyro import Gyro
from simdevice.noise import RateNoise
from simdevice.scenarios import GVK_6, LABORATORY_AMMETER, TYPES, GyroType, draw_gyro
from simdevice.stand import Stand
from simdevice.thermal import ZERO_CELSIUS
from solver.inputs import COMMON
from solver.records import PARAMETERS
from solver.units import (
    arcsec_from_rad,
    deg_from_rad,
    ma_from_ampere,
    rad_from_arcsec,
    rad_from_deg,
    rad_per_s_from_deg_per_h,
)

NOTHING_STATED: Final[Statement] = MappingProxyType({})
_ANGLES: Final = ("alpha", "beta", "gamma")


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
    conditions: Conditions,
    rows: Sequence[CertificateRow],
    latitude_deg: float,
    statement: Statement = NOTHING_STATED,
) -> tuple[dict[str, float], list[CurrentRecord]]:
    """A session's truth in laboratory units, and its records, θ outer, ψ inner; see `bench_for`."""
    bench = bench_for(conditions, rows, latitude_deg, statement)
    positions = [Position(rad_from_deg(row.theta_deg), rad_from_deg(row.psi_deg)) for row in rows]
    session = run_session(bench, positions, workers=1)
    return truth_values(session.truth), records_lab(session.positions)


def bench_for(
    conditions: Conditions,
    rows: Sequence[CertificateRow],
    latitude_deg: float,
    statement: Statement = NOTHING_STATED,
) -> Bench:
    """The bench on which the session is measured.

    What `statement` calls uncertain really deviates, by an amount drawn once for each stand: gain and
    offset of the ammeter, the base, the latitude, the common part of the angles. Gravity and
    temperature are what they are taken for.
    """
    kind = TYPES.get(conditions.type, GVK_6)
    own = _seed_of(conditions.serial)
    individual = FleetGyro(conditions.serial, kind, draw_gyro(kind, own), own)
    common = common_uncertainty(statement)
    u_angles = [common.standard[COMMON.index(name)] for name in _ANGLES]
    off = deviations(_seed_of(conditions.stand), statement)
    latitude = float(np.clip(rad_from_deg(latitude_deg) + off["latitude"], -np.pi / 2, np.pi / 2))
    base = (off["level_1"], off["level_2"], off["azimuth"])
    stand = Stand(latitude, certificate_si(rows, u_angles), base, _seed_of(conditions.stand))
    bench = Bench(
        individual.truth(0.0, conditions.start), stand, ammeter_off(LABORATORY_AMMETER, off), kind.noise,
        rate=conditions.rate_hz, duration=conditions.duration_s, seed=conditions.seed,
    )  # fmt: skip
    if conditions.noise_deg_per_h is None:
        return bench
    walk = rad_per_s_from_deg_per_h(conditions.noise_deg_per_h) * float(np.sqrt(conditions.duration_s))
    return replace(bench, noise=RateNoise(angle_random_walk=walk))


def deviations(seed: int, statement: Statement) -> dict[str, float]:
    """True minus assumed of everything that a session's positions share, by name, SI; drawn as stated."""
    common = common_uncertainty(statement)
    sizes, directions = np.linalg.eigh(common.correlation)
    deviates = np.random.default_rng([seed, len(COMMON)]).standard_normal(len(COMMON))
    drawn = common.standard * (directions @ (np.sqrt(np.clip(sizes, 0.0, None)) * deviates))
    return dict(zip(COMMON, drawn.tolist(), strict=True))


def ammeter_off(ammeter: Ammeter, off: Mapping[str, float]) -> Ammeter:
    """The ammeter whose readings J stand for true currents (1 + gain)·J + offset."""
    return Ammeter(
        *(
            replace(
                channel,
                gain=channel.gain / (1.0 + off[f"gain_{axis}"]),
                offset=channel.offset - off[f"offset_{axis}"] / (1.0 + off[f"gain_{axis}"]),
            )
            for axis, channel in zip("xy", ammeter.channels, strict=True)
        )
    )


def certificate_si(
    rows: Sequence[CertificateRow], u_common: Sequence[float] | NDArray[np.float64] = (0.0, 0.0, 0.0)
) -> Certificate:
    """A certificate as the simulator takes it; an uncertainty that is not given counts as none.

    `u_common`, rad, is that of what α, β, γ of all positions share.
    """
    angles = [(row.alpha_arcsec, row.beta_arcsec, row.gamma_arcsec) for row in rows]
    u = [(row.u_alpha_arcsec or 0.0, row.u_beta_arcsec or 0.0, row.u_gamma_arcsec or 0.0) for row in rows]
    return certify(
        [rad_from_deg(row.theta_deg) for row in rows],
        [rad_from_deg(row.psi_deg) for row in rows],
        rad_from_arcsec(np.array(angles)),
        u_random=rad_from_arcsec(np.array(u)),
        u_systematic=u_common,
    )


def certificate_lab(certificate: Certificate) -> list[CertificateRow]:
    """The simulator's certificate as rows with the random part of its uncertainty; see `common_lab`."""
    u_arcsec = certificate.u_random / rad_from_arcsec(1.0)
    angles_arcsec = certificate.angles / rad_from_arcsec(1.0)
    return [
        CertificateRow(degrees(theta), degrees(psi), *np.round(angle, 3).tolist(),
                       *np.round(u, 3).tolist())
        for theta, psi, angle, u in zip(
            certificate.theta, certificate.psi, angles_arcsec, u_arcsec, strict=True
        )
    ]  # fmt: skip


def common_lab(certificate: Certificate) -> CommonAngles:
    """The systematic part of the simulator's certificate, which all positions share."""
    return CommonAngles(*np.round(arcsec_from_rad(certificate.u_systematic), 3).tolist())


def nominal_values(kind: GyroType) -> dict[str, Nominal]:
    """What the simulated type's gyros are drawn from, as a laboratory would round it."""
    return {
        name: Nominal(
            round(parameter_lab(name, getattr(kind.nominal, name)), 2),
            float(f"{parameter_lab(name, kind.spread[name]):.2g}"),
        )
        for name in PARAMETERS
    }


def errors_stated(bench: Bench) -> dict[str, float]:
    """Standard uncertainties that allow for the bench's errors of gain, zero and base; no more than it has.

    An ammeter's two channels are of one make: the larger error of both holds for either.
    """
    channels = bench.ammeter.channels
    gain_ppm = max(abs(channel.gain - 1.0) for channel in channels) * 1e6
    offset_ma = max(abs(float(ma_from_ampere(channel.offset))) for channel in channels)
    level_1, level_2, azimuth = (abs(float(arcsec_from_rad(angle))) for angle in bench.stand.base)
    found = {
        "u_gain_x_ppm": gain_ppm, "u_gain_y_ppm": gain_ppm, "u_offset_x_ma": offset_ma, "u_offset_y_ma": offset_ma,
        "u_level_1_arcsec": level_1, "u_level_2_arcsec": level_2, "u_azimuth_arcsec": azimuth,
    }  # fmt: skip
    return {key: float(f"{value:.4g}") for key, value in found.items() if value}


def records_lab(positions: Sequence[SimulatedPosition]) -> list[CurrentRecord]:
    """Simulated records in laboratory units."""
    return [
        CurrentRecord(
            degrees(item.theta), degrees(item.psi), item.t, ma_from_ampere(item.jx), ma_from_ampere(item.jy),
            item.repeat, temperature_c=celsius(item.temperature),
        )
        for item in positions
    ]  # fmt: skip


def truth_values(gyro: Gyro) -> dict[str, float]:
    """A gyro's true parameters by name, in laboratory units."""
    return {name: parameter_lab(name, getattr(gyro, name)) for name in PARAMETERS}


def degrees(angle: float) -> float:
    """A commanded angle in degrees as a person writes it, without what the conversion left."""
    return round(float(deg_from_rad(angle)), 9)


def celsius(temperature: float | None) -> float | None:
    """A temperature, K, in °C to the millikelvin."""
    return None if temperature is None else round(temperature - ZERO_CELSIUS, 3)


def _seed_of(name: str) -> int:
    return zlib.crc32(name.encode())
