"""What Prometheus reads: requests, and the jobs in the laboratory's book."""

from collections.abc import Iterator
from typing import Final

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector

from app.services import access, jobs
from app.services.lab import Lab

MEDIA_TYPE: Final = "text/plain; version=0.0.4; charset=utf-8"
_BUCKETS_S: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_METHODS: Final = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class Metrics:
    """The counters of one application, in a registry of their own."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        labels = ("method", "route", "status")
        self._requests = Counter(
            "driftbook_http_requests", "Requests answered.", labels, registry=self._registry
        )
        self._durations = Histogram(
            "driftbook_http_request_duration_seconds",
            "Time until the whole answer was sent.",
            ("method", "route"),
            buckets=_BUCKETS_S,
            registry=self._registry,
        )

    def observe(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count one request; `route` is a pattern, so that there are few of them."""
        known = method if method in _METHODS else "other"
        self._requests.labels(known, route, str(status)).inc()
        self._durations.labels(known, route).observe(seconds)

    def text(self, lab: Lab) -> bytes:
        """Everything, in Prometheus' text format."""
        book = CollectorRegistry()
        book.register(_Book(lab))
        return generate_latest(self._registry) + generate_latest(book)


class _Book(Collector):
    """Jobs by state, counted when they are asked for."""

    def __init__(self, lab: Lab) -> None:
        self._lab = lab

    def collect(self) -> Iterator[GaugeMetricFamily]:
        """Count the jobs."""
        with self._lab.read(access.NOBODY) as work:
            counts = jobs.counts(work)
        family = GaugeMetricFamily("driftbook_jobs", "Jobs by state.", labels=["state"])
        for state, count in counts.items():
            family.add_metric([state], count)
        yield family
