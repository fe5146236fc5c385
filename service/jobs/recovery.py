"""Nothing finished is lost: notes of which a store is made again, and what a start does with what was left.

dems/<id>/notes/<id>.json, results/<digest>/notes/<job>.json    a row of the store each
"""

from __future__ import annotations

import json
import logging
import os
import re
import sqlite3
import time
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

from service.errors import JobInterruptedError
from service.files.layer import replacing

from .folder import DataFolder
from .records import Failure, JobRecord, JobStatus
from .store import Store
from .store_file import StoredRow

__all__ = ["NOTES", "adopt", "interrupted", "note_dem", "note_job", "note_some", "recover", "unnote_job"]

logger = logging.getLogger("sightline.jobs")

NOTES = "notes"
TABLES = {"dems": "dems", "results": "jobs"}
# others come to the store in between
AT_A_TIME, AT_ONCE_S = 20, 0.005
# of many that are missing, the log names some
TOLD_ONE_BY_ONE = 20
ID = re.compile(r"[0-9a-f]{32}")


def note_dem(store: Store, folder: DataFolder, dem_id: str) -> None:
    """Note a DEM beside its files."""
    _write(folder.dem(dem_id), dem_id, store.row("dems", dem_id))


def note_job(store: Store, folder: DataFolder, job_id: str, digest: str) -> None:
    """Note a finished job beside the files of its result."""
    _write(folder.result(digest), job_id, store.row("jobs", job_id))


def unnote_job(folder: DataFolder, job_id: str, digest: str) -> None:
    """Forget a job whose result others share."""
    (folder.result(digest) / NOTES / f"{job_id}.json").unlink(missing_ok=True)


def note_some(store: Store, folder: DataFolder, after: str) -> str | None:
    """Note some jobs that have no note: from before there were any, or from when the service was killed.

    Those whose ids follow on ``after``; the last of them comes back, None when there are no more.
    """
    last: str | None = None
    until_s = time.monotonic() + AT_ONCE_S
    for job_id, digest in store.succeeded(after, AT_A_TIME):
        if not (folder.result(digest) / NOTES / f"{job_id}.json").exists():
            note_job(store, folder, job_id, digest)
        last = job_id
        if time.monotonic() >= until_s:
            break
    return last


def adopt(store: Path, folders: Iterable[Path]) -> int:
    """Put into a copy of a store what the notes in folders of DEMs and results say; how many rows are new."""
    new = 0
    with closing(sqlite3.connect(store)) as connection:
        for folder in folders:
            table = TABLES.get(folder.parent.name)
            for note in sorted((folder / NOTES).glob("*.json")) if table else ():
                try:
                    new += _insert(connection, str(table), _read(note, folder.name))
                except (OSError, ValueError, KeyError, TypeError, sqlite3.Error) as error:
                    logger.warning("the note %s makes no sense (%s) and is passed over", note, error)
        connection.commit()
    return new


def _insert(connection: sqlite3.Connection, table: str, row: StoredRow) -> int:
    """Raises ValueError for a row of a newer Sightline; columns that an older one's lacks have their defaults."""
    if not row.keys() <= {column[1] for column in connection.execute(f"PRAGMA table_info({table})")}:
        raise ValueError("it is of a newer Sightline")
    query = f"INSERT INTO {table} ({', '.join(row)}) VALUES ({', '.join('?' * len(row))}) ON CONFLICT (id) DO NOTHING"
    return connection.execute(query, tuple(row.values())).rowcount


def _write(folder: Path, name: str, row: StoredRow | None) -> None:
    if row is None or not folder.is_dir():
        return
    try:
        (folder / NOTES).mkdir(exist_ok=True)
        with replacing(folder / NOTES / f"{name}.json") as unfinished:
            unfinished.write_text(json.dumps(dict(row), allow_nan=False), encoding="utf-8")
    except OSError as error:
        # the store has it; only a store that is lost could not be made again
        logger.error("no note of %s could be written: %s", name, error)


def _read(note: Path, owner: str) -> StoredRow:
    """The row in a note. Raises OSError; ValueError, KeyError, TypeError unless it is of that DEM or result."""
    row = json.loads(note.read_text(encoding="utf-8"))
    if not ID.fullmatch(row["id"]) or owner != row.get("digest", row["id"]):
        raise ValueError(f"it is not of {owner}")
    if "digest" in row:
        str(row["kind"]), JobStatus(row["status"]), json.loads(row["request"])
    json.loads(row["summary"])
    return dict(row)


def recover(store: Store, folder: DataFolder, max_attempts: int) -> list[JobRecord]:
    """Jobs to take on again: those that waited, and those that ran unless they were tried often enough."""
    known = store.known()
    folder.take_back(known)
    folder.set_aside_unknown(known)
    for dem_id in sorted(known.dems):
        if not folder.dem(dem_id).is_dir():
            logger.error("DEM %s: its files are missing from the data folder; upload it again", dem_id)
        elif not (folder.dem(dem_id) / NOTES / f"{dem_id}.json").exists():
            note_dem(store, folder, dem_id)
    again = []
    for job in store.active_jobs():
        if job.status is JobStatus.RUNNING and job.attempts >= max_attempts:
            store.finish_job(job.id, JobStatus.INTERRUPTED, failure=Failure.of(interrupted(job.attempts)))
        elif job.has_inputs and not folder.inputs(job.id).is_dir():
            store.finish_job(job.id, JobStatus.INTERRUPTED, failure=_missing("What it was asked"))
        else:
            if job.status is JobStatus.RUNNING:
                store.requeue_job(job.id)
            again.append(job)
    with os.scandir(folder.result("any").parent) as results:  # at one look, however many there are
        there = frozenset(entry.name for entry in results if entry.is_dir())
    lost = store.look_for_results(known, there, _missing("Its result"))
    for job_id in lost[:TOLD_ONE_BY_ONE]:
        logger.error("job %s: its result is missing from the data folder", job_id)
    if len(lost) > TOLD_ONE_BY_ONE:
        logger.error("%d jobs in all: their results are missing from the data folder", len(lost))
    held = folder.count_quarantined()
    if held:
        logger.warning("%d in quarantine, where nothing is deleted; `sightline store check` lists it", held)
    return again


def interrupted(attempts: int) -> JobInterruptedError:
    """A job's worker died in its last attempt."""
    times = "once" if attempts == 1 else f"{attempts} times"
    return JobInterruptedError(
        f"The job was started {times} and its worker process ended each time before it was done; it may need more "
        "memory than the machine has. POST it again to try once more."
    )


def _missing(what: str) -> Failure:
    return Failure("service.JobInterruptedError", f"{what} is missing from the data folder.")
