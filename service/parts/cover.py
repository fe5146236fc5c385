"""What stands on the ground, as requests write it: footprints and meshes of buildings, put onto the grid."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
from pydantic import Base64Bytes, BaseModel, Field, JsonValue, WithJsonSchema, model_validator

from service.errors import RequestError
from service.parts.canopy import CanopyIn, foliage_in
from service.parts.geojson_reading import Fields, shapes_of
from service.parts.points import Metres, Positive, StrictModel
from terrain import DEFAULT_MAX_CELLS, ElevationGrid, body_of, to_grid_frame
from visibility.cover import (
    Buildings,
    Footprint,
    FootprintHeights,
    OneFootprint,
    footprints_of,
    parse_buildings,
    standing_footprints,
    standing_mesh,
    with_standing,
)
from visibility.signal import with_foliage

__all__ = [
    "BuildingsIn",
    "CoverIn",
    "CoverParameters",
    "FootprintsIn",
    "buildings_of",
    "covered",
    "footprints_in",
    "notes_on_cover",
]

MOST_MESHES = 20


class BuildingsIn(StrictModel):
    """Buildings that stand on the DEM, in one .stl, .obj, .ply or .glb file, in metres."""

    name: str = Field(
        min_length=5,
        max_length=200,
        pattern=r"^[^/\\]*\.([sS][tT][lL]|[oO][bB][jJ]|[pP][lL][yY]|[gG][lL][bB])$",
        description="What the file is called; its ending tells the format: .stl, .obj, .ply or .glb.",
    )
    base64: Base64Bytes = Field(min_length=1, description="The file's bytes in base64.")
    heights: Literal["above_ground", "absolute"] = Field(
        "above_ground",
        description="Each separate body stands on the ground under the middle of its footprint, or the file's heights "
        "are altitudes.",
    )
    up: Literal["y", "z"] | None = Field(
        None, description="The file's upward axis; left out: y for .glb, as that format says, z for the others."
    )
    origin_east_m: Metres = Field(0.0, description="East of the file's own origin in the DEM's metric CRS, metres.")
    origin_north_m: Metres = Field(0.0, description="North of it, metres.")


class FootprintsIn(StrictModel):
    """Footprints of buildings with heights, as OpenStreetMap's tools write GeoJSON."""

    geojson: Annotated[dict[str, JsonValue], WithJsonSchema({"type": "object"})] = Field(
        description="A FeatureCollection: polygons with a tag building, building:part or height. Their height is in "
        "metres, or says its unit; min_height is told, and counts as solid below. Degrees, unless it says otherwise."
    )
    level_m: Positive | None = Field(
        None, description="Height of each of building:levels where none is told, metres; null = those are refused."
    )
    default_height_m: Positive | None = Field(
        None, description="Height of buildings that tell none, metres; null = those are refused."
    )


class CoverIn(StrictModel):
    """What stands on the ground: it hides in every answer, and nobody drives or flies through it."""

    footprints: FootprintsIn | None = Field(None, description="Buildings as footprints with heights.")
    meshes: list[BuildingsIn] = Field(
        [], max_length=MOST_MESHES, description="Buildings as meshes; what is open below a roof counts as solid."
    )
    canopy: CanopyIn | None = Field(None, description="Trees, which weaken signals.")

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.footprints is None and not self.meshes and self.canopy is None:
            raise ValueError("A cover needs footprints, meshes or a canopy.")
        return self


class CoverParameters(StrictModel):
    """What stands on the ground that a request is about."""

    cover: CoverIn | None = Field(
        None, description="Buildings that stand on the DEM: they hide in every answer. null = bare ground."
    )


def covered(grid: ElevationGrid, parameters: BaseModel, max_cells: int = DEFAULT_MAX_CELLS) -> ElevationGrid:
    """The ground of a request with what it says stands there; the same grid where it says nothing.

    max_cells: that a raster of trees may have. Raises CoverError, MeshError, RequestError, FrameError, DemReadError.
    """
    cover = getattr(parameters, "cover", None)
    return _covered(grid, cover.model_dump_json(), max_cells) if isinstance(cover, CoverIn) else grid


def notes_on_cover(grid: ElevationGrid) -> tuple[str, ...]:
    """What was assumed or left out of what stands on a grid, for answers that tell no other warnings of the DEM."""
    of_buildings = () if grid.standing is None else grid.standing.notes
    return of_buildings if grid.trees is None else (*of_buildings, *grid.trees.notes)


def buildings_of(grid: ElevationGrid, asked: BuildingsIn | None) -> Buildings | None:
    """The buildings of a mesh in a request, stood on the grid. Raises MeshError."""
    if asked is None:
        return None
    return parse_buildings(
        asked.base64,
        asked.name,
        grid,
        heights=asked.heights,
        up=asked.up,
        origin_east_m=asked.origin_east_m,
        origin_north_m=asked.origin_north_m,
    )


def footprints_in(
    grid: ElevationGrid, document: object, heights: FootprintHeights, called: str
) -> tuple[list[Footprint], tuple[str, ...]]:
    """(footprints, sentences) of GeoJSON in any frame that it may tell. Raises CoverError, RequestError, FrameError."""
    polygons, others = [], 0
    for number, shape in enumerate(shapes_of(document, called)):
        if shape.kind != "Polygon":
            others += 1
            continue
        tags = dict(shape.properties)
        tags |= cast("dict[str, JsonValue]", tags["tags"]) if isinstance(tags.get("tags"), dict) else {}
        name = str(shape.feature.get("id") or tags.get("@id") or tags.get("id") or f"polygon {number}")[:80]
        polygons.append(OneFootprint(tuple(_ring(grid, places) for places in shape.lines), tags, name))
    found, told = footprints_of(polygons, heights, called)
    return found, (*told, f"{called}: {others} shapes are no polygons and are passed over.") if others else told


def _ring(grid: ElevationGrid, places: list[Fields]) -> Any:
    if "east_m" in places[0]:
        return np.array([(place["east_m"], place["north_m"]) for place in places], np.float64)
    if grid.crs is None:
        raise RequestError(
            "The footprints are in degrees, which have no place on a DEM without a CRS; a collection in metres of the "
            'DEM says so with "coordinates_are": "metres".'
        )
    body, own = places[0].get("body"), body_of(grid.crs).name
    if body not in (None, own):
        raise RequestError(f"The footprints are in degrees on {body}, which have no place on a DEM of {own}.")
    degrees = np.array([(place["lon_deg"], place["lat_deg"]) for place in places], np.float64)
    return np.column_stack(to_grid_frame(grid, degrees[:, 0], degrees[:, 1]))


@lru_cache(maxsize=2)
def _covered(grid: ElevationGrid, text: str, max_cells: int) -> ElevationGrid:
    """Kept, since a pointer over a map asks on the same ground again and again."""
    cover = CoverIn.model_validate_json(text)
    parts = []
    asked = cover.footprints
    if asked is not None:
        heights = FootprintHeights(asked.level_m, asked.default_height_m)
        footprints, told = footprints_in(grid, asked.geojson, heights, "cover.footprints")
        parts.append(standing_footprints(grid, footprints, told))
    for mesh in cover.meshes:
        buildings = buildings_of(grid, mesh)
        if buildings is None:
            raise RequestError("A mesh of a cover is missing.")
        parts.append(standing_mesh(buildings))
    built = with_standing(grid, parts)
    return built if cover.canopy is None else with_foliage(built, foliage_in(built, cover.canopy, max_cells))
