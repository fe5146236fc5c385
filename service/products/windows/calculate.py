"""Visibility maps over rasters larger than memory: anchors with a range limit, each over the ground in its reach."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

import numpy as np
from rasterio.windows import Window

from planning.placement import Cluster
from planning.placement.cluster import results_from_cluster
from service.errors import RequestError
from service.files.layer import replacing
from service.parts.map_facts import curvature_of
from service.parts.sentences import told_as_asked
from service.products import UNWATCHED, Work
from service.products.visibility.request import VisibilityMapParameters
from terrain import ElevationGrid, LargeDem
from visibility.sight.in_reach import Raster, Reach, ReachOptions, work_bytes

from .answer import WindowMap, WindowMapSummary, summary_of
from .files import BLOCK, COUNT, LOWEST, NOTHING, UNITS, combined, to_cog, unfinished_raster
from .ground import Prepared, prepared, raster_of
from .parcels import Parcel, ParcelFacts, remove_parcel, stored, work_out
from .request import WindowMapParameters

__all__ = ["MEMORY_LIMIT_BYTES", "calculate_window_map", "check_room", "make_large_map", "scheduler_of"]

MEMORY_LIMIT_BYTES = 2 << 30
# an anchor's altitudes and classes on disk until all block rows that they touch are written, and those rows
DISK_BYTES_PER_POST = 5 + 6
NO_SCHEDULER = (
    "run_on 'cluster' needs a Dask scheduler, and none is set: the service takes its address from "
    "SIGHTLINE_DASK_SCHEDULER, the command line from --scheduler."
)
# of the whole way, what is done once all block rows are written
SHARE_OF_ROWS = 0.9
COLUMNS_AT_A_TIME = 8 * BLOCK


@told_as_asked
def calculate_window_map(grid: ElevationGrid, parameters: WindowMapParameters, work: Work = UNWATCHED) -> WindowMap:
    """The map that the parameters ask for of the raster that a DEM is the overview of, or of the DEM itself.

    Raises as ``make_large_map``; RequestError for workers of a cluster that is not set up, or of a DEM that is held.
    """
    dem = raster_of(grid)
    work = replace(work, scheduler=scheduler_of(parameters, dem, work.scheduler))
    folder = Path(mkdtemp(prefix="map-", dir=work.folder))
    try:
        answer = make_large_map(dem, parameters, folder, work)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return WindowMap(grid, parameters, answer, folder)


def scheduler_of(parameters: WindowMapParameters, dem: Raster, scheduler: str | None) -> str | None:
    """That of the cluster that a request asks for, None for this process. Raises RequestError where it cannot be."""
    if parameters.run_on == "here":
        return None
    if scheduler is None:
        raise RequestError(NO_SCHEDULER)
    if not isinstance(dem, LargeDem):
        raise RequestError("run_on 'cluster' is for a DEM that is read by windows, and this one is held whole.")
    return scheduler


def make_large_map(
    dem: Raster,
    parameters: VisibilityMapParameters,
    folder: Path,
    work: Work | None = None,
    *,
    memory_limit_bytes: int = MEMORY_LIMIT_BYTES,
) -> WindowMapSummary:
    """Write the map of anchors with a range limit over a raster into a folder, by windows; what it says in numbers.

    COUNT: uint8, anchors in sight and anchors unknown among those in reach; 255 (nodata) in reach of none, and in the
    first band where all in reach are unknown. LOWEST: float32 metres, the lowest altitude from which at least one is in
    sight; +inf at none, NaN (nodata) unknown or in reach of none. In reach is what lies no further on the map than the
    range. Both are tiled COGs with overviews,
    over the box of posts around all reaches. An anchor at a time is in memory; its answer is min_visible_altitude's of
    the ground in its reach.

    work: progress, stop (nothing is left behind then), and the scheduler of a Dask cluster whose workers read their own
    windows; the raster and the folder must lie where they see them.
    Raises RequestError (no range limit, more memory or disk than there is), DemReadError, AnchorError,
    AreaError, ClusterError, VisibilityInputError, VerticalDatumError, FrameError.
    """
    started_s = time.perf_counter()
    work = work or Work()
    if parameters.cover is not None:
        raise RequestError("A map by windows knows bare ground only; leave out cover, or have the DEM read whole.")
    request = prepared(dem, parameters)
    check_room(request, folder, memory_limit_bytes)
    parameters = request.parameters
    options = ReachOptions(
        parameters.receiver_above_ground_m,
        parameters.receiver_altitude_m,
        parameters.mode,
        parameters.unknown,
        curvature_of(parameters),
    )
    with TemporaryDirectory(prefix=".windows-", dir=folder) as parts:
        parcels = [
            Parcel(number, dem, request.anchors[which], reach, options, str(Path(parts).absolute()), request.shape)
            # from north to south, so that what was written can be freed
            for number, (which, reach) in enumerate(sorted(request.reaches.items(), key=lambda one: one[1].first_row))
        ]
        facts = _write(request, parcels, Path(parts), work)
        by_anchor = {parcel.anchor.id: facts[parcel.number] for parcel in parcels}
        cluster = work.scheduler
        answer = summary_of(
            request, by_anchor, f"workers of the Dask scheduler {cluster}" if cluster else "this process"
        )
        calculated_s = time.perf_counter()
        with ThreadPoolExecutor(2) as pool:  # GDAL's work needs no interpreter
            list(pool.map(lambda name: _finish(Path(parts) / name, folder / name, answer), (COUNT, LOWEST)))
    finished_s = time.perf_counter()
    work.progress(1.0)
    timing = {"calculation_s": calculated_s - started_s, "files_s": finished_s - calculated_s}
    return answer.model_copy(update={"timing": timing})


def _finish(unfinished: Path, path: Path, answer: WindowMapSummary) -> None:
    names = ("version", "mode", "error_statement", "curvature")
    tags = {"product": "window-map", **{name: getattr(answer, name) for name in names}, **UNITS[path.name]}
    with replacing(path) as whole:
        to_cog(unfinished, whole, tags)


def _write(request: Prepared, parcels: Sequence[Parcel], parts: Path, work: Work) -> dict[int, ParcelFacts]:
    """Block rows from north to south, each once all parcels that touch it are done; the facts of all parcels."""
    facts: dict[int, ParcelFacts] = {}
    posts, done = sum(parcel.reach.posts for parcel in parcels), 0
    nan = float("nan")
    dem, box = request.dem, request.box
    count_of = (f"{request.parameters.sight} anchors", "unknown anchors")
    lowest_of = (f"lowest altitude with one {request.parameters.in_words}",)
    with (
        closing(_worked_out(parcels, work)) as coming,
        ThreadPoolExecutor(2) as pool,
        unfinished_raster(dem, box, parts / COUNT, "uint8", NOTHING, count_of) as count,
        unfinished_raster(dem, box, parts / LOWEST, "float32", nan, lowest_of) as lowest,
    ):
        lowest.set_band_unit(1, "metre")
        for first_row in range(box.first_row, box.last_row + 1, BLOCK):
            rows = first_row, min(first_row + BLOCK, box.last_row + 1)
            here = [one for one in parcels if one.reach.first_row < rows[1] and one.reach.last_row >= rows[0]]
            while any(one.number not in facts for one in here):
                number, fact = next(coming)
                facts[number] = fact
                done += parcels[number].reach.posts
                work.progress(SHARE_OF_ROWS * done / posts)
            _write_rows(dem, box, here, rows, (count, lowest), pool)
            for parcel in here:
                if parcel.reach.last_row < rows[1]:
                    remove_parcel(parcel)
    return facts


def _worked_out(parcels: Sequence[Parcel], work: Work) -> Generator[tuple[int, ParcelFacts]]:
    """(number, facts) of each parcel once it is done; while it is used, the next one is worked out already.

    Raises RequestError when somebody wants it ended.
    """
    if work.scheduler is None:
        with ThreadPoolExecutor(1) as ahead:
            coming: Future[ParcelFacts] | None = None
            for parcel in (*parcels, None):
                _go_on(work.stop)
                done, coming = coming, None if parcel is None else ahead.submit(work_out, parcel)
                if done is not None:
                    facts = done.result()
                    yield facts.number, facts
        return

    def submit(client: Any, numbers: Sequence[int]) -> dict[Any, int]:
        return {client.submit(work_out, parcels[number], pure=False): number for number in numbers}

    yield from results_from_cluster(Cluster(work.scheduler), len(parcels), submit, work.stop)
    _go_on(work.stop)


def _go_on(stop: Callable[[], bool]) -> None:
    if stop():
        raise RequestError("The map was ended before it was done; nothing of it is left.")


def _write_rows(
    dem: Raster, box: Reach, parcels: Sequence[Parcel], rows: tuple[int, int], files: tuple[Any, Any], pool: Executor
) -> None:
    """What the parcels say of one block row, where any of them reaches, into count and lowest."""
    count, lowest = files
    arrays = {parcel.number: stored(parcel) for parcel in parcels}
    blocks = []
    for first_col in range(box.first_col, box.last_col + 1, COLUMNS_AT_A_TIME):
        cols = first_col, min(first_col + COLUMNS_AT_A_TIME, box.last_col + 1)
        pieces = []
        for parcel in parcels:
            reach = parcel.reach
            top, bottom = max(rows[0], reach.first_row), min(rows[1], reach.last_row + 1)
            left, right = max(cols[0], reach.first_col), min(cols[1], reach.last_col + 1)
            if top < bottom and left < right:
                part = (
                    slice(top - reach.first_row, bottom - reach.first_row),
                    slice(left - reach.first_col, right - reach.first_col),
                )
                altitude_m, seen = arrays[parcel.number]
                where = slice(top - rows[0], bottom - rows[0]), slice(left - cols[0], right - cols[0])
                pieces.append((parcel, np.asarray(altitude_m[part]), np.asarray(seen[part]), where))
        if pieces:
            blocks.append((Reach(rows[0], rows[1] - 1, cols[0], cols[1] - 1), pieces))
    # numpy leaves the interpreter meanwhile
    said = pool.map(lambda one: combined(dem, *one), blocks)
    for (block, _), (visible, unknown, lowest_m) in zip(blocks, said, strict=True):
        window = Window(
            block.first_col - box.first_col, block.first_row - box.first_row, block.shape[1], block.shape[0]
        )
        count.write(visible, 1, window=window)
        count.write(unknown, 2, window=window)
        lowest.write(lowest_m, 1, window=window)


def check_room(request: Prepared, folder: Path, memory_limit_bytes: int = MEMORY_LIMIT_BYTES) -> None:
    """Before any work. Raises RequestError where there is too little memory or disk."""
    id, posts = request.largest
    needed = work_bytes(posts)
    if needed > memory_limit_bytes:
        raise RequestError(
            f"The reach of anchor {id} has {posts:,} posts, which take about {needed / 1e9:.1f} GB of memory, more "
            f"than the limit of {memory_limit_bytes / 1e9:.1f} GB; give it a shorter max_range_m, or the DEM larger "
            "cells."
        )
    disk = DISK_BYTES_PER_POST * request.posts
    here = folder.absolute()
    free = shutil.disk_usage(next(path for path in (here, *here.parents) if path.exists())).free
    if disk > free:
        raise RequestError(
            f"The map needs up to {disk / 1e9:.1f} GB of disk, and where it is written {free / 1e9:.1f} GB are free."
        )
