"""GeoJSON written: features cut at 180°, no-go zones and contours, and what their numbers mean."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, NotRequired, TypedDict

import numpy as np
import numpy.typing as npt
import shapely
from shapely import affinity

from service.parts.map_facts import body_name, crs_label, grid_north_deg
from service.parts.positioning import PositioningParameters
from terrain import ElevationGrid, to_lon_lat
from visibility.dilution import NO_GO, contour_lines, zones

__all__ = [
    "Feature",
    "Geometry",
    "collection_of",
    "coordinates_of",
    "cut",
    "feature",
    "place_of",
    "write_collection",
    "write_contours",
    "write_no_go_zones",
]

Floats = npt.NDArray[np.float64]
DECIMALS_DEG, DECIMALS_M, DECIMALS_HEIGHT_M = 8, 3, 2
LEVELS_PER_LIMIT = (0.5, 1.0, 2.0)
LOCAL_METRES = "metres east and north in the DEM's local frame, which has no CRS"
HALF, TURN = 180.0, 360.0
TURNS = (-1, 0, 1)


class Geometry(TypedDict):
    """A geometry of RFC 7946. coordinates: of a place, or of places nested as its type says."""

    type: str
    coordinates: list[Any]


class Feature(TypedDict):
    """A geometry and what is told of it."""

    type: Literal["Feature"]
    id: NotRequired[str]
    geometry: Geometry
    properties: Mapping[str, object]


def feature(kind: str, coordinates: list[Any], properties: Mapping[str, object], id: str | None = None) -> Feature:
    """A feature of one geometry of that kind."""
    geometry = Geometry(type=kind, coordinates=coordinates)
    if id is None:
        return {"type": "Feature", "geometry": geometry, "properties": properties}
    return {"type": "Feature", "id": id, "geometry": geometry, "properties": properties}


def coordinates_of(grid: ElevationGrid, places_m: npt.NDArray[np.float64]) -> list[list[float]]:
    """Places (n, 2) or (n, 3) east, north, altitude in the grid's frame, metres, as GeoJSON writes them.

    In longitude and latitude, degrees; without a CRS in the grid's metres. Altitudes stay in its vertical datum.
    """
    if grid.crs is None:
        metres: list[list[float]] = np.round(places_m, DECIMALS_M).tolist()
        return metres
    lon_lat_deg = np.round(np.column_stack(to_lon_lat(grid, places_m[:, 0], places_m[:, 1])), DECIMALS_DEG)
    degrees: list[list[float]] = np.column_stack([lon_lat_deg, np.round(places_m[:, 2:], DECIMALS_HEIGHT_M)]).tolist()
    return degrees


def place_of(grid: ElevationGrid, east_m: float, north_m: float) -> list[float]:
    """One place, without its height."""
    return coordinates_of(grid, np.array([[east_m, north_m]]))[0]


def cut(geometry: Geometry) -> Geometry:
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


def _one_or_many(single: str, kind: str, parts: list[Any]) -> Geometry:
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


def write_collection(
    grid: ElevationGrid, features: Iterable[Mapping[str, Any]], path: Path, indent: int | None = None
) -> None:
    """Features of a grid: in longitude and latitude, without a CRS in the grid's metres.

    Beside the features stand the body where it is not the Earth, what altitudes count from, and where the grid's north
    lies, from which azimuths and headings in properties count.
    """
    path.write_text(json.dumps(collection_of(grid, features), allow_nan=False, indent=indent), encoding="utf-8")


def collection_of(grid: ElevationGrid, features: Iterable[Mapping[str, Any]]) -> dict[str, object]:
    """The collection that ``write_collection`` writes."""
    cuts = (one if grid.crs is None else {**one, "geometry": cut(one["geometry"])} for one in features)
    return {"type": "FeatureCollection", **_meaning(grid), "features": list(cuts)}


def _meaning(grid: ElevationGrid) -> dict[str, str]:
    if grid.crs is None:
        return {"coordinates_are": LOCAL_METRES}
    body, north_deg = body_name(grid), grid_north_deg(grid)
    told = {}
    if body != "Earth":
        assert grid.crs.geodetic_crs is not None, "places have been turned into degrees"
        told = {"body": str(body), "coordinates_are": f"longitude and latitude on {body}: {grid.crs.geodetic_crs.name}"}
    told["altitudes_are"] = f"metres above {_datum(grid)}"
    if north_deg is not None:
        told["azimuths_are"] = (
            f"clockwise from the grid's north ({crs_label(grid)}), which lies {north_deg:.2f}° clockwise of true north"
        )
    return told


def _datum(grid: ElevationGrid) -> str:
    if grid.vertical_datum is None:
        return "what the DEM's heights count from, which it does not say"
    return f"the DEM's vertical datum: {grid.vertical_datum}"


def write_no_go_zones(
    grid: ElevationGrid, no_go: npt.NDArray[np.uint8], parameters: PositioningParameters, path: Path
) -> None:
    """Polygons in degrees round the no-go posts; without a CRS in the DEM's local metres, and says so."""
    features = [
        feature(
            "Polygon",
            [coordinates_of(grid, ring) for ring in (zone.exterior, *zone.holes)],
            {"area_m2": round(zone.area_m2, 1), **_limit(parameters)},
        )
        for zone in zones(grid, no_go == NO_GO)
    ]
    write_collection(grid, features, path)


def write_contours(
    grid: ElevationGrid, dop: npt.NDArray[np.float32], parameters: PositioningParameters, path: Path
) -> None:
    """One MultiLineString for each level of the dilution; the limit is one of them."""
    levels = [parameters.dop_limit * part for part in LEVELS_PER_LIMIT]
    lines = contour_lines(grid, dop, levels) if min(grid.shape) > 1 else dict.fromkeys(levels, ())
    features = [
        feature(
            "MultiLineString",
            [coordinates_of(grid, line) for line in lines[level]],
            {"dop": level, **_limit(parameters)},
        )
        for level in levels
    ]
    write_collection(grid, features, path)


def _limit(parameters: PositioningParameters) -> dict[str, str | float]:
    return {"measure": parameters.measure, "kind": parameters.kind, "dop_limit": parameters.dop_limit}
