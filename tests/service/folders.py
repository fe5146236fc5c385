"""Folders as tests look at them, and small data folders made without a service."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from service.jobs.folder import DataFolder, digest_of
from service.jobs.kept_files import save_grid
from service.jobs.records import DemRecord, JobRecord, JobStatus
from service.jobs.recovery import note_some, recover
from service.jobs.store import Store
from terrain import ElevationGrid

DEM = "d" * 32


def contents(folder: Path) -> dict[str, bytes | str | None]:
    """Every file's bytes, every link's aim and every folder, by their place in the folder."""
    return {
        path.relative_to(folder).as_posix(): (
            str(path.readlink()) if path.is_symlink() else path.read_bytes() if path.is_file() else None
        )
        for path in folder.rglob("*")
    }


def job_id(number: int) -> str:
    return f"{number:032x}"


def small_data_folder(root: Path, jobs: int, *, first: int = 0) -> None:
    """One DEM and so many finished jobs, each with a result of one file; added to what is there."""
    folder = DataFolder.open(root)
    store = Store(folder.database)
    if not folder.dem(DEM).exists():
        grid = ElevationGrid(np.arange(12, dtype=np.float32).reshape(3, 4), 30.0, 25.0, crs="EPSG:32611")
        save_grid(grid, folder.dem(DEM))
        store.add_dem(DemRecord(DEM, "hill.tif", 1.0, {"sha256": grid.digest}))
    for number in range(first, first + jobs):
        store.add_job(JobRecord(job_id(number), "visibility-map", DEM, {}, JobStatus.QUEUED, 1.0))
        work = folder.work(job_id(number))
        work.mkdir()
        (work / "count.npy").write_bytes(b"result %d" % number)
        digest = digest_of(work)
        work.rename(folder.result(digest))
        store.finish_job(job_id(number), JobStatus.SUCCEEDED, digest=digest, summary={"number": number})
    recover(store, folder, max_attempts=1)
    note_some(store, folder, "")
    store.close()
    folder.close()
