"""Answers of a service, and of what stands between."""

import httpx
import pytest

from app.errors import Invalid
from app.station.keeping.entries import Finding, Judged, Said, Started, Target
from app.station.keeping.history import Attempt
from app.station.sending import client
from app.station.sending.client import ServerRefused, Unreachable, asked, connected, followed, send, send_once
from app.station.sending.service import Service

PROXY = httpx.Response(200, html="<p>Please sign in to the network.</p>")


def answering(*answers: httpx.Response | Exception) -> httpx.Client:
    """A client whose requests are answered so, the last for ever."""
    left = list(answers)

    def handle(request: httpx.Request) -> httpx.Response:
        answer = left.pop(0) if len(left) > 1 else left[0]
        if isinstance(answer, Exception):
            raise answer
        return answer

    return httpx.Client(base_url="http://lab.example/api/v1", transport=httpx.MockTransport(handle))


@pytest.mark.parametrize(
    "server", ["not a url", "lab.example:8000", "http://", "ftp://lab.example", "http://lab.example:port"]
)
def test_what_is_no_address_is_not_waited_for(server):
    with pytest.raises(Invalid, match=r"--server: .* is not the address of a service"):
        connected(server, "token")


@pytest.fixture
def pauses(monkeypatch):
    found = []
    monkeypatch.setattr(client.time, "sleep", found.append)
    return found


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (httpx.ConnectError("refused"), "refused"),
        (httpx.ReadTimeout(""), "ReadTimeout"),
        (httpx.Response(502), "status 502"),
        (httpx.Response(429), "status 429"),
    ],
    ids=["no connection", "no answer", "gateway", "later"],
)
def test_an_absence_says_why(answer, why):
    with (
        answering(answer) as http,
        pytest.raises(Unreachable, match=rf"lab\.example.*does not answer \({why}\)"),
    ):
        send_once(http, "GET", "/jobs/1")


def test_a_refusal_comes_in_the_services_words():
    said = httpx.Response(422, json={"detail": "Certificate C has no position θ 45°."})
    with answering(said) as http, pytest.raises(ServerRefused, match="has no position") as refused:
        send_once(http, "PUT", "/sessions/1/positions/45/0/currents")
    assert refused.value.answered == 422


def test_a_refusal_without_words_asks_whether_that_is_the_service():
    with (
        answering(httpx.Response(404, html="<h1>404</h1>")) as http,
        pytest.raises(ServerRefused, match="is there a Drift"),
    ):
        send_once(http, "GET", "/jobs/1")


@pytest.mark.parametrize(
    "answer",
    [PROXY, httpx.Response(200, json=[]), httpx.Response(200, json={"id": 3})],
    ids=["page", "list", "other"],
)
def test_an_answer_of_somebody_else_acknowledges_nothing(answer):
    with answering(answer) as http, pytest.raises(Unreachable, match="no Driftbook"):
        asked(http, "PUT", "/sessions/1/positions/0/0/currents", "record_sha256")


def test_patience_ends(pauses):
    with answering(httpx.ConnectError("away")) as http, pytest.raises(Unreachable):
        send(http, "GET", "/jobs/1")
    assert pauses == [0.5, 1.0, 2.0, 4.0, 8.0]


def test_a_service_that_comes_back_is_waited_for(pauses):
    with answering(httpx.ConnectError("away"), httpx.Response(503), httpx.Response(200, json={})) as http:
        assert send(http, "GET", "/jobs/1").status_code == 200
    assert pauses == [0.5, 1.0]


def test_a_job_is_followed_to_its_result(pauses):
    done = {"id": "j", "state": "succeeded", "result": "/api/v1/calibrations/7"}
    with answering(
        httpx.Response(200, json={"id": "j", "state": "running"}), httpx.Response(200, json=done)
    ) as http:
        assert followed(http, {"id": "j", "state": "queued"}) == "/api/v1/calibrations/7"


@pytest.mark.parametrize(("error", "why"), [({"detail": "rank 7"}, "rank 7"), (None, "cancelled")])
def test_a_job_without_a_result_says_why(error, why):
    with answering(PROXY) as http, pytest.raises(ServerRefused, match=f"gave no result: {why}"):
        followed(http, {"id": "j", "state": "cancelled", "error": error})


def test_a_record_is_brought_with_what_the_checks_said_of_it():
    sent = []

    def answer(request: httpx.Request) -> httpx.Response:
        sent.append(dict(request.url.params))
        return httpx.Response(201, json={"record_sha256": "0"})

    service = Service("http://lab", "token")
    service._client = httpx.Client(base_url="http://lab/api/v1", transport=httpx.MockTransport(answer))
    noise = Finding(Said("noise", "Jx scatters by %(noise)d nA.", {"noise": 300}), "suspicious")
    for findings in ((), (noise, noise)):
        started = Started(0, Target(0.0, 90.0), 0)
        service.put_record(5, Attempt(started, judged=Judged(0, "accepted", findings)), b"")
    service.close()
    assert [params.get("note") for params in sent] == [None, "suspicious: Jx scatters by 300 nA."]
