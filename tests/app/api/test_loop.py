"""GET /loop: what it answers, and what it refuses."""

import math

import httpx
import pytest

from simdevice.dynamics import GVK_6, LoopDynamics


def test_the_paper_s_loop_needs_no_word(stand: httpx.Client) -> None:
    answer = stand.get("/loop")
    assert answer.status_code == 200
    found = answer.json()
    assert found["stable"] is True
    assert found["verdict"]["code"] == "stable"
    assert found["parameters"]["t1_s"] == 0.015
    assert stand.get("/loop?type=").json() == found  # an empty part of a query is none
    poles = [complex(item["re_per_s"], item["im_rad_per_s"]) for item in found["poles"]]
    assert poles == list(LoopDynamics(GVK_6).poles)  # every bit
    assert found["margins"]["worse"]["gain_db"] == pytest.approx(16.16, abs=0.01)
    assert abs(found["margins"]["worse"]["phase_deg"]) == pytest.approx(49.02, abs=0.01)
    lengths = {len(found["step_response"][name]) for name in ("t_s", "alpha_rad", "measured_y_rad_per_s")}
    assert lengths == {1001}
    assert found["step_response"]["cut_off_s"] is None
    assert len({len(column) for column in found["frequency_response"].values()}) == 1


def test_an_unstable_loop_is_a_verdict_and_no_error(stand: httpx.Client) -> None:
    found = stand.get("/loop", params={"t1_s": 1.5e-3, "duration_s": 10}).json()
    assert found["stable"] is False
    assert found["verdict"]["code"] == "integral-time"
    assert "Lengthen T1" in found["verdict"]["message"]
    assert found["margins"] is None
    assert found["settling_time_s"] is None
    assert found["poles"][0]["time_constant_s"] is None
    steps = found["step_response"]
    assert steps["t_s"][-1] <= steps["cut_off_s"] < 10


def test_a_loop_without_integrator(stand: httpx.Client) -> None:
    found = stand.get("/loop", params={"t1_s": "inf"}).json()
    assert found["parameters"]["t1_s"] is None
    assert len(found["poles"]) == 4
    # −(ω − ωp)/K remains: nothing takes the deflection away.
    assert found["step_response"]["alpha_rad"][-1] == pytest.approx(-1 / 180, rel=1e-2)


def test_a_type_gives_its_scale_factor(stand: httpx.Client) -> None:
    nominals = {name: {"value": 1031.324, "standard_uncertainty": 10.0} for name in ("kx", "ky")}
    assert stand.put("/types/half/nominals", json={"nominals": nominals}).status_code == 200
    found = stand.get("/loop", params={"type": "half"}).json()
    expected = 1031.324 * math.pi / 180 / 3600 * 1000
    assert found["parameters"]["k_m_rad_per_s_per_a"] == pytest.approx(expected, rel=1e-5)
    assert stand.get("/loop", params={"type": "half", "k_m_rad_per_s_per_a": 7}).json()["gain_per_s"] == 126.0


@pytest.mark.parametrize(
    ("query", "status", "parameter"),
    [
        ({"h_n_m_s": 0}, 422, "h_n_m_s"),
        ({"a_kg_m2": -1}, 422, "a_kg_m2"),
        ({"a_kg_m2": 9}, 422, "a_kg_m2"),
        ({"t1_s": "nan"}, 422, "t1_s"),
        ({"t2_s": "inf"}, 422, "t2_s"),
        ({"k_u_a_per_v": "many"}, 422, "k_u_a_per_v"),
        ({"duration_s": 0}, 422, "duration_s"),
        ({"duration_s": "inf"}, 422, "duration_s"),
        ({"duration_s": 1e6}, 422, "duration_s"),
        ({"type": "none"}, 404, "type"),
        ({"colour": "blue"}, 422, "colour"),
    ],
    ids=lambda value: (
        "-".join(f"{key}={item}" for key, item in value.items()) if isinstance(value, dict) else None
    ),
)
def test_what_cannot_be_asked(
    stand: httpx.Client, query: dict[str, object], status: int, parameter: str
) -> None:
    answer = stand.get("/loop", params=query)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["errors"][0]["parameter"] == parameter
