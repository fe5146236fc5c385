"""GeoJSON geometries cut where they cross 180° of longitude (RFC 7946, 3.1.9)."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely import affinity

__all__ = ["cut"]

Floats = npt.NDArray[np.float64]
DECIMALS_DEG = 8
HALF, TURN = 180.0, 360.0
TURNS = (-1, 0, 1)


def cut(geometry: dict[str, Any]) -> dict[str, Any]:
    """The same geometry, in parts where it crosses 180°; coordinates are degrees in −180…180, heights may follow.

    Neighbouring corners are joined the short way. A ring round a pole has the pole inside.
    """
    kind, coordinates = geometry["type"], geometry["coordinates"]
    if kind in ("LineString", "MultiLineString"):
        lines = [coordinates] if kind == "LineString" else coordinates
        return _one_or_many("LineString", kind, [part for line in lines for part in _parts_of_line(line)])
    if kind in ("Polygon", "MultiPolygon"):
        polygons = [coordinates] if kind == "Polygon" else coordinates
        return _one_or_many("Polygon", kind, [part for polygon in polygons for part in _parts_of_polygon(polygon)])
    return geometry


def _one_or_many(single: str, kind: str, parts: list[Any]) -> dict[str, Any]:
    if kind == single and len(parts) == 1:
        return {"type": single, "coordinates": parts[0]}
    return {"type": f"Multi{single}", "coordinates": parts}


def _parts_of_line(line: list[list[float]]) -> list[list[list[float]]]:
    at = np.array(line, np.float64)
    whole = np.unwrap(at[:, 0], period=TURN)
    if np.array_equal(whole, at[:, 0]):
        return [line]
    at[:, 0] = whole
    parts, begun = [], [at[0]]
    for here, there in itertools.pairwise(at):
        low, high = sorted((here[0], there[0]))
        border = (np.floor((low + HALF) / TURN) + 1.0) * TURN - HALF
        if low < border < high and not _on_border(here):
            on_it = here + (there - here) * ((border - here[0]) / (there[0] - here[0]))
            on_it[0] = border
            parts.append([*begun, on_it])
            begun = [on_it]
        begun.append(there)
        if _on_border(there):
            parts.append(begun)
            begun = [there]
    return [_as_degrees(np.array(part)) for part in (*parts, begun) if len(part) > 1]


def _on_border(point: Floats) -> bool:
    return bool((point[0] + HALF) % TURN == 0.0)


def _as_degrees(part: Floats) -> list[list[float]]:
    """A part that lies between two borders, turned into −180…180."""
    turns = np.floor(((part[:, 0].min() + part[:, 0].max()) / 2.0 + HALF) / TURN)
    part[:, 0] -= turns * TURN
    degrees: list[list[float]] = np.round(part, DECIMALS_DEG).tolist()
    return degrees


def _parts_of_polygon(rings: list[list[list[float]]]) -> list[list[list[list[float]]]]:
    unwrapped = [_unwrapped(ring) for ring in rings]
    if all(np.array_equal(whole[:, 0], np.array(ring)[:, 0]) for whole, ring in zip(unwrapped, rings, strict=True)):
        return [rings]
    around, *holes = (shapely.make_valid(shapely.Polygon(whole)) for whole in unwrapped)
    for hole in holes:
        for turns in TURNS:
            around = around.difference(_turned(hole, turns))
    parts = []
    for turns in TURNS:
        window = shapely.box(turns * TURN - HALF, -90.0, turns * TURN + HALF, 90.0)
        for part in shapely.get_parts(around.intersection(window)):
            if part.geom_type == "Polygon" and part.area > 0.0:
                parts.append(_rings_of(shapely.orient_polygons(_turned(part, -turns))))
    return parts


def _unwrapped(ring: list[list[float]]) -> Floats:
    """(n, 2) corners with longitudes that do not jump; a ring round a pole is closed over it."""
    at = np.array(ring, np.float64)[:, :2]
    at[:, 0] = np.unwrap(at[:, 0], period=TURN)
    if abs(at[-1, 0] - at[0, 0]) < HALF:
        return at
    pole = np.copysign(90.0, at[:, 1].mean())
    return np.concatenate([at, [[at[-1, 0], pole], [at[0, 0], pole], at[0]]])


def _turned(shape: shapely.Geometry, turns: int) -> shapely.Geometry:
    return affinity.translate(shape, turns * TURN)


def _rings_of(polygon: shapely.Polygon) -> list[list[list[float]]]:
    rings = (polygon.exterior, *polygon.interiors)
    return [np.round(shapely.get_coordinates(ring), DECIMALS_DEG).tolist() for ring in rings]
