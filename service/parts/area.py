"""Areas as requests write them: a box, a circle round a place, a polygon, in degrees or in metres."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag

from service.errors import RequestError
from service.parts.areas import GeoJson, polygon_or_place
from service.parts.points import DegreesEast, DegreesNorth, Metres, Positive, StrictModel
from service.parts.shapes import PlaceIn, PolygonIn
from terrain import DEGREES, GRID_METRES, Area, Box, Circle, Outline

__all__ = ["AreaChoice", "BoxDegreesIn", "BoxMetresIn", "CircleIn", "area_of"]


class BoxDegreesIn(StrictModel):
    """All between two meridians and two parallels; with west > east over the antimeridian."""

    west_deg: DegreesEast = Field(description="Western side, longitude, degrees.")
    south_deg: DegreesNorth = Field(description="Southern side, latitude, degrees.")
    east_deg: DegreesEast = Field(description="Eastern side, longitude, degrees.")
    north_deg: DegreesNorth = Field(description="Northern side, latitude, degrees.")


class BoxMetresIn(StrictModel):
    """All between two eastings and two northings."""

    west_m: Metres = Field(description="Western side, east coordinate, metres.")
    south_m: Metres = Field(description="Southern side, north coordinate, metres.")
    east_m: Metres = Field(description="Eastern side, east coordinate, metres.")
    north_m: Metres = Field(description="Northern side, north coordinate, metres.")


class CircleIn(PlaceIn):
    """All within a distance of a place."""

    radius_m: Positive = Field(description="Distance over ground, metres.")


def _kind(value: Any) -> str:
    if isinstance(value, AnyArea):
        return type(value).__name__
    fields = value if isinstance(value, dict) else {}
    if "ring" in fields:
        return "PolygonIn"
    if "radius_m" in fields:
        return "CircleIn"
    return "BoxMetresIn" if "west_m" in fields else "BoxDegreesIn"


AnyArea = BoxDegreesIn | BoxMetresIn | CircleIn | PolygonIn
AreaChoice = Annotated[
    Annotated[BoxDegreesIn, Tag("BoxDegreesIn")]
    | Annotated[BoxMetresIn, Tag("BoxMetresIn")]
    | Annotated[CircleIn, Tag("CircleIn")]
    | Annotated[PolygonIn, Tag("PolygonIn")],
    Discriminator(_kind),
    BeforeValidator(polygon_or_place, json_schema_input_type=AnyArea | GeoJson),
]


def area_of(asked: AnyArea, metres: str = GRID_METRES) -> Area:
    """The area that a request means. metres: which frame its metres are in. Raises AreaError, RequestError."""
    if isinstance(asked, BoxDegreesIn):
        return Box(asked.west_deg, asked.south_deg, asked.east_deg, asked.north_deg, DEGREES)
    if isinstance(asked, BoxMetresIn):
        return Box(asked.west_m, asked.south_m, asked.east_m, asked.north_m, metres)
    if isinstance(asked, CircleIn):
        (x, y), frame = _pair(asked, metres)
        return Circle(x, y, asked.radius_m, frame)
    rings = [tuple(_pair(place, metres) for place in ring) for ring in (asked.ring, *asked.holes)]
    frames = {frame for ring in rings for _, frame in ring}
    if len(frames) > 1:
        raise RequestError("The corners of an area must all be in degrees or all in metres.")
    outer, *holes = (tuple(pair for pair, _ in ring) for ring in rings)
    return Outline(outer, tuple(holes), frames.pop())


def _pair(place: PlaceIn, metres: str) -> tuple[tuple[float, float], str]:
    if place.lon_deg is not None and place.lat_deg is not None:
        return (place.lon_deg, place.lat_deg), DEGREES
    assert place.east_m is not None, "the validator has seen to it"
    assert place.north_m is not None, "the validator has seen to it"
    return (place.east_m, place.north_m), metres
