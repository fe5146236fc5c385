"""How the service is."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["Health", "JobCounts", "Ready", "WorkerCounts"]


class WorkerCounts(BaseModel):
    """Worker processes."""

    warm: int = Field(description="Processes that are ready or at work.")
    wanted: int = Field(description="Processes that there should be.")


class JobCounts(BaseModel):
    """Calculations that are not finished."""

    queued: int = Field(description="Jobs that wait for a worker.")
    running: int = Field(description="Jobs that are being calculated.")


class Health(BaseModel):
    """The state of the service in one glance."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "status": "ok",
                    "version": "0.1.0",
                    "uptime_s": 3600.5,
                    "workers": {"warm": 5, "wanted": 5},
                    "jobs": {"queued": 0, "running": 2},
                    "store_writable": True,
                    "quarantined": 0,
                }
            ]
        }
    )

    status: Literal["ok", "degraded"] = Field(description="degraded: no warm worker, or nothing can be written.")
    version: str = Field(description="Version of Sightline.")
    uptime_s: float = Field(description="Seconds since it started.")
    workers: WorkerCounts
    jobs: JobCounts
    store_writable: bool = Field(description="Whether data folder and job store could be written when last tried.")
    quarantined: int = Field(
        description="Number of DEMs, results and other things in the data folder's quarantine: the store did not know "
        "them. They stay there until somebody takes them back or clears it."
    )


class Ready(BaseModel):
    """Work can be given."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "ready"}]})

    status: Literal["ready"] = Field(description="Always ready; otherwise the answer is 503.")
