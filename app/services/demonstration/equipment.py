"""What the demonstration's laboratory has: types, gyros, a stand with two certificates whose base turns once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Final

from app.exchange.rows import CertificateRow
from app.exchange.uncertainties import Statement
from app.services import gyros, stands
from app.services.lab import Work
from app.services.simulated import ammeter_off, certificate_lab, common_lab, deviations, nominal_values
from app.services.views import Nominal
from simdevice.ammeter import Ammeter
from simdevice.certificate import draw_certificate
from simdevice.fleet import FleetGyro
from simdevice.scenarios import LABORATORY_AMMETER, TYPES
from simdevice.stand import Stand
from solver.units import rad_from_arcsec, rad_from_deg

SEED: Final = 2026
STAND: Final = "S1"
LATITUDE_DEG: Final = 55.7558
CHECK_GYRO: Final = "0412"
TURNED_DAYS_AGO: Final = 65
TURN_ARCSEC: Final = 60.0
"""So much the base of the stand has turned about the vertical, and nobody has noticed."""
_LIMITS: Final = {
    "GVK-6": {"kx": (1980.0, 2140.0), "ky": (1960.0, 2120.0), "kxy": (-25.0, 25.0), "kyx": (-25.0, 25.0),
              "w0x": (-6.0, 6.0), "w0y": (-6.0, 6.0), "wg": (-15.0, 15.0), "wk": (-2.65, 2.65)},
    "DTG-4": {"kx": (790.0, 860.0), "ky": (790.0, 870.0), "kxy": (-20.0, 20.0), "kyx": (-20.0, 20.0),
              "w0x": (-14.0, 14.0), "w0y": (-14.0, 14.0), "wg": (-25.0, 25.0), "wk": (-12.0, 12.0)},
}  # fmt: skip
_INTERVAL_DAYS: Final = {"GVK-6": 90, "DTG-4": 60}
_REPEATABILITY: Final = {
    "GVK-6": {"w0x": 0.1, "w0y": 0.1, "wg": 0.06, "wk": 0.06},
    "DTG-4": {"w0x": 0.2, "w0y": 0.2, "wg": 0.12, "wk": 0.12},
}
UNCERTAINTY: Final[Statement] = {
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
class Era:
    """How the stand truly stands from a time on, and what its certificate says."""

    since: datetime
    stand: Stand
    rows: list[CertificateRow]


def register(work: Work, fleet: Sequence[FleetGyro]) -> None:
    """The types with what is expected of them, and the gyros."""
    for kind, limits in _LIMITS.items():
        gyros.set_limits(work, kind, limits, repeatability=_REPEATABILITY[kind])
        gyros.set_nominals(work, kind, _nominals(kind))
        gyros.set_interval(work, kind, _INTERVAL_DAYS[kind])
    for item in fleet:
        gyros.add_gyro(work, item.serial, item.kind.name, check=item.serial == CHECK_GYRO)


def _nominals(kind: str) -> dict[str, Nominal]:
    """What is expected of the type, and how it changes with the temperature."""
    return {
        name: item._replace(per_kelvin=_PER_KELVIN[kind].get(name))
        for name, item in nominal_values(TYPES[kind]).items()
    }


def equip(work: Work, now: datetime) -> list[Era]:
    """Stand S1 with two successive certificates; later its base turns, and no certificate says so."""
    off = deviations(SEED, UNCERTAINTY)
    base = (off["level_1"], off["level_2"], off["azimuth"])
    latitude = rad_from_deg(LATITUDE_DEG) + off["latitude"]
    first = Stand(latitude, draw_certificate(SEED), base, seed=SEED)
    stands.add_stand(work, STAND, LATITUDE_DEG, "Room 12, pier 1")
    stands.state_uncertainty(work, STAND, UNCERTAINTY)
    eras = [
        _certified(work, "C-16", first, now - timedelta(days=500)),
        _certified(work, "C-17", first.recertified(SEED + 1), now - timedelta(days=160)),
    ]
    turned = (*base[:2], base[2] + float(rad_from_arcsec(TURN_ARCSEC)))
    last = eras[-1]
    return [*eras, Era(now - timedelta(days=TURNED_DAYS_AGO), replace(last.stand, base=turned), last.rows)]


def _certified(work: Work, number: str, stand: Stand, begin: datetime) -> Era:
    rows = certificate_lab(stand.certificate)
    end = (begin + timedelta(days=365)).date()
    issuer, common = "Regional metrology centre", common_lab(stand.certificate)
    stands.add_certificate(work, STAND, number, begin.date(), end, rows, issuer, common)
    return Era(begin, stand, rows)


def era_of(eras: Sequence[Era], at: datetime) -> Era:
    """The stand as it is at a time."""
    return [era for era in eras if era.since.date() <= at.date()][-1]


def ammeter() -> Ammeter:
    """The laboratory's ammeter, off by as much as is stated of it."""
    return ammeter_off(LABORATORY_AMMETER, deviations(SEED, UNCERTAINTY))
