"""Sight of neighbouring candidates over the posts in their reach: worked out anywhere, left as a file of bits.

Whoever works a parcel out reads its window of the ground from the file of the DEM, so that no ground is sent about.
Targets are the known posts of the window: they are worked out from their numbers and kept nowhere.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import ClusterError
from planning.placement.sight import Bits, Floats, Parcel, SightOptions, SightTable, pack, parcel_bits
from planning.placement.targets import Targets
from terrain import ElevationGrid
from visibility.sight.in_reach import Raster

__all__ = ["ParcelFacts", "Window", "WindowParcel", "targets_within", "work_out"]

Mask = npt.NDArray[np.bool_]
# (top, bottom, left, right) of posts, bottom and right excluded
Window = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class WindowParcel:
    """A piece of the work. rows: of its candidates among all. position_m: (n, 3). window: the posts in their reach.

    folder: where its bits are left; whoever works and whoever asks must see it under this name.
    """

    number: int
    dem: Raster
    rows: npt.NDArray[np.intp]
    position_m: Floats
    window: Window
    above_ground_m: float
    area: shapely.Geometry | None
    options: SightOptions
    folder: str

    @property
    def path(self) -> Path:
        """The file of its bits: (n, words) uint64, bit i of a row = the candidate sees post i of the window."""
        return Path(self.folder) / f"parcel-{self.number}.npy"


@dataclass(frozen=True, slots=True, eq=False)
class ParcelFacts:
    """What is told of a finished parcel. seen: (n,) targets in sight. reached: (n,) bool, some target is in range."""

    number: int
    seen: npt.NDArray[np.int64]
    reached: Mask


def work_out(parcel: WindowParcel) -> ParcelFacts:
    """Sight of a parcel's candidates, left in its file, whole or not at all.

    Raises ClusterError where the folder is not there, DemReadError, AnchorError.
    """
    if not Path(parcel.folder).is_dir():
        raise ClusterError(f"The folder {parcel.folder} is not one that this machine and the workers share.")
    top, bottom, left, right = parcel.window
    grid = parcel.dem.window(top, bottom - 1, left, right - 1)
    posts = targets_within(grid, parcel.area)
    targets = _targets(grid, posts, parcel.above_ground_m)
    assert targets.post is not None, "they are posts"
    if len(targets):
        bits = parcel_bits(Parcel(parcel.rows, parcel.position_m, grid, targets, targets.post, parcel.options))
    else:
        bits = np.zeros((len(parcel.rows), 1), np.uint64)
    if len(targets) < posts.size:
        bits = _spread(bits, targets.post, posts.size)
    unfinished = parcel.path.with_suffix(f".{os.getpid()}")
    with unfinished.open("wb") as file:
        np.save(file, bits, allow_pickle=False)
    unfinished.replace(parcel.path)
    seen = np.bitwise_count(bits).sum(axis=1, dtype=np.int64)
    return ParcelFacts(parcel.number, seen, _reached(parcel, targets))


def targets_within(grid: ElevationGrid, area: shapely.Geometry | None) -> Mask:
    """(rows, cols) bool: the posts of known ground in an area, or all of them."""
    posts: Mask = ~np.isnan(grid.heights_m)
    if area is not None:
        row, col = np.nonzero(posts)
        east_m, north_m = grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m
        posts[row, col] = shapely.intersects_xy(area, east_m, north_m)
    return posts


def _targets(grid: ElevationGrid, posts: Mask, above_ground_m: float) -> Targets:
    """Places over some posts of a window. What only dilutions need, normals, is left empty."""
    post = np.flatnonzero(posts)
    row, col = np.divmod(post, grid.cols)
    point_m = np.column_stack(
        [
            grid.origin_east_m + col * grid.cell_east_m,
            grid.origin_north_m - row * grid.cell_north_m,
            grid.heights_m.reshape(-1)[post].astype(np.float64) + above_ground_m,
        ]
    )
    return Targets("area", point_m, np.ones(len(post)), post, np.zeros((0, 3)), above_ground_m, 0)


def _spread(bits: Bits, post: npt.NDArray[np.intp], posts: int) -> Bits:
    """Bits of some posts of a window as bits of all of them."""
    seen = np.zeros((len(bits), posts), np.bool_)
    if len(post):
        seen[:, post] = SightTable(bits, len(post)).visible()
    return pack(seen)


def _reached(parcel: WindowParcel, targets: Targets) -> Mask:
    """(n,) whether some target is no further away than the longest range, by the straight line."""
    reach2 = (parcel.options.max_range_m * (1.0 + 1e-9)) ** 2
    reached = np.zeros(len(parcel.rows), np.bool_)
    for number, place_m in enumerate(parcel.position_m):
        # most find one among the first few that are looked at: the posts nearest to the parcel's middle
        reached[number] = any(
            bool((((targets.point_m[part] - place_m) ** 2).sum(axis=1) <= reach2).any()) for part in _parts(targets)
        )
    return reached


def _parts(targets: Targets) -> list[slice]:
    """Every 97th target first, then all."""
    return [slice(0, None, 97), slice(None)] if len(targets) else []
