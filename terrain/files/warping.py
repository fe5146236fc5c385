"""A grid of posts in one CRS brought onto a metric grid in another, without leaving its own triangulated surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.enums import TransformDirection

from .. import kernels
from ..errors import DemUnsupportedError
from ..limits import check_declared_size
from ..units import degrees_per_unit

__all__ = ["Frame", "Posts", "border_positions", "cell_sizes", "sample", "warp"]

# source positions are computed exactly on every nth post of the target, n ≤ 16, and interpolated between: they are off
# by about (n cells)² / (8 · radius), which n keeps below a hundredth of a cell even on a body of the Moon's size
LATTICE = 16
LATTICE_ERROR_CELLS = 0.01
SMALL_RADIUS_M = 1.7e6
BORDER_POINTS = 65
# near a pole longitude turns too fast to be interpolated
POLAR_DEG = 80.0


@dataclass(frozen=True, slots=True, eq=False)
class Posts:
    """Heights (rows, cols) float32, NaN = unknown; post (0, 0) at x0, y0; steps > 0 east and south, CRS units."""

    heights_m: npt.NDArray[np.float32]
    x0: float
    y0: float
    step_x: float
    step_y: float
    crs: pyproj.CRS

    @property
    def middle(self) -> tuple[float, float]:
        """Centre of the posts, CRS units."""
        rows, cols = self.heights_m.shape
        return self.x0 + (cols - 1) / 2.0 * self.step_x, self.y0 - (rows - 1) / 2.0 * self.step_y


class Frame(NamedTuple):
    """Where the posts of a metric grid lie: rows, cols, post (0, 0) and the metres between neighbours."""

    rows: int
    cols: int
    west_m: float
    top_m: float
    cell_east_m: float
    cell_north_m: float


def border_positions(posts: Posts) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Positions x, y (n,) along the outermost posts, CRS units."""
    rows, cols = posts.heights_m.shape
    x = posts.x0 + np.linspace(0.0, (cols - 1) * posts.step_x, BORDER_POINTS)
    y = posts.y0 - np.linspace(0.0, (rows - 1) * posts.step_y, BORDER_POINTS)
    first, last = np.full(BORDER_POINTS, x[0]), np.full(BORDER_POINTS, x[-1])
    top, bottom = np.full(BORDER_POINTS, y[0]), np.full(BORDER_POINTS, y[-1])
    return np.concatenate([x, x, first, last]), np.concatenate([top, bottom, y, y])


def warp(name: str, posts: Posts, target: pyproj.CRS, *, max_cells: int) -> Posts:
    """Resample onto a north-up grid in ``target`` (metres), with cells as fine as the source's in each direction.

    Each new height is the source's triangulated surface at that place: unknown posts make exactly the triangles they
    belong to unknown, and nothing is extrapolated beyond the outermost posts.
    Raises DemTooLargeError and, where the ground does not project, DemUnsupportedError.
    """
    posts = _closed_circle(posts)
    onward = pyproj.Transformer.from_crs(posts.crs, target, always_xy=True)
    border_x, border_y = border_positions(posts)
    east, north = onward.transform(border_x, border_y)
    cell_east_m, cell_north_m = cell_sizes(posts, target)
    if not (np.isfinite(east).all() and np.isfinite(north).all() and min(cell_east_m, cell_north_m) > 0.0):
        raise DemUnsupportedError(f"{name} cannot be projected to {target.name}; give another target_crs.")
    cols = int(np.floor((east.max() - east.min()) / cell_east_m + 1e-6)) + 1
    rows = int(np.floor((north.max() - north.min()) / cell_north_m + 1e-6)) + 1
    check_declared_size(f"{name} in {target.name}", rows, cols, max_cells=max_cells, bytes_per_value=4, file_bytes=None)
    west_m = (east.min() + east.max() - (cols - 1) * cell_east_m) / 2.0
    top_m = (north.min() + north.max() + (rows - 1) * cell_north_m) / 2.0
    return sample(posts, target, Frame(rows, cols, float(west_m), float(top_m), cell_east_m, cell_north_m))


def sample(posts: Posts, target: pyproj.CRS, frame: Frame) -> Posts:
    """The posts' triangulated surface at the posts of a frame in ``target`` (metres); NaN off the surface."""
    onward = pyproj.Transformer.from_crs(posts.crs, target, always_xy=True)
    rows, cols, west_m, top_m, cell_east_m, cell_north_m = frame
    geographic = posts.crs.is_geographic
    turning = geographic and (
        max(abs(posts.y0), abs(2.0 * posts.middle[1] - posts.y0)) * degrees_per_unit(posts.crs) > POLAR_DEG
    )
    fine_enough = math.sqrt(LATTICE_ERROR_CELLS * 8.0 * SMALL_RADIUS_M / max(cell_east_m, cell_north_m))
    lattice = 1 if turning else max(1, min(LATTICE, int(fine_enough)))
    lattice_east = west_m + np.arange(0, cols - 1 + lattice, lattice) * cell_east_m
    lattice_north = top_m - np.arange(0, rows - 1 + lattice, lattice) * cell_north_m
    mesh_east, mesh_north = np.meshgrid(lattice_east, lattice_north)
    x, y = onward.transform(mesh_east, mesh_north, direction=TransformDirection.INVERSE)
    if geographic:
        turn = 360.0 / degrees_per_unit(posts.crs)
        middle = posts.middle[0]
        x = (x - middle + turn / 2.0) % turn + middle - turn / 2.0
    source_rows, source_cols = (posts.y0 - y) / posts.step_y, (x - posts.x0) / posts.step_x
    heights_m = np.full((rows, cols), np.nan, np.float32)
    kernels.resample_surface(posts.heights_m, source_rows, source_cols, lattice, heights_m)
    return Posts(heights_m, west_m, top_m, cell_east_m, cell_north_m, target)


def cell_sizes(posts: Posts, target: pyproj.CRS) -> tuple[float, float]:
    """Metres east and north that one source cell covers at the middle; a map turned by 90° swaps them by itself."""
    onward = pyproj.Transformer.from_crs(posts.crs, target, always_xy=True)
    x, y = posts.middle
    east, north = onward.transform(
        [x - posts.step_x / 2, x + posts.step_x / 2, x, x], [y, y, y - posts.step_y / 2, y + posts.step_y / 2]
    )
    across, down = (east[1] - east[0], north[1] - north[0]), (east[3] - east[2], north[3] - north[2])
    return float(max(abs(across[0]), abs(down[0]))), float(max(abs(across[1]), abs(down[1])))


def _closed_circle(posts: Posts) -> Posts:
    """Where a geographic grid goes once around the planet, its first column again as its last: no seam."""
    cols = posts.heights_m.shape[1]
    if not posts.crs.is_geographic:
        return posts
    if (
        abs(cols * posts.step_x * degrees_per_unit(posts.crs) - 360.0)
        > posts.step_x * degrees_per_unit(posts.crs) / 2.0
    ):
        return posts
    closed = np.concatenate([posts.heights_m, posts.heights_m[:, :1]], axis=1)
    return Posts(closed, posts.x0, posts.y0, posts.step_x, posts.step_y, posts.crs)
