"""Helpers of the station's tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for `unreal`: test modules are no package
