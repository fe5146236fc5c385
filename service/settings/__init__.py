"""Settings of the service: where it listens, where it keeps data, and every limit. Environment prefix SIGHTLINE_."""

from __future__ import annotations

import resource
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self, get_args

from pydantic import Field, SecretStr, ValidationInfo, field_validator, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.logs import LogFormat
from service.machine.limits import this_machine
from service.machine.shares import LEAST_BYTES, Processes, processes_for

from .ground_sources import GroundSource

__all__ = ["ROOT_PATH", "GroundSource", "Rehearsal", "Settings"]

MIB = 1024 * 1024
GIB = 1024 * MIB

Rehearsal = Literal["everything", "maps"]
ROOT_PATH = r"(/[A-Za-z0-9._~-]{1,64}){1,4}"


def _calculation_bytes(told: Mapping[str, Any]) -> int:
    """What a calculation may take so that all processes of these numbers fit into the machine or the control group."""
    names = ("workers", "file_workers", "spare_workers")
    # one that is not valid is told as such, not for want of memory
    workers, files, spares = (told.get(name, 1) for name in names)
    there = told.get("calculate_on") == "cluster"
    return Processes(0 if there else workers, files, spares).calculation_bytes(this_machine())


def _connections() -> int:
    """So many that descriptors are left for the store, workers, files that come in and files that go out."""
    most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return 1000 if most == resource.RLIM_INFINITY else max(16, min(1000, (most - 128) * 3 // 4))


class Settings(BaseSettings):
    """Each field is read from the environment as SIGHTLINE_<FIELD IN CAPITALS>; arguments given in Python win."""

    model_config = SettingsConfigDict(env_prefix="SIGHTLINE_", frozen=True, extra="forbid", allow_inf_nan=False)

    host: str = Field(default="127.0.0.1", description="Address to listen on; loopback unless told otherwise.")
    port: int = Field(default=8000, ge=0, le=65535, description="TCP port; 0 picks a free one.")
    data_folder: Path = Field(
        default=Path("sightline-data"), description="Folder of uploaded DEMs, job state and results."
    )

    database_url: SecretStr | None = Field(
        default=None,
        description="Database of a PostgreSQL server that keeps the store in place of a file in the data folder, such "
        "as postgresql://sightline@db/sightline.",
    )

    insecure: bool = Field(
        default=False, description="Listen off loopback without keys: whoever reaches the service may do everything."
    )
    keys_file: Path | None = Field(
        default=None, description="File of the API keys; without it keys.json in the data folder."
    )
    oidc_issuer: str | None = Field(
        default=None, description="Identity provider whose tokens are taken too, such as https://login.example.org."
    )
    oidc_audience: str | None = Field(default=None, description="Audience that its tokens must name.")
    oidc_jwks: str | None = Field(
        default=None, description="File or address of its public keys (JWKS); without it the issuer is asked where."
    )
    oidc_tenant_claim: str = Field(default="tenant", description="Claim of a token that names the tenant.")
    max_login_s: float = Field(default=43_200.0, gt=0.0, description="Seconds that a login of the page lasts.")
    allowed_hosts: tuple[str, ...] = Field(
        default=(),
        description="Names that the service answers to beside localhost, host and bare IP addresses, a JSON list; "
        "*.example.org means every name under it, * any name.",
    )
    allowed_origins: tuple[str, ...] = Field(
        default=(),
        description="Web pages of other origins that may use the service, a JSON list such as "
        '["https://maps.example.org"].',
    )

    root_path: str = Field(
        default="",
        pattern=rf"^({ROOT_PATH})?$",
        description="Path of a shared name under which a proxy has the service, such as /sightline.",
    )
    trusted_proxies: tuple[str, ...] = Field(
        default=("127.0.0.1", "::1"),
        description="Addresses and networks of proxies whose X-Forwarded-For, -Proto and -Prefix are believed, a "
        "JSON list.",
    )
    max_connections: int = Field(default_factory=_connections, ge=4, description="Connections that are open at once.")
    max_client_connections: int = Field(
        default=128, ge=1, description="Connections of one address, unless it is a trusted proxy's."
    )
    max_header_s: float = Field(
        default=10.0, gt=0.0, description="Seconds in which a request line and headers must have come."
    )
    max_stall_s: float = Field(
        default=20.0,
        gt=0.0,
        description="Seconds after which a client is cut off that sends less than 1,000 bytes/s of a body, or takes "
        "nothing of an answer.",
    )
    log_format: LogFormat = Field(
        default="text", description="Lines of the log: text for people, or json, one object per line."
    )
    access_log: bool = Field(default=True, description="Whether every request is a line of the log.")
    otlp_endpoint: str | None = Field(
        default=None,
        pattern=r"^https?://[^\s/]+(/[^\s]*)?$",
        description="Base address of an OpenTelemetry collector that takes traces over HTTP, such as "
        "http://collector:4318; none unless set.",
    )

    dask_scheduler: str | None = Field(
        default=None,
        description="Address of a Dask scheduler that placements may be spread over, such as tcp://host:8786.",
    )
    calculate_on: Literal["here", "cluster"] = Field(
        default="here",
        description="Where jobs are calculated: here, or all of them by the workers of dask_scheduler, which have the "
        "data folder under the same path.",
    )
    workers: int = Field(
        default_factory=lambda: processes_for(this_machine()).workers,
        ge=1,
        le=256,
        description="Calculations that run at the same time.",
    )
    file_workers: int = Field(
        default_factory=lambda: processes_for(this_machine()).file_workers,
        ge=1,
        le=64,
        description="Short tasks that run beside them: reading DEMs, checking requests, drawing layers.",
    )
    spare_workers: int = Field(
        default_factory=lambda: processes_for(this_machine()).spare_workers,
        ge=0,
        le=16,
        description="Warm processes that answer probes, and take over when one is cancelled or dies.",
    )

    rehearse: Rehearsal = Field(
        default="everything",
        description="What workers compile and load before they take work: everything, or only fast visibility maps.",
    )

    more_products: tuple[str, ...] = Field(
        default=(),
        description="Products of other packages, a JSON list of places such as package.module:NAME; each is a "
        "service.products.Product.",
    )

    ground_sources: dict[str, GroundSource] = Field(
        default={},
        description="Servers of ground that may be asked, JSON of name to base and scheme (copernicus-glo-30, "
        "copernicus-glo-90, srtm, or template with template); none unless listed.",
    )
    max_ground_store_bytes: int = Field(
        default=10 * GIB, ge=1, description="Bytes that are kept of what was read from them."
    )

    max_upload_bytes: int = Field(default=1 * GIB, ge=1, description="Size of an uploaded DEM file, bytes.")
    max_uploads: int = Field(default=8, ge=1, description="Uploads that are received at the same time.")
    max_incoming_bytes: int = Field(
        default=4 * GIB, ge=1, description="Bytes of uploads that lie on disk while they come in and are read."
    )
    max_body_memory_bytes: int = Field(
        default=64 * MIB, ge=1024, description="Bytes of JSON bodies in memory, of which one client has a quarter."
    )
    max_json_bytes: int = Field(default=2 * MIB, ge=1024, description="Size of a JSON request body, bytes.")
    max_pairs_bytes: int = Field(
        default=64 * MIB,
        ge=1024,
        description="Size of the body of a lines-of-sight, safety-bubbles or navigations request, bytes.",
    )
    max_missions: int = Field(default=1000, ge=0, description="Missions that are kept.")
    max_mission_bytes: int = Field(
        default=MIB, ge=1024, le=32 * MIB, description="Size of a mission's document, bytes."
    )
    max_mission_versions: int = Field(
        default=100, ge=2, le=10_000, description="Versions that are kept of a mission without names, and with names."
    )
    max_log_bytes: int = Field(default=128 * MIB, ge=1024, description="Size of a range log to read, bytes.")
    max_places_bytes: int = Field(default=32 * MIB, ge=1024, description="Size of a file of places to import, bytes.")
    max_dem_cells: int = Field(default=100_000_000, ge=1, description="Cells (rows times columns) of a DEM.")
    max_anchors: int = Field(default=64, ge=1, description="Anchors in one request.")
    max_anchor_cells: int = Field(default=600_000_000, ge=1, description="Cells times anchors of one visibility map.")
    max_voxels: int = Field(default=100_000_000, ge=1, description="Voxels of one control volume.")
    max_candidates: int = Field(default=20_000, ge=1, description="Candidates of one placement.")
    max_pairs: int = Field(default=100_000, ge=1, description="Point pairs in one lines-of-sight request.")
    max_path_points: int = Field(default=100_000, ge=1, description="Points of one path of safety bubbles.")
    max_queued_jobs: int = Field(default=256, ge=1, description="Jobs that wait for a worker.")
    max_tenant_queued_jobs: int = Field(
        default=64, ge=1, description="Jobs of one tenant that wait or run, where keys are demanded."
    )
    max_tenant_calculation_s_per_hour: float | None = Field(
        default=None, gt=0.0, description="Seconds of calculation that one tenant may use in an hour; none unless set."
    )
    max_tenant_storage_bytes: int | None = Field(
        default=None, ge=1, description="Bytes of DEMs and results that one tenant may keep; none unless set."
    )
    max_tenant_detectors: int = Field(
        default=50, ge=0, description="Detector sessions of one tenant, where keys are demanded."
    )
    max_job_s: float = Field(default=900.0, gt=0.0, description="Seconds that one calculation may run.")
    max_file_task_s: float = Field(
        default=120.0, gt=0.0, description="Seconds that reading a DEM or drawing a layer may take."
    )
    max_check_s: float = Field(
        default=30.0, gt=0.0, description="Seconds that reading and checking a request may take before it is taken in."
    )
    max_wait_s: float = Field(default=60.0, ge=0.0, description="Longest wait that `Prefer: wait=SECONDS` is granted.")
    max_worker_memory_bytes: int = Field(
        default_factory=_calculation_bytes,
        ge=LEAST_BYTES,
        description="Memory that one calculation may take on top of a warm worker, bytes; reading, checking and "
        "drawing half of it, a probe a quarter.",
    )
    keep_results_s: float | None = Field(
        default=None,
        gt=0.0,
        description="Seconds that jobs and results are kept after they were over, unless they are pinned; for good "
        "unless set.",
    )
    max_results_bytes: int | None = Field(
        default=None,
        ge=0,
        description="Bytes of results beyond which the oldest are deleted, unless pinned; no limit unless set.",
    )
    min_free_bytes: int = Field(
        default=256 * MIB,
        ge=0,
        description="Bytes of the data folder's disk below which new work is refused, at most a twentieth of the disk.",
    )
    max_attempts: int = Field(
        default=2, ge=1, le=10, description="Times that a job is started when its worker keeps dying."
    )

    max_detectors: int = Field(default=200, ge=0, description="Detector sessions that are open at the same time.")
    max_detector_anchors: int = Field(
        default=32, ge=1, le=62, description="Anchors of a detector, and ranges in one of its epochs."
    )
    max_detector_search: int = Field(
        default=5000, ge=1, description="Subsets of anchors that a detector may be told to try in one epoch."
    )
    max_detector_epochs: int = Field(default=500, ge=1, description="Epochs in one request to a detector session.")
    max_detector_streams: int = Field(default=8, ge=1, description="WebSocket streams of one detector session.")
    max_detector_idle_s: float = Field(
        default=900.0, gt=0.0, description="Seconds that a detector session may lie idle before it expires."
    )
    max_stream_message_bytes: int = Field(
        default=MIB // 16, ge=1024, le=MIB, description="Size of one message on a stream, bytes."
    )
    max_detector_bytes: int = Field(
        default=MIB // 16,
        ge=1024,
        le=MIB,
        description="Size of the body that opens a detector or asks for one detection, bytes.",
    )

    @field_validator("*", mode="before")
    @classmethod
    def _has_digits_alone(cls, value: object, info: ValidationInfo) -> object:
        """Of the environment all is text, and pydantic would read 1_0 as 10."""
        kind = cls.model_fields[str(info.field_name)].annotation
        if isinstance(value, str) and "_" in value and {kind, *get_args(kind)} & {int, float}:
            raise ValueError(f"{value[:40]!r} is not a number")
        return value

    @model_validator(mode="after")
    def _names_its_cluster(self) -> Self:
        if self.calculate_on == "cluster" and self.dask_scheduler is None:
            raise ValueError("With calculate_on 'cluster', dask_scheduler names the scheduler.")
        return self

    @property
    def processes(self) -> Processes:
        """The processes of this machine."""
        workers = 0 if self.calculate_on == "cluster" else self.workers
        return Processes(workers, self.file_workers, self.spare_workers)
