"""What a map by windows stands on: a raster read by windows or a DEM that is held, anchors in it, and their reaches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely

from service.errors import RequestError
from service.parts.altitude_datums import in_dem_datum
from service.parts.areas import area_of
from service.parts.doubts import doubted_anchors
from service.parts.shapes_in_grid import resolve_anchor
from service.products.visibility.request import VisibilityMapParameters
from terrain import AreaError, ElevationGrid, LargeDem, area_in, to_grid_frame
from visibility import Anchor
from visibility.sight.in_reach import Raster, Reach, box_of, name_of, reach_of, work_bytes

__all__ = ["Prepared", "ground_at", "posts_asked_about", "prepared", "raster_of"]

MOST_ANCHORS = 254  # of what a byte counts, 255 means nothing


@dataclass(frozen=True, slots=True)
class Prepared:
    """A request in a raster's frame.

    middle: the few posts in its middle. reaches: of those anchors whose reach touches what is asked about, by number.
    shape: the area that is asked about, metres; None without one. box: the posts that the map covers.
    """

    dem: Raster
    middle: ElevationGrid
    parameters: VisibilityMapParameters
    anchors: tuple[Anchor, ...]
    reaches: Mapping[int, Reach]
    shape: shapely.Polygon | None
    box: Reach
    told: tuple[str, ...]

    @property
    def largest(self) -> tuple[str, int]:
        """(id of the anchor, posts) of the largest reach, which is in memory at once."""
        number = max(self.reaches, key=lambda one: self.reaches[one].posts)
        return self.anchors[number].id, self.reaches[number].posts

    @property
    def posts(self) -> int:
        """Of all reaches, once for each anchor."""
        return sum(reach.posts for reach in self.reaches.values())

    @property
    def posts_in_a_row(self) -> int:
        """Of the reaches that one row of posts touches, where that is most: their answers are held until then."""
        reaches = self.reaches.values()
        return max(
            sum(other.posts for other in reaches if other.first_row <= one.first_row <= other.last_row)
            for one in reaches
        )


def raster_of(grid: ElevationGrid) -> Raster:
    """The raster that a DEM is the overview of, or the DEM itself."""
    finer = grid.provenance.overview_of
    return finer if isinstance(finer, LargeDem) else grid


def prepared(dem: Raster, parameters: VisibilityMapParameters) -> Prepared:
    """Anchors and reaches of a request; of the raster only some posts around anchors are read.

    Raises RequestError (no range limit, with what that would take; nothing in reach), AreaError, AnchorError,
    FrameError, VerticalDatumError, DemReadError.
    """
    middle = ground_at(dem, (dem.rows - 1) / 2.0, (dem.cols - 1) / 2.0)
    parameters, told = in_dem_datum(middle, parameters)
    placed = [_anchor(dem, middle, parameters, number) for number in range(len(parameters.anchors))]
    anchors, passed_over = doubted_anchors(middle, placed, parameters.doubts)
    told = (*told, *passed_over)
    ids = [anchor.id for anchor in anchors]
    if len(set(ids)) < len(ids) or len(ids) > MOST_ANCHORS:
        raise RequestError(f"A map by windows takes up to {MOST_ANCHORS} anchors with unique ids, not {len(ids)}.")
    reaches = {number: reach for number, anchor in enumerate(anchors) if (reach := reach_of(dem, anchor)) is not None}
    if not reaches:
        raise RequestError(
            f"No post of {name_of(dem)} lies in any anchor's reach; are places or ranges in other units?"
        )
    if parameters.area is None:
        return Prepared(dem, middle, parameters, anchors, reaches, None, box_of([*reaches.values()]), told)
    shape = area_in(area_of(parameters.area), dem.crs)
    window = _window_of(dem, shape)
    parts = {number: _common(reach, window) for number, reach in reaches.items()}
    touching = [part for part in parts.values() if part is not None]
    if not touching:
        raise AreaError(f"No post of {name_of(dem)} in the area lies in any anchor's reach.")
    reaches = {number: reaches[number] for number, part in parts.items() if part is not None}
    told = (*told, "The answer is for an area; ground outside it hides as ever.")
    return Prepared(dem, middle, parameters, anchors, reaches, shape, box_of(touching), told)


def posts_asked_about(
    dem: Raster, anchor: Anchor, shape: shapely.Polygon | None, rows: tuple[int, int], cols: tuple[int, int]
) -> npt.NDArray[np.bool_]:
    """(rows, cols) bool: which posts of a half-open block lie no further from an anchor on the map than its range.

    shape: only those in it or on its border, where there is one.
    """
    row, col = dem.post_at(anchor.east_m, anchor.north_m)
    north_m = (np.arange(*rows) - row) * dem.cell_north_m
    east_m = (np.arange(*cols) - col) * dem.cell_east_m
    within: npt.NDArray[np.bool_] = east_m * east_m <= (anchor.limits.max_range_m**2 - north_m * north_m)[:, None]
    if shape is None:
        return within
    at_east_m = dem.origin_east_m + np.arange(*cols) * dem.cell_east_m
    at_north_m = dem.origin_north_m - np.arange(*rows) * dem.cell_north_m
    west, south, east, north = shape.bounds
    within &= np.logical_and.outer(
        (at_north_m >= south) & (at_north_m <= north), (at_east_m >= west) & (at_east_m <= east)
    )
    if not shape.equals(shape.envelope):
        at_row, at_col = np.nonzero(within)
        shapely.prepare(shape)
        within[at_row, at_col] = shapely.intersects_xy(shape, at_east_m[at_col], at_north_m[at_row])
    return within


def _window_of(dem: Raster, shape: shapely.Polygon) -> Reach:
    """The posts within the bounds of a shape, of a raster without borders."""
    west, south, east, north = shape.bounds
    first_row, first_col = dem.post_at(west, north)
    last_row, last_col = dem.post_at(east, south)
    return Reach(math.ceil(first_row), math.floor(last_row), math.ceil(first_col), math.floor(last_col))


def _common(one: Reach, other: Reach) -> Reach | None:
    both = Reach(
        max(one.first_row, other.first_row), min(one.last_row, other.last_row),
        max(one.first_col, other.first_col), min(one.last_col, other.last_col),
    )  # fmt: skip
    return both if both.first_row <= both.last_row and both.first_col <= both.last_col else None


def _anchor(dem: Raster, middle: ElevationGrid, parameters: VisibilityMapParameters, number: int) -> Anchor:
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
            f"Anchor {asked.id} has no range limit, so all {posts:,} posts of {name_of(dem)} are in its reach, which "
            f"take about {work_bytes(posts) / 1e9:,.2g} GB of memory; give it max_range_m, or read the DEM whole."
        )
    found = resolve_anchor(ground_at(dem, *dem.post_at(*place)), asked)
    return found if parameters.usable else replace(found, radio=None)


def ground_at(dem: Raster, row: float, col: float) -> ElevationGrid:
    """The few posts around a place, or the nearest to one outside."""
    first_row = int(np.clip(np.floor(row), 0, max(dem.rows - 2, 0)))
    first_col = int(np.clip(np.floor(col), 0, max(dem.cols - 2, 0)))
    return dem.window(first_row, min(first_row + 1, dem.rows - 1), first_col, min(first_col + 1, dem.cols - 1))
