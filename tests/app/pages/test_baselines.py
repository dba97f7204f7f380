import html
import re
from pathlib import Path
from statistics import NormalDist

import drift_laboratory
import pytest
from fastapi.testclient import TestClient

from app.services import access
from app.services.drift import baselines
from app.services.lab import Lab


@pytest.fixture(scope="session")
def prepared(laid: Path) -> Path:
    """Gyro 0417 with a year of results."""
    return laid


PATH = "/gyros/0417/baseline"


def choice(results: range | list[int], **further: object) -> dict[str, object]:
    chosen: dict[str, object] = {
        "method": "least-squares", "result": list(results), "parameter": ["w0x", "w0y"], "look": "true",
        "estimator": "standard-deviation", "limits": "three-sigma", "rule": ["nelson-1"], "from": "", "until": "",
    }  # fmt: skip
    return chosen | further


def text(page: str) -> str:
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page)))


def known(lab: Lab) -> tuple[baselines.BaselineView, ...]:
    with lab.read(access.SYSTEM) as work:
        return baselines.of_gyro(work, "0417")


def test_a_stretch_without_an_event_is_proposed(quality: TestClient) -> None:
    """The certificate changes after the third session, the gyro is repaired after the ninth: six lie between."""
    page = quality.get(PATH).text
    ticked = re.findall(r'name="result" value="(\d+)" checked', page)
    assert [int(item) for item in ticked] == [4, 5, 6, 7, 8, 9]
    assert re.findall(r'name="rule" value="([\w-]+)" checked', page) == ["nelson-1", "ewma"]


def test_the_preview_tells_limits_and_false_alarms(quality: TestClient) -> None:
    """Three standard deviations of six values, by hand; 3σ limits of known σ alarm in 0.27 % of values."""
    values = [drift_laboratory.value("w0x", number) for number in range(3, 9)]
    mean = sum(values) / 6
    sd = (sum((value - mean) ** 2 for value in values) / 5) ** 0.5
    page = quality.get(PATH, params=choice(range(4, 10)))
    assert page.status_code == 200
    table = page.text[page.text.index('id="preview"') :]
    row = table[table.index("Fixed drift, x") : table.index("Fixed drift, y")]
    for limit in (mean - 3 * sd, mean, mean + 3 * sd):
        assert f"{limit:.4f}" in row
    # the estimate of σ from six values errs, so false alarms are more frequent than for a known one
    expected = re.search(r"one false alarm in about (\d+) sessions", page.text)
    assert expected
    assert 10 < int(expected[1]) < 0.5 / NormalDist().cdf(-3.0)


def test_too_few_sessions_are_refused_in_words(quality: TestClient) -> None:
    page = quality.get(PATH, params=choice([4, 5]))
    assert page.status_code == 422
    assert "needs at least 5 sessions; these are 2." in text(page.text)
    assert re.findall(r'name="result" value="(\d+)" checked', page.text) == ["4", "5"]
    assert "Freeze the baseline" not in page.text


def test_who_judges_freezes_what_was_looked_at(quality: TestClient, lab: Lab) -> None:
    before = {line.id for line in known(lab)}
    answer = quality.post(PATH, data=choice(range(4, 10), reason="Quiet half year."))
    assert (answer.status_code, answer.headers["location"]) == (303, "/gyros/0417?method=least-squares")
    made = [line for line in known(lab) if line.id not in before]
    assert {line.parameter for line in made} == {"w0x", "w0y"}
    assert {line.calibrations for line in made} == {(4, 5, 6, 7, 8, 9)}
    assert {(line.estimator, line.limits, line.reason) for line in made} == {
        ("standard-deviation", "three-sigma", "Quiet half year.")
    }
    assert made[0].rules == {"individuals": ["nelson-1"]}


def test_who_does_not_judge_looks_only(technician: TestClient, lab: Lab) -> None:
    page = technician.get(PATH, params=choice(range(4, 10))).text
    assert "Freeze the baseline" not in page
    assert "/retirement" not in page
    before = known(lab)
    assert technician.post(PATH, data=choice(range(4, 10))).status_code == 403
    assert known(lab) == before


def test_a_baseline_is_retired(quality: TestClient, lab: Lab) -> None:
    first = known(lab)[0]
    answer = quality.post(f"/baselines/{first.id}/retirement", data={"next": PATH})
    assert (answer.status_code, answer.headers["location"]) == (303, PATH)
    assert first.id not in {line.id for line in known(lab)}


def test_other_days_are_shown_without_a_look(quality: TestClient) -> None:
    page = quality.get(PATH, params=choice([], look="false", until="1999-01-01")).text
    assert "No results to choose from" in page


def test_no_such_gyro_or_parameter(quality: TestClient) -> None:
    assert quality.get("/gyros/9999/baseline").status_code == 404
    page = quality.get(PATH, params=choice(range(4, 10), parameter=["mass"]))
    assert page.status_code == 422
