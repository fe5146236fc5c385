"""Footprints of buildings with heights, as OpenStreetMap tags them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from terrain import ElevationGrid, FrameError, body_of, to_grid_frame
from visibility.errors import CoverError

__all__ = ["Footprint", "FootprintHeights", "OneFootprint", "footprints_of", "parse_footprints", "read_footprints"]

FOOT_M, INCH_M = 0.3048, 0.0254
LENGTH = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*(m|meters?|metres?|ft|feet|')?", re.IGNORECASE)
FEET_AND_INCHES = re.compile(r"(\d+)'\s*(\d+(?:\.\d+)?)(?:\"|'')")
TALLEST_M = 3000.0
CRS84 = ("urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "OGC:CRS84", "EPSG:4326")
MAX_FOOTPRINTS = 200_000


@dataclass(frozen=True, slots=True)
class Footprint:
    """A building seen from above, in the frame of a grid: height_m of its roof, and of its lowest part, over ground."""

    outline: shapely.Polygon
    height_m: float
    min_height_m: float = 0.0


@dataclass(frozen=True, slots=True)
class FootprintHeights:
    """How heights are found where a footprint tells none: metres for each of its levels, metres for all others.

    None: it is refused. Raises CoverError.
    """

    level_m: float | None = None
    default_m: float | None = None

    def __post_init__(self) -> None:
        for name in ("level_m", "default_m"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and 0.0 < value <= TALLEST_M):
                raise CoverError(f"{name} must be a number of metres above 0 and at most {TALLEST_M:g}, not {value}.")


@dataclass(frozen=True, slots=True)
class OneFootprint:
    """A polygon of a file, in the frame of a grid: its rings, the outer one first, its tags, and what to call it."""

    rings: tuple[np.ndarray[tuple[int, int], np.dtype[np.float64]], ...]
    tags: Mapping[str, Any]
    name: str


def footprints_of(
    polygons: list[OneFootprint], heights: FootprintHeights, called: str
) -> tuple[list[Footprint], tuple[str, ...]]:
    """(footprints with heights, sentences about what was assumed or passed over).

    A polygon is a building when it has a tag building or building:part (other than no), or a height. Heights are those
    of OpenStreetMap: metres, or with a unit ("12", "12 m", "40 ft", 40'6"). called: what sentences call the source.
    Raises CoverError, naming the first, for those without height, self-crossing ones and heights that are none.
    """
    if len(polygons) > MAX_FOOTPRINTS:
        raise CoverError(f"{called} holds {len(polygons):,} polygons, more than the limit of {MAX_FOOTPRINTS:,}.")
    found: list[Footprint] = []
    without: list[str] = []
    other = by_levels = by_default = 0
    for polygon in polygons:
        if not _is_building(polygon.tags):
            other += 1
            continue
        top_m, source = _height(polygon, heights, called)
        if top_m is None:
            without.append(polygon.name)
            continue
        by_levels += source == "levels"
        by_default += source == "default"
        base_m = _base(polygon, heights, called)
        if not 0.0 < top_m <= TALLEST_M or not 0.0 <= base_m < top_m:
            raise CoverError(
                f"{called}: {polygon.name} has height {top_m:g} m and min_height {base_m:g} m; a roof is above 0 m, "
                f"at most {TALLEST_M:g} m high, and above its min_height."
            )
        found.append(Footprint(_outline(polygon, called), top_m, base_m))
    if without:
        raise CoverError(
            f"{called}: {len(without)} of {len(without) + len(found)} footprints have no height, the first is "
            f"{without[0]}; give them one, or say how high a level is, or what to take for those without."
        )
    if not found:
        raise CoverError(f"{called} holds no footprints of buildings (polygons with a tag building or a height).")
    told = (
        ("polygons that are no buildings, passed over", other),
        (f"heights told as levels, taken as {heights.level_m} m each, as asked", by_levels),
        (f"heights not told, taken as {heights.default_m} m, as asked", by_default),
    )
    return found, tuple(f"{called}: {what}: {count}." for what, count in told if count)


def read_footprints(
    path: str | Path, grid: ElevationGrid, heights: FootprintHeights | None = None
) -> tuple[list[Footprint], tuple[str, ...]]:
    """The footprints of a GeoJSON file as ``parse_footprints`` has them. Raises CoverError."""
    path = Path(path)
    try:
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise CoverError(f"The footprints {path.name} cannot be read as GeoJSON: {error}.") from error
    return parse_footprints(document, grid, heights, called=f"The footprints {path.name}")


def parse_footprints(
    document: object, grid: ElevationGrid, heights: FootprintHeights | None = None, *, called: str = "The footprints"
) -> tuple[list[Footprint], tuple[str, ...]]:
    """(footprints, sentences) of a GeoJSON document, as OpenStreetMap's tools write it.

    Coordinates are longitude and latitude (RFC 7946), or metres of the grid where the grid has no CRS. Lines and points
    beside the polygons are passed over, and told. Raises CoverError.
    """
    _check_body(document, grid, called)
    polygons: list[OneFootprint] = []
    others = 0
    for feature in _features(document, called):
        geometry = feature.get("geometry")
        tags = feature.get("properties") or {}
        if not isinstance(geometry, dict) or not isinstance(tags, dict):
            raise CoverError(f"{called} holds a feature without geometry or with properties that are no object.")
        tags = {**tags, **(tags["tags"] if isinstance(tags.get("tags"), dict) else {})}
        name = str(feature.get("id") or tags.get("@id") or tags.get("id") or f"number {len(polygons) + others}")[:80]
        kind, coordinates = geometry.get("type"), geometry.get("coordinates")
        if kind not in ("Polygon", "MultiPolygon"):
            others += 1
            continue
        if not isinstance(coordinates, list):
            raise CoverError(f"{called}: {name} has no list of coordinates.")
        for rings in [coordinates] if kind == "Polygon" else coordinates:
            if not isinstance(rings, list):
                raise CoverError(f"{called}: {name} has a polygon that is no list of rings.")
            placed = tuple(_in_grid(grid, ring, name, called) for ring in rings)
            polygons.append(OneFootprint(placed, tags, name))
    found, told = footprints_of(polygons, heights or FootprintHeights(), called)
    if others:
        told = (*told, f"{called}: features that are no polygons, passed over: {others}.")
    return found, told


def _check_body(document: object, grid: ElevationGrid, called: str) -> None:
    """Degrees of another body than the grid's, which Sightline's own files name, are no places on it."""
    body = document.get("body") if isinstance(document, dict) else None
    if body is not None and grid.crs is not None and body != body_of(grid.crs).name:
        raise CoverError(f"{called} are on the body {str(body)[:80]!r}, the grid lies on {body_of(grid.crs).name}.")


def _features(document: object, called: str) -> Iterator[dict[str, Any]]:
    if not isinstance(document, dict):
        raise CoverError(f"{called} are no GeoJSON object.")
    crs = document.get("crs")
    if crs is not None:
        properties = crs.get("properties") if isinstance(crs, dict) else None
        name = properties.get("name") if isinstance(properties, dict) else crs
        if name not in CRS84:
            raise CoverError(f"{called} are in the CRS {str(name)[:80]!r}; give longitude and latitude (RFC 7946).")
    features = document.get("features") if document.get("type") == "FeatureCollection" else [document]
    if not isinstance(features, list):
        raise CoverError(f"{called} are a FeatureCollection without a list of features.")
    for feature in features:
        if not isinstance(feature, dict) or feature.get("type") != "Feature":
            raise CoverError(f"{called} hold a part that is no GeoJSON feature.")
        yield feature


def _in_grid(grid: ElevationGrid, ring: Any, name: str, called: str) -> Any:
    try:
        places = np.array([pair[:2] for pair in ring], np.float64)
    except (TypeError, ValueError, IndexError) as error:
        raise CoverError(f"{called}: {name} has a ring that is no list of coordinates.") from error
    if places.ndim != 2 or places.shape[1:] != (2,) or not np.isfinite(places).all():
        raise CoverError(f"{called}: {name} has a ring that is no list of finite coordinates.")
    if grid.crs is None:
        return places
    try:
        return np.column_stack(to_grid_frame(grid, places[:, 0], places[:, 1]))
    except FrameError as error:
        raise CoverError(f"{called}: {name}: {error}") from error


def _outline(polygon: OneFootprint, called: str) -> shapely.Polygon:
    if not polygon.rings or any(len(ring) < 3 for ring in polygon.rings):
        raise CoverError(f"{called}: {polygon.name} has a ring of fewer than three corners.")
    outline = shapely.Polygon(polygon.rings[0], polygon.rings[1:])
    if not outline.is_valid or not outline.area > 0.0:
        raise CoverError(f"{called}: {polygon.name} is no simple polygon ({shapely.is_valid_reason(outline)}).")
    return outline


def _is_building(tags: Mapping[str, Any]) -> bool:
    return any(tags.get(tag) not in (None, "", "no", False) for tag in ("building", "building:part", "height"))


def _height(polygon: OneFootprint, heights: FootprintHeights, called: str) -> tuple[float | None, str]:
    tags = polygon.tags
    if tags.get("height") not in (None, ""):
        return _metres(tags["height"], "height", polygon.name, called), "height"
    if heights.level_m is not None and tags.get("building:levels") not in (None, ""):
        return _metres(tags["building:levels"], "building:levels", polygon.name, called) * heights.level_m, "levels"
    return (None, "") if heights.default_m is None else (heights.default_m, "default")


def _base(polygon: OneFootprint, heights: FootprintHeights, called: str) -> float:
    tags = polygon.tags
    if tags.get("min_height") not in (None, ""):
        return _metres(tags["min_height"], "min_height", polygon.name, called)
    if heights.level_m is not None and tags.get("building:min_level") not in (None, ""):
        level = _metres(tags["building:min_level"], "building:min_level", polygon.name, called)
        return level * heights.level_m
    return 0.0


def _metres(value: Any, tag: str, name: str, called: str) -> float:
    """A length as OpenStreetMap writes it: metres unless it says feet."""
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    text = str(value).strip()
    parts = FEET_AND_INCHES.fullmatch(text)
    if parts is not None:
        return float(parts[1]) * FOOT_M + float(parts[2]) * INCH_M
    one = LENGTH.fullmatch(text)
    if one is None:
        raise CoverError(f"{called}: {name} has the {tag} {text[:40]!r}, which is no length.")
    return float(one[1].replace(",", ".")) * (FOOT_M if (one[2] or "m").lower() in ("ft", "feet", "'") else 1.0)
