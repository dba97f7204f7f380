import csv
import html
import io
import json
import re

import numpy as np
import pytest
from fastapi.testclient import TestClient

from app.exchange.records import write_record_csv, write_record_parquet
from app.exchange.rows import CurrentRecord
from app.services import access, sessions
from app.services.lab import Lab

SPIKE_AT = 777


def record(theta_deg: float = 90.0, psi_deg: float = 180.0) -> CurrentRecord:
    """A minute at 200 Hz, noisy, with one spike of Jy."""
    random = np.random.default_rng(3)
    t_s = np.arange(12_000) / 200.0
    jx_ma, jy_ma = random.normal(1e-3, 1e-5, 12_000), random.normal(-4e-3, 1e-5, 12_000)
    jy_ma[SPIKE_AT] = -3e-3
    return CurrentRecord(theta_deg, psi_deg, t_s, jx_ma, jy_ma)


def bring(client: TestClient, number: int, *files: tuple[str, bytes]):
    sent = [("files", (name, content, "application/octet-stream")) for name, content in files]
    return client.post(f"/sessions/{number}/files", files=sent)


@pytest.fixture
def recorded(technician: TestClient, stocked: Lab, opened: int) -> int:
    """The measurement of a position whose record was brought as Parquet."""
    assert bring(technician, opened, ("one.parquet", write_record_parquet(record()))).status_code == 200
    return newest(stocked, opened)[90.0, 180.0].id


def newest(lab: Lab, number: int):
    with lab.read(access.SYSTEM) as work:
        positions = sessions.detail(work, number).positions
    return {(item.theta_deg, item.psi_deg): item.measurement for item in positions if item.measurement}


def charts(page: str) -> list[dict]:
    return [json.loads(html.unescape(item)) for item in re.findall(r"data-chart='([^']*)'", page)]


def test_nobody_sees_a_measurement_without_signing_in(anonymous: TestClient, recorded: int) -> None:
    assert anonymous.get(f"/measurements/{recorded}").status_code == 303
    assert anonymous.get(f"/measurements/{recorded}.csv").status_code == 303


def test_a_brought_record_becomes_a_measurement(stocked: Lab, opened: int, recorded: int) -> None:
    row, known = newest(stocked, opened)[90.0, 180.0], record()
    # The product's mean and numpy's are both correctly rounded to some 1e-16 of the values summed.
    assert row.jx_ma == pytest.approx(float(np.mean(known.jx_ma)), rel=1e-12)
    assert (row.origin, row.duration_s, row.rate_hz) == ("upload", pytest.approx(60.0), pytest.approx(200.0))


def test_the_page_shows_both_channels_and_keeps_the_spike(technician: TestClient, recorded: int) -> None:
    page = technician.get(f"/measurements/{recorded}").text
    jx, jy, _, _ = charts(page)
    assert len(jx["datasets"]["trace"]) == 800
    assert max(row["h"] for row in jy["datasets"]["trace"]) == -3.0  # µA
    assert "12000 samples" in page
    assert "one.parquet" in page
    assert "Position 7 of session" in page


def test_a_stretch_down_to_the_samples(technician: TestClient, recorded: int) -> None:
    begin = SPIKE_AT / 200.0
    page = technician.get(
        f"/measurements/{recorded}", params={"since": begin - 0.1, "until": begin + 0.1}
    ).text
    trace = charts(page)[1]["datasets"]["trace"]
    assert len(trace) == 40  # 0.2 s at 200 Hz
    assert all(row["l"] == row["h"] for row in trace)
    for word in ("Whole record", "Earlier", "Later", "Twice as much", "Middle half"):
        assert word in page


@pytest.mark.parametrize(
    "window", [{"since": 59.99}, {"since": 100, "until": 200}, {"since": 30, "until": 20}]
)
def test_a_window_off_the_record_shows_what_is_there(
    technician: TestClient, recorded: int, window: dict[str, float]
) -> None:
    answer = technician.get(f"/measurements/{recorded}", params=window)
    assert answer.status_code == 200
    assert charts(answer.text)[0]["datasets"]["trace"]


def test_zoom_links_enlarge(technician: TestClient, recorded: int) -> None:
    page = technician.get(f"/measurements/{recorded}").text
    stretches = charts(page)[0]["datasets"]["stretches"]
    assert len(stretches) == 8
    inner = technician.get(stretches[1]["href"]).text
    first = charts(inner)[0]["datasets"]["trace"][0]["t"]
    assert first == pytest.approx(7.5)


def test_the_stretch_as_csv(technician: TestClient, recorded: int) -> None:
    text = technician.get(f"/measurements/{recorded}.csv", params={"since": 1, "until": 1.5}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    known = record().jx_ma[200:300]
    assert [float(row["jx_low_ma"]) for row in rows] == known.tolist()


def test_means_alone_have_no_record(technician: TestClient, stocked: Lab, measured: int) -> None:
    number = newest(stocked, measured)[0.0, 0.0].id
    page = technician.get(f"/measurements/{number}").text
    assert "Only the means were given" in page
    assert not charts(page)
    assert technician.get(f"/measurements/{number}.csv").status_code == 404


def test_revisions_lead_to_each_other(technician: TestClient, stocked: Lab, measured: int) -> None:
    old = newest(stocked, measured)[0.0, 0.0].id
    technician.post(f"/sessions/{measured}/rows/0/0/0", data={"jx_ua": "1", "jy_ua": "2"})
    new = newest(stocked, measured)[0.0, 0.0].id
    assert (
        f'href="/measurements/{new}">See the one that counts' in technician.get(f"/measurements/{old}").text
    )
    assert f'href="/measurements/{old}"' in technician.get(f"/measurements/{new}").text
    technician.post(f"/sessions/{measured}/rows/0/0/0/withdraw", data={"note": "slipped"})
    gone = newest(stocked, measured)[0.0, 0.0].id
    page = technician.get(f"/measurements/{gone}").text
    assert "Withdrawn by irina" in page
    assert "slipped" in page


def test_no_such_measurement(technician: TestClient, stocked: Lab) -> None:
    assert technician.get("/measurements/99").status_code == 404


def test_several_files_at_once(technician: TestClient, stocked: Lab, opened: int) -> None:
    files = [
        (f"theta{int(theta):03d}_psi{int(psi):03d}.csv", write_record_csv(record(theta, psi)))
        for theta, psi in ((0.0, 0.0), (0.0, 90.0))
    ]
    answer = bring(technician, opened, *files)
    assert answer.status_code == 200
    assert "2 positions were saved." in answer.text
    assert set(newest(stocked, opened)) == {(0.0, 0.0), (0.0, 90.0)}
    assert "2 were there already." in bring(technician, opened, *files).text


def test_means_typed_and_brought_give_the_same_bits(
    technician: TestClient, stocked: Lab, opened: int
) -> None:
    technician.post(f"/sessions/{opened}/rows/0/0/0", data={"jx_ua": "4,5360", "jy_ua": "−0.7499555"})
    typed = newest(stocked, opened)[0.0, 0.0]
    means = b"theta_deg,psi_deg,jx_ma,jy_ma\n0,90,0.004536,-0.0007499555\n"
    assert bring(technician, opened, ("means.csv", means)).status_code == 200
    brought = newest(stocked, opened)[0.0, 90.0]
    assert (typed.jx_ma, typed.jy_ma) == (brought.jx_ma, brought.jy_ma)


def test_a_file_that_cannot_be_read_says_where_and_saves_nothing(
    technician: TestClient, stocked: Lab, opened: int
) -> None:
    means = b"theta_deg,psi_deg,jx_ma,jy_ma\n0,0,0.001,0.002\n0,90,abc,0.002\n"
    answer = bring(technician, opened, ("means.csv", means))
    assert answer.status_code == 422
    assert "means.csv, row 3, column jx_ma: “abc” is not a number" in answer.text
    assert not newest(stocked, opened)


def test_a_position_that_is_not_certified_is_refused(
    technician: TestClient, stocked: Lab, opened: int
) -> None:
    answer = bring(technician, opened, ("means.csv", b"theta_deg,psi_deg,jx_ma,jy_ma\n45,0,0.001,0.002\n"))
    assert answer.status_code == 422
    assert "θ 45°, ψ 0°" in answer.text
    assert not newest(stocked, opened)


def test_long_files_are_read_in_the_background(
    technician: TestClient, opened: int, queue, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.services.uploads.LARGEST_AT_ONCE", 1000)
    answer = bring(technician, opened, ("one.parquet", write_record_parquet(record())))
    assert answer.status_code == 303
    assert answer.headers["location"] == f"/jobs/{queue.queued[0]}"


def test_no_file_chosen(technician: TestClient, opened: int) -> None:
    answer = technician.post(f"/sessions/{opened}/files", files=[("files", ("", b""))])
    assert answer.status_code == 422
    assert "Choose at least one file." in answer.text


def test_whoever_only_reads_brings_nothing(designer: TestClient, stocked: Lab, opened: int) -> None:
    assert bring(designer, opened, ("one.parquet", write_record_parquet(record()))).status_code == 403
    assert not newest(stocked, opened)


def row_of(page: str, name: str) -> list[str]:
    """The cells of the table's row with that head, without markup."""
    found = re.search(rf"<tr><th scope=\"row\"[^>]*>(?:<i>\w</i> )?{re.escape(name)}</th>(.*?)</tr>", page)
    assert found, name
    return [re.sub("<[^>]*>", "", cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", found[1])]


def test_the_page_shows_the_noise_of_both_channels(technician: TestClient, recorded: int) -> None:
    """White noise of 10 nA: u is 10 nA/√12000 = 0.091 nA, N is 10 nA·√5 ms = 0.707 nA·√s."""
    page = technician.get(f"/measurements/{recorded}").text
    unit, x, _ = row_of(page, "u of the mean, as stated (slow fluctuations)")
    assert unit == "nA"
    # u is known to some 10 %: three of these.
    assert float(x.split()[0]) == pytest.approx(0.0913, rel=0.3)
    assert row_of(page, "Effective samples")[1].endswith(" of 12000")
    unit, x, _ = row_of(page, "Angle random walk")
    assert (unit, float(x.split()[0])) == ("nA·√s", pytest.approx(0.707, abs=0.03))
    assert row_of(page, "Rate random walk")[1].startswith("≤ ")
    assert "no result yet" in page
    _, _, allan, correlation = charts(page)
    assert len(allan["datasets"]["points_x"]) == 13  # 1, 2, …, 4096 of 12,000 samples.
    assert allan["datasets"]["duration"] == [{"t": 60.0, "text": "mean over 60 s"}]
    assert correlation["datasets"]["x"][0] == {"t": 0.0, "v": 1.0}


def test_a_channel_that_drifts_and_one_that_is_stuck(
    technician: TestClient, stocked: Lab, opened: int
) -> None:
    known = record()
    drifting = known.jx_ma + np.linspace(0.0, 1e-5, 12_000)
    made = CurrentRecord(90.0, 180.0, known.t_s, drifting, np.full(12_000, -4e-3))
    bring(technician, opened, ("one.parquet", write_record_parquet(made)))
    page = technician.get(f"/measurements/{newest(stocked, opened)[90.0, 180.0].id}").text
    assert "The current drifts" in page
    assert "Every sample is the same" in page
    # 10 nA in a minute.
    assert float(row_of(page, "Slope")[1].split()[0]) == pytest.approx(10.0, abs=1.5)
    assert row_of(page, "Slope")[2] == "–"


def test_a_short_record_shows_what_it_can(technician: TestClient, stocked: Lab, opened: int) -> None:
    known = record()
    made = CurrentRecord(90.0, 180.0, known.t_s[:40], known.jx_ma[:40], known.jy_ma[:40])
    bring(technician, opened, ("one.parquet", write_record_parquet(made)))
    page = technician.get(f"/measurements/{newest(stocked, opened)[90.0, 180.0].id}").text
    assert "too short to judge" in page
    assert "Angle random walk" not in page


def test_in_russian(technician: TestClient, recorded: int) -> None:
    technician.cookies.set("lang", "ru")
    page = technician.get(f"/measurements/{recorded}").text
    assert "Средние токи" in page
    assert "Запись" in page
    assert "Девиация Аллана" in page
    assert "Запись стационарна" in page
