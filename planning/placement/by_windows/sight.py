"""Sight of all candidates of a question by windows: here, or by the workers of a Dask cluster; and what counts."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import ClusterError, PlacementError
from planning.placement.candidates import TILE
from planning.placement.cluster import Cluster, results_from_cluster
from planning.placement.sight import Floats, SightOptions, neighbours, positions_of, window_within
from terrain import LargeDem
from visibility.sight import Anchor, check_anchors
from visibility.sight.in_reach import Raster, name_of, work_bytes

from .judging import Counts, Seen, SightFiles, reached_by, seen_by
from .parcels import Mask, ParcelFacts, Window, WindowParcel, targets_within, work_out

__all__ = ["WindowSight", "WorkedOut"]

MEMORY_LIMIT_BYTES = 2 << 30
MOST_SEEING = 255  # of what a byte counts
# neighbours share a window while it is no more than so many times what one reaches
MOST_OF_ONE = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class WorkedOut:
    """files: of the candidates' sight. kept: (n,) bool, those worked out that have a target in range. done: those
    worked out before the work was stopped.
    """

    files: SightFiles
    kept: Mask
    done: Mask
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class WindowSight:
    """The ground and targets of a question. area: polygon of the targets; None: all known ground. folder: for files."""

    dem: Raster
    options: SightOptions
    above_ground_m: float
    area: shapely.Geometry | None
    folder: Path

    def of_candidates(
        self,
        position_m: Floats,
        fixed: Sequence[Anchor],
        cluster: Cluster | None,
        progress: Callable[[float], None],
        stop: Callable[[], bool],
    ) -> WorkedOut:
        """Raises PlacementError (no targets; more memory or disk than there is), ClusterError, AnchorError."""
        parcels = self._parcels(position_m)
        self._check_room(parcels)
        total = self._targets()
        if total == 0:
            raise PlacementError(f"No known ground of {name_of(self.dem)} is to be served; is the area in its CRS?")
        of_fixed, warnings = self.of_anchors(fixed, self.options)
        at, seen = np.zeros((len(position_m), 2), np.intp), np.zeros(len(position_m), np.int64)
        kept, done = np.zeros(len(position_m), np.bool_), np.zeros(len(position_m), np.bool_)
        by_all: Counts = np.memmap(self.folder / "seen-by-all", np.uint8, "w+", shape=(self.dem.rows, self.dem.cols))
        for one in of_fixed:
            _add(by_all, one.window, one.posts.astype(np.uint8))
        for facts in self._worked_out(parcels, cluster, warnings, lambda: bool(done.any()) and stop()):
            parcel = parcels[facts.number]
            at[parcel.rows, 0], at[parcel.rows, 1] = facts.number, np.arange(len(parcel.rows))
            seen[parcel.rows], kept[parcel.rows], done[parcel.rows] = facts.seen, facts.reached, True
            rows = np.load(parcel.path, allow_pickle=False)
            for row in rows:
                _add(by_all, parcel.window, seen_by(parcel.window, row).posts.astype(np.uint8))
            progress(float(done.mean()))
        files = SightFiles(parcels, at, seen, np.flatnonzero(kept), total, of_fixed, by_all)
        return WorkedOut(files, kept, done, tuple(warnings))

    def of_anchors(self, anchors: Sequence[Anchor], options: SightOptions) -> tuple[tuple[Seen, ...], list[str]]:
        """(what each of some anchors sees, warnings); the radio of each decides. Raises AnchorError."""
        found: list[Seen] = []
        warnings: list[str] = []
        for number, anchor in enumerate(anchors):
            window = self._window(positions_of([anchor]))
            top, bottom, left, right = window
            warnings += check_anchors(self.dem.window(top, bottom - 1, left, right - 1), [anchor])
            parcel = WindowParcel(
                -1 - number, self.dem, np.zeros(1, np.intp), positions_of([anchor]), window, self.above_ground_m,
                self.area, replace(options, radio=anchor.radio), str(self.folder),
            )  # fmt: skip
            work_out(parcel)
            found.append(seen_by(window, np.load(parcel.path, allow_pickle=False)[0]))
            parcel.path.unlink()
        return tuple(found), warnings

    def exact_share(self, anchors: Sequence[Anchor], full: int, total: int) -> float:
        """Share of the targets that see at least ``full`` anchors, over every edge of the surface."""
        seen, _ = self.of_anchors(anchors, replace(self.options, mode="exact"))
        return reached_by(seen, full) / total

    def _parcels(self, position_m: Floats) -> list[WindowParcel]:
        """Neighbours together, while their window is not much more than what one of them reaches."""
        range_m, dem = self.options.max_range_m, self.dem
        across = (2.0 * range_m / dem.cell_north_m + 3.0) * (2.0 * range_m / dem.cell_east_m + 3.0)
        one = min(across, float(dem.rows * dem.cols))
        pieces = neighbours(position_m, math.ceil(one))
        parcels: list[WindowParcel] = []
        while pieces:
            rows = pieces.pop(0)
            window = self._window(position_m[rows])
            if len(rows) > 1 and _posts(window) > MOST_OF_ONE * one:
                pieces[:0] = [rows[: len(rows) // 2], rows[len(rows) // 2 :]]
                continue
            parcels.append(
                WindowParcel(
                    len(parcels),
                    dem,
                    rows,
                    position_m[rows],
                    window,
                    self.above_ground_m,
                    self.area,
                    self.options,
                    str(self.folder),
                )
            )
        return parcels

    def _window(self, place_m: Floats) -> Window:
        found = window_within(self.dem, place_m, self.options.max_range_m)
        return (0, self.dem.rows, 0, self.dem.cols) if found is None else found

    def _check_room(self, parcels: Sequence[WindowParcel]) -> None:
        """Before any work. Raises PlacementError."""
        posts = max((_posts(parcel.window) for parcel in parcels), default=0)
        if work_bytes(posts) > MEMORY_LIMIT_BYTES:
            raise PlacementError(
                f"A candidate's reach has {posts:,} posts, which take about {work_bytes(posts) / 1e9:.1f} GB of "
                f"memory, more than the limit of {MEMORY_LIMIT_BYTES / 1e9:.1f} GB; give a shorter max_range_m."
            )
        bits = sum(len(parcel.rows) * (_posts(parcel.window) // 64 + 1) * 8 for parcel in parcels)
        disk, free = bits + self.dem.rows * self.dem.cols, shutil.disk_usage(self.folder).free
        if disk > free:
            raise PlacementError(
                f"What candidates see takes {disk / 1e9:.1f} GB of disk, and where it is written {free / 1e9:.1f} GB "
                "are free."
            )

    def _targets(self) -> int:
        """How many posts count."""
        dem = self.dem
        first_row, last_row, first_col, last_col = 0, dem.rows - 1, 0, dem.cols - 1
        if self.area is not None:
            west_m, south_m, east_m, north_m = self.area.bounds
            (top, left), (bottom, right) = dem.post_at(west_m, north_m), dem.post_at(east_m, south_m)
            first_row, first_col = max(first_row, math.floor(top)), max(first_col, math.floor(left))
            last_row, last_col = min(last_row, math.ceil(bottom)), min(last_col, math.ceil(right))
        return sum(
            int(np.count_nonzero(targets_within(self._tile(row, col, last_row, last_col), self.area)))
            for row in range(first_row, last_row + 1, TILE)
            for col in range(first_col, last_col + 1, TILE)
        )

    def _tile(self, row: int, col: int, last_row: int, last_col: int) -> Any:
        return self.dem.window(row, min(row + TILE - 1, last_row), col, min(col + TILE - 1, last_col))

    def _worked_out(
        self, parcels: Sequence[WindowParcel], cluster: Cluster | None, warnings: list[str], stop: Callable[[], bool]
    ) -> Iterator[ParcelFacts]:
        """Facts of parcels as they are done; on this machine where a cluster is lost and that was asked for."""
        left = set(range(len(parcels)))
        if cluster is not None:
            if not isinstance(self.dem, LargeDem):
                raise PlacementError("A cluster works by windows on a DEM in its file, and this one is held whole.")
            try:
                for number, facts in results_from_cluster(cluster, len(parcels), _submitting(parcels), stop):
                    left.discard(number)
                    yield facts
            except ClusterError as error:
                if not cluster.or_local:
                    raise
                warnings.append(f"{error} {len(left):,} of {len(parcels):,} parcels were done on this machine instead.")
        with ThreadPoolExecutor(1) as ahead:
            coming: Future[ParcelFacts] | None = None
            for parcel in (*(parcels[number] for number in sorted(left)), None):
                if stop():
                    break
                done, coming = coming, None if parcel is None else ahead.submit(work_out, parcel)
                if done is not None:
                    yield done.result()


def _submitting(parcels: Sequence[WindowParcel]) -> Callable[[Any, Sequence[int]], dict[Any, int]]:
    # impure: a repeated run must not be answered from what the cluster remembers of files that are gone
    return lambda client, numbers: {client.submit(work_out, parcels[n], pure=False): n for n in numbers}


def _posts(window: Window) -> int:
    return (window[1] - window[0]) * (window[3] - window[2])


def _add(counts: Counts, window: Window, more: npt.NDArray[np.uint8]) -> None:
    """Add to counts in place, up to what a byte holds."""
    top, bottom, left, right = window
    part = counts[top:bottom, left:right]
    part[:] = np.minimum(part.astype(np.uint16) + more, MOST_SEEING)
