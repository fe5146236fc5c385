"""Areas: which piece of ground is meant, as a box, a circle round a place or a polygon, in degrees or in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyproj
import shapely

from .crs.frames import degrees_to_crs, geodesics_of
from .crs.metric import local_metric_crs
from .crs.parts import same_map
from .crs.texts import parse_crs
from .errors import AreaError, FrameError
from .grid import ElevationGrid

__all__ = [
    "DEGREES",
    "GRID_METRES",
    "Area",
    "Box",
    "Circle",
    "Outline",
    "area_in",
    "area_in_degrees",
    "area_window",
    "grown_area",
]

# the words for the two frames that need no CRS: longitude and latitude, and the metres of the DEM that is asked about
DEGREES, GRID_METRES = "degrees", "metres"
WGS84 = pyproj.CRS.from_epsg(4326)
# straight sides bend from one CRS to another: so many pieces follow them
PIECES = 64
CIRCLE_CORNERS = 360

Pairs = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Box:
    """All between two meridians and two parallels, or two eastings and two northings.

    frame: DEGREES (longitude and latitude, WGS 84 on Earth), GRID_METRES (of the DEM that is asked about) or a CRS as
    ``parse_crs`` takes it. In degrees a box with east < west goes over the antimeridian. Raises AreaError.
    """

    west: float
    south: float
    east: float
    north: float
    frame: str = DEGREES

    def __post_init__(self) -> None:
        _check_numbers("An area W,S,E,N", (self.west, self.south, self.east, self.north))
        if self.frame == DEGREES:
            _check_degrees((self.west, self.east), (self.south, self.north))
        if not self.south < self.north or self.west == self.east or (self.west > self.east and self.frame != DEGREES):
            raise AreaError(
                f"The area W,S,E,N = {self.west:g},{self.south:g},{self.east:g},{self.north:g} is empty: south must "
                "lie below north, and west before east."
            )


@dataclass(frozen=True, slots=True)
class Circle:
    """All within ``radius_m`` metres over ground of a place (x east or longitude, y north or latitude).

    frame: as in Box. Raises AreaError.
    """

    x: float
    y: float
    radius_m: float
    frame: str = DEGREES

    def __post_init__(self) -> None:
        _check_numbers("The place and radius of an area", (self.x, self.y, self.radius_m))
        if self.frame == DEGREES:
            _check_degrees((self.x,), (self.y,))
        if not self.radius_m > 0.0:
            raise AreaError(f"The radius of an area must be more than 0 m, not {self.radius_m:g}.")


@dataclass(frozen=True, slots=True)
class Outline:
    """All within a ring of corners (x, y), closed or not, and outside its holes. frame: as in Box. Raises AreaError."""

    ring: tuple[tuple[float, float], ...]
    holes: tuple[tuple[tuple[float, float], ...], ...] = ()
    frame: str = DEGREES

    def __post_init__(self) -> None:
        for ring in (self.ring, *self.holes):
            if len(ring) < 3:
                raise AreaError(f"The outline of an area needs at least three corners, not {len(ring)}.")
            _check_numbers("The corners of an area", [number for corner in ring for number in corner])
        if self.frame == DEGREES:
            _check_degrees([x for x, _ in self.ring], [y for _, y in self.ring])
        shape = _polygon(self)
        if not shape.is_valid or shape.area == 0.0:
            why = shapely.is_valid_reason(shape) if not shape.is_valid else "it is empty"
            raise AreaError(f"The outline of the area is no polygon: {why}.")


Area = Box | Circle | Outline


def area_in(area: Area, crs: pyproj.CRS | None) -> shapely.Polygon:
    """The area in a CRS, or in a local metric frame (None); longitudes run on over the antimeridian.

    Raises FrameError where the area's frame and the CRS have nothing to do with one another, or it does not project.
    """
    own = _own_crs(area)
    if own is None or (crs is not None and same_map(own, crs)):
        return _drawn(area, crs)
    if crs is None:
        raise FrameError("The DEM has no CRS, so an area must be in its metres (the frame 'metres').")
    return _transformed(area_in_degrees(area, crs), degrees_to_crs(crs), "The area")


def area_in_degrees(area: Area, of: pyproj.CRS = WGS84) -> shapely.Polygon:
    """The area in longitude and latitude (WGS 84 on Earth, else the body's own). Raises FrameError.

    of: a CRS on the body whose degrees they are.
    """
    own = _own_crs(area)
    if own is None:
        raise FrameError(
            "An area in a DEM's metres has no place of its own; give it in degrees, or name the CRS of its metres."
        )
    if area.frame == DEGREES:
        return _drawn(area, of)
    back = degrees_to_crs(own)
    ring = _dense(_drawn(area, own))

    def inverse(pairs: Pairs) -> Pairs:
        lon, lat = back.transform(pairs[:, 0], pairs[:, 1], direction="INVERSE")
        return np.column_stack([_running(lon), lat])

    return _checked(shapely.transform(ring, inverse), "The area")


def grown_area(area: Area, margin_m: float) -> Outline:
    """The area and all within ``margin_m`` metres of it, in degrees or, where it is that, in the grid's metres."""
    if area.frame == GRID_METRES:
        return _outline(area_in(area, None).buffer(margin_m), GRID_METRES)
    shape = area_in_degrees(area)
    if margin_m == 0.0:
        return _outline(shape, DEGREES)
    lon, lat = np.asarray(shape.exterior.coords).T
    metric = local_metric_crs(WGS84, lon, lat)
    grown = area_in(_outline(shape, DEGREES), metric).buffer(margin_m)
    return _outline(area_in_degrees(_outline(grown, metric.to_wkt())), DEGREES)


def area_window(grid: ElevationGrid, area: Area) -> tuple[int, int, int, int]:
    """(first_row, last_row, first_col, last_col) of the posts around an area, as ``ElevationGrid.window`` takes them.

    Raises AreaError where the area lies beside the grid, FrameError.
    """
    west_m, south_m, east_m, north_m = area_in(area, grid.crs).bounds
    top, left = grid.post_at(west_m, north_m)
    bottom, right = grid.post_at(east_m, south_m)
    slack = 1e-6
    rows = max(math.floor(top + slack), 0), min(math.ceil(bottom - slack), grid.rows - 1)
    cols = max(math.floor(left + slack), 0), min(math.ceil(right - slack), grid.cols - 1)
    if bottom < 0.0 or right < 0.0 or top > grid.rows - 1 or left > grid.cols - 1:
        west, south, east, north = grid.bounds_m
        raise AreaError(
            f"The area ({west_m:.0f} … {east_m:.0f} m east, {south_m:.0f} … {north_m:.0f} m north) lies beside the "
            f"DEM, whose posts lie within {west:.0f} … {east:.0f} m east, {south:.0f} … {north:.0f} m north."
        )
    return *rows, *cols


def _own_crs(area: Area) -> pyproj.CRS | None:
    if area.frame == GRID_METRES:
        return None
    return WGS84 if area.frame == DEGREES else parse_crs(area.frame)


def _drawn(area: Area, crs: pyproj.CRS | None) -> shapely.Polygon:
    """The area in its own frame."""
    if isinstance(area, Box):
        east = area.east + (360.0 if area.east < area.west else 0.0)
        return shapely.box(area.west, area.south, east, area.north)
    if isinstance(area, Outline):
        return _polygon(area)
    if area.frame != DEGREES:
        angle = np.linspace(0.0, 2.0 * math.pi, CIRCLE_CORNERS, endpoint=False)
        radius_m = area.radius_m / math.cos(math.pi / CIRCLE_CORNERS)  # around the circle, not within it
        return shapely.Polygon(np.column_stack([area.x + radius_m * np.cos(angle), area.y + radius_m * np.sin(angle)]))
    geodesics = geodesics_of(WGS84 if crs is None else crs)
    most_m = math.pi / 2.0 * geodesics.b
    if area.radius_m > most_m:
        raise AreaError(
            f"The radius of the area, {area.radius_m / 1000.0:,.0f} km, is more than a quarter of the way round the "
            f"body, {most_m / 1000.0:,.0f} km; give a smaller one."
        )
    azimuth_deg = np.linspace(0.0, -360.0, CIRCLE_CORNERS, endpoint=False)
    radius_m = area.radius_m / math.cos(math.pi / CIRCLE_CORNERS)
    lon, lat, _ = geodesics.fwd(np.full_like(azimuth_deg, area.x), np.full_like(azimuth_deg, area.y), azimuth_deg,
                                np.full_like(azimuth_deg, radius_m))  # fmt: skip
    lon = _running(lon)
    if abs(lon[-1] - lon[0]) > 180.0:
        raise AreaError("The circle holds a pole, round which degrees make no area; give an area in metres there.")
    return shapely.Polygon(np.column_stack([lon + 360.0 * round((area.x - float(lon.mean())) / 360.0), lat]))


def _polygon(area: Outline) -> shapely.Polygon:
    if area.frame != DEGREES:
        return shapely.Polygon(area.ring, area.holes)
    rings = [np.array(ring, np.float64) for ring in (area.ring, *area.holes)]
    for ring in rings:  # over the antimeridian the short way, holes beside their ring
        ring[:, 0] = _running(ring[:, 0])
        ring[:, 0] += 360.0 * round((float(rings[0][:, 0].mean()) - float(ring[:, 0].mean())) / 360.0)
    return shapely.Polygon(rings[0], rings[1:])


def _running(lon: Pairs) -> Pairs:
    """Longitudes without the jump at the antimeridian."""
    return np.unwrap(lon, period=360.0)


def _dense(shape: shapely.Polygon) -> shapely.Polygon:
    west, south, east, north = shape.bounds
    return shapely.segmentize(shape, max(east - west, north - south) / PIECES)


def _transformed(shape: shapely.Polygon, onward: pyproj.Transformer, called: str) -> shapely.Polygon:
    def forward(pairs: Pairs) -> Pairs:
        return np.column_stack(onward.transform(pairs[:, 0], pairs[:, 1]))

    return _checked(shapely.transform(_dense(shape), forward), called)


def _checked(shape: shapely.Polygon, called: str) -> shapely.Polygon:
    if not np.isfinite(shape.bounds).all():
        raise FrameError(f"{called} lies where the CRS is not defined.")
    return shape


def _outline(shape: shapely.Polygon, frame: str) -> Outline:
    rings = [tuple((float(x), float(y)) for x, y in ring.coords) for ring in (shape.exterior, *shape.interiors)]
    return Outline(rings[0], tuple(rings[1:]), frame)


def _check_numbers(called: str, numbers: tuple[float, ...] | list[float]) -> None:
    if not all(math.isfinite(number) for number in numbers):
        raise AreaError(f"{called} must be finite numbers.")


def _check_degrees(lon_deg: tuple[float, ...] | list[float], lat_deg: tuple[float, ...] | list[float]) -> None:
    wrong = [lon for lon in lon_deg if not -180.0 <= lon <= 540.0] + [lat for lat in lat_deg if abs(lat) > 90.0]
    if wrong:
        raise AreaError(
            f"The area has {wrong[0]:g} among its degrees; longitudes lie in −180…360 and latitudes in −90…90. Are "
            "they swapped, or metres?"
        )
