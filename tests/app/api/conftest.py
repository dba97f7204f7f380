import csv
import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from serving import GRID, Service, ready, running

from app.main import working_lab
from app.settings import Settings


@pytest.fixture
def means() -> list[dict[str, float]]:
    """Sixteen made-up means; what matters is that no two are equal."""
    return [
        {"theta_deg": theta, "psi_deg": psi, "jx_ma": 0.0011 * (n + 1), "jy_ma": -0.0003 * (16 - n)}
        for n, (theta, psi) in enumerate(GRID)
    ]


@pytest.fixture
def currents() -> dict[str, np.ndarray[Any, Any]]:
    """A minute at 200 Hz: 12,000 samples of white noise about two means."""
    rng = np.random.default_rng(20260301)
    noise = rng.normal(scale=1e-6, size=(2, 12_000))
    return {"t_s": np.arange(12_000) / 200.0, "jx_ma": 0.0045 + noise[0], "jy_ma": -0.0021 + noise[1]}


def as_csv(columns: dict[str, Any]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return text.getvalue().encode()


def as_parquet(columns: dict[str, Any]) -> bytes:
    stream = io.BytesIO()
    pq.write_table(pa.table(columns), stream)
    return stream.getvalue()


@pytest.fixture
def record_csv(currents: dict[str, Any]) -> bytes:
    return as_csv(currents)


@pytest.fixture
def record_parquet(currents: dict[str, Any]) -> bytes:
    return as_parquet(currents)


@pytest.fixture(scope="module")
def solving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """The service with its real job engine and a registered stand, for the tests of one module."""
    settings = Settings(data=tmp_path_factory.mktemp("solving"), workers=1)
    with running(settings, working_lab) as service:
        ready(service.client())
        yield service
