"""The body that is driven on, and the frame that is navigated in: rotation and gravity are its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import StateError
from ..inputs import numbers
from .kernels import strapdown as kernel

__all__ = ["EARTH", "MARS", "MOON", "Body", "TangentFrame"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """A turning ellipsoid and its normal gravity at equator and pole, centrifugal acceleration included.

    Raises StateError.
    """

    name: str
    semi_major_axis_m: float
    flattening: float
    rate_rad_per_s: float
    gravity_equator_m_per_s2: float
    gravity_pole_m_per_s2: float

    def __post_init__(self) -> None:
        if not (self.semi_major_axis_m > 0.0 and 0.0 <= self.flattening < 1.0 and math.isfinite(self.rate_rad_per_s)):
            raise StateError(f"{self.name or 'The body'} has no ellipsoid: axis above 0, flattening from 0 to below 1.")
        if not (self.gravity_equator_m_per_s2 > 0.0 and self.gravity_pole_m_per_s2 > 0.0):
            raise StateError(f"{self.name or 'The body'} has no gravity.")


# WGS 84 (NGA.STND.0036), the defining and derived constants
EARTH = Body("Earth", 6_378_137.0, 1.0 / 298.257223563, 7.292115e-5, 9.7803253359, 9.8321849378)
# IAU 2015 radius and rotation, GM of GRGM1200A
MOON = Body("Moon", 1_737_400.0, 0.0, 2.6616995e-6, 1.62422, 1.62422)
# IAU 2015 ellipsoid and rotation; GM and J2 of MRO120D on it, less the centrifugal part
MARS = Body("Mars", 3_396_190.0, 1.0 / 169.894447, 7.088218e-5, 3.70706, 3.73493)


@dataclass(frozen=True)
class TangentFrame:
    """East, north, up at an origin that stands still on a body; angles in radians, metres above the ellipsoid.

    It turns with the body and does not follow the vehicle, so that anchors keep their places in it. A map's grid of the
    same origin differs from it by its convergence, its scale and the curvature of the ground. Raises StateError.
    """

    latitude_rad: float
    longitude_rad: float = 0.0
    altitude_m: float = 0.0
    body: Body = EARTH

    def __post_init__(self) -> None:
        if not abs(self.latitude_rad) <= math.pi / 2.0 or not math.isfinite(self.longitude_rad + self.altitude_m):
            raise StateError("The frame's origin must be finite, and its latitude within ±90°.")

    def from_geodetic_m(
        self, latitude_rad: npt.ArrayLike, longitude_rad: npt.ArrayLike, altitude_m: npt.ArrayLike
    ) -> Array:
        """(..., 3) east, north, up of places on the body, altitude above the ellipsoid. Raises StateError."""
        centred = _centred_m(self.body, latitude_rad, np.asarray(longitude_rad) - self.longitude_rad, altitude_m)
        return (centred - self._origin_m()) @ self._axes()

    def from_centred_m(self, centred_m: npt.ArrayLike) -> Array:
        """(..., 3) east, north, up of places (..., 3) in the body's own axes: x to longitude 0, z to the north pole."""
        x, y, z = np.moveaxis(np.asarray(centred_m, np.float64), -1, 0)
        cosine, sine = math.cos(self.longitude_rad), math.sin(self.longitude_rad)
        turned = np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=-1)
        return (turned - self._origin_m()) @ self._axes()

    def to_geodetic(self, position_m: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """(latitudes rad, longitudes rad, altitudes m) of places (..., 3) in the frame."""
        centred = np.asarray(position_m, np.float64) @ self._axes().T + self._origin_m()
        body = self.body
        e2 = body.flattening * (2.0 - body.flattening)
        across, along = np.hypot(centred[..., 0], centred[..., 1]), centred[..., 2]
        latitude = np.arctan2(along, across * (1.0 - e2))
        # the foot of the vertical moves by e2 of the altitude's share: each round is good to 1/150 of the one before
        for _ in range(6):
            normal = body.semi_major_axis_m / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
            latitude = np.arctan2(along + e2 * normal * np.sin(latitude), across)
        sine, cosine = np.sin(latitude), np.cos(latitude)
        altitude = across * cosine + along * sine - body.semi_major_axis_m * np.sqrt(1.0 - e2 * sine**2)
        return latitude, np.arctan2(centred[..., 1], centred[..., 0]) + self.longitude_rad, altitude

    def planet(self) -> kernel.Planet:
        """What the kernels need of it."""
        body, axes = self.body, self._axes()
        axis = np.ascontiguousarray(axes[2])
        b = body.semi_major_axis_m * (1.0 - body.flattening)
        ratio = (
            body.rate_rad_per_s**2
            * body.semi_major_axis_m
            * b
            / (body.gravity_equator_m_per_s2 * body.semi_major_axis_m)
        )
        return kernel.Planet(
            body.semi_major_axis_m,
            body.flattening,
            body.gravity_equator_m_per_s2,
            body.gravity_pole_m_per_s2,
            ratio,
            body.rate_rad_per_s * axis,
            np.ascontiguousarray(-self._origin_m() @ axes),
            axis,
        )

    def gravity_m_per_s2(self, position_m: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """(3,) normal gravity at a place in the frame. Raises StateError."""
        out = np.zeros(3)
        kernel.gravity(self.planet(), numbers("position_m", position_m, (3,), StateError), out)
        return out

    def _origin_m(self) -> Array:
        return _centred_m(self.body, self.latitude_rad, 0.0, self.altitude_m)

    def _axes(self) -> Array:
        """(3, 3) columns east, north, up in the body's axes, the origin's meridian first."""
        sine, cosine = math.sin(self.latitude_rad), math.cos(self.latitude_rad)
        return np.array([(0.0, -sine, cosine), (1.0, 0.0, 0.0), (0.0, cosine, sine)])


def _centred_m(
    body: Body, latitude_rad: npt.ArrayLike, longitude_rad: npt.ArrayLike, altitude_m: npt.ArrayLike
) -> Array:
    latitude, longitude = np.asarray(latitude_rad, np.float64), np.asarray(longitude_rad, np.float64)
    altitude = np.asarray(altitude_m, np.float64)
    e2 = body.flattening * (2.0 - body.flattening)
    normal = body.semi_major_axis_m / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
    across = (normal + altitude) * np.cos(latitude)
    along = (normal * (1.0 - e2) + altitude) * np.sin(latitude)
    centred: Array = np.stack(
        np.broadcast_arrays(across * np.cos(longitude), across * np.sin(longitude), along), axis=-1
    )
    return centred
