"""Helpers of the station's tests."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for `unreal`: test modules are no package


@pytest.fixture
def no_sync(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody cuts the power during a test: what is written is there, and thousands of writes take no time."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)
