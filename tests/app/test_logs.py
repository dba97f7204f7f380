"""Logging goes to standard error as it is at the moment, and tells no secrets."""

import io
import json
import sys

import structlog

from app import logs


def test_standard_error_may_change_after_the_set_up(monkeypatch):
    first, second = io.StringIO(), io.StringIO()
    monkeypatch.setattr(sys, "stderr", first)
    logs.configure()
    first.close()
    monkeypatch.setattr(sys, "stderr", second)
    structlog.get_logger("test").warning("told", answer=42)
    line = json.loads(second.getvalue())
    assert (line["event"], line["answer"], line["level"]) == ("told", 42, "warning")


def test_a_traceback_shows_no_local_variables(monkeypatch):
    out = io.StringIO()
    monkeypatch.setattr(sys, "stderr", out)
    logs.configure()
    password = "correct horse"
    try:
        raise ValueError(len(password))
    except ValueError:
        structlog.get_logger("test").exception("failed")
    assert "ValueError" in out.getvalue()
    assert password not in out.getvalue()
