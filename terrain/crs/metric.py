"""The metric CRS that serves a piece of ground: the local UTM zone, or an azimuthal equidistant one around it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.crs import ProjectedCRS
from pyproj.crs.coordinate_operation import AzimuthalEquidistantConversion, UTMConversion

from ..errors import DemUnsupportedError
from ..units import degrees_per_unit
from .frames import body_of

__all__ = ["ground_scale", "local_metric_crs"]

UTM_SOUTH_DEG, UTM_NORTH_DEG, UTM_WIDTH_DEG = -80.0, 84.0, 6.0
# 30° from its centre an azimuthal equidistant map stretches by 4.7 %
WIDEST_DEG = 60.0
# points for measuring the local scale stand this far from the centre
PROBE_M = 50.0


def local_metric_crs(
    geodetic: pyproj.CRS, lon_deg: npt.NDArray[np.float64], lat_deg: npt.NDArray[np.float64]
) -> pyproj.CRS:
    """Metric CRS on the datum of ``geodetic`` for the ground that the points (n,) enclose (longitudes unwrapped).

    lon_deg counts from the prime meridian of ``geodetic``, which for UTM has to be Greenwich.
    UTM on Earth where the ground is at most one zone wide and off the poles; else azimuthal equidistant at its middle.
    Raises DemUnsupportedError where the ground is too wide for any flat map.
    """
    west, east, south, north = lon_deg.min(), lon_deg.max(), lat_deg.min(), lat_deg.max()
    lon, lat = float(west + east) / 2.0, float(south + north) / 2.0
    around_pole = east - west > 180.0
    if around_pole:
        lon, lat = 0.0, 90.0 if lat > 0.0 else -90.0
    reach_deg = max(abs(lat - south), abs(lat - north)) * 2.0
    if reach_deg > WIDEST_DEG or (not around_pole and (east - west) * np.cos(np.radians(lat)) > WIDEST_DEG):
        raise DemUnsupportedError("The DEM spans too much of the planet for a flat map; cut out the part you need.")
    lon = (lon + 180.0) % 360.0 - 180.0
    off_poles = south >= UTM_SOUTH_DEG and north <= UTM_NORTH_DEG
    from_greenwich = geodetic.prime_meridian is not None and geodetic.prime_meridian.longitude == 0.0
    # PROJ makes no UTM of a sphere
    spheroid = geodetic.ellipsoid is not None and geodetic.ellipsoid.inverse_flattening != 0.0
    if from_greenwich and spheroid and body_of(geodetic).name == "Earth" and off_poles and east - west <= UTM_WIDTH_DEG:
        return _utm(geodetic, int((lon + 180.0) // 6.0) % 60 + 1, "N" if lat >= 0.0 else "S")
    around = AzimuthalEquidistantConversion(
        latitude_natural_origin=round(lat, 6), longitude_natural_origin=round(lon, 6)
    )
    name = f"{geodetic.name} / azimuthal equidistant at {lat:.4f}, {lon:.4f}"
    return ProjectedCRS(around, name=name, geodetic_crs=geodetic)


def _utm(geodetic: pyproj.CRS, zone: int, hemisphere: str) -> pyproj.CRS:
    name = f"{geodetic.name} / UTM zone {zone}{hemisphere}"
    crs = ProjectedCRS(UTMConversion(str(zone), hemisphere), name=name, geodetic_crs=geodetic)
    code = crs.to_epsg(min_confidence=100)
    return crs if code is None else pyproj.CRS.from_epsg(code)


def ground_scale(crs: pyproj.CRS, east_m: float, north_m: float) -> tuple[float, float]:
    """How many map metres one ground metre makes, eastward and northward at a position; NaN where it does not project.

    Web Mercator gives 1.41 at 45° of latitude; a CRS fit for measuring stays near 1.
    """
    ellipsoid = crs.ellipsoid
    if ellipsoid is None or crs.geodetic_crs is None:
        return float("nan"), float("nan")
    onward = pyproj.Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True)
    geod = pyproj.Geod(a=ellipsoid.semi_major_metre, b=ellipsoid.semi_minor_metre)
    east = np.array([-PROBE_M, PROBE_M, 0.0, 0.0]) + east_m
    north = np.array([0.0, 0.0, -PROBE_M, PROBE_M]) + north_m
    lon, lat = np.array(onward.transform(east, north)) * degrees_per_unit(crs.geodetic_crs)
    if not (np.isfinite(lon).all() and np.isfinite(lat).all()):
        return float("nan"), float("nan")
    _, _, ground_m = geod.inv(lon[[0, 2]], lat[[0, 2]], lon[[1, 3]], lat[[1, 3]])
    if not (ground_m > 0.0).all():
        return float("nan"), float("nan")
    return 2.0 * PROBE_M / float(ground_m[0]), 2.0 * PROBE_M / float(ground_m[1])
