"""What a bubble must stay clear of: the ground and the buildings on it, whichever is nearer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from navigation import BubbleError
from service.parts.buildings import BuildingsIn
from terrain import ElevationGrid, nearest_surface, told_place
from visibility import Buildings, Curvature, clear_of_buildings, nearest_building, parse_buildings
from visibility.cover.building_distance import solid_bodies

__all__ = ["Surroundings", "buildings_of", "in_sight_past", "open_bodies_warning", "surroundings"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """For n points: signed distance to the nearest ground or building, negative below or inside, and that place.

    at_building: (n,) whether it is a building's. unknown_m: as in NearestSurface.
    """

    distance_m: Array
    nearest_m: Array
    unknown_m: Array
    at_building: npt.NDArray[np.bool_]

    def words(self) -> list[str]:
        """What is nearest to each point."""
        return ["building" if building else "ground" for building in self.at_building]


def buildings_of(grid: ElevationGrid, asked: BuildingsIn | None) -> Buildings | None:
    """The buildings of a request, stood on the grid. Raises MeshError."""
    if asked is None:
        return None
    return parse_buildings(
        asked.base64,
        asked.name,
        grid,
        heights=asked.heights,
        up=asked.up,
        origin_east_m=asked.origin_east_m,
        origin_north_m=asked.origin_north_m,
    )


def surroundings(
    grid: ElevationGrid, points_m: Array, buildings: Buildings | None, *, inside_is_refused: bool
) -> Surroundings:
    """Distances to what is nearest; raises BubbleError for a point over no ground or, if refused, in a building."""
    ground = nearest_surface(grid, points_m)
    nowhere = np.isnan(ground.distance_m)
    if nowhere.any():
        first = int(np.argmax(nowhere))
        east_m, north_m, _ = points_m[first]
        what = "lies over unknown ground" if grid.contains(east_m, north_m) else "lies outside the DEM"
        raise BubbleError(f"Point {first} {what}, at {told_place(grid, east_m, north_m, 0.1)}.", index=first)
    if buildings is None:
        return Surroundings(
            ground.distance_m, ground.nearest_m, ground.unknown_m, np.zeros(len(points_m), dtype=np.bool_)
        )
    walls = nearest_building(buildings, points_m)
    inside = walls.distance_m < 0.0
    if inside_is_refused and inside.any():
        first = int(np.argmax(inside))
        raise BubbleError(
            f"Point {first} lies inside a building, {-walls.distance_m[first]:.2f} m from its nearest wall or roof.",
            index=first,
        )
    nearer = walls.distance_m < ground.distance_m
    return Surroundings(
        np.where(nearer, walls.distance_m, ground.distance_m),
        np.where(nearer[:, None], walls.nearest_m, ground.nearest_m),
        ground.unknown_m,
        nearer,
    )


def in_sight_past(
    grid: ElevationGrid,
    buildings: Buildings | None,
    points_m: Array,
    anchors_m: Sequence[tuple[float, float, float]],
    curvature: Curvature,
    visible: npt.NDArray[np.bool_],
) -> npt.NDArray[np.bool_]:
    """(n, k) which of the anchors that the ground leaves in sight no building hides."""
    if buildings is None:
        return visible
    return clear_of_buildings(grid, buildings, points_m, np.array(anchors_m), curvature, asked=visible)


def open_bodies_warning(buildings: Buildings | None) -> tuple[str, ...]:
    """A sentence about bodies that have no inside."""
    if buildings is None:
        return ()
    solid = solid_bodies(buildings)
    if solid.all():
        return ()
    return (
        f"{int(np.count_nonzero(~solid))} of {len(solid)} bodies in {buildings.source} are open surfaces: a point "
        "inside one is not told from one outside.",
    )
