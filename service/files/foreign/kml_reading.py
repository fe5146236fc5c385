"""KML 2.2 and Google's extensions read: placemarks as GeoJSON, their heights as KML means them.

absolute counts from the EGM96 geoid, relativeToGround from the ground, clampToGround (the default) lies on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from lxml import etree

from service.errors import RequestError
from service.files.written import written_number

from .features import Allowance, Feature, Foreign, counted, parsed_xml, place_of

__all__ = ["read_kml"]

# what KML has besides placemarks; folders and documents hold them
PASSED_OVER = frozenset({"NetworkLink", "GroundOverlay", "PhotoOverlay", "ScreenOverlay", "Tour", "NetworkLinkControl"})
HEIGHTS = frozenset({"above_ground_m", "altitude_m", "altitude_datum", "east_m", "north_m", "lon_deg", "lat_deg"})
TEXTS = frozenset({"id", "what", "kind", "name", "radio", "height_from"})
SEA_FLOOR = {"clampToSeaFloor": "clampToGround", "relativeToSeaFloor": "relativeToGround"}
Place = tuple[float, ...]


def read_kml(data: bytes, allowance: Allowance) -> Foreign:
    """Every placemark of a document. Raises RequestError."""
    called = allowance.called
    root = parsed_xml(data, called, ("kml", "Document", "Folder", "Placemark"))
    allowance.refuse(sum(1 for _ in root.iter("{*}Placemark")))
    skipped = [_name(one) for one in root.iter(*(f"{{*}}{name}" for name in PASSED_OVER))]
    told: list[str] = counted(skipped, "not read; only placemarks are.")
    features: list[Feature] = []
    strange: list[str] = []
    clamped: list[str] = []
    for number, mark in enumerate(root.iter("{*}Placemark"), 1):
        title = _text(mark, "name") or f"P{number}"
        reading = _Reading(title, _told_of(mark), f"{called}, placemark {title!r}", allowance, strange, clamped)
        found = list(_geometries(mark, reading))
        if not found:
            strange.append("Placemark without a geometry")
        features += found
    told += counted(strange, "not understood.")
    if clamped:
        shown = ", ".join(clamped[:5]) + (f" and {len(clamped) - 5} more" if len(clamped) > 5 else "")
        told.append(f"On the ground, for that is where the file has them (clampToGround): {shown}.")
    return Foreign("KML", tuple(features), tuple(told))


@dataclass(frozen=True, slots=True)
class _Reading:
    """What is the same for all geometries of a placemark; strange and clamped grow."""

    title: str
    properties: dict[str, object]
    called: str
    allowance: Allowance
    strange: list[str]
    clamped: list[str]

    def places(self, geometry: etree._Element) -> list[Place]:
        # blanks after a comma are not KML, and are common
        text = ",".join((_text(geometry, "coordinates") or "").replace(", ", ",").split(" ,"))
        told = text.split()
        if not told:
            raise RequestError(f"{self.called} has a {_name(geometry)} without coordinates.")
        self.allowance.take(len(told))
        return [_numbers(one.replace(",", " "), self.called) for one in told]

    def line(self, geometry: etree._Element) -> list[list[float]]:
        return [list(place[:2]) for place in self.places(geometry)]

    def track(self, geometry: etree._Element) -> list[list[float]]:
        told = [one.text or "" for one in geometry if _name(one) == "coord"]
        self.allowance.take(len(told))
        return [list(_numbers(one, self.called)[:2]) for one in told]


def _geometries(element: etree._Element, reading: _Reading) -> Iterator[Feature]:
    title, properties = reading.title, reading.properties
    for child in element:
        name = _name(child)
        if name in ("MultiGeometry", "MultiTrack"):
            yield from _geometries(child, reading)
        elif name == "Point":
            (place, *_) = reading.places(child)
            heights = _height(child, place)
            if heights == {"above_ground_m": 0.0}:
                reading.clamped.append(title)
            yield place_of("Point", list(place[:2]), title, {**properties, **heights})
        elif name in ("LineString", "LinearRing"):
            yield place_of("LineString", reading.line(child), title, properties)
        elif name == "Track":
            yield place_of("LineString", reading.track(child), title, properties)
        elif name == "Polygon":
            rings = [
                reading.line(one)
                for side in ("outerBoundaryIs", "innerBoundaryIs")
                for boundary in child
                if _name(boundary) == side
                for one in boundary
                if _name(one) == "LinearRing"
            ]
            yield place_of("Polygon", rings, title, properties)
        elif name == "Model":
            reading.strange.append("Model")


def _height(point: etree._Element, place: Place) -> dict[str, object]:
    """Fields of a request; a point without a third number lies on the ground."""
    told = _text(point, "altitudeMode") or "clampToGround"
    mode = SEA_FLOOR.get(told, told)
    if mode == "clampToGround" or len(place) < 3:
        return {"above_ground_m": 0.0}
    if mode == "relativeToGround":
        return {"above_ground_m": place[2]}
    return {"altitude_m": place[2], "altitude_datum": "EGM96"}


def _told_of(mark: etree._Element) -> dict[str, object]:
    """Its extended data: numbers as numbers. Where it is and how high its geometry says."""
    found: dict[str, object] = {}
    for one in mark.iter():
        name = one.get("name")
        if name is None or name in HEIGHTS:
            continue
        kind = _name(one)
        text = _text(one, "value") if kind == "Data" else one.text if kind == "SimpleData" else None
        if text and text.strip():
            found[name] = _number_or_text(name, text.strip())
    return found


def _number_or_text(name: str, text: str) -> object:
    try:
        return text if name in TEXTS else written_number(text)
    except ValueError:
        return text


def _numbers(text: str, called: str) -> Place:
    try:
        numbers = tuple(written_number(one) for one in text.split())
    except ValueError as error:
        raise RequestError(f"{called} has coordinates that are no numbers: {text[:60]!r}.") from error
    if len(numbers) < 2:
        raise RequestError(f"{called} has a place that has not two coordinates: {text[:60]!r}.")
    return numbers


def _text(element: etree._Element, name: str) -> str | None:
    found = next((one for one in element if _name(one) == name), None)
    return None if found is None or found.text is None else found.text.strip()


def _name(element: etree._Element) -> str:
    return etree.QName(element).localname if isinstance(element.tag, str) else ""
