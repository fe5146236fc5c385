"""What every job tells, whatever it calculates."""

from __future__ import annotations

from datetime import UTC, datetime

from pydantic import BaseModel, Field

from service.http.problem_answer import Problem
from service.jobs.records import JobStatus

__all__ = ["JobOut", "moment"]


class JobOut(BaseModel):
    """How a calculation stands."""

    id: str = Field(description="Names the resource.")
    status: JobStatus = Field(
        description="queued and running are on their way; succeeded has a result; failed has a problem; cancelled was "
        "deleted before it was done; interrupted means that its worker process died more often than is tried again."
    )
    progress: float = Field(ge=0.0, le=1.0, description="Finished share, 0..1.")
    dem_id: str = Field(description="The DEM it is about.")
    created_at: datetime = Field(description="When it was asked for.")
    started_at: datetime | None = Field(description="When a worker took it last.")
    finished_at: datetime | None = Field(description="When it was over, one way or another.")
    run_s: float | None = Field(description="Seconds from start to end of the last attempt.")
    attempts: int = Field(description="How often it was started.")
    problem: Problem | None = Field(description="Why there is no result, when it is over without one.")
    links: dict[str, str] = Field(description="Paths of what belongs to it.")


def moment(seconds: float | None) -> datetime | None:
    """A time of the store as a date in UTC."""
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
