"""What stands beside the numbers of a result in a terminal."""

import pytest

from app.cli.tables import taken_as_exact


@pytest.mark.parametrize(
    ("stated", "exact"),
    [
        (
            {},
            ["gain of the ammeter", "offset of the ammeter", "certified angles, in common", "level of the base",
             "azimuth of the base", "latitude", "gravity", "temperature"],
        ),
        (
            {"u_gain_x_ppm": 300, "u_offset_x_ma": 0, "u_alpha_common_arcsec": 1, "u_level_2_arcsec": 2,
             "u_azimuth_arcsec": 10, "u_latitude_arcsec": 1, "dof": {"gravity": 5}, "u_temperature_k": 0.5},
            ["offset of the ammeter", "gravity"],
        ),
    ],
)  # fmt: skip
def test_what_nobody_stated_is_named(stated, exact):
    assert taken_as_exact({"method": "paper", "stated": {"uncertainties": stated}}) == exact
