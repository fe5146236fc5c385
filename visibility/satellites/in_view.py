"""Which satellites stand in the visibility cone of a place, and where; places on a DEM as places on Earth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.enums import TransformDirection

from gnss.almanac import Almanac
from gnss.almanac_orbits import ALMANAC_USEFUL_S, almanac_positions_ecef_m
from gnss.broadcast_ephemeris import EPHEMERIS_USEFUL_S, Ephemerides, ephemeris_positions_ecef_m
from gnss.gps_time import Instants, Moments, instants
from gnss.sky import ConeAxis, Place, enu_to_ecef_m, look_angles, off_axis_rad
from terrain import ElevationGrid, FrameError, body_of, height_at, to_grid_frame, to_lon_lat
from visibility.sight.anchors import middle_m

from ..errors import VisibilityInputError

__all__ = [
    "DEFAULT_CONE_RAD",
    "Constellation",
    "SatellitesInView",
    "place_on_grid",
    "satellite_positions_ecef_m",
    "satellites_in_view",
    "true_to_grid",
]

STEP_M = 100.0


def place_on_grid(grid: ElevationGrid, east_m: float | None = None, north_m: float | None = None) -> Place:
    """The place on Earth over a position of a grid, on its ground; without a position, the grid's middle.

    Where the ground is unknown or absent, the mean of the known heights stands in for it.
    Raises FrameError for a grid without CRS or of another body.
    """
    _check_earth(grid)
    middle_east_m, middle_north_m = middle_m(grid)
    east_m = middle_east_m if east_m is None else east_m
    north_m = middle_north_m if north_m is None else north_m
    lon_deg, lat_deg = to_lon_lat(grid, east_m, north_m)
    height_m = float(height_at(grid, east_m, north_m)) if grid.contains(east_m, north_m) else np.nan
    if np.isnan(height_m):
        known_m = grid.heights_m[~np.isnan(grid.heights_m)]
        height_m = float(known_m.mean(dtype=np.float64)) if known_m.size else 0.0
    return Place(lon_deg, lat_deg, height_m)


def true_to_grid(grid: ElevationGrid, place: Place) -> Array:
    """(2, 2) matrix from true metres (east, north) at a place to metres of the grid's axes.

    For a conformal CRS: its scale there times the rotation by meridian convergence. The identity for a grid without
    CRS, whose north is taken as true. Raises FrameError for a grid of another body.
    """
    if grid.crs is None:
        return np.eye(2)
    _check_earth(grid)
    steps_enu_m = STEP_M * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    # by way of ECEF, so that a pole is a place like any other
    ecef_x_m, ecef_y_m, ecef_z_m = enu_to_ecef_m(place, steps_enu_m).T
    lon_deg, lat_deg, _ = _ecef_of_lon_lat().transform(
        ecef_x_m, ecef_y_m, ecef_z_m, direction=TransformDirection.INVERSE
    )
    east_m, north_m = to_grid_frame(grid, np.asarray(lon_deg, np.float64), np.asarray(lat_deg, np.float64))
    return np.array(
        [[east_m[0] - east_m[1], east_m[2] - east_m[3]], [north_m[0] - north_m[1], north_m[2] - north_m[3]]]
    ) / (2.0 * STEP_M)


def _check_earth(grid: ElevationGrid) -> None:
    if grid.crs is None:
        raise FrameError("The DEM has no CRS, so its place on Earth is unknown; give the place (lon_deg, lat_deg).")
    body = body_of(grid.crs)
    if body.name != "Earth":
        raise FrameError(f"The DEM lies on {body.name}; GPS satellites serve places on Earth only.")


@lru_cache(maxsize=1)
def _ecef_of_lon_lat() -> pyproj.Transformer:
    return pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)


Array = npt.NDArray[np.float64]
Constellation = Almanac | Ephemerides

DEFAULT_CONE_RAD = math.radians(85.0)


@dataclass(frozen=True, slots=True, eq=False)
class SatellitesInView:
    """The answer to ``satellites_in_view``: every usable satellite at every instant, (n_satellites, n_times).

    ids: of the rows, sorted. unhealthy_ids: satellites left out as unhealthy. warnings: what else in the
        constellation's file was passed over.
    azimuth_rad: clockwise from true north. elevation_rad: above the ellipsoid's horizontal. range_m: slant.
    off_axis_rad: θ of eq. 1. in_view: θ < cone_rad. position_ecef_m: (n_satellites, n_times, 3).
    NaN (and in_view False) where the constellation's file tells no position for that time.
    """

    ids: tuple[str, ...]
    unhealthy_ids: tuple[str, ...]
    warnings: tuple[str, ...]
    times: Instants
    place: Place
    cone_rad: float
    azimuth_rad: Array
    elevation_rad: Array
    range_m: Array
    off_axis_rad: Array
    in_view: npt.NDArray[np.bool_]
    position_ecef_m: Array

    def ids_in_view(self, time: int = 0) -> tuple[str, ...]:
        """The satellites in view at the instant of that index."""
        return tuple(name for name, seen in zip(self.ids, self.in_view[:, time], strict=True) if seen)


def satellites_in_view(
    constellation: Constellation,
    times: Moments,
    place: Place | ElevationGrid,
    cone_rad: float = DEFAULT_CONE_RAD,
    *,
    axis: ConeAxis = "geocentric",
    leap_seconds: int | None = None,
    max_age_s: float | None = None,
) -> SatellitesInView:
    """Azimuth, elevation, range and ECEF position of each healthy satellite, and whether it is in the cone.

    times: one or many aware datetimes or GpsTime. leap_seconds: GPS − UTC for the datetimes; None = built-in table.
    place: a grid stands for its middle, on the ground there.
    cone_rad: θ_lim, the half-angle of the cone of potentially visible satellites (De Vivo et al., eq. 1), in 0…π.
    axis: the cone's axis, see ``cone_axis_ecef``.
    max_age_s: how far from its own time the file may be used; None = 28 days for an almanac, 2 h for ephemerides.
    Bending of the ray by the air (0.16° at 5° elevation) is not applied.
    Raises AlmanacError, VisibilityInputError, FrameError.
    """
    if not 0.0 < cone_rad <= math.pi:
        raise VisibilityInputError(f"cone_rad must lie in 0…π, not {cone_rad:g}; θ_lim = 85° is 1.4835.")
    at = place_on_grid(place) if isinstance(place, ElevationGrid) else place
    when = instants(times, leap_seconds)
    ids, position_ecef_m = satellite_positions_ecef_m(constellation, when, max_age_s)
    angles = look_angles(at, position_ecef_m)
    theta_rad = off_axis_rad(at, position_ecef_m, axis)
    return SatellitesInView(
        ids=ids,
        unhealthy_ids=constellation.unhealthy_ids,
        warnings=constellation.warnings,
        times=when,
        place=at,
        cone_rad=cone_rad,
        azimuth_rad=angles.azimuth_rad,
        elevation_rad=angles.elevation_rad,
        range_m=angles.range_m,
        off_axis_rad=theta_rad,
        in_view=theta_rad < cone_rad,
        position_ecef_m=position_ecef_m,
    )


def satellite_positions_ecef_m(
    constellation: Constellation, times: Instants, max_age_s: float | None = None
) -> tuple[tuple[str, ...], Array]:
    """Ids, sorted, and (n_satellites, n_times, 3) ECEF of the healthy satellites; NaN where the file tells nothing.

    max_age_s: see ``satellites_in_view``. Raises AlmanacError, VisibilityInputError.
    """
    if max_age_s is not None and not max_age_s >= 0.0:
        raise VisibilityInputError(f"max_age_s must be >= 0 s, not {max_age_s}.")
    if isinstance(constellation, Almanac):
        entries = sorted(constellation.healthy, key=lambda entry: entry.prn)
        useful_s = ALMANAC_USEFUL_S if max_age_s is None else max_age_s
        return tuple(entry.id for entry in entries), almanac_positions_ecef_m(entries, times, useful_s)
    ids = constellation.healthy_ids
    useful_s = EPHEMERIS_USEFUL_S if max_age_s is None else max_age_s
    return ids, ephemeris_positions_ecef_m(constellation, ids, times, useful_s)
