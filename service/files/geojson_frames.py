"""What the numbers of a GeoJSON document are: degrees on a body, metres of a DEM, or places in a CRS that it names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pyproj
from pyproj.exceptions import ProjError

from service.errors import RequestError
from service.files.geojson_frames import crs_of_name
from terrain import FrameError, body_of

__all__ = ["COORDINATES_ARE", "DEGREES", "GeoJsonFrame", "Pairs", "frame_within"]

# the member by which Sightline's own files say so where RFC 7946 does not
COORDINATES_ARE = "coordinates_are"
Pairs = list[tuple[float, float]]
WGS_84 = {("EPSG", "4326"), ("OGC", "CRS84")}


@dataclass(frozen=True, slots=True)
class GeoJsonFrame:
    """local: metres in the frame of the DEM. body: whose degrees, where the document tells.

    crs: of its positions, None where they are degrees already.
    """

    local: bool = False
    body: str | None = None
    crs: pyproj.CRS | None = None

    def places(self, pairs: Pairs, called: str) -> list[dict[str, Any]]:
        """Pairs of numbers as the fields of places in a request. Raises RequestError."""
        if self.local:
            return [{"east_m": east_m, "north_m": north_m} for east_m, north_m in pairs]
        if self.crs is not None:
            pairs = _in_degrees(self.crs, pairs, called)
        body = {} if self.body is None else {"body": self.body}
        for lon_deg, lat_deg in pairs:
            if not (-180.0 <= lon_deg <= 360.0 and -90.0 <= lat_deg <= 90.0):
                raise RequestError(
                    f"{called} has coordinates ({lon_deg:g}, {lat_deg:g}), which are no longitude and latitude; "
                    "GeoJSON is in degrees (RFC 7946), so transform it, name its CRS in a member crs, or give metres "
                    "as east_m and north_m."
                )
        return [{"lon_deg": lon_deg, "lat_deg": lat_deg, **body} for lon_deg, lat_deg in pairs]


# what RFC 7946 says of a document that says nothing: WGS 84, or the degrees of the DEM's own body
DEGREES = GeoJsonFrame()


def frame_within(frame: GeoJsonFrame, document: dict[str, Any], called: str) -> GeoJsonFrame:
    """The frame of a part of a document: the whole's, unless the part says otherwise. Raises RequestError."""
    told = document.get(COORDINATES_ARE)
    if told is not None:
        if not str(told).startswith(("metres", "longitude")):
            raise RequestError(f"{called} says that its coordinates are {str(told)[:80]!r}, which is not understood.")
        frame = replace(frame, local=str(told).startswith("metres"))
    if isinstance(document.get("body"), str):
        frame = replace(frame, body=document["body"])
    if document.get("crs") is not None:
        frame = _with_crs(frame, document["crs"], called)
    return frame


def _with_crs(frame: GeoJsonFrame, member: Any, called: str) -> GeoJsonFrame:
    properties = member.get("properties") if isinstance(member, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    if not isinstance(name, str):
        raise RequestError(f"{called} has a member crs that names no CRS.")
    if member.get("type") != "name":
        raise RequestError(
            f"{called} is in the CRS {name[:80]!r}, says a member crs that is not of the type 'name' (GeoJSON 2008)."
        )
    crs = crs_of_name(name, called)
    if frame.local or not (crs.is_geographic or crs.is_projected):
        why = "says that its coordinates are metres of the DEM as well" if frame.local else "is no CRS of a map"
        raise RequestError(f"{called} is in the CRS {name[:80]!r}, which {why}.")
    try:
        body = body_of(crs).name
    except FrameError as error:
        raise RequestError(f"{called}: {error}") from error
    if frame.body not in (None, body):
        raise RequestError(f"{called} is in the CRS {name[:80]!r}, which lies on {body}, not on {frame.body}.")
    return GeoJsonFrame(body=body, crs=None if crs.to_authority() in WGS_84 else crs)


@lru_cache(maxsize=16)
def _to_degrees(crs: pyproj.CRS) -> pyproj.Transformer:
    geodetic = pyproj.CRS.from_epsg(4326) if body_of(crs).name == "Earth" else crs.geodetic_crs
    return pyproj.Transformer.from_crs(crs, geodetic, always_xy=True, allow_ballpark=False)


def _in_degrees(crs: pyproj.CRS, pairs: Sequence[tuple[float, float]], called: str) -> Pairs:
    try:
        x, y = np.array(pairs, np.float64).reshape(-1, 2).T
        lon, lat = _to_degrees(crs).transform(x, y)
    except ProjError as error:
        raise RequestError(f"{called}: PROJ knows no exact way from its CRS {crs.name} to WGS 84.") from error
    if not (np.isfinite(lon).all() and np.isfinite(lat).all()):
        raise RequestError(f"{called} has places that its CRS {crs.name} cannot express.")
    return list(zip(lon.tolist(), lat.tolist(), strict=True))
