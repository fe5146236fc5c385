"""GPX read: way-points as points, routes and tracks as lines; elevations count from mean sea level."""

from __future__ import annotations

import math

import gpxpy
import gpxpy.gpx
from lxml import etree

from service.errors import RequestError
from service.files.written import written_number

from .features import Allowance, Feature, Foreign, parsed_xml, place_of

__all__ = ["read_gpx"]

PLACES = ("{*}wpt", "{*}rtept", "{*}trkpt")
LINES = ("{*}rte", "{*}trk", "{*}trkseg")


def read_gpx(data: bytes, allowance: Allowance) -> Foreign:
    """Everything in a document. Raises RequestError."""
    called = allowance.called
    root = parsed_xml(data, called, ("gpx",))
    for names in (PLACES, LINES):
        allowance.refuse(sum(1 for _ in root.iter(*names)))
    _refuse_other_numbers(root, called)
    try:
        gpx = gpxpy.parse(data.decode("utf-8-sig"))
    except (gpxpy.gpx.GPXException, UnicodeDecodeError, ValueError) as error:
        raise RequestError(f"{called} is no GPX that can be read: {str(error)[:200]}.") from error
    features: list[Feature] = []
    without: list[str] = []
    for number, point in enumerate(gpx.waypoints, 1):
        title = point.name or f"W{number}"
        height: dict[str, object] = {}
        if point.elevation is None:
            without.append(title)
        else:
            height = {"altitude_m": point.elevation, "altitude_datum": "msl"}
        features.append(place_of("Point", [point.longitude, point.latitude], title, {"what": "way-point", **height}))
    for number, route in enumerate(gpx.routes, 1):
        line = [[point.longitude, point.latitude] for point in route.points]
        features.append(place_of("LineString", line, route.name or f"Route {number}", {"what": "route"}))
    for number, track in enumerate(gpx.tracks, 1):
        for segment in track.segments:
            line = [[point.longitude, point.latitude] for point in segment.points]
            features.append(place_of("LineString", line, track.name or f"Track {number}", {"what": "track"}))
    told = [f"Without an elevation in the file: {', '.join(without[:5])}."] if without else []
    empty = [one for one in features if one["geometry"] == {"type": "LineString", "coordinates": []}]
    if empty:
        told.append(f"{len(empty)} routes or tracks without points were left out.")
    return Foreign("GPX", tuple(one for one in features if one not in empty), tuple(told))


def _refuse_other_numbers(root: etree._Element, called: str) -> None:
    """What gpxpy would take for numbers of places, as Python does. Raises RequestError."""
    for place in root.iter(*PLACES):
        for text in (place.get("lat"), place.get("lon"), place.findtext("{*}ele")):
            try:
                number = written_number(text or "0")
            except ValueError:
                number = math.nan
            if not math.isfinite(number):
                raise RequestError(f"{called} has a place whose numbers are none: {str(text)[:60]!r}.")
