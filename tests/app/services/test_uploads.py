import os
import time
from datetime import timedelta
from pathlib import Path

from app.services.uploads import sweep


def test_only_what_is_old_is_swept(tmp_path: Path) -> None:
    for name in ("old", "new"):
        (tmp_path / f"{name}-folder").mkdir()
        (tmp_path / f"{name}-folder" / "part").write_bytes(b"x")
        (tmp_path / f"{name}-file").write_bytes(b"x")
    hour_ago = time.time() - 3600
    for path in tmp_path.glob("old-*"):
        os.utime(path, (hour_ago, hour_ago))
    sweep(tmp_path, timedelta(minutes=30))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new-file", "new-folder"]
