"""How the stand's base stood in a session, as JSON in the laboratory's units."""

import numpy as np

from app.exchange.json_values import Json, finite
from app.exchange.si import parameter_lab
from solver.estimators.stand_attitude import StandAttitude
from solver.records import PARAMETERS
from solver.units import arcsec_from_rad, rad_from_arcsec


def attitude_json(attitude: StandAttitude | None) -> Json | None:
    """Write azimuth and level about north in arcsec, and what a turn about east does to each parameter.

    Each of the two is as if the other were zero; `correlation` is theirs, `dof` null where infinite. The
    `u_` without ``certificate`` are of the session's own noise. `level_east` is per arcsec. What the
    positions do not show is null.
    """
    if attitude is None:
        return None
    by_level, by_azimuth = attitude.u_certificate.tolist()
    angles = {
        "azimuth_arcsec": attitude.azimuth,
        "u_azimuth_arcsec": attitude.u_azimuth,
        "level_north_arcsec": attitude.level_north,
        "u_level_north_arcsec": attitude.u_level_north,
        "u_certificate_azimuth_arcsec": by_azimuth,
        "u_certificate_level_north_arcsec": by_level,
    }
    per_arcsec = attitude.level_east * rad_from_arcsec(1.0)
    return {
        **{name: finite(arcsec_from_rad(float(value))) for name, value in angles.items()},
        "correlation": finite(attitude.correlation),
        "dof": finite(attitude.dof),
        "level_east": {
            name: finite(parameter_lab(name, float(change)))
            for name, change in zip(PARAMETERS, np.asarray(per_arcsec), strict=True)
        },
    }
