"""A stand's page: whose change it is, said first."""

import csv
import io
import json
import re
import shutil
from collections.abc import Iterator
from datetime import date, datetime
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from fastapi.testclient import TestClient
from stand_tables import sessions, stored, turned

from app.exchange.rows import CertificateRow
from app.services import access, gyros, stands
from app.services.drift import events, studying
from app.services.lab import Lab, Queue
from app.settings import Settings
from app.store.database import Database
from app.store.records import RecordFiles

TURNED = 18
"""The first session after the base turned, of 36."""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, prepared: Path) -> Path:
    """A database, made once: S1, whose base turned by 150″ in azimuth; S2 with one gyro; S3 with nothing."""
    settings = Settings(data=tmp_path_factory.mktemp("moved"))
    shutil.copy(prepared, settings.data)
    database = Database(settings.url)
    lab = Lab(settings, database, RecordFiles(settings.records), studying.NoJobs())
    positions = [
        CertificateRow(theta, psi, 6.9, -16.4, 6.6)
        for theta in (0, 90, 180, 270)
        for psi in (0, 90, 180, 270)
    ]
    with lab.write(access.SYSTEM) as work:
        gyros.add_gyro(work, "0417", "GVK-6")
        for name in ("S1", "S2", "S3"):
            stands.add_stand(work, name, 55.7558)
            stands.add_certificate(work, name, "C-17", date(2020, 1, 1), date(2100, 1, 1), positions)
        stored(work, turned(sessions(["0412", "0417", "0419"], 12, 11), TURNED, azimuth=150.0), "S1")
        stored(work, sessions(["0431"], 5, 3), "S2")
        studying.follow_all_now(work)
    database.close()
    return settings.data / "driftbook.sqlite"


@pytest.fixture
def lab(tmp_path: Path, queue: Queue, built: Path) -> Iterator[Lab]:
    """The same laboratory anew for each test."""
    settings = Settings(data=tmp_path)
    shutil.copy(built, tmp_path)
    database = Database(settings.url)
    yield Lab(settings, database, RecordFiles(settings.records), queue)
    database.close()


def _charts(page: str) -> list[dict]:
    return [json.loads(text.replace("&#39;", "'")) for text in re.findall(r"data-chart='([^']+)'", page)]


def test_the_verdict_is_said_first(designer: TestClient, lab: Lab) -> None:
    page = designer.get("/stands/S1/drift").text
    said = re.search(r'class="verdict-text">([^<]+)<', page)
    assert said is not None
    assert re.match(
        r"Stand S1 turned by \+1\d\d″ ± \d\d″ about the vertical between \d+ \w+ 2024 and ", said[1]
    )
    assert "A turn of " in page


def test_every_point_is_a_link_and_the_change_is_marked(designer: TestClient, lab: Lab) -> None:
    charts = _charts(designer.get("/stands/S1/drift?by=session").text)
    assert len(charts) == 4  # azimuth, both levels, all gyros together
    rows = charts[0]["datasets"]["within"]
    assert len(rows) == 36
    assert all(row["href"].startswith("/results/") for row in rows)
    assert len(charts[0]["datasets"]["changes"]) == 1
    assert charts[1]["datasets"]["changes"] == []


def test_points_are_grouped_and_zoomed_by_the_address(designer: TestClient, lab: Lab) -> None:
    by_month = _charts(designer.get("/stands/S1/drift?by=month").text)[0]["datasets"]["within"]
    assert len(by_month) == 12
    assert by_month[0]["href"].startswith("/stands/S1/drift?since=2024-01-05")
    zoomed = designer.get(by_month[0]["href"]).text
    assert len(_charts(zoomed)[0]["datasets"]["within"]) == 3
    assert "Show the whole time" in zoomed
    nothing = designer.get("/stands/S1/drift?since=1999-01-01&until=1999-01-02")
    assert nothing.status_code == 200
    assert "No session in these days" in nothing.text


def test_what_the_change_touched_is_listed(designer: TestClient, lab: Lab) -> None:
    page = designer.get("/stands/S1/drift").text
    # the session before the first likely one is sound, so 18 of 36 or a few more or fewer
    found = re.search(r'id="affected">(\d+) sessions since then', page)
    assert found is not None
    assert 14 <= int(found[1]) <= 22


def test_an_event_explains_it(technician: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        at = datetime.fromisoformat("2024-07-03T00:00:00+00:00")
        events.add(work, "moved", at, "to the new pier", stand="S1")
        studying.follow_all_now(work)
    page = technician.get("/stands/S1/drift").text
    assert "Nothing shows that stand S1 changed but what its events explain." in page
    assert "Explained: Moved." in page
    assert "to the new pier" in page
    assert 'id="affected"' not in page


def test_the_same_as_files(designer: TestClient, lab: Lab) -> None:
    rows = list(csv.DictReader(io.StringIO(designer.get("/stands/S1/drift.csv").text)))
    assert len(rows) == 36
    assert rows[0]["gyro"] == "0412"
    table = pq.read_table(io.BytesIO(designer.get("/stands/S1/drift.parquet").content))
    assert table["azimuth_arcsec"].to_pylist() == [float(row["azimuth_arcsec"]) for row in rows]
    assert len(designer.get("/stands/S1/drift.json").json()) == 36


def test_a_stand_of_which_nothing_is_known(designer: TestClient, lab: Lab) -> None:
    assert "Nothing is known of this stand yet" in designer.get("/stands/S3/drift").text
    assert designer.get("/stands/S9/drift").status_code == 404
    assert designer.get("/stands/S3/drift.csv").text.startswith("measured_at,session")


def test_a_stand_with_one_gyro(designer: TestClient, lab: Lab) -> None:
    page = designer.get("/stands/S2/drift").text
    assert "Nothing shows that stand S2 changed." in page
    assert "measure another one here" in page


def test_a_study_that_is_behind_says_so(designer: TestClient, lab: Lab) -> None:
    assert designer.get("/stands/S1/drift/study").headers["hx-refresh"] == "true"
    with lab.write(access.SYSTEM) as work:
        stored(work, sessions(["0417"], 1, 5), "S1")
    page = designer.get("/stands/S1/drift").text
    assert "hx-get=" not in page  # the gyro's own study comes first; the stand's is told by it
    with lab.write(access.SYSTEM) as work:
        events.add(work, "other", datetime.fromisoformat("2024-03-03T00:00:00+00:00"), stand="S1")
    assert designer.get("/stands/S1/drift/study").status_code == 204
    assert "A newer result is being taken in" in designer.get("/stands/S1/drift").text
