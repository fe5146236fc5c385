"""Rows of the store as records, and what their columns hold."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping

from .records import DemRecord, Failure, JobRecord, JobStatus

__all__ = ["as_json", "dem_of", "failure_text", "job_of"]


def as_json(value: Mapping[str, object]) -> str:
    """The text of a column that holds JSON."""
    return json.dumps(dict(value), allow_nan=False)


def failure_text(failure: Failure) -> str:
    """A failure as its column holds it."""
    return as_json({"error": failure.error, "detail": failure.detail, "data": failure.data})


def dem_of(row: sqlite3.Row) -> DemRecord:
    """The DEM of a row."""
    return DemRecord(row["id"], row["name"], row["created_at_s"], json.loads(row["summary"]), row["tenant"])


def job_of(row: sqlite3.Row) -> JobRecord:
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
