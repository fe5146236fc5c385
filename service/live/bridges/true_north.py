"""From the anchors' frame to what autopilots mean: metres true north, east, down of an origin, and degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt
import pyproj

from detection import RangingAnchor
from gnss import Place, ecef_to_enu_m, enu_to_ecef_m, place_ecef_m
from terrain import ElevationGrid, egm96_height_m, grid_north, to_grid_frame, to_lon_lat, true_offsets

__all__ = ["GridFrame", "LocalFrame", "NedOrigin", "TrueFrame", "Unplaced", "origin_of"]

Array = npt.NDArray[np.float64]


class TrueFrame(Protocol):
    """The anchors' frame on Earth."""

    def degrees(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float]:
        """(longitude, latitude), WGS 84."""
        ...

    def place(self, lon_deg: float, lat_deg: float, altitude_m: float) -> tuple[float, float, float]:
        """East, north, up in the anchors' frame."""
        ...

    def offsets(self, origin_m: tuple[float, float, float], place_m: Sequence[float]) -> tuple[float, float, float]:
        """Metres true north, east, down from an origin to a place, both in the anchors' frame."""
        ...

    def turn_rad(self) -> float:
        """Azimuth of the frame's north, radians clockwise from true north."""
        ...


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """East, north, up of a place, as anchors in degrees are put into; ups are altitudes there."""

    middle: Place

    def degrees(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float]:
        """(longitude, latitude), WGS 84."""
        at_ecef_m = enu_to_ecef_m(self.middle, (east_m, north_m, up_m - self.middle.height_m))
        lon_deg, lat_deg = _geodetic().transform(*at_ecef_m)[:2]
        return float(lon_deg), float(lat_deg)

    def place(self, lon_deg: float, lat_deg: float, altitude_m: float) -> tuple[float, float, float]:
        """East, north, up in the anchors' frame."""
        east_m, north_m, up_m = ecef_to_enu_m(self.middle, place_ecef_m(Place(lon_deg, lat_deg, altitude_m)))
        return float(east_m), float(north_m), float(up_m) + self.middle.height_m

    def offsets(self, origin_m: tuple[float, float, float], place_m: Sequence[float]) -> tuple[float, float, float]:
        """Metres true north, east, down."""
        east_m, north_m, up_m = (float(to) - by for to, by in zip(place_m, origin_m, strict=True))
        return north_m, east_m, -up_m

    def turn_rad(self) -> float:
        """The frame's north is true north."""
        return 0.0


@dataclass(frozen=True)
class GridFrame:
    """A metric CRS: its north is turned by the meridian convergence, its metres by its scale."""

    grid: ElevationGrid

    def degrees(self, east_m: float, north_m: float, up_m: float) -> tuple[float, float]:
        """(longitude, latitude), WGS 84."""
        return to_lon_lat(self.grid, east_m, north_m)

    def place(self, lon_deg: float, lat_deg: float, altitude_m: float) -> tuple[float, float, float]:
        """East, north, up in the anchors' frame."""
        east_m, north_m = to_grid_frame(self.grid, lon_deg, lat_deg)
        return east_m, north_m, altitude_m

    def offsets(self, origin_m: tuple[float, float, float], place_m: Sequence[float]) -> tuple[float, float, float]:
        """Metres true north, east, down."""
        east_m, north_m = true_offsets(self.grid, origin_m[:2], place_m[0], place_m[1])
        return float(north_m[0]), float(east_m[0]), origin_m[2] - float(place_m[2])

    def turn_rad(self) -> float:
        """The meridian convergence in the grid's middle."""
        return self._turn_rad

    @cached_property
    def _turn_rad(self) -> float:
        west_m, south_m, east_m, north_m = self.grid.bounds_m
        return grid_north(self.grid, 0.5 * (west_m + east_m), 0.5 * (south_m + north_m))


@dataclass(frozen=True, slots=True)
class Unplaced:
    """Metres of nobody knows where: north is taken as true, and there are no degrees."""

    def offsets(self, origin_m: tuple[float, float, float], place_m: Sequence[float]) -> tuple[float, float, float]:
        """Metres north, east, down."""
        east_m, north_m, up_m = (float(to) - by for to, by in zip(place_m, origin_m, strict=True))
        return north_m, east_m, -up_m

    def turn_rad(self) -> float:
        """Nothing is known."""
        return 0.0


@dataclass(frozen=True, slots=True)
class NedOrigin:
    """From where an autopilot counts north, east, down. at_m: in the anchors' frame; lon_deg, lat_deg: None, unplaced.

    Degrees are such as 32 bits hold exactly, since ArduPilot keeps BCN_LATITUDE in so many: half a metre otherwise.
    sea_level_m: what to add to an altitude of the anchors for one above mean sea level.
    """

    frame: TrueFrame | Unplaced
    at_m: tuple[float, float, float]
    lon_deg: float | None
    lat_deg: float | None
    sea_level_m: float

    def ned_m(self, place_m: Sequence[float]) -> tuple[float, float, float]:
        """North, east, down of a place; one of two dimensions is at the origin's height."""
        return self.frame.offsets(self.at_m, [*place_m, *self.at_m[len(place_m) :]])

    def ned_covariance_m2(self, covariance_m2: Array) -> Array:
        """The covariance of north, east, down from that of east, north, up; what has no height has a wide one."""
        whole = np.diag([0.0, 0.0, 1e4])
        size = len(covariance_m2)
        whole[:size, :size] = covariance_m2
        sine, cosine = np.sin(self.frame.turn_rad()), np.cos(self.frame.turn_rad())
        turn = np.array([[-sine, cosine, 0.0], [cosine, sine, 0.0], [0.0, 0.0, -1.0]])
        return np.asarray(turn @ whole @ turn.T, np.float64)

    def degrees(self, place_m: Sequence[float]) -> tuple[float, float, float] | None:
        """(longitude, latitude, altitude above mean sea level) of a place; None where the frame is nowhere."""
        if isinstance(self.frame, Unplaced):
            return None
        east_m, north_m, up_m = (*place_m, *self.at_m[len(place_m) :])
        return (*self.frame.degrees(east_m, north_m, up_m), up_m + self.sea_level_m)


def origin_of(frame: TrueFrame | Unplaced, anchors: Sequence[RangingAnchor], ellipsoid: bool) -> NedOrigin:
    """An origin amid the anchors, at the lowest of them. ellipsoid: their altitudes are above it, not above the sea."""
    east_m, north_m = (float(np.mean([getattr(one, name) for one in anchors])) for name in ("east_m", "north_m"))
    up_m = min(one.altitude_m for one in anchors)
    if isinstance(frame, Unplaced):
        return NedOrigin(frame, (east_m, north_m, up_m), None, None, 0.0)
    lon_deg, lat_deg = (float(np.float32(degrees)) for degrees in frame.degrees(east_m, north_m, up_m))
    at_m = frame.place(lon_deg, lat_deg, up_m)
    geoid_m = float(egm96_height_m(np.array([lon_deg]), np.array([lat_deg]))[0]) if ellipsoid else 0.0
    return NedOrigin(frame, (at_m[0], at_m[1], up_m), lon_deg, lat_deg, -geoid_m)


def _geodetic() -> pyproj.Transformer:
    return pyproj.Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
