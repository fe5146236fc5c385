"""Metrics as Prometheus scrapes them: requests, queue, seconds by kind, memory, sessions, bytes."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

from fastapi import APIRouter, Request, Response
from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_LATEST
from prometheus_client.registry import Collector

from service.http.context import Service
from service.http.guard.connections import Connections
from service.jobs.pool import Lane
from service.jobs.upkeep.telling import JobOver
from service.machine.limits import resident_bytes

__all__ = ["Metrics", "router"]

router = APIRouter(tags=["Health"])

REQUEST_BUCKETS_S = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
JOB_BUCKETS_S = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 900.0)


class Metrics:
    """The metrics of one app, in a registry of their own."""

    def __init__(self, version: str) -> None:
        self.registry = CollectorRegistry()
        self.connections: Connections | None = None
        self._version = version
        self._requests = Counter(
            "sightline_http_requests", "Requests answered; status 0: the client left before.",
            ("method", "route", "status"), registry=self.registry,
        )  # fmt: skip
        self._seconds = Histogram(
            "sightline_http_request_seconds", "Seconds from a request to the end of its answer.",
            ("method", "route"), buckets=REQUEST_BUCKETS_S, registry=self.registry,
        )  # fmt: skip
        self._jobs = Counter("sightline_jobs_over", "Jobs that are over.", ("kind", "status"), registry=self.registry)
        self._job_seconds = Histogram(
            "sightline_job_seconds", "Seconds that the last attempt of jobs ran.",
            ("kind",), buckets=JOB_BUCKETS_S, registry=self.registry,
        )  # fmt: skip
        # what is looked up by labels costs more than to count: routes, methods and statuses are few
        self._of_answers: dict[tuple[str, str, int], tuple[Counter, Histogram]] = {}

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """A request was answered."""
        key = (method, route, status)
        found = self._of_answers.get(key)
        if found is None:
            found = self._requests.labels(method, route, str(status)), self._seconds.labels(method, route)
            self._of_answers[key] = found
        requests, times = found
        requests.inc()
        times.observe(seconds)

    def job_over(self, over: JobOver) -> None:
        """A job is over."""
        self._jobs.labels(over.job.kind, str(over.status)).inc()
        if over.ran_s is not None:
            self._job_seconds.labels(over.job.kind).observe(over.ran_s)

    def watch(self, service: Service) -> None:
        """Tell of a service that has been put together."""
        service.supervisor.telling.listeners.append(self.job_over)
        self.registry.register(_State(service, self._version, self.connections))


class _State(Collector):
    """What is read of the service when somebody asks."""

    def __init__(self, service: Service, version: str, connections: Connections | None) -> None:
        self._service = service
        self._connections = connections
        self._version = version

    def describe(self) -> Iterable[Metric]:
        """Nothing: the names would be collected, and nobody else registers here."""
        return ()

    def collect(self) -> Iterator[Metric]:
        """Every gauge."""
        service = self._service
        supervisor, pool = service.supervisor, service.pool
        yield _one("sightline_info", "Version of Sightline.", {self._version: 1.0}, "version")
        yield _one("sightline_uptime_seconds", "Since the service started.", time.monotonic() - service.started_at_s)
        yield _one("sightline_jobs_running", "Jobs that are being calculated.", supervisor.running)
        waiting = {str(lane.value): float(pool.waiting(lane)) for lane in Lane}
        yield _one("sightline_queue_length", "Tasks that wait for a worker.", waiting, "lane")
        yield _one("sightline_workers_warm", "Worker processes that are ready or at work.", pool.warm)
        yield _one("sightline_workers_wanted", "Worker processes that there should be.", pool.size)
        memory = {
            "server": float(resident_bytes()),
            "workers": float(sum(resident_bytes(str(pid)) for pid in pool.pids)),
        }
        yield _one("sightline_memory_resident_bytes", "Memory in use, what is shared counted twice.", memory, "process")
        yield _one("sightline_detector_sessions", "Detector sessions that are open.", len(service.detectors))
        if self._connections is not None:
            yield _one("sightline_connections", "Connections that are open.", len(self._connections))
            ended = {what: float(number) for what, number in self._connections.ended.items()}
            yield _one("sightline_connections_ended", "Ended or refused, and why, since the start.", ended, "why")
        yield _one("sightline_store_bytes", "What the store takes.", service.store.size_bytes)
        yield _one("sightline_store_writable", "1 when it could be written last.", float(service.store_writable))
        yield _one("sightline_results_bytes", "Files of results.", supervisor.retention.results_bytes)
        yield _one("sightline_disk_free_bytes", "Left on the data folder's disk.", supervisor.space.free_bytes)
        yield _one("sightline_disk_low", "1 when new work is refused for want of room.", float(supervisor.space.low))
        yield _one("sightline_quarantined", "Things in quarantine.", service.quarantined)


def _one(name: str, words: str, values: float | dict[str, float], label: str | None = None) -> Metric:
    family = GaugeMetricFamily(name, words, labels=[] if label is None else [label])
    for key, value in values.items() if isinstance(values, dict) else (("", values),):
        family.add_metric([] if label is None else [key], float(value))
    return family


@router.get("/metrics", include_in_schema=False)
async def metrics(request: Request) -> Response:
    """For Prometheus, in its text format."""
    told: Metrics = request.app.state.metrics
    return Response(generate_latest(told.registry), media_type=CONTENT_TYPE_LATEST)
