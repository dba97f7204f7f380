"""Rows in laboratory units, as every reader gives them and every writer takes them."""

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class CertificateRow:
    """Certified misalignment of one position; uncertainties are standard uncertainties."""

    theta_deg: float
    psi_deg: float
    alpha_arcsec: float
    beta_arcsec: float
    gamma_arcsec: float
    u_alpha_arcsec: float | None = None
    u_beta_arcsec: float | None = None
    u_gamma_arcsec: float | None = None


@dataclass(frozen=True, slots=True)
class MeansRow:
    """Mean torquer currents of one measured position. `repeat` counts from 0.

    `dof_jx` and `dof_jy` are the degrees of freedom of the uncertainties, None where they are not known.
    `line` is where the row stood in its file, for problems found later; it is no part of the value.
    """

    theta_deg: float
    psi_deg: float
    jx_ma: float
    jy_ma: float
    u_jx_ma: float | None = None
    u_jy_ma: float | None = None
    duration_s: float | None = None
    rate_hz: float | None = None
    started_at: datetime | None = None
    temperature_c: float | None = None
    repeat: int = 0
    dof_jx: float | None = None
    dof_jy: float | None = None
    line: int | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class CurrentRecord:
    """Sampled currents at one position: three arrays of one length, s and mA."""

    theta_deg: float
    psi_deg: float
    t_s: NDArray[np.float64]
    jx_ma: NDArray[np.float64]
    jy_ma: NDArray[np.float64]
    repeat: int = 0
    started_at: datetime | None = None
    temperature_c: float | None = None


@dataclass(frozen=True, slots=True)
class Facts:
    """What a session's own files say about it (`session.json`); None where they are silent."""

    gyro: str | None = None
    stand: str | None = None
    latitude_deg: float | None = None
    certificate: str | None = None
    started_at: datetime | None = None
    temperature_c: float | None = None
    further: dict[str, Any] | None = None
