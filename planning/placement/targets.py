"""Where anchors shall be seen: weighted places of the rover's antenna."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import PlacementError
from terrain import ElevationGrid, height_at
from visibility.dilution import rover_normals

__all__ = ["Targets", "area_targets", "corridor_targets", "path_targets"]

Floats = npt.NDArray[np.float64]
MOST_PATH_POINTS = 2_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Places of the rover's antenna, and what each counts.

    point_m: (m, 3) east, north, altitude, metres. weight: (m,) > 0; of a path, the metres that each point stands for.
    post: (m,) flat index of each point's post in the grid, or None where points lie between posts.
    normal: (m, 3) upward unit normals of the ground. above_ground_m: height of the antenna.
    left_out: places on unknown ground or outside the DEM, which are not asked about.
    """

    what: str
    point_m: Floats
    weight: Floats
    post: npt.NDArray[np.intp] | None
    normal: Floats
    above_ground_m: float
    left_out: int

    def __len__(self) -> int:
        return len(self.point_m)

    @property
    def total(self) -> float:
        """Sum of the weights."""
        return float(self.weight.sum())


def area_targets(
    grid: ElevationGrid,
    above_ground_m: float = 1.5,
    *,
    area: shapely.Geometry | None = None,
    weight: npt.ArrayLike | None = None,
) -> Targets:
    """The posts of known ground in an area, the whole grid by default.

    area: polygon in the grid's frame. weight: (rows, cols) >= 0, what each post counts; 0 or NaN leaves it out; equal
        by default. Raises PlacementError.
    """
    return _posts(grid, "area", above_ground_m, area, weight)


def corridor_targets(
    grid: ElevationGrid,
    path_m: npt.ArrayLike,
    width_m: float,
    above_ground_m: float = 1.5,
    *,
    weight: npt.ArrayLike | None = None,
) -> Targets:
    """The posts within half a width of a path (n, 2) of east, north. Raises PlacementError."""
    if not (math.isfinite(width_m) and width_m > 0.0):
        raise PlacementError(f"The width of a corridor must be a number of metres > 0, not {width_m}.")
    area = shapely.LineString(_checked_path(path_m)).buffer(width_m / 2.0)
    return _posts(grid, "corridor", above_ground_m, area, weight)


def path_targets(
    grid: ElevationGrid, path_m: npt.ArrayLike, above_ground_m: float = 1.5, *, spacing_m: float | None = None
) -> Targets:
    """Points along a path (n, 2) of east, north, each counting the metres of path that it stands for.

    spacing_m: between points, half a cell by default. Raises PlacementError.
    """
    path = _checked_path(path_m)
    if spacing_m is None:
        spacing_m = min(grid.cell_east_m, grid.cell_north_m) / 2.0
    if not (math.isfinite(spacing_m) and spacing_m > 0.0):
        raise PlacementError(f"The spacing along a path must be a number of metres > 0, not {spacing_m}.")
    along_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    if not along_m[-1] / spacing_m <= MOST_PATH_POINTS:
        raise PlacementError(
            f"A path of {along_m[-1] / 1000:,.4g} km has more than {MOST_PATH_POINTS:,} points {spacing_m:g} m apart; "
            "are its coordinates metres in the DEM's CRS?"
        )
    pieces = max(math.ceil(along_m[-1] / spacing_m - 1e-9), 1)
    edges_m = np.linspace(0.0, along_m[-1], pieces + 1)
    middle_m = (edges_m[:-1] + edges_m[1:]) / 2.0
    places_m = np.column_stack([np.interp(middle_m, along_m, path[:, axis]) for axis in (0, 1)])
    ground_m = np.asarray(height_at(grid, places_m[:, 0], places_m[:, 1]), np.float64)
    return _targets(grid, "path", places_m, ground_m, np.diff(edges_m), None, above_ground_m)


def _posts(
    grid: ElevationGrid,
    what: str,
    above_ground_m: float,
    area: shapely.Geometry | None,
    weight: npt.ArrayLike | None,
) -> Targets:
    row, col = np.divmod(np.arange(grid.heights_m.size), grid.cols)
    places_m = np.column_stack(
        [grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m]
    )
    worth = np.ones(grid.heights_m.size) if weight is None else _checked_weight(grid, weight)
    asked = worth > 0.0
    if area is not None:
        asked &= shapely.intersects_xy(area, *places_m.T)
    which = np.flatnonzero(asked)
    ground_m = grid.heights_m.reshape(-1)[which].astype(np.float64)
    return _targets(grid, what, places_m[which], ground_m, worth[which], which, above_ground_m)


def _targets(
    grid: ElevationGrid,
    what: str,
    places_m: Floats,
    ground_m: Floats,
    weight: Floats,
    post: npt.NDArray[np.intp] | None,
    above_ground_m: float,
) -> Targets:
    if not (math.isfinite(above_ground_m) and above_ground_m >= 0.0):
        raise PlacementError(f"The antenna's height above ground must be >= 0 m, not {above_ground_m}.")
    known = ~np.isnan(ground_m)
    if not known.any():
        raise PlacementError(
            f"The {what} has no known ground on the DEM; are its coordinates metres in the DEM's CRS?"
            if len(places_m)
            else f"The {what} has no post of the DEM in it."
        )
    point_m = np.column_stack([places_m, ground_m + above_ground_m])[known]
    return Targets(
        what=what,
        point_m=point_m,
        weight=np.ascontiguousarray(weight[known]),
        post=None if post is None else post[known],
        normal=_normals(grid, point_m),
        above_ground_m=float(above_ground_m),
        left_out=int(np.count_nonzero(~known)),
    )


def _normals(grid: ElevationGrid, point_m: Floats) -> Floats:
    """Upward normals; where a neighbour is unknown the ground is taken as level."""
    normal = rover_normals(grid, point_m[:, 0], point_m[:, 1])
    normal[np.isnan(normal).any(axis=1)] = (0.0, 0.0, 1.0)
    return normal


def _checked_weight(grid: ElevationGrid, weight: npt.ArrayLike) -> Floats:
    worth = np.asarray(weight, np.float64)
    if worth.shape != grid.shape:
        raise PlacementError(f"Weights must have the grid's shape {grid.shape}, not {worth.shape}.")
    worth = np.nan_to_num(worth.reshape(-1), nan=0.0, posinf=-1.0)
    if (worth < 0.0).any() or not worth.any():
        raise PlacementError("Weights must be finite numbers >= 0, and not all 0.")
    return worth


def _checked_path(path_m: npt.ArrayLike) -> Floats:
    path = np.asarray(path_m, np.float64)
    if path.ndim != 2 or path.shape[1:] != (2,) or len(path) < 2 or not np.isfinite(path).all():
        raise PlacementError(f"A path must be (n, 2) finite east, north in metres, n >= 2, not shape {path.shape}.")
    if not np.hypot(*np.diff(path, axis=0).T).sum() > 0.0:
        raise PlacementError("A path must be longer than 0 m.")
    return path
