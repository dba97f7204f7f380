import httpx


def test_a_session_from_nothing_to_its_queue(stand: httpx.Client, session_id: int, noted) -> None:
    for theta in (0, 90, 180, 270):
        for psi in (0, 90, 180, 270):
            body = {"jx_ma": 0.004536, "jy_ma": -0.002117, "duration_s": 60, "rate_hz": 200}
            answer = stand.put(f"/sessions/{session_id}/positions/{theta}/{psi}/means", json=body)
            assert answer.status_code == 201, answer.text
    assert stand.get(f"/sessions/{session_id}").json()["state"] == "ready"
    asked = stand.post(f"/sessions/{session_id}/calibrations", json={"method": "both"})
    assert asked.status_code == 202
    assert asked.headers["location"] == f"/api/v1/jobs/{asked.json()['id']}"
    job = stand.get(asked.headers["location"].removeprefix("/api/v1")).json()
    assert (job["state"], job["progress"], job["result"], job["error"]) == ("queued", 0.0, None, None)
    assert noted.queued == [job["id"]]
