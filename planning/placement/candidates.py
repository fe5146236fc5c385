"""Places where an anchor could be put: a grid or given points, each at one or more heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import PlacementError
from terrain import ElevationGrid, height_at

__all__ = ["Candidates", "candidate_grid", "candidate_points", "candidates_within", "join_candidates"]

Floats = npt.NDArray[np.float64]
MOST_CANDIDATES = 5_000_000


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
    grid: ElevationGrid,
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
    grid: ElevationGrid,
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
    ground_m = np.asarray(height_at(grid, places[:, 0], places[:, 1]), np.float64)
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


def _within(grid: ElevationGrid, area: shapely.Geometry) -> tuple[float, float, float, float]:
    """Bounds of the part of an area that lies on the grid; raises PlacementError where none does."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    part = area.intersection(shapely.box(west_m, south_m, east_m, north_m))
    if part.is_empty:
        raise PlacementError(
            "The area for candidates lies outside the DEM; are its coordinates metres in the DEM's CRS?"
        )
    bounds: tuple[float, float, float, float] = part.bounds
    return bounds


def candidates_within(
    grid: ElevationGrid,
    here_m: Floats,
    reach_m: float,
    above_ground_m: Sequence[float],
    altitudes_m: Sequence[float],
) -> tuple[npt.NDArray[np.intp], Candidates]:
    """(posts (n,), candidates over them) of all posts within reach, at each height above ground and each altitude.

    here_m: (3,) east, north, altitude of a drone in the grid's frame; reach_m: metres over the ground. Unknown ground
    gives NaN.
    """
    row, col = np.arange(grid.rows), np.arange(grid.cols)
    north_m, east_m = grid.origin_north_m - row * grid.cell_north_m, grid.origin_east_m + col * grid.cell_east_m
    near = np.add.outer((north_m - here_m[1]) ** 2, (east_m - here_m[0]) ** 2) <= reach_m**2
    post = np.flatnonzero(near)
    ground_m = grid.heights_m.reshape(-1)[post].astype(np.float64)
    east, north = east_m[post % grid.cols], north_m[post // grid.cols]
    levels = [ground_m + height_m for height_m in above_ground_m]
    levels += [np.full(len(post), altitude_m) for altitude_m in altitudes_m]
    position_m = np.concatenate([np.column_stack([east, north, level]) for level in levels])
    candidates = Candidates(position_m, np.tile(ground_m, len(levels)), ("drone",) * len(position_m))
    return np.tile(post, len(levels)), candidates
