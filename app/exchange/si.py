"""Rows in laboratory units to the solver's SI records, and its parameters back: the only such place."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid, Problem
from app.exchange.means import match
from app.exchange.positions import Positions
from app.exchange.problems import refuse
from app.exchange.rows import CertificateRow, MeansRow
from solver import units
from solver.errors import InputError, Message
from solver.records import PARAMETERS, Array, Observations

PARAMETER_UNITS: Final = {
    **dict.fromkeys(("kx", "ky", "kxy", "kyx"), ("deg/h/mA", "rad/(s·A)")),
    **dict.fromkeys(("w0x", "w0y"), ("deg/h", "rad/s")),
    **dict.fromkeys(("wg", "wk"), ("deg/h/g", "rad/s/g")),
}
"""Unit of each parameter in the laboratory and in SI, as text."""


def parameter_si(name: str, value: float) -> float:
    """One parameter from the laboratory's unit to SI."""
    return (
        units.scale_from_deg_per_h_per_ma(value) if _is_scale(name) else units.rad_per_s_from_deg_per_h(value)
    )


def parameter_lab(name: str, value: float) -> float:
    """One parameter from SI to the laboratory's unit."""
    return (
        units.deg_per_h_per_ma_from_scale(value) if _is_scale(name) else units.deg_per_h_from_rad_per_s(value)
    )


def _is_scale(name: str) -> bool:
    return PARAMETER_UNITS[name][0] == "deg/h/mA"


def covariance_lab(covariance: Array) -> Array:
    """Covariance (8, 8) of the parameters from SI to laboratory units, same order."""
    sizes = np.array([parameter_lab(name, 1.0) for name in PARAMETERS])
    return np.asarray(covariance * np.outer(sizes, sizes), dtype=np.float64)


def observations(
    means: Sequence[MeansRow],
    certificate: Sequence[CertificateRow],
    latitude_deg: float,
    *,
    file: str | None = None,
) -> Observations:
    """Join the measured means with the certified angles, in SI, sorted for the solver.

    Positions are taken as the certificate writes them; a measured one matches within 1e-6°. The
    uncertainties of the currents count only when every row has both: see `incomplete_uncertainties`.

    Parameters
    ----------
    means, certificate
        In any order.
    latitude_deg
        Of the stand, degrees, south negative.
    file
        Name of the file of means, for the problems.

    Raises
    ------
    Invalid
        No row at all, a latitude beyond ±90°, or a problem for each row whose position the
        certificate lacks.
    """
    if not means:
        raise refuse("no-rows", "There is no measured position. Bring at least one.", file=file)
    if not abs(latitude_deg) <= 90.0:
        raise refuse(
            "bad-latitude",
            "The latitude %(latitude)g° does not lie between −90° and 90°. South is negative.",
            column="latitude_deg",
            latitude=latitude_deg,
        )
    problems, _ = match(means, certificate, file=file)
    if problems:
        raise Invalid(*problems)
    try:
        return _observations(means, _angles_of(means, certificate), latitude_deg)
    except InputError as error:
        raise Invalid(Problem(error.message, file=file)) from error


def _angles_of(means: Sequence[MeansRow], certificate: Sequence[CertificateRow]) -> list[CertificateRow]:
    """The certificate's row for each row of means."""
    known = Positions()
    by_number = {known.put(entry.theta_deg, entry.psi_deg): entry for entry in reversed(certificate)}
    return [by_number[known.put(row.theta_deg, row.psi_deg)] for row in means]


def _observations(
    means: Sequence[MeansRow], angles: Sequence[CertificateRow], latitude_deg: float
) -> Observations:
    u_jx = _column([row.u_jx_ma for row in means])
    u_jy = _column([row.u_jy_ma for row in means])
    uncertain = not (np.isnan(u_jx).any() or np.isnan(u_jy).any())
    return Observations.sorted_from(
        theta=units.rad_from_deg(_column([row.theta_deg for row in angles])),
        psi=units.rad_from_deg(_column([row.psi_deg for row in angles])),
        repeat=np.array([row.repeat for row in means], dtype=np.int64),
        alpha=units.rad_from_arcsec(_column([row.alpha_arcsec for row in angles])),
        beta=units.rad_from_arcsec(_column([row.beta_arcsec for row in angles])),
        gamma=units.rad_from_arcsec(_column([row.gamma_arcsec for row in angles])),
        jx=units.ampere_from_ma(_column([row.jx_ma for row in means])),
        jy=units.ampere_from_ma(_column([row.jy_ma for row in means])),
        u_jx=units.ampere_from_ma(u_jx) if uncertain else None,
        u_jy=units.ampere_from_ma(u_jy) if uncertain else None,
        duration=_column([row.duration_s for row in means]),
        rate=_column([row.rate_hz for row in means]),
        time=_times(means),
        u_alpha=_uncertain_angle([row.u_alpha_arcsec for row in angles]),
        u_beta=_uncertain_angle([row.u_beta_arcsec for row in angles]),
        u_gamma=_uncertain_angle([row.u_gamma_arcsec for row in angles]),
        dof_jx=_freedom([row.dof_jx for row in means]),
        dof_jy=_freedom([row.dof_jy for row in means]),
        latitude=units.rad_from_deg(float(latitude_deg)),
    )


def _column(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Values as float64, NaN for None; −0 becomes 0, so that equal numbers have equal bits."""
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64) + 0.0


def _times(means: Sequence[MeansRow]) -> NDArray[np.float64]:
    """Middle of each measurement, s since the first began; NaN where its beginning is not known."""
    begun = [row.started_at for row in means if row.started_at is not None]
    first = min(begun, default=None)
    return np.array(
        [
            np.nan
            if row.started_at is None or first is None
            else (row.started_at - first).total_seconds() + (row.duration_s or 0.0) / 2
            for row in means
        ]
    )


def _uncertain_angle(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Standard uncertainties of certified angles, rad; what is not stated counts as none."""
    return units.rad_from_arcsec(np.nan_to_num(_column(values)))


def _freedom(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([np.inf if value is None else value for value in values], dtype=np.float64)


def incomplete_uncertainties(means: Sequence[MeansRow]) -> Message | None:
    """Warn when u(J) is given for some rows only: `observations` then uses none of them."""
    given = sum(row.u_jx_ma is not None and row.u_jy_ma is not None for row in means)
    partly = any(row.u_jx_ma is not None or row.u_jy_ma is not None for row in means)
    if not partly or given == len(means):
        return None
    return Message(
        "uncertainty-incomplete",
        "The uncertainties of the currents are given for %(given)d of %(all)d measurements and are not used. "
        "Give u_jx_ma and u_jy_ma for every one.",
        {"given": given, "all": len(means)},
    )
