import html
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from app.services import access
from app.services.lab import Lab
from app.store import drift, equipment


@pytest.fixture(scope="session")
def prepared(laid: Path) -> Path:
    """Gyro 0417 with a year of results and its study."""
    return laid


def test_the_largest_unexplained_step_stands_beside_the_last_one(technician: TestClient, lab: Lab) -> None:
    """ω0x: an unexplained jump, then the repair's step, then a small one."""
    unexplained = {"event": None, "event_kind": None}
    _give_changes(lab, "w0x", lambda step: [
        step | unexplained | {"size": -0.499, "u": 0.02}, step, step | unexplained | {"size": 0.01, "u": 0.001},
    ])  # fmt: skip
    said = _trend_of(technician.get("/gyros/0417").text)
    assert re.search(r"\+0\.0100 ± 0\.0020 °/h, .*largest unexplained −0\.499 ± 0\.040 °/h, ", said)
    assert "explained by an event" not in said


def test_a_last_step_that_is_the_largest_stands_alone(technician: TestClient, lab: Lab) -> None:
    unexplained = {"event": None, "event_kind": None}
    _give_changes(lab, "w0x", lambda step: [
        step | unexplained | {"size": 0.01, "u": 0.001}, step | unexplained | {"size": -0.499, "u": 0.02},
    ])  # fmt: skip
    said = _trend_of(technician.get("/gyros/0417").text)
    assert "−0.499 ± 0.040 °/h" in said
    assert "largest unexplained" not in said


def _trend_of(page: str) -> str:
    """The row of ω0x in the table of courses, in words."""
    row = re.search(
        r"<tr[^>]*>(?:(?!</tr>).)*/drift/w0x\?method.*?</tr>", page[page.index('id="trend"') :], re.DOTALL
    )
    assert row
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", row[0])))


def _give_changes(
    lab: Lab, parameter: str, changed: Callable[[dict[str, Any]], list[dict[str, Any]]]
) -> None:
    """Give the study of 0417 other changes, made from the step at its repair."""
    with lab.write(access.SYSTEM) as work:
        gyro = equipment.gyro(work.db, "0417")
        assert gyro is not None
        row = drift.study(work.db, gyro.id, None, "least-squares")
        assert row is not None
        assert row.document
        document = json.loads(row.document)
        entry = document["parameters"][parameter]
        entry["changes"] = changed(entry["changes"][0])
        row.document = json.dumps(document)
