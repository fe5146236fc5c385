"""Boxes and circles where a request wants polygons: each becomes the ring that goes round it."""

from __future__ import annotations

import math
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from service.parts.shapes import BoxDegreesIn, BoxMetresIn, CircleIn
from terrain import DEGREES, Circle, area_in_degrees

__all__ = ["polygon_fields_of"]

Shape = TypeVar("Shape", bound=BaseModel)

# sides along a parallel are straight on no map: so many pieces follow them
PIECES = 16
CORNERS = 180


def polygon_fields_of(value: Any) -> Any:
    """A box or a circle as the fields of a polygon; anything else as it is. Raises ValueError for one that is none."""
    fields = value if isinstance(value, dict) else {}
    if "radius_m" in fields:
        return _ring_of_circle(_model(CircleIn, fields))
    if "west_m" in fields:
        box = _model(BoxMetresIn, fields)
        return _ring("east_m", "north_m", _around(box.west_m, box.south_m, box.east_m, box.north_m))
    if "west_deg" in fields:
        degrees = _model(BoxDegreesIn, fields)
        east = degrees.east_deg + (360.0 if degrees.east_deg < degrees.west_deg else 0.0)
        return _ring("lon_deg", "lat_deg", _around(degrees.west_deg, degrees.south_deg, east, degrees.north_deg))
    return value


def _model(model: type[Shape], fields: dict[str, Any]) -> Shape:
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def _ring_of_circle(circle: CircleIn) -> dict[str, Any]:
    if circle.east_m is not None and circle.north_m is not None:
        angle = np.linspace(0.0, 2.0 * math.pi, CORNERS, endpoint=False)
        radius_m = circle.radius_m / math.cos(math.pi / CORNERS)
        pairs = np.column_stack([circle.east_m + radius_m * np.cos(angle), circle.north_m + radius_m * np.sin(angle)])
        return _ring("east_m", "north_m", pairs.tolist())
    assert circle.lon_deg is not None, "the validator has seen to it"
    assert circle.lat_deg is not None, "the validator has seen to it"
    if circle.body not in (None, "Earth"):
        raise ValueError("A circle in degrees is one of the Earth here; give east_m and north_m.")
    around = area_in_degrees(Circle(circle.lon_deg, circle.lat_deg, circle.radius_m, DEGREES))
    # said to be the Earth's, so that on a DEM of another body it is refused, not drawn with another radius
    return _ring("lon_deg", "lat_deg", list(around.exterior.coords)[:-1], {"body": "Earth"})


def _around(west: float, south: float, east: float, north: float) -> list[list[float]]:
    x, y = np.linspace(west, east, PIECES + 1), np.linspace(south, north, PIECES + 1)
    sides = [
        np.column_stack([x[:-1], np.full(PIECES, south)]),
        np.column_stack([np.full(PIECES, east), y[:-1]]),
        np.column_stack([x[:0:-1], np.full(PIECES, north)]),
        np.column_stack([np.full(PIECES, west), y[:0:-1]]),
    ]
    ring: list[list[float]] = np.concatenate(sides).tolist()
    return ring


def _ring(x_name: str, y_name: str, pairs: list[Any], more: dict[str, str] | None = None) -> dict[str, Any]:
    return {"ring": [{x_name: float(x), y_name: float(y), **(more or {})} for x, y in pairs]}
