import re

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.spatial.transform import Rotation


@pytest.mark.parametrize(
    ("language", "words"),
    [
        ("en", ["Misprints in the source", "third and fourth line", "The paper’s iteration"]),
        ("ru", ["Опечатки источника", "третья и четвёртая строки", "дрейф, зависящий от ускорения"]),
    ],
)
def test_the_method_is_told_in_both_languages(
    technician: TestClient, language: str, words: list[str]
) -> None:
    page = technician.get("/method", headers={"accept-language": language}).text
    assert all(word in page for word in words)
    for number in ("(18)", "(23)", "(24)", "(14)", "(25)", "(2)"):
        assert number in page


def test_the_quadrature_drift_has_the_paper_s_letter(technician: TestClient) -> None:
    russian = technician.get("/method", headers={"accept-language": "ru"}).text
    english = technician.get("/method").text
    assert '<span class="q">ω<sub>к</sub></span>' in russian
    assert '<span class="q">ω<sub>k</sub></span>' in english
    assert not re.search(r"<sub>k</sub></span>·<span class=\"q\">d", russian)


def test_the_special_case_on_the_page_follows_from_the_rotations() -> None:
    # d₁₁ = cos γ·sin α + sin γ·sin β·cos α, against scipy's rotations about the turned axes.
    alpha, beta, gamma = np.deg2rad([3.0, -2.0, 5.0])
    turned = Rotation.from_euler("XYZ", [alpha, beta, gamma]).as_matrix().T
    expected = np.cos(gamma) * np.sin(alpha) + np.sin(gamma) * np.sin(beta) * np.cos(alpha)
    assert turned[1, 2] == pytest.approx(expected, abs=1e-15)  # rounding of a few products below one
