"""What is remembered of DEMs and jobs, and how rows of the store hold it."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NotRequired, TypedDict

from pydantic import JsonValue

from service.access.callers import DEFAULT_TENANT
from service.database import Place, Row

__all__ = [
    "ACTIVE",
    "DemRecord",
    "Failure",
    "JobRecord",
    "JobRequest",
    "JobStatus",
    "Known",
    "Place",
    "as_json",
    "dem_of",
    "failure_text",
    "has_inputs",
    "job_of",
]


class JobStatus(StrEnum):
    """Where a job stands."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    INTERRUPTED = "interrupted"


ACTIVE = (JobStatus.QUEUED, JobStatus.RUNNING)
# what these were asked was too big for the store already when no job said that it has inputs
OLDER_WITH_INPUTS = frozenset({"lines-of-sight", "safety-bubbles"})


@dataclass(frozen=True, slots=True)
class Failure:
    """Why something did not work out.

    error: class that was raised, as ``package.Class``. detail: its sentence. data: its numbers, for programs.
    """

    error: str
    detail: str
    data: Mapping[str, object] = field(default_factory=dict)

    @classmethod
    def of(cls, error: Exception) -> Failure:
        """The same from an exception; numbers and words that it carries come along, as JSON can have them."""
        name = f"{type(error).__module__.partition('.')[0]}.{type(error).__name__}"
        told = (int, float, str, dict, tuple)
        data = {key: _bounded(value) for key, value in vars(error).items() if isinstance(value, told)}
        # half a surrogate pair of a request, which no text in UTF-8 has
        return cls(name, str(error).encode("utf-8", "replace").decode(), data)


def _bounded(value: object) -> object:
    """A whole number of more than 64 bits as the nearest float, or the largest."""
    if not isinstance(value, int) or abs(value) < 2**63:
        return value
    return float(max(-sys.float_info.max, min(value, sys.float_info.max)))


@dataclass(frozen=True, slots=True)
class Known:
    """Everything that a store knows, by what it is called in the data folder."""

    dems: frozenset[str]
    jobs: frozenset[str]
    jobs_over: frozenset[str]
    digests: frozenset[str]
    inputs: frozenset[str]  # ids of jobs that wait or run and have files to work on
    missions: int = 0  # they have no files
    whole: frozenset[str] = frozenset()  # digests of results that jobs have
    lost: frozenset[str] = frozenset()  # digests of results that jobs had, and whose files were not there at a start

    def parts(self) -> tuple[tuple[str, frozenset[str]], ...]:
        """The data folder's folders, each with what the store wants to find there."""
        return ("dems", self.dems), ("results", self.digests), ("inputs", self.inputs)

    def wanted(self) -> list[tuple[str, str]]:
        """(folder, name) of everything that the store wants to find."""
        return [(part, name) for part, names in self.parts() for name in sorted(names)]

    def counts(self) -> dict[str, int]:
        """Ready for JSON."""
        return {
            "dems": len(self.dems),
            "jobs": len(self.jobs),
            "results": len(self.digests),
            "missions": self.missions,
        }


@dataclass(frozen=True, slots=True)
class DemRecord:
    """An uploaded DEM: its id, the name it came under, when (seconds since 1970 UTC), what was read, whose it is."""

    id: str
    name: str
    created_at_s: float
    summary: Mapping[str, JsonValue]
    tenant: str = DEFAULT_TENANT

    @property
    def place(self) -> Place:
        """Where it stands in lists."""
        return Place(self.created_at_s, self.id)


class JobRequest(TypedDict):
    """What a job is asked, ready for JSON.

    parameters: of its product, without what lies in its folder of inputs. has_inputs: whether there is such a folder.
    notes: sentences for whoever asked, about older names for instance.
    """

    parameters: Mapping[str, JsonValue]
    has_inputs: NotRequired[bool]
    notes: NotRequired[list[str]]


@dataclass(frozen=True, slots=True)
class JobRecord:
    """A job as the store knows it; times are seconds since 1970 UTC.

    attempts: how often it was started.
    digest: names the files of the result. summary: what the result says, ready for JSON. pinned: kept for good.
    """

    id: str
    kind: str
    dem_id: str
    request: JobRequest
    status: JobStatus
    created_at_s: float
    started_at_s: float | None = None
    finished_at_s: float | None = None
    attempts: int = 0
    digest: str | None = None
    summary: Mapping[str, JsonValue] | None = None
    failure: Failure | None = None
    pinned: bool = False
    tenant: str = DEFAULT_TENANT

    @property
    def place(self) -> Place:
        """Where it stands in lists."""
        return Place(self.created_at_s, self.id)

    @property
    def has_inputs(self) -> bool:
        """Whether what it was asked is too big for the store, and lies in a folder of its own until it is over."""
        return has_inputs(self.kind, self.request)

    @property
    def active(self) -> bool:
        """Whether it still waits or runs."""
        return self.status in ACTIVE


def has_inputs(kind: str, request: JobRequest) -> bool:
    """Whether a job of that kind, which is asked that, has a folder of inputs."""
    return bool(request.get("has_inputs", kind in OLDER_WITH_INPUTS))


def as_json(value: Mapping[str, object]) -> str:
    """The text of a column that holds JSON."""
    return json.dumps(dict(value), allow_nan=False)


def failure_text(failure: Failure) -> str:
    """A failure as its column holds it."""
    return as_json({"error": failure.error, "detail": failure.detail, "data": failure.data})


def dem_of(row: Row) -> DemRecord:
    """The DEM of a row."""
    return DemRecord(row["id"], row["name"], row["created_at_s"], json.loads(row["summary"]), row["tenant"])


def job_of(row: Row) -> JobRecord:
    """The job of a row."""
    # a job whose files are not at hand keeps its result in the store, and has none to show
    at_hand = row["status"] == JobStatus.SUCCEEDED
    return JobRecord(
        row["id"],
        row["kind"],
        row["dem_id"],
        json.loads(row["request"]),
        JobStatus(row["status"]),
        row["created_at_s"],
        row["started_at_s"],
        row["finished_at_s"],
        row["attempts"],
        row["digest"] if at_hand else None,
        json.loads(row["summary"]) if at_hand and row["summary"] is not None else None,
        None if row["failure"] is None else Failure(**json.loads(row["failure"])),
        bool(row["pinned"]),
        row["tenant"],
    )
