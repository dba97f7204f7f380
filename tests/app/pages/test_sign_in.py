import re
from datetime import timedelta

import pytest
from fastapi.testclient import TestClient

from app.services import access
from app.services.lab import Lab

PASSWORD = "correct horse battery"


def test_somebody_not_signed_in_is_led_there_and_back(anonymous: TestClient) -> None:
    answer = anonymous.get("/gyros?type=GVK-6")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/sign-in?next=/gyros%3Ftype%3DGVK-6"
    form = anonymous.get(answer.headers["location"])
    assert 'name="next" value="/gyros?type=GVK-6"' in form.text
    sent = {"name": "irina", "password": PASSWORD, "next": "/gyros?type=GVK-6"}
    assert anonymous.post("/sign-in", data=sent).headers["location"] == "/gyros?type=GVK-6"


def test_htmx_is_told_to_leave_the_page(anonymous: TestClient) -> None:
    answer = anonymous.get("/gyros", headers={"hx-request": "true"})
    assert answer.headers["hx-redirect"] == "/sign-in?next=/gyros"


def test_the_cookie_is_out_of_reach_of_scripts_and_other_sites(anonymous: TestClient) -> None:
    answer = anonymous.post("/sign-in", data={"name": "irina", "password": PASSWORD})
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert "secure" not in cookie  # reached without https


def test_the_cookie_is_secure_and_bound_to_the_host_behind_https(anonymous: TestClient, lab: Lab) -> None:
    object.__setattr__(lab.settings, "origin", "https://lab.example")
    cookie = anonymous.post("/sign-in", data={"name": "irina", "password": PASSWORD}).headers["set-cookie"]
    assert cookie.startswith("__Host-")
    assert "secure" in cookie.lower()


def test_a_wrong_password_keeps_the_name_and_is_said_beside_the_field(anonymous: TestClient) -> None:
    answer = anonymous.post("/sign-in", data={"name": "irina", "password": "no", "next": "/stands"})
    assert answer.status_code == 422
    assert 'value="irina"' in answer.text
    assert 'name="next" value="/stands"' in answer.text
    assert re.search(r'id="f-password"[^>]*aria-invalid="true"', answer.text)
    assert "Name and password do not fit together." in answer.text
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("elsewhere", ["https://evil.example/", "//evil.example", "/\\evil.example"])
def test_nobody_is_led_to_another_site(anonymous: TestClient, elsewhere: str) -> None:
    sent = {"name": "irina", "password": PASSWORD, "next": elsewhere}
    assert anonymous.post("/sign-in", data=sent).headers["location"] == "/"
    assert anonymous.get("/choose", params={"lang": "ru", "next": elsewhere}).headers["location"] == "/"


def test_a_link_signs_in_once_it_is_known(anonymous: TestClient, lab: Lab) -> None:
    with lab.write(access.SYSTEM) as work:
        secret = access.make_sign_in_link(work, "irina", timedelta(minutes=5))
    unknown = anonymous.get("/sign-in/link/nothing")
    assert unknown.status_code == 422
    assert "unknown or has expired" in unknown.text
    assert anonymous.get(f"/sign-in/link/{secret}").headers["location"] == "/"
    assert anonymous.get("/method").status_code == 200


def test_signing_out_ends_it_on_the_server_too(technician: TestClient) -> None:
    cookies = dict(technician.cookies)
    assert technician.post("/sign-out").headers["location"] == "/sign-in"
    technician.cookies.update(cookies)  # the old cookie, kept by somebody
    assert technician.get("/method").status_code == 303


def test_language_and_theme_are_written_by_the_server(technician: TestClient) -> None:
    page = technician.get("/method").text
    assert '<html lang="en">' in page
    assert technician.get("/choose?lang=ru&next=/method").headers["location"] == "/method"
    technician.get("/choose?theme=dark")
    page = technician.get("/method").text
    assert '<html lang="ru" data-theme="dark">' in page
    assert "Гироскопы" in page
    technician.get("/choose?theme=auto")
    assert '<html lang="ru">' in technician.get("/method").text


def test_the_browser_s_own_language_is_used_first(anonymous: TestClient) -> None:
    page = anonymous.get("/sign-in", headers={"accept-language": "de, ru;q=0.8, en;q=0.5"}).text
    assert '<html lang="ru">' in page


def test_a_page_that_is_not_there_says_so(technician: TestClient) -> None:
    answer = technician.get("/nowhere")
    assert answer.status_code == 404
    assert "Nothing is here" in answer.text
