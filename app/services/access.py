"""Who may do what: accounts, passwords, signed-in browsers, bearer tokens.

Secrets leave this module once, when they are made; the database keeps their SHA-256 (they are 256
random bits, so a slow hash would add nothing) and passwords as argon2 hashes.
"""

import hashlib
import secrets
from datetime import datetime, timedelta
from functools import cache
from typing import Final

from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher

from app.errors import Conflict, Forbidden, Invalid, Unauthenticated, problem
from app.services.lab import Person, Work
from app.store import people
from app.store.tables import Account, Login, SignInLink, Token

SCOPES: Final = ("read", "upload", "admin")
"""read: see everything; upload: register, measure and solve as well; admin: accounts too."""

ROLES: Final = {
    "technician": ("read", "upload"),
    "metrologist": ("read", "upload"),
    "quality": ("read", "upload"),
    "automation": ("read", "upload"),
    "designer": ("read",),
    "admin": ("read", "upload", "admin"),
}

JUDGES: Final = ("metrologist", "quality", "admin")
"""Roles that judge the gyros' and the stands' drift: freeze a baseline, answer for an alarm."""

SYSTEM: Final = Person("system", "Driftbook", "admin", frozenset(SCOPES))
NOBODY: Final = Person("", "", "", frozenset())
_IDLE: Final = timedelta(days=7)
_SEEN_STEP: Final = timedelta(minutes=5)
_hasher = PasswordHash((Argon2Hasher(),))


@cache
def _unknown_account_hash() -> str:
    """A hash that no password has: an unknown name takes as long to refuse as a wrong password."""
    return _hasher.hash(secrets.token_hex())


def add_account(work: Work, name: str, role: str, password: str | None = None, full_name: str = "") -> Person:
    """Open an account; without a password it can sign in by a link or a token only.

    Raises
    ------
    Invalid
        Unknown role, empty name, or a password shorter than ten characters.
    Conflict
        The name is taken.
    """
    if role not in ROLES:
        raise Invalid(problem("unknown-role", "There is no role “%(role)s”. Choose one of %(roles)s.",
                              column="role", role=role, roles=", ".join(ROLES)))  # fmt: skip
    if not name.strip():
        raise Invalid(problem("empty-name", "An account needs a name.", column="name"))
    if password is not None and len(password) < 10:
        raise Invalid(
            problem("short-password", "A password needs ten characters or more.", column="password")
        )
    if people.account(work.db, name) is not None:
        raise Conflict(
            problem("name-taken", "There is an account “%(name)s” already.", column="name", name=name)
        )
    account = Account(
        name=name, full_name=full_name or name, role=role, created_at=work.now,
        password_hash=None if password is None else _hasher.hash(password),
    )  # fmt: skip
    work.db.add(account)
    work.db.flush()
    return _person(account)


def create_token(work: Work, name: str, scopes: tuple[str, ...], valid_for: timedelta | None = None) -> str:
    """Make a bearer token for an account, opening one for a machine when the name is new.

    Returns
    -------
    str
        The secret; it cannot be seen again.
    """
    unknown = [item for item in scopes if item not in SCOPES]
    if unknown or not scopes:
        raise Invalid(problem("unknown-scope", "There is no scope “%(scope)s”. Choose among %(scopes)s.",
                              column="scope", scope=" ".join(unknown), scopes=", ".join(SCOPES)))  # fmt: skip
    if people.account(work.db, name) is None:
        add_account(work, name, "automation")
    account = _account(work, name)
    secret = "dbk_" + secrets.token_urlsafe(32)
    expires_at = None if valid_for is None else work.now + valid_for
    work.db.add(Token(account_id=account.id, digest=_digest(secret), scopes=sorted(set(scopes)),
                      created_at=work.now, expires_at=expires_at))  # fmt: skip
    return secret


def bearer(work: Work, secret: str) -> Person:
    """The owner of a token, with the token's scopes.

    Raises
    ------
    Unauthenticated
        Unknown, revoked or expired token, or a closed account.
    """
    token = people.token(work.db, _digest(secret))
    expired = token is not None and token.expires_at is not None and token.expires_at <= work.now
    if token is None or token.revoked_at or expired or token.account.disabled_at:
        raise Unauthenticated(
            problem(
                "bad-token",
                "The token is unknown, expired or revoked. Make one with “driftbook token create”.",
            )
        )
    return _person(token.account, frozenset(token.scopes))


def sign_in(work: Work, name: str, password: str) -> str:
    """Check a password and give the secret for the browser's cookie."""
    account = people.account(work.db, name)
    known = account is not None and account.password_hash is not None and account.disabled_at is None
    stored = account.password_hash if account is not None and account.password_hash and known else None
    if not _hasher.verify(password, stored or _unknown_account_hash()) or account is None or not known:
        raise Unauthenticated(
            problem("bad-password", "Name and password do not fit together.", column="password")
        )
    return _open_login(work, account)


def make_sign_in_link(work: Work, name: str, valid_for: timedelta) -> str:
    """Make the secret of a link that signs the account in for as long as it is valid."""
    secret = secrets.token_urlsafe(24)
    account = _account(work, name)
    work.db.add(SignInLink(digest=_digest(secret), account_id=account.id, expires_at=work.now + valid_for))
    return secret


def sign_in_by_link(work: Work, secret: str) -> str:
    """Turn a link's secret into the secret for the browser's cookie."""
    link = people.sign_in_link(work.db, _digest(secret))
    if link is None or link.expires_at <= work.now:
        raise Unauthenticated(problem("bad-link", "This sign-in link is unknown or has expired."))
    return _open_login(work, link.account)


def browser(work: Work, secret: str) -> Person | None:
    """Who signed in with this browser, or None when the sign-in is unknown, revoked or too old."""
    login = people.login(work.db, _digest(secret))
    if login is None or login.revoked_at or login.account.disabled_at or login.seen_at + _IDLE <= work.now:
        return None
    return _person(login.account)


def wants_touch(work: Work, secret: str) -> bool:
    """Whether the browser's last sign of life is old enough to be written anew."""
    login = people.login(work.db, _digest(secret))
    return login is not None and login.seen_at + _SEEN_STEP <= work.now


def touch(work: Work, secret: str) -> None:
    """Note that the browser is in use."""
    login = people.login(work.db, _digest(secret))
    if login is not None:
        login.seen_at = work.now


def sign_out(work: Work, secret: str) -> None:
    """Revoke the browser's sign-in."""
    login = people.login(work.db, _digest(secret))
    if login is not None:
        login.revoked_at = work.now


def require(person: Person, scope: str) -> None:
    """Raise `Forbidden` unless the person's scopes reach."""
    if scope not in person.scopes:
        raise Forbidden(problem("scope", "This needs the scope “%(scope)s”; you have %(have)s.",
                                scope=scope, have=", ".join(sorted(person.scopes)) or "none"))  # fmt: skip


def require_judge(person: Person) -> None:
    """Raise `Forbidden` unless the person may upload and its role is one of `JUDGES`."""
    require(person, "upload")
    if person.role not in JUDGES:
        raise Forbidden(problem("not-a-judge", "This is for the roles %(roles)s; yours is %(role)s.",
                                roles=", ".join(JUDGES), role=person.role or "none"))  # fmt: skip


def _open_login(work: Work, account: Account) -> str:
    secret = secrets.token_urlsafe(32)
    now: datetime = work.now
    work.db.add(Login(digest=_digest(secret), account_id=account.id, created_at=now, seen_at=now))
    return secret


def _account(work: Work, name: str) -> Account:
    account = people.account(work.db, name)
    if account is None:
        raise Invalid(problem("unknown-account", "There is no account “%(name)s”.", column="name", name=name))
    return account


def _person(account: Account, scopes: frozenset[str] | None = None) -> Person:
    granted = frozenset(ROLES[account.role]) if scopes is None else scopes
    return Person(account.name, account.full_name, account.role, granted)


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
