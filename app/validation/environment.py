"""The build and the machine that a validation speaks of."""

import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

import solver


def environment() -> dict[str, str]:
    """Versions of the product and of what it computes with, and the platform."""
    config: Mapping[str, Any] = np.show_config(mode="dicts")
    blas = config.get("Build Dependencies", {}).get("blas", {})
    found = config.get("SIMD Extensions", {}).get("found", [])
    return {
        "driftbook": version("driftbook"),
        "solver": solver.__version__,
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "numpy": np.__version__,
        "scipy": version("scipy"),
        "blas": f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip(),
        "simd": found[-1] if found else "baseline",
        "platform": platform.platform(),
        "machine": platform.machine(),
    }
