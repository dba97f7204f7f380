"""A worked case by a route of its own: what a gyro of known parameters shows at certified positions."""

import numpy as np
from scipy.spatial.transform import Rotation

EARTH_DEG_PER_H = np.rad2deg(7.292115e-5) * 3600
FOUR = (0, 90, 180, 270)
SIXTEEN = [(theta, psi) for theta in FOUR for psi in FOUR]
OFF_GRID = [(theta + 17.25, psi - 31.5) for theta, psi in SIXTEEN]
TRUTH = {
    "kx": 2062.65,
    "ky": 2041.0,
    "kxy": 10.3,
    "kyx": -8.25,
    "w0x": 1.5,
    "w0y": -0.8,
    "wg": 6.0,
    "wk": 2.0,
}
REVERSED = TRUTH | {"kx": -1800.0, "ky": 1833.0}


def write_case(folder, places, latitude_deg, truth, spread_arcsec, shuffle=False):
    """A worked case by another route: laboratory units throughout, scipy's rotations, a 2×2 solve per position.

    The case is turned by θ about east, ψ about its own third axis, then α, β, γ about its own axes
    (intrinsic turns); a vector's case components are those of the inverse rotation.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(11)
    angles = np.round(rng.normal(0, spread_arcsec, (len(places), 3)), 3)
    turns = Rotation.from_euler("XZ", places, degrees=True) * Rotation.from_euler(
        "XYZ", angles / 3600, degrees=True
    )
    latitude = np.deg2rad(latitude_deg)
    rate = turns.inv().apply(EARTH_DEG_PER_H * np.array([0, np.cos(latitude), np.sin(latitude)]))
    up = turns.inv().apply([0.0, 0.0, 1.0])
    K = np.array([[truth["kx"], truth["kxy"]], [truth["kyx"], truth["ky"]]])
    rows = []
    for w, n in zip(rate, up, strict=True):
        drift = [
            truth["w0x"] + truth["wg"] * n[0] - truth["wk"] * n[1],
            truth["w0y"] + truth["wk"] * n[0] + truth["wg"] * n[1],
        ]
        rows.append(np.linalg.solve(K, w[:2] - drift))
    order = rng.permutation(len(places)) if shuffle else range(len(places))
    _write(
        folder / "certificate.csv",
        "alpha_arcsec,beta_arcsec,gamma_arcsec",
        places,
        angles,
        range(len(places)),
    )
    _write(folder / "currents.csv", "jx_ma,jy_ma", places, np.array(rows), order)
    return folder


def _write(path, columns, places, values, order):
    lines = [",".join(map(repr, (*places[n], *values[n].tolist()))) for n in order]
    path.write_text("\n".join([f"theta_deg,psi_deg,{columns}", *lines, ""]))
