"""Accounts, passwords, tokens, browsers."""

from datetime import timedelta

import pytest
import sqlalchemy as sa

from app.errors import Conflict, Forbidden, Invalid, Unauthenticated
from app.services import access
from app.services.access import SYSTEM


def test_a_password_signs_in_and_a_wrong_one_does_not(lab):
    with lab.write(SYSTEM) as work:
        secret = access.sign_in(work, "petrova", "a good password")
        assert access.browser(work, secret).name == "petrova"
        for name, password in (("petrova", "a wrong password"), ("nobody", "a good password")):
            with pytest.raises(Unauthenticated):
                access.sign_in(work, name, password)


def test_signing_out_and_idleness_end_a_browser(lab):
    with lab.write(SYSTEM) as work:
        one, other = (access.sign_in(work, "petrova", "a good password") for _ in range(2))
        access.sign_out(work, one)
        assert access.browser(work, one) is None
        work.now += timedelta(days=6)
        access.touch(work, other)
        work.now += timedelta(days=6)
        assert access.browser(work, other) is not None
        work.now += timedelta(days=2)
        assert access.browser(work, other) is None


def test_a_token_has_its_scopes_and_its_end(lab):
    with lab.write(SYSTEM) as work:
        secret = access.create_token(work, "stand-1", ("read",), timedelta(days=30))
        person = access.bearer(work, secret)
        assert (person.name, person.scopes) == ("stand-1", frozenset({"read"}))
        with pytest.raises(Forbidden, match="upload"):
            access.require(person, "upload")
        work.now += timedelta(days=30)
        with pytest.raises(Unauthenticated):
            access.bearer(work, secret)


def test_no_secret_is_kept_in_the_database(lab):
    with lab.write(SYSTEM) as work:
        secrets = [
            access.create_token(work, "stand-1", ("read",)),
            access.sign_in(work, "petrova", "a good password"),
            access.make_sign_in_link(work, "petrova", timedelta(days=1)),
            "a good password",
        ]
    with lab.read(SYSTEM) as work:
        tables = ("account", "token", "login", "sign_in_link")
        kept = " ".join(
            str(row) for table in tables for row in work.db.execute(sa.text(f"SELECT * FROM {table}"))
        )
    assert not [secret for secret in secrets if secret in kept]


def test_a_link_signs_in_until_it_expires(lab):
    with lab.write(SYSTEM) as work:
        link = access.make_sign_in_link(work, "petrova", timedelta(hours=1))
        assert access.browser(work, access.sign_in_by_link(work, link)).name == "petrova"
        work.now += timedelta(hours=1)
        with pytest.raises(Unauthenticated):
            access.sign_in_by_link(work, link)


@pytest.mark.parametrize(
    ("name", "role", "password", "error"),
    [
        ("petrova", "technician", None, Conflict),
        ("ivanov", "king", None, Invalid),
        ("ivanov", "technician", "short", Invalid),
        (" ", "technician", None, Invalid),
    ],
)
def test_a_bad_account_is_refused(lab, name, role, password, error):
    with pytest.raises(error), lab.write(SYSTEM) as work:
        access.add_account(work, name, role, password)


def test_an_account_without_a_password_cannot_sign_in_by_one(lab):
    with lab.write(SYSTEM) as work:
        access.add_account(work, "machine", "automation")
        with pytest.raises(Unauthenticated):
            access.sign_in(work, "machine", "")
