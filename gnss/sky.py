"""The sky over a place on Earth: local axes, azimuth, elevation and range, and the visibility cone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError

__all__ = [
    "ConeAxis",
    "LookAngles",
    "Place",
    "cone_axis_ecef",
    "ecef_to_enu_m",
    "enu_to_ecef_m",
    "look_angles",
    "off_axis_rad",
    "place_ecef_m",
    "place_of_ecef",
]

Array = npt.NDArray[np.float64]
ConeAxis = Literal["geocentric", "vertical"] | Sequence[float]

# WGS 84
SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1.0 / 298.257223563


@dataclass(frozen=True, slots=True)
class Place:
    """A place on Earth: WGS 84 longitude and latitude in degrees, height above the ellipsoid in metres.

    An altitude above sea level serves as well: 100 m turn a satellite's direction by 5e-6 rad at most.
    Raises GnssInputError.
    """

    lon_deg: float
    lat_deg: float
    height_m: float = 0.0

    def __post_init__(self) -> None:
        if not (-180.0 <= self.lon_deg <= 360.0 and -90.0 <= self.lat_deg <= 90.0):
            raise GnssInputError(
                f"A place needs lon_deg in −180…360 and lat_deg in −90…90, not {self.lon_deg:g} and {self.lat_deg:g}."
            )
        if not abs(self.height_m) <= 1e6:
            raise GnssInputError(f"A place's height_m must lie within 1000 km of the Earth, not {self.height_m:g}.")


@dataclass(frozen=True, slots=True, eq=False)
class LookAngles:
    """Directions and distances from a place, arrays of one shape.

    azimuth_rad: clockwise from true north, 0…2π. elevation_rad: above the ellipsoid's horizontal. range_m: slant.
    """

    azimuth_rad: Array
    elevation_rad: Array
    range_m: Array


def place_ecef_m(place: Place) -> Array:
    """(3,) ECEF of a place, metres."""
    lat, lon = math.radians(place.lat_deg), math.radians(place.lon_deg)
    eccentricity2 = FLATTENING * (2.0 - FLATTENING)
    # radius of curvature across the meridian: 6378 km at the equator, 6400 km at a pole
    across_m = SEMI_MAJOR_M / math.sqrt(1.0 - eccentricity2 * math.sin(lat) ** 2)
    return np.array(
        [
            (across_m + place.height_m) * math.cos(lat) * math.cos(lon),
            (across_m + place.height_m) * math.cos(lat) * math.sin(lon),
            (across_m * (1.0 - eccentricity2) + place.height_m) * math.sin(lat),
        ]
    )


def place_of_ecef(position_ecef_m: npt.ArrayLike) -> Place:
    """The place of a (3,) ECEF position, metres: the inverse of ``place_ecef_m`` to 1 µm. Raises GnssInputError."""
    position_m = np.asarray(position_ecef_m, np.float64)
    if position_m.shape != (3,) or not np.isfinite(position_m).all() or np.linalg.norm(position_m) < SEMI_MAJOR_M / 2.0:
        raise GnssInputError("A place needs three finite numbers of metres, far from the Earth's middle.")
    x_m, y_m, z_m = (float(value) for value in position_m)
    eccentricity2 = FLATTENING * (2.0 - FLATTENING)
    off_axis_m, lat = math.hypot(x_m, y_m), math.atan2(z_m, math.hypot(x_m, y_m) * (1.0 - eccentricity2))
    # Hirvonen and Moritz: each step leaves 1/300 of what was wrong
    for _ in range(8):
        across_m = SEMI_MAJOR_M / math.sqrt(1.0 - eccentricity2 * math.sin(lat) ** 2)
        lat = math.atan2(z_m + eccentricity2 * across_m * math.sin(lat), off_axis_m)
    up_m = off_axis_m * math.cos(lat) + z_m * math.sin(lat)
    height_m = up_m - SEMI_MAJOR_M * math.sqrt(1.0 - eccentricity2 * math.sin(lat) ** 2)
    return Place(math.degrees(math.atan2(y_m, x_m)), math.degrees(lat), height_m)


def R_ecef_to_enu(place: Place) -> Array:
    """(3, 3) rotation from ECEF to east, north, up at a place; rows are those axes."""
    lat, lon = math.radians(place.lat_deg), math.radians(place.lon_deg)
    sin_lat, cos_lat, sin_lon, cos_lon = math.sin(lat), math.cos(lat), math.sin(lon), math.cos(lon)
    return np.array(
        [
            [-sin_lon, cos_lon, 0.0],
            [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
        ]
    )


def ecef_to_enu_m(place: Place, position_ecef_m: npt.ArrayLike) -> Array:
    """(..., 3) east, north, up from a place, metres, of (..., 3) ECEF positions."""
    return (np.asarray(position_ecef_m, np.float64) - place_ecef_m(place)) @ R_ecef_to_enu(place).T


def enu_to_ecef_m(place: Place, position_enu_m: npt.ArrayLike) -> Array:
    """(..., 3) ECEF of (..., 3) east, north, up from a place: the inverse of ``ecef_to_enu_m``."""
    return np.asarray(position_enu_m, np.float64) @ R_ecef_to_enu(place) + place_ecef_m(place)


def look_angles(place: Place, position_ecef_m: npt.ArrayLike) -> LookAngles:
    """Azimuth, elevation and range, each (...), of (..., 3) ECEF positions; NaN where a position is NaN."""
    enu_m = ecef_to_enu_m(place, position_ecef_m)
    east_m, north_m, up_m = enu_m[..., 0], enu_m[..., 1], enu_m[..., 2]
    azimuth_rad = np.arctan2(east_m, north_m) % (2.0 * np.pi)
    # a hair west of north must not become a full turn
    azimuth_rad = np.where(azimuth_rad >= 2.0 * np.pi, 0.0, azimuth_rad)
    return LookAngles(
        azimuth_rad=azimuth_rad,
        elevation_rad=np.arctan2(up_m, np.hypot(east_m, north_m)),
        range_m=np.linalg.norm(enu_m, axis=-1),
    )


def cone_axis_ecef(place: Place, axis: ConeAxis) -> Array:
    """(3,) unit vector n of the visibility cone in ECEF.

    axis: "geocentric" is De Vivo's n = P/‖P‖; "vertical" the normal of the ellipsoid, up to 0.19° from it; three
        numbers are the antenna's pointing direction as east, north, up.
    Raises GnssInputError.
    """
    if axis == "geocentric":
        position_ecef_m = place_ecef_m(place)
        return position_ecef_m / float(np.linalg.norm(position_ecef_m))
    if isinstance(axis, str):
        axis_enu = np.array([0.0, 0.0, 1.0]) if axis == "vertical" else np.zeros(0)
    else:
        axis_enu = np.asarray(axis, np.float64)
    length = float(np.linalg.norm(axis_enu)) if axis_enu.shape == (3,) else 0.0
    if not (math.isfinite(length) and length > 0.0):
        raise GnssInputError(
            f"The cone's axis must be 'geocentric', 'vertical' or a direction (east, north, up), not {axis!r}."
        )
    return axis_enu / length @ R_ecef_to_enu(place)


def off_axis_rad(place: Place, position_ecef_m: npt.ArrayLike, axis: ConeAxis = "geocentric") -> Array:
    """θ of De Vivo's eq. 1, (...): the angle at a place between the cone's axis and (..., 3) ECEF positions."""
    line_ecef_m = np.asarray(position_ecef_m, np.float64) - place_ecef_m(place)
    n = cone_axis_ecef(place, axis)
    # as eq. 1's arccos, but exact along the axis too
    angle: Array = np.arctan2(np.linalg.norm(np.cross(line_ecef_m, n), axis=-1), line_ecef_m @ n)
    return angle
