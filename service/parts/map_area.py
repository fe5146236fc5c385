"""The area of a request: the ground around it hides as ever; what is asked, shares and files are of the part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from pydantic import Field

from service.parts.areas import AnyArea, AreaChoice, area_of
from service.parts.cover import CoverParameters
from terrain import GRID_METRES, Area, AreaError, Box, ElevationGrid, area_in, area_window, told_place
from visibility import MinimumVisibleAltitude

__all__ = ["AreaParameters", "MapArea", "area_shape", "map_area", "places_in_area", "refuse_outside"]

POSTS_AT_ONCE = 1_000_000
# a corner that was given in degrees is on the border whichever way it was rounded
BORDER_M = 1e-3


class AreaParameters(CoverParameters):
    """Which part of a DEM a request is about, and what stands there."""

    area: AreaChoice | None = Field(
        None,
        description="Only this part: places that are asked about lie in it, shares count the posts in it, files and "
        "pictures hold the box around it. Ground outside still hides, so each answer is that of the whole DEM. "
        "Left out = the whole DEM.",
    )


@dataclass(frozen=True, eq=False, slots=True)
class MapArea:
    """The part of a DEM that a request is about.

    window: first and last row, first and last column of the box around the area. inside: (rows, cols) bool over that
    box, which of its posts lie in the area; None where all do. shape: the area in the grid's frame, metres; None where
    the whole DEM is meant.
    """

    grid: ElevationGrid
    window: tuple[int, int, int, int]
    inside: npt.NDArray[np.bool_] | None
    shape: shapely.Polygon | None = None

    @property
    def box(self) -> ElevationGrid:
        """The ground of the box."""
        return self.grid if self._is_all else self.grid.window(*self.window)

    def lines(self, found: MinimumVisibleAltitude) -> MinimumVisibleAltitude:
        """Minimum visible altitudes over the box, calculated with all of the ground."""
        return found if self._is_all else found.window(*self.window)

    def cut(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The box of an array (…, rows, cols) over the whole DEM."""
        first_row, last_row, first_col, last_col = self.window
        part = array[..., first_row : last_row + 1, first_col : last_col + 1]
        return array if self._is_all else np.ascontiguousarray(part)

    def cut_squares(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The box of an array (rows - 1, cols - 1) over the squares between the posts of the whole DEM."""
        first_row, last_row, first_col, last_col = self.window
        part = array[first_row:last_row, first_col:last_col]
        return array if self._is_all else np.ascontiguousarray(part)

    def within(self, polygons: Sequence[shapely.Geometry], called: str) -> tuple[shapely.Polygon, ...]:
        """What of some polygons lies in the area; the area itself where there are none, none where there is no area.

        Raises AreaError where nothing of them does.
        """
        if self.shape is None:
            return tuple(polygons)
        parts = [polygon.intersection(self.shape) for polygon in polygons] if polygons else [self.shape]
        found = tuple(
            part
            for shape in parts
            for part in shapely.get_parts(shape)
            if part.geom_type == "Polygon" and part.area > 0.0
        )
        if not found:
            raise AreaError(f"Nothing of {called} lies in the area of the request.")
        return found

    def known(self) -> npt.NDArray[np.bool_]:
        """(rows, cols) over the box: the posts that shares count, known ones in the area."""
        known: npt.NDArray[np.bool_] = ~np.isnan(self.box.heights_m)
        return known if self.inside is None else known & self.inside

    def over_all(self) -> npt.NDArray[np.bool_]:
        """(rows, cols) over the whole DEM: the posts in the area."""
        first_row, last_row, first_col, last_col = self.window
        found = np.zeros(self.grid.shape, np.bool_)
        found[first_row : last_row + 1, first_col : last_col + 1] = True if self.inside is None else self.inside
        return found

    def count(self, posts: npt.NDArray[np.bool_]) -> int:
        """How many of some posts (rows, cols) over the box lie in the area."""
        return int(np.count_nonzero(posts if self.inside is None else posts & self.inside))

    def sentences(self) -> tuple[str, ...]:
        """What to know about an answer for a part."""
        if self._is_all:
            return ()
        rows, cols = self.box.shape
        posts = rows * cols if self.inside is None else int(np.count_nonzero(self.inside))
        around = "" if self.inside is None else f"; files and pictures hold the box of {rows * cols:,} around it"
        all_posts = self.grid.heights_m.size
        return (f"The answer is for an area of {posts:,} posts of {all_posts:,}{around}. All of the DEM hides.",)

    @property
    def _is_all(self) -> bool:
        return self.inside is None and self.window == (0, self.grid.rows - 1, 0, self.grid.cols - 1)


def map_area(grid: ElevationGrid, asked: AnyArea | None) -> MapArea:
    """The area of a request over a DEM; without one all of it. Raises AreaError, FrameError, RequestError."""
    if asked is None:
        return MapArea(grid, (0, grid.rows - 1, 0, grid.cols - 1), None)
    area = area_of(asked)
    window = area_window(grid, area)
    inside = _inside(grid, area, window)
    if not inside.any():
        raise AreaError("The area lies between the posts of the DEM, so no post is in it; make it larger.")
    return MapArea(grid, window, None if inside.all() else inside, area_in(area, grid.crs))


def area_shape(grid: ElevationGrid, asked: AnyArea | None) -> shapely.Polygon | None:
    """The area of a request in the grid's frame, metres; None of none. Raises AreaError, FrameError, RequestError."""
    return None if asked is None else area_in(area_of(asked), grid.crs)


def places_in_area(
    grid: ElevationGrid, asked: AnyArea | None, places_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """(n,) which places (n, 2 or more: east, north …) lie in the area of a request or on its border; all without one.

    Raises FrameError, RequestError.
    """
    shape = area_shape(grid, asked)
    if shape is None:
        return np.ones(len(places_m), np.bool_)
    off_m: npt.NDArray[np.float64] = shapely.distance(shape, shapely.points(places_m[:, :2]))
    return off_m <= BORDER_M


def refuse_outside(grid: ElevationGrid, asked: AnyArea | None, places_m: npt.NDArray[np.float64], called: str) -> None:
    """Raise AreaError where one of these places lies outside the area of a request.

    called: what error sentences call a place, with {} for its number. Raises FrameError, RequestError as well.
    """
    outside = ~places_in_area(grid, asked, places_m)
    if outside.any():
        number = int(np.argmax(outside))
        where = told_place(grid, *places_m[number, :2].tolist())
        raise AreaError(
            f"{called.format(number)} ({where}) lies outside the area of the request; move it, or make the area larger."
        )


def _inside(grid: ElevationGrid, area: Area, window: tuple[int, int, int, int]) -> npt.NDArray[np.bool_]:
    """(rows, cols) of a window, which of its posts lie in an area or on its border."""
    first_row, last_row, first_col, last_col = window
    rows, cols = np.arange(first_row, last_row + 1), np.arange(first_col, last_col + 1)
    if isinstance(area, Box) and area.frame == GRID_METRES:
        east_m, north_m = grid.position_of(rows, cols)
        in_rows = (north_m >= area.south) & (north_m <= area.north)
        return np.logical_and.outer(in_rows, (east_m >= area.west) & (east_m <= area.east))
    shape = area_in(area, grid.crs)
    shapely.prepare(shape)
    inside = np.empty((len(rows), len(cols)), np.bool_)
    step = max(1, POSTS_AT_ONCE // len(cols))
    for start in range(0, len(rows), step):
        posts = grid.position_of(*np.meshgrid(rows[start : start + step], cols, indexing="ij"))
        inside[start : start + step] = shapely.intersects_xy(shape, *posts)
    return inside
