"""Where anchors could be put: candidates on a lattice or at given places, over a grid or a DEM in its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import PlacementError
from terrain import ElevationGrid, height_at
from visibility.sight.in_reach import Raster

__all__ = ["Candidates", "candidate_grid", "candidate_points", "join_candidates"]

Floats = npt.NDArray[np.float64]
MOST_CANDIDATES = 5_000_000
TILE = 1024  # posts along a side of what is read of a file at once


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Places for anchors.

    position_m: (n, 3) east, north, altitude, metres, in the grid's frame. ground_m: (n,) height of the ground below;
        NaN where it is unknown or outside the grid. what: (n,) words such as "drone", "mast" or "site".
    """

    position_m: Floats
    ground_m: Floats
    what: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.position_m)

    @property
    def above_ground_m(self) -> Floats:
        """(n,) height above the ground, metres; NaN where that is unknown."""
        return self.position_m[:, 2] - self.ground_m

    def take(self, which: npt.NDArray[np.intp] | npt.NDArray[np.bool_]) -> Candidates:
        """Some of them, by numbers or by a mask."""
        numbers = np.arange(len(self))[which]
        return Candidates(self.position_m[numbers], self.ground_m[numbers], tuple(self.what[n] for n in numbers))


def candidate_grid(
    grid: Raster,
    spacing_m: float,
    *,
    above_ground_m: Sequence[float] = (),
    altitude_m: Sequence[float] = (),
    area: shapely.Geometry | None = None,
    what: str = "drone",
) -> Candidates:
    """Places on a square lattice over the grid, or over an area of it, at every height asked for.

    The lattice is centred, so that its margins to the west and east are equal. area: polygon in the grid's frame.
    Raises PlacementError.
    """
    if not (np.isfinite(spacing_m) and spacing_m > 0.0):
        raise PlacementError(f"The spacing of candidates must be a number of metres > 0, not {spacing_m}.")
    west_m, south_m, east_m, north_m = grid.bounds_m if area is None else _within(grid, area)
    if (east_m - west_m) / spacing_m * ((north_m - south_m) / spacing_m) > MOST_CANDIDATES:
        raise PlacementError(
            f"A lattice of {spacing_m:g} m over {(east_m - west_m) / 1000:.1f} × {(north_m - south_m) / 1000:.1f} km "
            f"has more than {MOST_CANDIDATES:,} places; take a wider one."
        )
    east, north = np.meshgrid(_lattice(west_m, east_m, spacing_m), _lattice(south_m, north_m, spacing_m)[::-1])
    places_m = np.column_stack([east.ravel(), north.ravel()])
    if area is not None:
        places_m = places_m[shapely.intersects_xy(area, *places_m.T)]
    if len(places_m) == 0:
        raise PlacementError(f"No place of a lattice of {spacing_m:g} m lies in the area for candidates.")
    return candidate_points(grid, places_m, above_ground_m=above_ground_m, altitude_m=altitude_m, what=what)


def candidate_points(
    grid: Raster,
    places_m: npt.ArrayLike,
    *,
    above_ground_m: Sequence[float] = (),
    altitude_m: Sequence[float] = (),
    what: str = "drone",
) -> Candidates:
    """Places (n, 2) east, north at every height asked for: all places at the first height, then at the next.

    A height above ground makes no candidate where the ground is unknown: its altitude is NaN, and the rules remove it.
    Raises PlacementError.
    """
    places = np.asarray(places_m, np.float64)
    if places.ndim != 2 or places.shape[1:] != (2,) or len(places) == 0 or not np.isfinite(places).all():
        raise PlacementError(f"places_m must be (n, 2) finite east, north in metres, not shape {places.shape}.")
    if not len(above_ground_m) and not len(altitude_m):
        raise PlacementError("Candidates need at least one height: above_ground_m or altitude_m.")
    if not (np.isfinite([*above_ground_m, *altitude_m]).all() and min(above_ground_m, default=0.0) >= 0.0):
        raise PlacementError("Heights of candidates must be finite, and above_ground_m >= 0 m.")
    ground_m = _ground_under(grid, places)
    altitudes = [ground_m + height_m for height_m in above_ground_m]
    altitudes += [np.full(len(places), height_m) for height_m in altitude_m]
    position_m = np.concatenate([np.column_stack([places, altitude]) for altitude in altitudes])
    return Candidates(position_m, np.tile(ground_m, len(altitudes)), (what,) * len(position_m))


def join_candidates(sets: Sequence[Candidates]) -> Candidates:
    """All candidates of several sets, in their order; a place given twice counts once."""
    position_m = np.concatenate([some.position_m for some in sets])
    ground_m = np.concatenate([some.ground_m for some in sets])
    joined = Candidates(position_m, ground_m, tuple(word for some in sets for word in some.what))
    _, first = np.unique(position_m, axis=0, return_index=True)
    return joined if len(first) == len(joined) else joined.take(np.sort(first))


def _lattice(low_m: float, high_m: float, spacing_m: float) -> Floats:
    places = int((high_m - low_m) / spacing_m + 1e-9) + 1
    margin_m = (high_m - low_m - (places - 1) * spacing_m) / 2.0
    return np.asarray(low_m + margin_m + spacing_m * np.arange(places), np.float64)


def _ground_under(grid: Raster, places_m: Floats) -> Floats:
    """(n,) height of the ground below places (n, 2); of a DEM in its file tile by tile. NaN where it is not known."""
    if isinstance(grid, ElevationGrid):
        return np.asarray(height_at(grid, places_m[:, 0], places_m[:, 1]), np.float64)
    row = (grid.origin_north_m - places_m[:, 1]) / grid.cell_north_m
    col = (places_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    inside = (row >= 0.0) & (row <= grid.rows - 1) & (col >= 0.0) & (col <= grid.cols - 1)
    tile = np.where(inside, (row // TILE) * (grid.cols // TILE + 1) + col // TILE, -1).astype(np.intp)
    ground_m = np.full(len(places_m), np.nan)
    order = np.argsort(tile, kind="stable")
    for some in np.split(order, np.flatnonzero(np.diff(tile[order])) + 1):
        if tile[some[0]] >= 0:
            top, left = (int(at[some[0]] // TILE) * TILE for at in (row, col))
            # a row and a column more: places lie between posts
            part = grid.window(top, min(top + TILE, grid.rows - 1), left, min(left + TILE, grid.cols - 1))
            ground_m[some] = height_at(part, places_m[some, 0], places_m[some, 1])
    return ground_m


def _within(grid: Raster, area: shapely.Geometry) -> tuple[float, float, float, float]:
    """Bounds of the part of an area that lies on the grid; raises PlacementError where none does."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    part = area.intersection(shapely.box(west_m, south_m, east_m, north_m))
    if part.is_empty:
        raise PlacementError(
            "The area for candidates lies outside the DEM; are its coordinates metres in the DEM's CRS?"
        )
    bounds: tuple[float, float, float, float] = part.bounds
    return bounds
