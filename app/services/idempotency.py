"""Requests that may be repeated: the same key gives what was made the first time."""

import hashlib
import json
from typing import Any

from app.errors import Conflict, problem
from app.services.lab import Work
from app.store import results
from app.store.tables import IdempotentReply


def fingerprint(purpose: str, content: Any) -> str:
    """What a request asks for, as SHA-256; `content` is plain JSON, and the order of its keys is nothing."""
    plain = json.dumps([purpose, content], sort_keys=True, default=str)
    return hashlib.sha256(plain.encode()).hexdigest()


def made_before(work: Work, key: str | None, asked: str) -> str | None:
    """The subject made for this key by the same account, or None when the key is new.

    Raises
    ------
    Conflict
        The key came with another request.
    """
    earlier = results.reply(work.db, work.person.name, key) if key is not None else None
    if earlier is None:
        return None
    if earlier.fingerprint != asked:
        raise Conflict(
            problem(
                "key-reused",
                "The Idempotency-Key “%(key)s” came with another request before. Use a new key for a new "
                "request.",
                key=key,
            )
        )
    return earlier.subject


def remember(work: Work, key: str | None, asked: str, subject: str) -> None:
    """Note what was made for this key, in the transaction that made it."""
    if key is not None:
        work.db.add(
            IdempotentReply(
                account=work.person.name, key=key, fingerprint=asked, subject=subject, created_at=work.now
            )
        )
        work.db.flush()
