import json
from dataclasses import replace

import numpy as np
import pytest

from app.exchange.attitude import attitude_json
from app.exchange.json_values import dumps
from solver.estimators.stand_attitude import StandAttitude

ARCSEC = np.pi / 180 / 3600
ATTITUDE = StandAttitude(
    level_north=12.0 * ARCSEC,
    u_level_north=30.0 * ARCSEC,
    azimuth=-7.0 * ARCSEC,
    u_azimuth=25.0 * ARCSEC,
    correlation=-0.95,
    u_certificate=np.array([0.3, 0.2]) * ARCSEC,
    dof=np.inf,
    # 1 arcsec turns: 2 rad/(s·A) per rad for kx; 3e-4 rad/s per rad for wg.
    level_east=np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3e-4, np.nan]),
)


def test_angles_are_in_arcsec_and_what_is_unknown_is_null():
    found = json.loads(dumps(attitude_json(ATTITUDE)))
    east = found.pop("level_east")
    assert found.pop("dof") is None
    # Rounding of two factors.
    assert found == pytest.approx(
        {
            "azimuth_arcsec": -7.0, "u_azimuth_arcsec": 25.0, "level_north_arcsec": 12.0,
            "u_level_north_arcsec": 30.0, "u_certificate_azimuth_arcsec": 0.2,
            "u_certificate_level_north_arcsec": 0.3, "correlation": -0.95,
        },
        rel=1e-12,
    )  # fmt: skip
    # A rad is 206264.806 arcsec, and a rad/s as many °/h; 1 rad/(s·A) is 206.264806 °/h/mA.
    assert east["kx"] == pytest.approx(2.0 * 206.264806 / 206264.806, rel=1e-8)
    assert east["wg"] == pytest.approx(3e-4, rel=1e-8)
    assert east["wk"] is None
    assert list(east) == ["kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk"]


def test_positions_that_show_nothing_give_nulls_and_no_attitude_gives_null():
    blind = replace(ATTITUDE, azimuth=np.nan, u_azimuth=np.nan, correlation=np.nan, dof=22.0)
    found = attitude_json(blind)
    assert (found["azimuth_arcsec"], found["u_azimuth_arcsec"], found["correlation"]) == (None, None, None)
    assert found["dof"] == 22.0
    assert attitude_json(None) is None
