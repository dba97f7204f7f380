"""GET /stands/{name}/plan: what it answers, and what it refuses."""

import httpx
import pytest


def test_the_certificate_is_judged_without_a_word(stand: httpx.Client) -> None:
    answer = stand.get("/stands/S1/plan")
    assert answer.status_code == 200
    found = answer.json()
    assert (found["stand"], found["certificate"], found["counts"], found["trade"]) == ("S1", "C-17", [], None)
    assert found["plan"]["count"] == 16
    assert found["plan"]["search"] is None
    assert [item["name"] for item in found["plan"]["parameters"]] == [
        "kx", "ky", "kxy", "kyx", "w0x", "w0y", "wg", "wk",
    ]  # fmt: skip
    assert all(item["u"] > 0 for item in found["plan"]["parameters"])


def test_the_best_are_proposed(stand: httpx.Client) -> None:
    query = {"count": 6, "criterion": "kx", "time_s": 1200, "moving_s": 30, "gyro": "0417", "counts": "true"}
    found = stand.get("/stands/S1/plan", params=query).json()
    assert found["plan"]["duration_s"] == 170.0
    assert found["plan"]["search"]["exhaustive"]
    assert found["plan"]["search"]["figure"] == pytest.approx(found["plan"]["parameters"][0]["u"], rel=1e-6)
    six = next(item for item in found["counts"] if item["count"] == 6)
    assert six["figure"] == pytest.approx(found["plan"]["search"]["figure"], rel=1e-3)  # a shorter search


def test_what_is_not_determined_is_null_and_said(stand: httpx.Client) -> None:
    found = stand.get("/stands/S1/plan", params={"positions": "0/0 90/90 180/0"}).json()["plan"]
    assert found["rank"] < 8
    assert None in [item["u"] for item in found["parameters"]]
    assert found["warnings"][0]["code"] == "unobservable"


def test_the_trade_is_a_front(stand: httpx.Client) -> None:
    trade = stand.get("/stands/S1/plan", params={"trade": "true"}).json()["trade"]
    u_k = [point["u_k_deg_per_h_per_ma"] for point in trade["front"]]
    u_g = [point["u_wg_deg_per_h_per_g"] for point in trade["front"]]
    assert u_k == sorted(u_k)
    assert u_g == sorted(u_g, reverse=True)
    assert {point["kind"] for point in trade["marked"]} == {"paper", "all", "plan"}


@pytest.mark.parametrize(
    ("query", "status", "parameter"),
    [
        ({"count": 3}, 422, "count"),
        ({"count": 17}, 422, "count"),
        ({"criterion": "E"}, 422, "criterion"),
        ({"grid_deg": 44, "count": 8}, 422, "grid_deg"),
        ({"positions": "here"}, 422, "positions"),
        ({"time_s": 100}, 422, "time_s"),
        ({"noise_deg_per_h": "inf"}, 422, "noise_deg_per_h"),
        ({"certificate": "C-99"}, 404, "certificate"),
        ({"gyro": "9999"}, 404, "gyro"),
        ({"type": "none"}, 404, "type"),
        ({"colour": "blue"}, 422, "colour"),
    ],
)
def test_what_cannot_be_planned_is_a_problem_document(
    stand: httpx.Client, query: dict[str, object], status: int, parameter: str
) -> None:
    answer = stand.get("/stands/S1/plan", params=query)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["errors"][0]["parameter"] == parameter
    assert stand.get("/stands/S9/plan").status_code == 404
