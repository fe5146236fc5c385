"""GeoJSON geometries as the places, lines and polygons of a request."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .errors import RequestError

__all__ = ["COORDINATES_ARE", "GeoJsonShape", "lines_of", "places_of", "polygons_of", "shapes_of"]

Field = dict[str, float]
GeoJsonShape = tuple[str, Any, bool, dict[str, Any]]

# the member by which Sightline's own files of a DEM without CRS say so
COORDINATES_ARE = "coordinates_are"
# how files older than RFC 7946 may say what it says now: longitude and latitude
WGS_84 = ("CRS84", "EPSG:4326", "EPSG::4326")


def shapes_of(document: Any, called: str) -> list[GeoJsonShape]:
    """(type, coordinates, whether they are local metres, properties) of every geometry. Raises RequestError.

    called: what error sentences call the document, such as "The file areas.geojson".
    """
    if not isinstance(document, dict):
        raise RequestError(f"{called} is not GeoJSON.")
    _check_crs(document, called)
    features = document.get("features") if document.get("type") == "FeatureCollection" else [document]
    found = []
    for feature in features if isinstance(features, list) else []:
        geometry = feature.get("geometry", feature) if isinstance(feature, dict) else None
        if isinstance(geometry, dict) and isinstance(geometry.get("coordinates"), list):
            properties = feature.get("properties")
            told = properties if isinstance(properties, dict) else {}
            found.append((str(geometry.get("type")), geometry["coordinates"], COORDINATES_ARE in document, told))
    if not found:
        raise RequestError(f"{called} holds no GeoJSON geometries.")
    return found


def polygons_of(document: Any, called: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """(fields, properties) of every polygon. Raises RequestError where there is none."""
    found = []
    for kind, rings, local, properties in shapes_of(document, called):
        for polygon in [rings] if kind == "Polygon" else rings if kind == "MultiPolygon" else []:
            if not (isinstance(polygon, list) and polygon):
                raise RequestError(f"{called} holds a polygon without a ring.")
            ring, *holes = [places_of(one, local, called) for one in polygon]
            found.append(({"ring": ring, "holes": holes}, properties))
    if not found:
        raise RequestError(f"{called} holds no polygons.")
    return found


def lines_of(document: Any, called: str) -> Iterator[list[Field]]:
    """The places of each line. Raises RequestError."""
    for kind, line, local, _ in shapes_of(document, called):
        if kind == "LineString":
            yield places_of(line, local, called)


def places_of(line: Any, local: bool, called: str) -> list[Field]:
    """The fields of the places of a line, in metres if they are local and else in degrees. Raises RequestError."""
    try:
        pairs = [(float(point[0]), float(point[1])) for point in line]
    except (TypeError, ValueError, IndexError, KeyError, OverflowError) as error:
        raise RequestError(f"{called} holds a geometry whose coordinates are no numbers.") from error
    if local:
        return [{"east_m": east_m, "north_m": north_m} for east_m, north_m in pairs]
    for lon_deg, lat_deg in pairs:
        if not (-180.0 <= lon_deg <= 360.0 and -90.0 <= lat_deg <= 90.0):
            raise RequestError(
                f"{called} has coordinates ({lon_deg:g}, {lat_deg:g}), which are no longitude and latitude; GeoJSON is "
                "in degrees (RFC 7946), so transform it, or give metres as east_m and north_m."
            )
    return [{"lon_deg": lon_deg, "lat_deg": lat_deg} for lon_deg, lat_deg in pairs]


def _check_crs(document: dict[str, Any], called: str) -> None:
    crs = document.get("crs")
    if not isinstance(crs, dict):
        return
    properties = crs.get("properties")
    name = str(properties.get("name", "")) if isinstance(properties, dict) else ""
    if not name.endswith(WGS_84):
        raise RequestError(
            f"{called} is in the CRS {name[:80]!r}; GeoJSON is in longitude and latitude (RFC 7946): transform it."
        )
