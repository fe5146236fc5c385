"""Requests and their jobs as one trace, at a collector that speaks OTLP over HTTP; otherwise nothing is loaded."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.proto.trace.v1.trace_pb2 import Span, Status

from service.errors import StartError
from service.http.app import create_app
from service.settings import Settings
from tests.service.running import running

ANCHOR = {"id": "D1", "lon_deg": -84.2392, "lat_deg": 36.3300, "above_ground_m": 150.0}
TRACE, PARENT = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
ROOT = Path(__file__).parents[2]


class Collector:
    """Spans that came, and of which service."""

    def __init__(self) -> None:
        self.spans: list[Span] = []
        self.services: set[str] = set()
        collector = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                if self.path == "/otel/v1/traces" and self.headers["Content-Type"] == "application/x-protobuf":
                    for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
                        collector.services.add(of(resource.resource)["service.name"])
                        collector.spans += [span for scope in resource.scope_spans for span in scope.spans]
                self.send_response(200)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/otel/"


def of(told: Span) -> dict[str, str | int]:
    """Attributes by name."""
    return {
        one.key: one.value.int_value if one.value.HasField("int_value") else one.value.string_value
        for one in told.attributes
    }


@pytest.fixture
def collector() -> Iterator[Collector]:
    collector = Collector()
    thread = threading.Thread(target=collector.server.serve_forever)
    thread.start()
    yield collector
    collector.server.shutdown()
    thread.join()
    collector.server.server_close()


def test_a_request_and_its_job_are_spans_of_the_callers_trace_with_the_requests_id(
    tmp_path: Path, collector: Collector
) -> None:
    settings = {"workers": 1, "spare_workers": 0, "rehearse": "maps", "otlp_endpoint": collector.url}
    with running(tmp_path / "data", **settings) as server:
        dem = server.sample()
        asked = {"dem_id": dem["id"], "anchors": [ANCHOR]}
        headers = {"traceparent": f"00-{TRACE}-{PARENT}-01", "X-Request-Id": "req-7", "Prefer": "wait=60"}
        job = server.client.post("/visibility-maps", json=asked, headers=headers).json()
        assert job["status"] == "succeeded"
        assert server.client.get("/visibility-maps/none").status_code == 404
        server.client.get("/health")
        server.stop()
    assert collector.services == {"sightline"}
    [request] = [span for span in collector.spans if span.name == "POST /visibility-maps"]
    assert (request.trace_id.hex(), request.parent_span_id.hex(), request.kind) == (TRACE, PARENT, 2)
    told = of(request)
    assert (told["http.response.status_code"], told["sightline.request_id"]) == (201, "req-7")
    [calculated] = [span for span in collector.spans if span.name == "job visibility-map"]
    assert (calculated.trace_id, calculated.parent_span_id) == (request.trace_id, request.span_id)
    told = of(calculated)
    assert (told["sightline.job.id"], told["sightline.job.status"]) == (job["id"], "succeeded")
    assert told["sightline.request_id"] == "req-7"
    [begins] = calculated.events
    assert calculated.start_time_unix_nano <= begins.time_unix_nano <= calculated.end_time_unix_nano
    assert request.start_time_unix_nano <= calculated.start_time_unix_nano
    assert calculated.status.code == Status.STATUS_CODE_UNSET
    names = {span.name for span in collector.spans}
    assert any(name.startswith("GET /visibility-maps/{") for name in names), names  # the route, not the id
    assert not [name for name in names if "health" in name or "ready" in name]


def test_a_collector_that_is_away_stops_nothing(tmp_path: Path) -> None:
    settings = {"workers": 1, "spare_workers": 0, "rehearse": "maps", "otlp_endpoint": "http://127.0.0.1:9"}
    with running(tmp_path / "data", **settings) as server:
        assert server.client.get("/visibility-maps").status_code == 200
        server.stop()
        assert "Traceback" not in server.log.read_text()


def test_without_a_collector_nothing_that_collects_is_loaded(tmp_path: Path) -> None:
    program = (
        "import sys\nfrom service.http.app import create_app\nfrom service.settings import Settings\n"
        f"create_app(Settings(data_folder={str(tmp_path / 'data')!r}))\n"
        "print([name for name in sys.modules if name.startswith(('opentelemetry.sdk', 'opentelemetry.exporter'))])"
    )
    ended = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert ended.stdout.strip() == "[]", ended.stderr


def test_a_package_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)
    with pytest.raises(StartError, match=r"pip install 'sightline\[telemetry\]'"):
        create_app(Settings(otlp_endpoint="http://127.0.0.1:9"))
