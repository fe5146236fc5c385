"""GeoJSON read, from files and requests: what its numbers mean, and its geometries as those of a request.

A CRS is named by authority and code alone, for any other text may make PROJ read files of this machine.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pyproj
from pydantic import JsonValue
from pyproj.exceptions import CRSError, ProjError

from service.errors import RequestError
from terrain import FrameError, body_of

__all__ = [
    "COORDINATES_ARE",
    "DEGREES",
    "Fields",
    "GeoJsonFrame",
    "GeoJsonShape",
    "frame_within",
    "line_of",
    "polygons_of",
    "shapes_of",
]

# the fields of a place, or of a polygon, as a request has them
Fields = dict[str, JsonValue]
# kind, lines of positions as they are written, what their numbers mean, the feature
_Geometry = tuple[str, list[list[Any]], "GeoJsonFrame", Mapping[str, JsonValue]]

AUTHORITY, CODE = r"(?P<authority>[A-Za-z][\w.]*)", r"(?P<code>\w+)"
SPELLINGS = tuple(
    re.compile(spelling, re.IGNORECASE)
    for spelling in (
        rf"{AUTHORITY}:{CODE}",
        rf"urn:(?:x-)?ogc:def:crs:{AUTHORITY}:[\w.]*:{CODE}",
        rf"urn:(?:x-)?ogc:def:crs:{AUTHORITY}:{CODE}",
        rf"https?://www\.opengis\.net/def/crs/{AUTHORITY}/[\w.]+/{CODE}",
        rf"https?://www\.opengis\.net/gml/srs/(?P<authority>epsg)\.xml#{CODE}",
        r"(?P<authority>)(?P<code>CRS84)",
    )
)

# the member by which Sightline's own files say so where RFC 7946 does not
COORDINATES_ARE = "coordinates_are"
Pairs = list[tuple[float, float]]
WGS_84 = {("EPSG", "4326"), ("OGC", "CRS84")}
PARTS = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
KINDS = ("Point", "LineString", "Polygon")
DEEPEST = 32  # collections in collections; deeper nobody means it
LARGEST = 1e12  # no CRS of a planet has places so far out


def _crs_of_name(name: str, called: str) -> pyproj.CRS:
    """The CRS of "EPSG:25832", "urn:ogc:def:crs:OGC:1.3:CRS84" and the like. Raises RequestError."""
    for spelling in SPELLINGS:
        found = spelling.fullmatch(name.strip())
        if found is not None:
            try:
                return pyproj.CRS.from_authority((found["authority"] or "OGC").upper(), found["code"].upper())
            except CRSError as error:
                raise RequestError(f"{called} is in the CRS {name[:80]!r}, which is not known.") from error
    raise RequestError(
        f"{called} is in the CRS {name[:80]!r}; a CRS is named by authority and code, such as EPSG:25832 or "
        "urn:ogc:def:crs:OGC:1.3:CRS84."
    )


@dataclass(frozen=True, slots=True)
class GeoJsonFrame:
    """local: metres in the frame of the DEM. body: whose degrees, where the document tells.

    crs: of its positions, None where they are degrees already.
    """

    local: bool = False
    body: str | None = None
    crs: pyproj.CRS | None = None

    def places(self, positions: Sequence[Any], called: str) -> list[Fields]:
        """Positions as the fields of places in a request. Raises RequestError."""
        pairs = [_pair(at, called) for at in positions]
        if self.local:
            return [{"east_m": east_m, "north_m": north_m} for east_m, north_m in pairs]
        if self.crs is not None:
            pairs = _in_degrees(self.crs, pairs, called)
        body: Fields = {} if self.body is None else {"body": self.body}
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


def frame_within(frame: GeoJsonFrame, document: Mapping[str, JsonValue], called: str) -> GeoJsonFrame:
    """The frame of a part of a document: the whole's, unless the part says otherwise. Raises RequestError."""
    told = document.get(COORDINATES_ARE)
    if told is not None:
        if not str(told).startswith(("metres", "longitude")):
            raise RequestError(f"{called} says that its coordinates are {str(told)[:80]!r}, which is not understood.")
        frame = replace(frame, local=str(told).startswith("metres"))
    if isinstance(body := document.get("body"), str):
        frame = replace(frame, body=body)
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
    crs = _crs_of_name(name, called)
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


@dataclass(frozen=True, slots=True)
class GeoJsonShape:
    """One Point, LineString or Polygon; the parts of Multi… and of collections are shapes of their own.

    lines: the point, the line, or the rings, each as the places of a request. feature: what it was a part of.
    """

    kind: str
    lines: tuple[list[Fields], ...]
    feature: Mapping[str, JsonValue]

    @property
    def properties(self) -> Mapping[str, JsonValue]:
        """Of its feature."""
        told = self.feature.get("properties")
        return told if isinstance(told, dict) else {}


def shapes_of(document: Any, called: str, most_places: int | None = None) -> list[GeoJsonShape]:
    """Every geometry of a document, however deep in collections; one of more than most_places is not read on.

    called: what error sentences call the document, such as "The file areas.geojson". Raises RequestError.
    """
    if not isinstance(document, dict):
        raise RequestError(f"{called} is not GeoJSON.")
    found, places = list[GeoJsonShape](), 0
    for kind, lines, frame, feature in _geometries(document, DEGREES, {}, called, 0):
        places += sum(map(len, lines))
        if most_places is not None and places > most_places:
            raise RequestError(f"{called} holds more than {most_places:,} places.")
        found.append(GeoJsonShape(kind, tuple(frame.places(line, called) for line in lines), feature))
    if not found:
        raise RequestError(f"{called} holds no GeoJSON geometries.")
    return found


def polygons_of(document: Any, called: str) -> list[tuple[Fields, Mapping[str, JsonValue]]]:
    """(fields, properties) of every polygon. Raises RequestError where there is none, and for anything else in it."""
    shapes = shapes_of(document, called)
    others = sorted({shape.kind for shape in shapes} - {"Polygon"})
    if others and len({shape.kind for shape in shapes}) == len(others):
        raise RequestError(f"{called} holds no polygons.")
    if others:
        raise RequestError(
            f"{called} holds a {others[0]} beside its polygons, which is no area; close it or take it out."
        )
    return [
        ({"ring": [*shape.lines[0]], "holes": [[*hole] for hole in shape.lines[1:]]}, shape.properties)
        for shape in shapes
    ]


def line_of(document: Any, called: str) -> list[Fields]:
    """The places of the one line in a document; parts that meet, as where a line is cut at 180°, are one.

    Points that are corners of the line, as in Sightline's own paths, tell nothing more. Raises RequestError.
    """
    line: list[Fields] = []
    points: list[Fields] = []
    for shape in shapes_of(document, called):
        if shape.kind == "Point":
            points += shape.lines[0]
        elif shape.kind == "Polygon":
            raise RequestError(f"{called} holds no LineString only: a path has no Polygon.")
        elif line and _rounded(line[-1]) != _rounded(shape.lines[0][0]):
            raise RequestError(f"{called} holds several lines that do not meet; a path is one LineString.")
        else:
            line += shape.lines[0][1:] if line else shape.lines[0]
    if not line:
        raise RequestError(f"{called} holds no LineString.")
    corners = {_rounded(place) for place in line}
    if any(_rounded(point) not in corners for point in points):
        raise RequestError(f"{called} holds points beside its line; a path is one LineString.")
    return line


def _geometries(
    part: Any, frame: GeoJsonFrame, feature: Mapping[str, JsonValue], called: str, depth: int
) -> Iterator[_Geometry]:
    if not isinstance(part, dict):
        raise RequestError(f"{called} holds a part that is no GeoJSON object.")
    if depth == 0 and "type" not in part and "geometry" not in part:
        raise RequestError(f"{called} holds no GeoJSON geometries.")
    if depth > DEEPEST:
        raise RequestError(f"{called} holds collections in collections, deeper than {DEEPEST}.")
    kind, frame = str(part.get("type")), frame_within(frame, part, called)
    if kind == "Feature" or "geometry" in part:
        if part.get("geometry") is None:
            raise RequestError(f"{called} holds a feature without a geometry.")
        yield from _geometries(part["geometry"], frame, part, called, depth + 1)
    elif kind in ("FeatureCollection", "GeometryCollection"):
        for one in _list_of(part, "features" if kind == "FeatureCollection" else "geometries", called):
            yield from _geometries(one, frame, feature, called, depth + 1)
    elif kind in PARTS:
        for one in _list_of(part, "coordinates", called):
            yield PARTS[kind], _lines(PARTS[kind], one, called), frame, feature
    elif kind in KINDS:
        yield kind, _lines(kind, _list_of(part, "coordinates", called), called), frame, feature
    else:
        raise RequestError(f"{called} holds a part of the type {kind[:40]!r}, which GeoJSON does not know.")


def _lines(kind: str, coordinates: Any, called: str) -> list[list[Any]]:
    lines = {"Point": [[coordinates]], "LineString": [coordinates]}.get(kind, coordinates)
    if not isinstance(lines, list) or not lines:
        raise RequestError(f"{called} holds a polygon without a ring.")
    if not all(isinstance(line, list) and line for line in lines):
        raise RequestError(f"{called} holds a {kind} without places.")
    return lines


def _list_of(part: Mapping[str, JsonValue], member: str, called: str) -> list[Any]:
    listed = part.get(member)
    if not isinstance(listed, list):
        raise RequestError(f"{called} holds a {str(part.get('type'))[:40]} without a list {member!r}.")
    return listed


def _pair(at: Any, called: str) -> tuple[float, float]:
    numbers = at[:2] if isinstance(at, list) else []
    if len(numbers) == 1:
        raise RequestError(f"{called} holds a place that has not two coordinates.")
    if len(numbers) < 2 or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        raise RequestError(f"{called} holds a geometry whose coordinates are no numbers.")
    x, y = numbers
    if not (abs(x) <= LARGEST and abs(y) <= LARGEST):
        raise RequestError(f"{called} holds a geometry whose coordinates are no finite numbers.")
    return float(x), float(y)


def _rounded(place: Fields) -> tuple[float, float]:
    """Equal for the same place, also where one is written as 180° and one as −180°."""
    match place:
        case {"east_m": float(east_m), "north_m": float(north_m)}:
            return round(east_m, 6), round(north_m, 6)
        case {"lon_deg": float(lon_deg), "lat_deg": float(lat_deg)}:
            return round(lon_deg % 360.0, 7), round(lat_deg, 7)
    raise AssertionError("a place has one of the pairs")
