"""Traces of requests and jobs for OpenTelemetry; without a collector in the settings nothing of its SDK is loaded.

FastAPI itself makes the spans of requests. What a request has begun, its job among it, is in the trace of the request.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from typing import TYPE_CHECKING, Any

from fastapi.telemetry import TelemetryConfig
from opentelemetry.trace import StatusCode

from service.errors import StartError
from service.http.context import Service
from service.jobs.records import JobStatus
from service.jobs.upkeep.telling import JobOver
from service.logs import request_id
from service.settings import Settings

from .requests import ROUTINE

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider as CollectingProvider

__all__ = ["Traces"]

EXPORT_MAY_TAKE_S = 5.0
# a client's doing; all else that is no success is told as an error
NO_ERROR = frozenset({JobStatus.SUCCEEDED, JobStatus.CANCELLED})


class Traces:
    """Where the spans of one app go; ``close`` sends what waits. Raises StartError where the package is missing."""

    def __init__(self, settings: Settings, version: str) -> None:
        self._provider: CollectingProvider | None = None
        if settings.otlp_endpoint is not None:
            self._provider = _collecting(f"{settings.otlp_endpoint.rstrip('/')}/v1/traces", version)

    @property
    def config(self) -> TelemetryConfig:
        """What FastAPI is to trace; it has no metrics and logs beside ours."""
        return {
            "tracing": self._provider is not None,
            "tracer_provider": self._provider,
            "exclude": _routine,
            "metrics": False,
            "logs": False,
            "operation_spans": False,
            "auto_configure": False,
        }

    def watch(self, service: Service) -> None:
        """Trace the jobs of a service too."""
        if self._provider is not None:
            service.supervisor.telling.listeners.append(self._job_over)

    def close(self) -> None:
        """Send what has not been sent; a collector that does not answer is waited for a few seconds."""
        if self._provider is not None:
            self._provider.shutdown()

    def _job_over(self, over: JobOver) -> None:
        """A job's span, from when it was asked for until it was over; its event says when a worker began it."""
        assert self._provider is not None
        job = over.job
        span = self._provider.get_tracer("sightline").start_span(
            f"job {job.kind}",
            start_time=_ns(job.created_at_s),
            attributes={
                "sightline.job.id": job.id,
                "sightline.job.kind": job.kind,
                "sightline.job.status": str(over.status),
                "sightline.dem.id": job.dem_id,
                "sightline.request_id": request_id.get() or "",
            },
        )
        if over.ran_s is not None:
            span.add_event("begins", timestamp=_ns(over.at_s - over.ran_s))
        if over.status not in NO_ERROR:
            span.set_status(StatusCode.ERROR, over.why)
        span.end(_ns(over.at_s))


def _routine(scope: MutableMapping[str, Any]) -> bool:
    return scope.get("path") in ROUTINE


def _ns(time_s: float) -> int:
    return round(time_s * 1e9)


def _collecting(endpoint: str, version: str) -> CollectingProvider:
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        raise StartError(
            "SIGHTLINE_OTLP_ENDPOINT needs the packages of OpenTelemetry: pip install 'sightline[telemetry]'."
        ) from error
    # what OTEL_... variables say of sampling, resources, headers and batches holds
    named = {"service.name": os.environ.get("OTEL_SERVICE_NAME", "sightline"), "service.version": version}
    provider = TracerProvider(resource=Resource.create(named), shutdown_on_exit=False)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(endpoint, timeout=EXPORT_MAY_TAKE_S)))
    return provider
