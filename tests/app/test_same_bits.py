"""The same decimal means, by whatever way and in whatever order they come, give the same bits."""

import math
import random
from collections.abc import Callable
from datetime import timedelta
from decimal import Decimal

import httpx
import pytest

from app.cli import main
from app.exchange.rows import CertificateRow
from app.services import access, calibrations, jobs
from app.services.access import SYSTEM
from app.services.computing import calibrate
from app.services.ledger import JobLedger
from app.services.simulated import Conditions, bench_for
from simdevice.bench import mean_currents
from simdevice.certificate import sixteen_positions
from solver.units import ma_from_ampere

PLACES = [(theta, psi) for theta in (0, 90, 180, 270) for psi in (0, 90, 180, 270)]
# As instruments and people write them: all digits, few digits, an exponent, more digits than a float has.
WRITINGS = [repr, "{:.7f}".format, "{:.9e}".format, "{:.25f}".format]


@pytest.fixture(scope="module")
def means() -> dict[tuple[int, int], tuple[str, str]]:
    """Currents of a gyro, mA, as decimal texts."""
    rows = [CertificateRow(theta, psi, 6.9, -16.4, 6.6) for theta, psi in PLACES]
    bench = bench_for(Conditions("GVK-6", "0417", "S1", 1, seed=4), rows, 55.7558)
    found = mean_currents(bench, sixteen_positions())
    pairs = zip(ma_from_ampere(found.jx).tolist(), ma_from_ampere(found.jy).tolist(), strict=True)
    return {
        place: (WRITINGS[n % 4](jx_ma), WRITINGS[(n + 1) % 4](jy_ma))
        for n, (place, (jx_ma, jy_ma)) in enumerate(zip(PLACES, pairs, strict=True))
    }


@pytest.fixture
def browser(service) -> httpx.Client:
    """Somebody signed in."""
    with service.lab.write(SYSTEM) as work:
        access.add_account(work, "petrova", "technician")
        link = access.make_sign_in_link(work, "petrova", timedelta(hours=1))
    client = service.client(None, path="")
    client.headers["sec-fetch-site"] = "same-origin"
    assert client.get(f"/sign-in/link/{link}").status_code == 303
    return client


def solved(service, session_id: int) -> tuple[str, list[str]]:
    """The input's hash and the parameters of both methods, to the bit."""
    with service.lab.write(SYSTEM) as work:
        job = calibrations.request(work, session_id, "both").id
    ledger = JobLedger(service.lab)
    ledger.succeed(job, calibrate(ledger.begin(job).payload, lambda fraction, phase: None))
    with service.lab.read(SYSTEM) as work:
        result = calibrations.calibration(work, jobs.job(work, job).calibration).result
    answers = [result["least-squares"], result["paper"]]
    return result["input_hash"], [
        entry["value_si"].hex() for answer in answers for entry in answer["parameters"].values()
    ]


def opened(client: httpx.Client) -> int:
    return int(client.post("/sessions", json={"gyro": "0417", "stand": "S1"}).json()["id"])


def sent_as_json(service, stand, browser, means, tmp_path, order) -> int:
    session = opened(stand)
    for theta, psi in order:
        jx_ma, jy_ma = means[theta, psi]
        place = f"/sessions/{session}/positions/{theta}/{psi}/means"
        # The decimals as they are, as curl would send them: no float of ours in between.
        body = f'{{"jx_ma": {jx_ma}, "jy_ma": {jy_ma}, "duration_s": 60, "rate_hz": 200}}'
        assert stand.put(place, content=body, headers={"content-type": "application/json"}).status_code == 201
    return session


def uploaded(service, stand, browser, means, tmp_path, order, monkeypatch) -> int:
    lines = [f"{theta},{psi},{','.join(means[theta, psi])}" for theta, psi in order]
    (tmp_path / "means.csv").write_text("\n".join(["theta_deg,psi_deg,jx_ma,jy_ma", *lines, ""]))
    before = {item["id"] for item in stand.get("/sessions").json()["items"]}
    call = ["upload", tmp_path / "means.csv", "--gyro", "0417", "--stand", "S1", "--server", service.url]
    monkeypatch.setattr("sys.argv", ["driftbook", *map(str, call), "--token", service.tokens["both"]])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    (session,) = {item["id"] for item in stand.get("/sessions").json()["items"]} - before
    return int(session)


def typed(unit: str, factor: Decimal, write: Callable[[Decimal], str], origin: str) -> Callable[..., int]:
    def bring(service, stand, browser, means, tmp_path, order) -> int:
        session = opened(stand)
        for theta, psi in order:
            jx, jy = (write(Decimal(text) * factor) for text in means[theta, psi])
            form = {f"jx_{unit}": jx, f"jy_{unit}": jy, "duration_s": "", "note": "", "origin": origin}
            saved = browser.post(f"/sessions/{session}/rows/{theta}/{psi}/0?unit={unit}", data=form)
            assert saved.status_code < 400, saved.text
        return session

    return bring


def russian(value: Decimal) -> str:
    return f"{value:f}".replace(".", ",").replace("-", "−")


WAYS = {
    "json": sent_as_json,
    "typed in mA": typed("ma", Decimal(1), lambda value: f"{value:f}", "typed"),
    "typed in µA": typed("ua", Decimal(1000), lambda value: f"{value:f}", "typed"),
    "pasted with comma and true minus": typed("ua", Decimal(1000), russian, "pasted"),
}


@pytest.mark.parametrize("way", [*WAYS, "driftbook upload"])
def test_every_way_gives_the_bits_of_the_first(service, stand, browser, means, tmp_path, monkeypatch, way):
    first = solved(service, sent_as_json(service, stand, browser, means, tmp_path, PLACES))
    order = random.Random(way).sample(PLACES, len(PLACES))
    if way == "driftbook upload":
        session = uploaded(service, stand, browser, means, tmp_path, order, monkeypatch)
    else:
        session = WAYS[way](service, stand, browser, means, tmp_path, order)
    assert solved(service, session) == first


def test_the_last_digit_of_one_current_makes_another_input(service, stand, browser, means, tmp_path):
    first, _ = solved(service, sent_as_json(service, stand, browser, means, tmp_path, PLACES))
    value = float(means[0, 0][0])
    other = means | {(0, 0): (repr(math.nextafter(value, 1.0)), means[0, 0][1])}
    second, _ = solved(service, sent_as_json(service, stand, browser, other, tmp_path, PLACES))
    assert first != second
