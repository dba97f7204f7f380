"""A laboratory's statement of what all positions share: every complaint, and its units."""

import json
import math
from typing import Any

import numpy as np
import pytest

from app.errors import Invalid
from app.exchange.uncertainties import UNCERTAINTY_KEYS, common_uncertainty, read_uncertainties, tidy
from solver.inputs import COMMON
from solver.records import PARAMETERS

ARCSEC = math.pi / 648_000  # rad, by definition: 180 · 3600 arcseconds are π


def told(statement: Any) -> list[tuple[str, str | None]]:
    """Code and JSON pointer of every complaint about a statement."""
    with pytest.raises(Invalid) as error:
        common_uncertainty(statement)
    return [(item.message.code, item.column) for item in error.value.problems]


def test_nothing_stated_is_exact() -> None:
    common = common_uncertainty({})
    assert not common.standard.any()
    assert np.array_equal(common.correlation, np.eye(len(COMMON)))
    assert np.isinf(common.dof).all()
    assert not common.temperature_coefficients.any()


@pytest.mark.parametrize(
    ("key", "name", "value", "expected"),
    [
        ("u_gain_x_ppm", "gain_x", 50, 50e-6),
        ("u_gain_y_ppm", "gain_y", 20, 20e-6),
        ("u_offset_x_ma", "offset_x", 2e-6, 2e-9),  # 2 nA
        ("u_offset_y_ma", "offset_y", 3, 3e-3),
        ("u_alpha_common_arcsec", "alpha", 0.3, 0.3 * ARCSEC),
        ("u_beta_common_arcsec", "beta", 1, ARCSEC),
        ("u_gamma_common_arcsec", "gamma", 60, 60 * ARCSEC),
        ("u_level_1_arcsec", "level_1", 2, 2 * ARCSEC),
        ("u_level_2_arcsec", "level_2", 3, 3 * ARCSEC),
        ("u_azimuth_arcsec", "azimuth", 3600, math.pi / 180),  # one degree
        ("u_latitude_arcsec", "latitude", 1, ARCSEC),
        ("u_gravity_ppm", "gravity", 5, 5e-6),
        ("u_temperature_k", "temperature", 0.5, 0.5),
    ],
)
def test_each_key_in_si(key: str, name: str, value: float, expected: float) -> None:
    standard = common_uncertainty({key: value}).standard
    # Two products of binary64 at most: a few units of its last place.
    assert standard[COMMON.index(name)] == pytest.approx(expected, rel=1e-15)
    assert np.count_nonzero(standard) == 1


def test_every_input_has_its_key() -> None:
    assert sorted(name for name, _ in UNCERTAINTY_KEYS.values()) == sorted(COMMON)


def test_correlations_dof_and_coefficients() -> None:
    common = common_uncertainty(
        {
            "u_gain_x_ppm": 50,
            "u_gain_y_ppm": 50,
            "correlations": [{"between": ["gain_y", "gain_x"], "coefficient": 0.9}],
            "dof": {"azimuth": 8},
            "temperature_coefficients": {"kx": 0.36, "w0y": 1.0, "wk": -2.0},
        }
    )
    x, y = COMMON.index("gain_x"), COMMON.index("gain_y")
    assert common.correlation[x, y] == common.correlation[y, x] == 0.9
    # 0.9 · (50·10⁻⁶)²; a few roundings.
    assert common.covariance[x, y] == pytest.approx(2.25e-9, rel=1e-14)
    assert common.dof[COMMON.index("azimuth")] == 8
    assert np.count_nonzero(np.isinf(common.dof)) == len(COMMON) - 1
    # 1 °/h is (π/180)/3600 rad/s, 1 °/h/mA a thousand times that per ampere.
    rate = math.pi / 648_000
    expected = dict.fromkeys(PARAMETERS, 0.0) | {"kx": 0.36 * rate * 1e3, "w0y": rate, "wk": -2 * rate}
    assert common.temperature_coefficients == pytest.approx(list(expected.values()), rel=1e-14)


@pytest.mark.parametrize("value", ["50", True, [50], {}, math.nan, math.inf, -1e-9, 1.1e9, 10**400])
def test_what_is_no_uncertainty(value: Any) -> None:
    assert told({"u_gain_x_ppm": value}) == [("not-a-number", "/u_gain_x_ppm")]


@pytest.mark.parametrize(
    ("statement", "code", "pointer"),
    [
        ({"u_gain_ppm": 1}, "unknown-key", "/u_gain_ppm"),
        ({"a/b~c": 1}, "unknown-key", "/a~1b~0c"),
        ({"dof": 8}, "not-an-object", "/dof"),
        ({"dof": []}, "not-an-object", "/dof"),
        ({"dof": {"azimut": 8}}, "unknown-key", "/dof/azimut"),
        ({"dof": {"azimuth": 0}}, "not-a-number", "/dof/azimuth"),
        ({"dof": {"azimuth": -1}}, "not-a-number", "/dof/azimuth"),
        ({"dof": {"azimuth": "many"}}, "not-a-number", "/dof/azimuth"),
        ({"temperature_coefficients": {"kz": 1}}, "unknown-key", "/temperature_coefficients/kz"),
        ({"temperature_coefficients": {"kx": "1"}}, "not-a-number", "/temperature_coefficients/kx"),
        ({"correlations": {}}, "bad-correlation", "/correlations"),
        ({"correlations": "gain"}, "bad-correlation", "/correlations"),
        ({"correlations": [0.9]}, "bad-correlation", "/correlations/0"),
        ({"correlations": [{"between": ["gain_x"], "coefficient": 0.9}]}, "bad-correlation", "/correlations/0"),
        ({"correlations": [{"between": "gain_x gain_y", "coefficient": 0.9}]}, "bad-correlation", "/correlations/0"),
        ({"correlations": [{"between": ["gain_x", "gain_x"], "coefficient": 1}]}, "bad-correlation", "/correlations/0"),
        ({"correlations": [{"between": ["gain_x", "gainy"], "coefficient": 1}]}, "bad-correlation", "/correlations/0"),
        ({"correlations": [{"between": [[1], {}], "coefficient": 1}]}, "bad-correlation", "/correlations/0"),
        ({"correlations": [{"between": ["gain_x", "gain_y"]}]}, "bad-correlation", "/correlations/0"),
        (
            {"correlations": [{"between": ["gain_x", "gain_y"], "coefficient": None}]},
            "bad-correlation",
            "/correlations/0",
        ),
        (
            {"correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 0.9, "note": ""}]},
            "bad-correlation",
            "/correlations/0",
        ),
        (
            {"correlations": [{"between": ["gain_x", "gain_y"], "coefficient": 1.01}]},
            "not-a-number",
            "/correlations/0/coefficient",
        ),
        (
            {
                "correlations": [
                    {"between": ["gain_x", "gain_y"], "coefficient": 0.9},
                    {"between": ["gain_y", "gain_x"], "coefficient": 0.1},
                ]
            },
            "repeated-correlation",
            "/correlations/1",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_stated(statement: dict[str, Any], code: str, pointer: str) -> None:
    assert told(statement) == [(code, pointer)]


def test_correlations_that_contradict_one_another() -> None:
    # x goes with y and y with z, but x against z: the matrix has the eigenvalue 1 − 2·0.9 < 0.
    pairs = {("gain_x", "gain_y"): 0.9, ("gain_y", "azimuth"): 0.9, ("gain_x", "azimuth"): -0.9}
    listed = [{"between": list(pair), "coefficient": value} for pair, value in pairs.items()]
    assert told({"correlations": listed}) == [("bad-correlation", None)]
    # Without the third its coefficient is 0, and 1 − 0.9·√2 < 0 still; with 0.7 the smallest is 1 − 0.7·√2 > 0.
    assert told({"correlations": listed[:2]}) == [("bad-correlation", None)]
    weaker = [entry | {"coefficient": 0.7} for entry in listed[:2]]
    assert common_uncertainty({"correlations": weaker}).correlation[0, COMMON.index("azimuth")] == 0


def test_all_that_is_wrong_is_said_at_once() -> None:
    found = told({"u_gain_x_ppm": -1, "u_gravity_ppm": "5", "dof": {"azimuth": 0}, "other": 1})
    assert {pointer for _, pointer in found} == {"/u_gain_x_ppm", "/u_gravity_ppm", "/dof/azimuth", "/other"}


def test_a_file_is_named_in_every_problem() -> None:
    statement = {"u_gain_x_ppm": 50, "dof": {"gain_x": 12}}
    assert read_uncertainties(json.dumps(statement).encode(), "stand.json") == statement
    for data in (
        b'{"u_gain_x_ppm": -1}',
        b'{"u_gain_x_ppm": 1, "u_gain_x_ppm": 2}',
        b"[]",
        b"{",
        b'{"dof": 3}',
    ):
        with pytest.raises(Invalid) as error:
            read_uncertainties(data, "stand.json")
        assert {item.file for item in error.value.problems} == {"stand.json"}


def test_tidy_drops_what_says_nothing() -> None:
    statement = {"dof": {}, "correlations": [], "u_gravity_ppm": 0, "u_gain_x_ppm": 5, "u_gain_y_ppm": None}
    assert list(tidy(statement).items()) == [("u_gain_x_ppm", 5), ("u_gravity_ppm", 0)]
