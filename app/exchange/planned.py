"""A plan's question from laboratory units to the solver's SI records, and lists of positions as people write them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from app.errors import Invalid, problem
from app.exchange.numbers import typed
from app.exchange.positions import Positions
from app.exchange.rows import CertificateRow
from app.exchange.si import parameter_si
from app.exchange.uncertainties import Statement, common_uncertainty
from solver import units
from solver.positions.planning import Circumstances, NoiseModel, Places
from solver.records import PARAMETERS

NOISE_OVER_S: Final = 60.0
"""Time over which a stated noise of a mean holds, s: the method's own."""

_BETWEEN: Final = re.compile(r"[\s;,]+")
_U: Final = ("u_alpha_arcsec", "u_beta_arcsec", "u_gamma_arcsec")


def listed_positions(text: str, column: str) -> tuple[tuple[float, float], ...]:
    """Read positions as they are typed: ``0/0 0/90 90/180``, θ/ψ in degrees, any separators.

    Raises
    ------
    Invalid
        With a problem for every piece that is no position.
    """
    found, wrong = [], []
    for piece in _BETWEEN.split(text.strip()):
        theta, slash, psi = piece.partition("/")
        if not slash:
            wrong.append(problem("bad-position", "“%(text)s” is no position; write θ/ψ in degrees, such as 90/180.",
                                 column=column, text=piece[:40]))  # fmt: skip
            continue
        try:
            found.append(tuple(typed(angle, "deg", column=column) % 360.0 for angle in (theta, psi)))
        except Invalid as error:
            wrong.extend(error.problems)
    if wrong:
        raise Invalid(*wrong)
    return tuple((theta, psi) for theta, psi in found)


def grid_positions(step_deg: float) -> tuple[tuple[float, float], ...]:
    """Every θ with every ψ of a full grid, θ outer."""
    angles = [step_deg * number for number in range(round(360.0 / step_deg))]
    return tuple((theta, psi) for theta in angles for psi in angles)


def certified_rows(
    positions: Iterable[tuple[float, float]], certificate: Sequence[CertificateRow]
) -> tuple[CertificateRow, ...]:
    """The certificate's row of each position.

    A position that it lacks is taken without misalignment, and as well known as its positions are on
    average: otherwise an unknown position would look better than a certified one.
    """
    known = Positions()
    by_number = {known.put(row.theta_deg, row.psi_deg): row for row in certificate}
    typical = [_typical(certificate, name) for name in _U]
    found = []
    for theta, psi in positions:
        number = known.find(theta, psi)
        missing = CertificateRow(theta, psi, 0.0, 0.0, 0.0, *typical)
        found.append(missing if number is None else by_number[number])
    return tuple(found)


def _typical(certificate: Sequence[CertificateRow], name: str) -> float:
    given = [getattr(row, name) or 0.0 for row in certificate]
    return float(np.sqrt(np.mean(np.square(given)))) if given else 0.0


def places_si(rows: Sequence[CertificateRow]) -> Places:
    """Positions with their certified angles; an uncertainty that is not given counts as none."""

    def column(name: str, factor: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.array([(getattr(row, name) or 0.0) * factor for row in rows], dtype=np.float64)

    degree, arcsec = units.rad_from_deg(1.0), units.rad_from_arcsec(1.0)
    angles = [column(f"{name}_arcsec", arcsec) for name in ("alpha", "beta", "gamma")]
    return Places(
        column("theta_deg", degree),
        column("psi_deg", degree),
        *angles,
        *[column(name, arcsec) for name in _U],
    )


def circumstances_si(
    nominal: Mapping[str, float],
    latitude_deg: float,
    noise_deg_per_h: float,
    floor_deg_per_h: float,
    statement: Statement,
) -> Circumstances:
    """What is to be measured, and where.

    Parameters
    ----------
    nominal
        All eight parameters, in laboratory units.
    latitude_deg
    noise_deg_per_h
        Standard uncertainty of a mean over `NOISE_OVER_S`, as a rate.
    floor_deg_per_h
        What no longer measuring takes away, as a rate.
    statement
        Of what all positions have in common (`app.exchange.uncertainties`).

    Raises
    ------
    InputError
        A noise that is negative or zero altogether, scale factors by which no current answers a rate.
    """
    parameters = np.array([parameter_si(name, nominal[name]) for name in PARAMETERS])
    kx, ky, kxy, kyx = parameters[:4]
    scale = abs(kx * ky - kxy * kyx) ** 0.5
    # With no scale there is no noise either; the solver says which of the two is wrong.
    white, floor = (
        units.rad_per_s_from_deg_per_h(rate) / scale if scale else 1.0
        for rate in (noise_deg_per_h, floor_deg_per_h)
    )
    return Circumstances(
        parameters,
        units.rad_from_deg(latitude_deg),
        NoiseModel(white * NOISE_OVER_S**0.5, floor),
        common_uncertainty(statement),
    )
