"""Queries for accounts and what proves who somebody is."""

from collections.abc import Sequence

import sqlalchemy as sa
from sqlalchemy.orm import Session

from app.store.tables import Account, Login, SignInLink, Token


def account(db: Session, name: str) -> Account | None:
    """The account of that name."""
    return db.scalar(sa.select(Account).where(Account.name == name))


def accounts(db: Session) -> Sequence[Account]:
    """Every account, by name."""
    return db.scalars(sa.select(Account).order_by(Account.name)).all()


def token(db: Session, digest: str) -> Token | None:
    """The token whose secret has this digest, revoked or not."""
    return db.scalar(sa.select(Token).where(Token.digest == digest))


def login(db: Session, digest: str) -> Login | None:
    """The signed-in browser whose cookie has this digest, revoked or not."""
    return db.get(Login, digest)


def sign_in_link(db: Session, digest: str) -> SignInLink | None:
    """The sign-in link whose secret has this digest, expired or not."""
    return db.get(SignInLink, digest)
