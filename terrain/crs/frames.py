"""Frames: which body a CRS lies on, and positions in degrees brought into a grid's metric frame and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import overload

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.enums import TransformDirection

from ..errors import FrameError
from ..grid import ElevationGrid

__all__ = [
    "Body",
    "body_of",
    "datum_doubt",
    "degrees_to_crs",
    "geodesics_of",
    "grid_north",
    "shift_matters",
    "to_grid_frame",
    "to_lon_lat",
    "true_offsets",
]

Array = npt.NDArray[np.float64]

# no flat map of a planet in the solar system reaches this far
FARTHEST_M = 1.0e9
# a millimetre: two datum shifts that agree so far are one
SAME_PLACE_DEG = 1.0e-8
# the grid's north is told by two points so far north and south
PROBE_M = 50.0


@dataclass(frozen=True, slots=True)
class Body:
    """A celestial body: its name and mean ellipsoid radius (2a + b)/3 in metres."""

    name: str
    radius_m: float


def body_of(crs: pyproj.CRS) -> Body:
    """The body that a CRS describes, told by the size of its ellipsoid. Raises FrameError when it has none."""
    ellipsoid = crs.ellipsoid
    if ellipsoid is None:
        raise FrameError(f"The CRS {crs.name!r} has no ellipsoid, so its radius is unknown.")
    semi_major_m, semi_minor_m = ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre
    names = {"Earth": (6.33e6, 6.41e6), "Mars": (3.35e6, 3.42e6), "Moon": (1.73e6, 1.745e6)}
    name = next((n for n, (low, high) in names.items() if low <= semi_major_m <= high), ellipsoid.name)
    return Body(name, (2.0 * semi_major_m + semi_minor_m) / 3.0)


@overload
def to_grid_frame(grid: ElevationGrid, lon_deg: float, lat_deg: float) -> tuple[float, float]: ...
@overload
def to_grid_frame(grid: ElevationGrid, lon_deg: npt.ArrayLike, lat_deg: npt.ArrayLike) -> tuple[Array, Array]: ...
def to_grid_frame(
    grid: ElevationGrid, lon_deg: npt.ArrayLike, lat_deg: npt.ArrayLike
) -> tuple[float, float] | tuple[Array, Array]:
    """(east_m, north_m) in the grid's CRS of longitudes and latitudes, scalars or arrays of one shape.

    Degrees are WGS 84 on Earth, elsewhere the body's own in the grid's CRS; longitudes may run to 360.
    Raises FrameError for a grid without CRS, degrees out of range and positions that the CRS cannot express.
    """
    lon, lat = np.broadcast_arrays(np.asarray(lon_deg, np.float64), np.asarray(lat_deg, np.float64))
    if not (np.isfinite(lon).all() and np.isfinite(lat).all()):
        raise FrameError("lon_deg and lat_deg must be finite numbers.")
    if (np.abs(lat) > 90.0).any() or (lon < -180.0).any() or (lon > 360.0).any():
        raise FrameError(
            f"lat_deg must lie in −90…90 and lon_deg in −180…360, not {_first(lat, np.abs(lat) > 90.0)} and "
            f"{_first(lon, (lon < -180.0) | (lon > 360.0))}; are they swapped or in metres?"
        )
    east, north = degrees_to_crs(_crs_of(grid)).transform(lon, lat)
    return _checked(grid, east, north, f"lon_deg {lon.flat[0]:g}, lat_deg {lat.flat[0]:g}" if lon.size == 1 else "")


@overload
def to_lon_lat(grid: ElevationGrid, east_m: float, north_m: float) -> tuple[float, float]: ...
@overload
def to_lon_lat(grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> tuple[Array, Array]: ...
def to_lon_lat(
    grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike
) -> tuple[float, float] | tuple[Array, Array]:
    """(lon_deg, lat_deg) of positions in the grid's CRS: the inverse of ``to_grid_frame``. Raises FrameError."""
    east, north = np.broadcast_arrays(np.asarray(east_m, np.float64), np.asarray(north_m, np.float64))
    if not (np.isfinite(east).all() and np.isfinite(north).all()):
        raise FrameError("east_m and north_m must be finite numbers.")
    lon, lat = degrees_to_crs(_crs_of(grid)).transform(east, north, direction=TransformDirection.INVERSE)
    return _checked(grid, lon, lat, f"east_m {east.flat[0]:g}, north_m {north.flat[0]:g}" if east.size == 1 else "")


def datum_doubt(grid: ElevationGrid) -> str | None:
    """Why the grid's degrees are doubtful, as a sentence; None where PROJ knows how its datum lies to WGS 84."""
    if grid.crs is None or body_of(grid.crs).name != "Earth":
        return None
    west_m, south_m, east_m, north_m = grid.bounds_m
    _, guessed = _degrees_at(grid.crs, (west_m + east_m) / 2.0, (south_m + north_m) / 2.0)
    if not guessed:
        return None
    datum = grid.crs.name if grid.crs.datum is None else grid.crs.datum.name
    return (
        f"How the datum {datum!r} lies to WGS 84 is not known: longitudes and latitudes are taken to be its own, "
        "which may put them up to some hundred metres off. Positions in metres are right; give crs= if you know it."
    )


def shift_matters(plain: pyproj.CRS, shifted: pyproj.CRS, x: float, y: float) -> bool:
    """Whether a datum shift that is bound to a CRS moves degrees away from where PROJ puts them by itself."""
    if body_of(plain).name != "Earth":
        return False
    itself, guessed = _degrees_at(plain, x, y)
    stated, _ = _degrees_at(shifted, x, y)
    return guessed or max(abs(a - b) for a, b in zip(itself, stated, strict=True)) > SAME_PLACE_DEG


def _degrees_at(crs: pyproj.CRS, x: float, y: float) -> tuple[tuple[float, float], bool]:
    """((lon_deg, lat_deg), whether PROJ only takes the degrees of one datum for those of the other)."""
    onward = degrees_to_crs(crs)
    lon, lat = onward.transform(x, y, direction=TransformDirection.INVERSE)
    if not np.isfinite([lon, lat]).all():
        return (lon, lat), False
    # where PROJ has several operations it tells only afterwards which one it took
    used = onward.get_last_used_operation() if onward.description.startswith("unavailable") else onward
    return (lon, lat), "ballpark" in used.description.lower()


def grid_north(grid: ElevationGrid, east_m: float, north_m: float) -> float:
    """Azimuth of the grid's north at a position: radians clockwise from true north, −π…π. Raises FrameError.

    It is what to add to an azimuth from grid north for one from true north (the meridian convergence of surveyors).
    """
    lon, lat = to_lon_lat(grid, [east_m] * 3, [north_m, north_m + PROBE_M, north_m - PROBE_M])
    azimuth_deg, _, _ = geodesics_of(_crs_of(grid)).inv(lon[[0, 0]], lat[[0, 0]], lon[1:], lat[1:])
    ahead, behind = np.radians(azimuth_deg)
    return math.atan2(math.sin(ahead) - math.sin(behind), math.cos(ahead) - math.cos(behind))


def true_offsets(
    grid: ElevationGrid, origin_m: tuple[float, float], east_m: npt.ArrayLike, north_m: npt.ArrayLike
) -> tuple[Array, Array]:
    """Metres over ground true east and true north, (n,) each, of positions from an origin. Raises FrameError."""
    lon, lat = to_lon_lat(grid, np.atleast_1d(np.asarray(east_m)), np.atleast_1d(np.asarray(north_m)))
    from_lon, from_lat = to_lon_lat(grid, *origin_m)
    geodesics = geodesics_of(_crs_of(grid))
    azimuth_deg, _, way_m = geodesics.inv(np.full_like(lon, from_lon), np.full_like(lat, from_lat), lon, lat)
    azimuth_rad = np.radians(azimuth_deg)
    return way_m * np.sin(azimuth_rad), way_m * np.cos(azimuth_rad)


def geodesics_of(crs: pyproj.CRS) -> pyproj.Geod:
    """Of the ellipsoid that the degrees of ``to_lon_lat`` lie on."""
    geodetic = _geodetic_of(crs)
    ellipsoid = geodetic.ellipsoid
    assert ellipsoid is not None, "body_of has refused a CRS without one"
    return pyproj.Geod(a=ellipsoid.semi_major_metre, b=ellipsoid.semi_minor_metre)


def _crs_of(grid: ElevationGrid) -> pyproj.CRS:
    if grid.crs is None:
        raise FrameError(
            "The DEM has no CRS, so longitude and latitude have no place on it; give metres east and north."
        )
    return grid.crs


def _geodetic_of(crs: pyproj.CRS) -> pyproj.CRS:
    geodetic = pyproj.CRS.from_epsg(4326) if body_of(crs).name == "Earth" else crs.geodetic_crs
    if geodetic is None:
        raise FrameError(f"The CRS {crs.name!r} has no longitude and latitude.")
    return geodetic


@lru_cache(maxsize=64)
def degrees_to_crs(crs: pyproj.CRS) -> pyproj.Transformer:
    """From longitude and latitude (WGS 84 on Earth, elsewhere the body's own) to a CRS. Raises FrameError."""
    return pyproj.Transformer.from_crs(_geodetic_of(crs), crs, always_xy=True)


def _checked(grid: ElevationGrid, first: Array, second: Array, where: str) -> tuple[float, float] | tuple[Array, Array]:
    # some projections answer far-off places with huge numbers instead of none
    if not ((np.abs(first) < FARTHEST_M).all() and (np.abs(second) < FARTHEST_M).all()):
        name = grid.crs.name if grid.crs is not None else "local"
        raise FrameError(f"{where or 'Some positions'} cannot be projected with the DEM's CRS {name}.")
    if np.ndim(first) == 0:
        return float(first), float(second)
    return first, second


def _first(values: Array, wrong: npt.NDArray[np.bool_]) -> float:
    return float(values[wrong].flat[0]) if wrong.any() else float(values.flat[0])
