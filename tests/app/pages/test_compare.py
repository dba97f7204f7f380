"""Two results side by side."""

import io
import json
from collections.abc import Callable
from dataclasses import replace

import pyarrow.parquet as pq
import pytest
from fastapi.testclient import TestClient

from app.pages.compare import tidy
from app.services import access, calibrations, gyros, ingest
from app.services.lab import Lab
from app.services.sessions import NewSession, open_session


@pytest.fixture
def pair(stocked: Lab, result: int, measured: int, solving: Callable[..., int]) -> tuple[int, int]:
    """Session numbers of two sessions of gyro 0417; in the second ω0y is larger by 0.05 °/h."""
    with stocked.write(access.SYSTEM) as work:
        rows = calibrations.current_means(work, measured)
        number = open_session(work, NewSession("0417", "S1")).id
        for row in rows:
            moved = replace(row, jy_ma=row.jy_ma - 0.05 / 2063.0)
            ingest.save_means(work, number, moved, ingest.Source("typed"))
    solving(stocked, number)
    return measured, number


def test_without_two_it_asks_for_them(designer: TestClient, stocked: Lab) -> None:
    page = designer.get("/compare").text
    assert "Compare two results" in page
    assert 'name="a"' in page


def test_what_differs_is_said_first(designer: TestClient, pair: tuple[int, int]) -> None:
    page = designer.get(f"/compare?a=session:{pair[1]}&b=session:{pair[0]}").text
    assert "1 parameter differs by more than the uncertainty of the difference:" in page
    assert page.count('class="row-out"') == 1
    assert "it is taken off" in page or "Nothing that is stated" in page


def test_the_same_as_files(designer: TestClient, pair: tuple[int, int]) -> None:
    query = f"a=session:{pair[1]}&b=session:{pair[0]}"
    rows = json.loads(designer.get(f"/compare.json?{query}").text)
    table = pq.read_table(io.BytesIO(designer.get(f"/compare.parquet?{query}").content))
    assert table["parameter"].to_pylist() == [row["parameter"] for row in rows]
    found = next(row for row in rows if row["parameter"] == "w0y")
    assert found["verdict"] == "differ"
    # Jy less by 0.05/2063 mA in every position is a fixed drift more by 0.05 °/h (paper, (11)); K of the
    # fit differs from 2063 by parts in a thousand.
    assert found["difference"] == pytest.approx(0.05, rel=0.01)
    assert designer.get(f"/compare.csv?{query}").text.startswith("parameter,unit,session_a")


@pytest.mark.parametrize(
    ("query", "status", "sentence"),
    [
        ("a=session:9999&b=gyro:0417", 404, "has no result"),
        ("a=nonsense&b=gyro:0417", 422, "cannot be compared"),
        ("a=gyro:none&b=gyro:0417", 404, "There is no gyro none"),
    ],
)
def test_what_cannot_be_compared_is_said_at_its_field(
    designer: TestClient, stocked: Lab, result: int, query: str, status: int, sentence: str
) -> None:
    answer = designer.get(f"/compare?{query}")
    assert answer.status_code == status
    assert sentence in answer.text
    assert 'name="a" aria-invalid="true"' in answer.text or "notice bad" in answer.text


def test_the_same_result_twice_is_refused(
    designer: TestClient, stocked: Lab, measured: int, result: int
) -> None:
    answer = designer.get(f"/compare?a=session:{measured}&b=result:{result}")
    assert answer.status_code == 422
    assert "Both are the same result" in answer.text


@pytest.mark.parametrize(
    ("typed", "tidied"),
    [("Session 78", "session:78"), ("gyro: 0417", "gyro:0417"), (" result:9 ", "result:9"), ("78", "78")],
)
def test_what_people_type_is_understood(typed: str, tidied: str) -> None:
    assert tidy(typed) == tidied


def test_results_of_two_gyros(designer: TestClient, stocked: Lab, result: int, measured: int) -> None:
    with stocked.write(access.SYSTEM) as work:
        gyros.add_gyro(work, "0418", "GVK-6")
    answer = designer.get("/compare?a=gyro:0417&b=gyro:0418")
    assert answer.status_code == 404
    assert "gyro:0418 has no result" in answer.text
