"""Visibility maps over rasters larger than memory: anchors with a range limit, each over the ground in its reach."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rasterio.windows import Window

from planning.placement import Cluster
from planning.placement.cluster import results_from_cluster
from service.errors import RequestError
from service.files.layer import replacing
from service.parts.altitude_datums import in_dem_datum
from service.parts.doubts import doubted_anchors
from service.parts.map_facts import curvature_of
from service.parts.shapes_in_grid import resolve_anchor
from service.products import Work
from terrain import ElevationGrid, LargeDem, height_reference_of, to_grid_frame
from visibility import Anchor
from visibility.sight.in_reach import Reach, ReachOptions, box_of, reach_of, work_bytes

from .calculate import ReceiverHeight
from .large_answer import AnchorInReach, LargeGround, LargeMapSummary
from .large_files import BLOCK, NOTHING, combined, to_cog, unfinished_raster
from .large_parcels import Parcel, ParcelFacts, remove_parcel, stored, work_out
from .request import VisibilityMapParameters

__all__ = ["COUNT", "LOWEST", "MEMORY_LIMIT_BYTES", "make_large_map"]

COUNT, LOWEST = "count.tif", "min_visible_altitude.tif"
MEMORY_LIMIT_BYTES = 2 << 30
# an anchor's altitudes and classes on disk until all block rows that they touch are written, and those rows
DISK_BYTES_PER_POST = 5 + 6
MOST_ANCHORS = 254  # of what a byte counts, 255 means nothing
# of the whole way, what is done once all block rows are written
SHARE_OF_ROWS = 0.9
COLUMNS_AT_A_TIME = 8 * BLOCK


def make_large_map(
    dem: LargeDem,
    parameters: VisibilityMapParameters,
    folder: Path,
    work: Work | None = None,
    *,
    memory_limit_bytes: int = MEMORY_LIMIT_BYTES,
) -> LargeMapSummary:
    """Write the map of anchors with a range limit over a raster into a folder, by windows; what it says in numbers.

    COUNT: uint8, anchors in sight and anchors unknown among those in reach; 255 (nodata) in reach of none, and in the
    first band where all in reach are unknown. LOWEST: float32 metres, the lowest altitude from which at least one is in
    sight; +inf at none, NaN (nodata) unknown or in reach of none. In reach is what lies no further on the map than the
    range. Both are tiled COGs with overviews,
    over the box of posts around all reaches. An anchor at a time is in memory; its answer is min_visible_altitude's of
    the ground in its reach.

    work: progress, stop (nothing is left behind then), and the scheduler of a Dask cluster whose workers read their own
    windows; the raster and the folder must lie where they see them.
    Raises RequestError (no range limit, an area, more memory or disk than there is), DemReadError, AnchorError,
    ClusterError, VisibilityInputError, VerticalDatumError, FrameError.
    """
    started_s = time.perf_counter()
    work = work or Work()
    if parameters.area is not None:
        raise RequestError("A map by windows is of all ground in reach of its anchors; it takes no area.")
    if parameters.cover is not None:
        raise RequestError("A map by windows knows bare ground only; leave out cover, or have the DEM read whole.")
    middle = _ground_at(dem, *_middle(dem))
    parameters, told = in_dem_datum(middle, parameters)
    placed = [_anchor(dem, middle, parameters, number) for number in range(len(parameters.anchors))]
    anchors, passed_over = doubted_anchors(middle, placed, parameters.doubts)
    reaches = {number: reach for number, anchor in enumerate(anchors) if (reach := reach_of(dem, anchor)) is not None}
    _check(dem, anchors, reaches, folder, memory_limit_bytes)
    options = ReachOptions(
        parameters.receiver_above_ground_m,
        parameters.receiver_altitude_m,
        parameters.mode,
        parameters.unknown,
        curvature_of(parameters),
    )
    with tempfile.TemporaryDirectory(prefix=".windows-", dir=folder) as parts:
        parcels = [
            Parcel(number, dem, anchors[which], reach, options, str(Path(parts).absolute()))
            # from north to south, so that what was written can be freed
            for number, (which, reach) in enumerate(sorted(reaches.items(), key=lambda one: one[1].first_row))
        ]
        facts = _write(dem, parcels, Path(parts), work)
        calculated_s = time.perf_counter()
        with ThreadPoolExecutor(2) as pool:  # GDAL's work needs no interpreter
            list(pool.map(lambda name: _finish(Path(parts) / name, folder / name), (COUNT, LOWEST)))
    finished_s = time.perf_counter()
    work.progress(1.0)
    by_anchor = {parcel.anchor.id: facts[parcel.number] for parcel in parcels}
    return _summary(
        dem, middle, parameters, anchors, by_anchor, (*told, *passed_over),
        read_by="this process" if work.scheduler is None else f"workers of the Dask scheduler {work.scheduler}",
        timing={"calculation_s": calculated_s - started_s, "files_s": finished_s - calculated_s},
    )  # fmt: skip


def _finish(unfinished: Path, path: Path) -> None:
    with replacing(path) as whole:
        to_cog(unfinished, whole)


def _write(dem: LargeDem, parcels: Sequence[Parcel], parts: Path, work: Work) -> dict[int, ParcelFacts]:
    """Block rows from north to south, each once all parcels that touch it are done; the facts of all parcels."""
    facts: dict[int, ParcelFacts] = {}
    posts, done = sum(parcel.reach.posts for parcel in parcels), 0
    coming = _worked_out(parcels, work)
    nan = float("nan")
    box = box_of([parcel.reach for parcel in parcels])
    with (
        unfinished_raster(dem, box, parts / COUNT, "uint8", NOTHING, ("visible anchors", "unknown anchors")) as count,
        unfinished_raster(dem, box, parts / LOWEST, "float32", nan, ("lowest altitude with one in sight",)) as lowest,
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
            _write_rows(dem, box, here, rows, (count, lowest))
            for parcel in here:
                if parcel.reach.last_row < rows[1]:
                    remove_parcel(parcel)
    return facts


def _worked_out(parcels: Sequence[Parcel], work: Work) -> Iterator[tuple[int, ParcelFacts]]:
    """(number, facts) of each parcel once it is done. Raises RequestError when somebody wants it ended."""
    if work.scheduler is None:
        for parcel in parcels:
            _go_on(work.stop)
            yield parcel.number, work_out(parcel)
        return

    def submit(client: Any, numbers: Sequence[int]) -> dict[Any, int]:
        return {client.submit(work_out, parcels[number], pure=False): number for number in numbers}

    yield from results_from_cluster(Cluster(work.scheduler), len(parcels), submit, work.stop)
    _go_on(work.stop)


def _go_on(stop: Callable[[], bool]) -> None:
    if stop():
        raise RequestError("The map was ended before it was done; nothing of it is left.")


def _write_rows(
    dem: LargeDem, box: Reach, parcels: Sequence[Parcel], rows: tuple[int, int], files: tuple[Any, Any]
) -> None:
    """What the parcels say of one block row, where any of them reaches, into count and lowest."""
    count, lowest = files
    arrays = {parcel.number: stored(parcel) for parcel in parcels}
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
                pieces.append((parcel.anchor, np.asarray(altitude_m[part]), np.asarray(seen[part]), where))
        if pieces:
            block = Reach(rows[0], rows[1] - 1, cols[0], cols[1] - 1)
            visible, unknown, lowest_m = combined(dem, block, pieces)
            window = Window(cols[0] - box.first_col, rows[0] - box.first_row, block.shape[1], block.shape[0])
            count.write(visible, 1, window=window)
            count.write(unknown, 2, window=window)
            lowest.write(lowest_m, 1, window=window)


def _check(
    dem: LargeDem, anchors: Sequence[Anchor], reaches: dict[int, Reach], folder: Path, memory_limit_bytes: int
) -> None:
    """Before any work. Raises RequestError."""
    ids = [anchor.id for anchor in anchors]
    if len(set(ids)) < len(ids) or len(ids) > MOST_ANCHORS:
        raise RequestError(f"A map by windows takes up to {MOST_ANCHORS} anchors with unique ids, not {len(ids)}.")
    if not reaches:
        raise RequestError(f"No post of {dem.name} lies in any anchor's reach; are places or ranges in other units?")
    largest = max(reaches, key=lambda number: reaches[number].posts)
    needed = work_bytes(reaches[largest].posts)
    if needed > memory_limit_bytes:
        raise RequestError(
            f"The reach of anchor {ids[largest]} has {reaches[largest].posts:,} posts, which take about "
            f"{needed / 1e9:.1f} GB of memory, more than the limit of {memory_limit_bytes / 1e9:.1f} GB; give it a "
            "shorter max_range_m, or the DEM larger cells."
        )
    disk = DISK_BYTES_PER_POST * sum(reach.posts for reach in reaches.values())
    free = shutil.disk_usage(folder).free
    if disk > free:
        raise RequestError(
            f"The map needs up to {disk / 1e9:.1f} GB of disk in {folder}, where {free / 1e9:.1f} GB are free."
        )


def _anchor(dem: LargeDem, middle: ElevationGrid, parameters: VisibilityMapParameters, number: int) -> Anchor:
    """An anchor in the raster's frame, from the posts around it. Raises RequestError, AnchorError, FrameError."""
    asked = parameters.anchors[number]
    if asked.lon_deg is not None and asked.lat_deg is not None:
        place = to_grid_frame(middle, asked.lon_deg, asked.lat_deg)
    else:
        assert asked.east_m is not None, "the schema has seen to it"
        assert asked.north_m is not None, "the schema has seen to it"
        place = asked.east_m, asked.north_m
    if asked.max_range_m is None:
        posts = dem.rows * dem.cols
        raise RequestError(
            f"Anchor {asked.id} has no range limit, so all {posts:,} posts of {dem.name} are in its reach, which take "
            f"about {work_bytes(posts) / 1e9:,.1f} GB of memory; give it max_range_m, or read the DEM whole."
        )
    return resolve_anchor(_ground_at(dem, *dem.post_at(*place)), asked)


def _middle(dem: LargeDem) -> tuple[float, float]:
    return (dem.rows - 1) / 2.0, (dem.cols - 1) / 2.0


def _ground_at(dem: LargeDem, row: float, col: float) -> ElevationGrid:
    """The few posts around a place, or the nearest to one outside."""
    first_row = int(np.clip(np.floor(row), 0, max(dem.rows - 2, 0)))
    first_col = int(np.clip(np.floor(col), 0, max(dem.cols - 2, 0)))
    return dem.window(first_row, min(first_row + 1, dem.rows - 1), first_col, min(first_col + 1, dem.cols - 1))


def _summary(
    dem: LargeDem,
    middle: ElevationGrid,
    parameters: VisibilityMapParameters,
    anchors: Sequence[Anchor],
    facts: dict[str, ParcelFacts],
    told: tuple[str, ...],
    *,
    read_by: str,
    timing: dict[str, float],
) -> LargeMapSummary:
    worst = max(facts.values(), key=lambda one: 0.0 if one.errors is None else one.errors.misclassified)
    beside = [anchor.id for anchor in anchors if anchor.id not in facts]
    warnings = [*told, *dict.fromkeys(warning for one in facts.values() for warning in one.warnings)]
    warnings += [f"No post of the DEM lies in the reach of {', '.join(beside)}."] if beside else []
    rows = []
    for anchor in anchors:
        fact = facts.get(anchor.id)
        seen = (0, 0, 0) if fact is None else (fact.visible_posts, fact.hidden_posts, fact.unknown_posts)
        rows.append(
            AnchorInReach(
                id=anchor.id,
                east_m=anchor.east_m,
                north_m=anchor.north_m,
                altitude_m=anchor.altitude_m,
                max_range_m=anchor.limits.max_range_m,
                posts_in_reach=sum(seen),
                visible_posts=seen[0],
                hidden_posts=seen[1],
                unknown_posts=seen[2],
            )
        )
    return LargeMapSummary(
        version=worst.version,
        mode=parameters.mode,
        error_statement=worst.error_statement,
        curvature=worst.curvature,
        unknown=parameters.unknown,
        receiver=ReceiverHeight(
            above_ground_m=parameters.receiver_above_ground_m, altitude_m=parameters.receiver_altitude_m
        ),
        dem=LargeGround(
            name=dem.name,
            rows=dem.rows,
            cols=dem.cols,
            cell_east_m=dem.cell_east_m,
            cell_north_m=dem.cell_north_m,
            crs=None if dem.crs is None else dem.crs.to_string(),
            vertical_datum=dem.vertical_datum,
            heights_count_from=height_reference_of(middle).value,
        ),
        anchors=rows,
        posts_in_reach=sum(row.posts_in_reach for row in rows),
        read_by=read_by,
        warnings=warnings,
        timing=timing,
    )
