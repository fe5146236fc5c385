"""What stands on the ground, as requests write it: footprints and meshes of buildings, put onto the grid."""

from __future__ import annotations

import math
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
from pydantic import AfterValidator, Base64Bytes, BaseModel, Field, JsonValue, WithJsonSchema, model_validator

from service.errors import RequestError
from service.parts.geojson_reading import Fields, shapes_of
from service.parts.points import Metres, NotNegativeMetres, Positive, StrictModel
from terrain import (
    DEFAULT_MAX_CELLS,
    ElevationGrid,
    ElevationGridError,
    SkyDepths,
    body_of,
    read_dem,
    to_grid_frame,
)
from visibility.cover import (
    Buildings,
    Canopy,
    Footprint,
    FootprintHeights,
    OneFootprint,
    canopy_between,
    footprints_of,
    parse_buildings,
    resampled_canopy,
    standing_footprints,
    standing_mesh,
    with_standing,
)
from visibility.signal import Foliage, FoliageModel, with_foliage

__all__ = [
    "BuildingsIn",
    "CanopyIn",
    "CoverIn",
    "CoverParameters",
    "FootprintsIn",
    "buildings_of",
    "covered",
    "footprints_in",
    "notes_on_cover",
]

MOST_MESHES = 20
DepthPerM = Annotated[float, Field(strict=True, ge=0.0, le=100.0)]
ElevationDeg = Annotated[float, Field(strict=True, ge=0.0, le=90.0)]
# file systems take 255
MOST_NAME_BYTES = 200


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


def _file_name(name: str) -> str:
    """A name under which a file can lie anywhere. Raises ValueError."""
    if not name.strip(". ") or not name.isprintable() or len(name.encode()) > MOST_NAME_BYTES:
        raise ValueError(
            f"no file can be called that; give a name of printable letters, {MOST_NAME_BYTES} bytes at most"
        )
    return name


class RasterIn(StrictModel):
    """A raster in a file that is read as a DEM is."""

    name: Annotated[str, AfterValidator(_file_name)] = Field(
        min_length=1, max_length=200, pattern=r"^[^/\\]+$", description="What the file is called."
    )
    base64: Base64Bytes = Field(min_length=1, description="The file's bytes in base64.")


class SkyDepthsIn(StrictModel):
    """Optical depth per metre by the direction in which a way leads up, as ``sightline canopy fit`` finds it."""

    elevation_edges_deg: Annotated[list[ElevationDeg], Field(min_length=2, max_length=37)] = Field(
        description="Ascending edges of rings, degrees; ways below or above all of them are of the ring beside them."
    )
    depth_per_m: Annotated[
        list[Annotated[list[DepthPerM], Field(min_length=1, max_length=72)]], Field(min_length=1, max_length=36)
    ] = Field(description="Per metre of way, 1/m: a row for each ring, equal sectors clockwise from grid north in it.")

    def depths(self) -> SkyDepths:
        """The same as the library takes it. Raises ElevationGridError."""
        edges = tuple(math.radians(edge) for edge in self.elevation_edges_deg)
        return SkyDepths(edges, tuple(tuple(row) for row in self.depth_per_m))

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        try:
            self.depths()
        except ElevationGridError as error:
            raise ValueError(str(error)) from error
        return self


class CanopyIn(StrictModel):
    """Trees over the ground: they hide nothing, and weaken signals."""

    heights: RasterIn | None = Field(None, description="A raster of crown heights over the ground, metres.")
    surface: RasterIn | None = Field(
        None, description="A surface model instead; the canopy is what it has above the DEM, buildings taken out."
    )
    top_m: NotNegativeMetres | None = Field(
        None, description="One height of the crowns everywhere instead of a raster, metres."
    )
    base_m: NotNegativeMetres = Field(0.0, description="Height over the ground at which crowns begin, metres.")
    model: FoliageModel = Field(
        "weissberger",
        description="What a way through costs: a published model, each for its own frequencies, or density.",
    )
    depth_per_m: DepthPerM | None = Field(
        None, description="Optical depth per metre of way, 1/m: belongs to the model density; 4.34 dB each."
    )
    sky: SkyDepthsIn | None = Field(
        None, description="The same by direction, in place of depth_per_m: belongs to the model density."
    )
    season: Annotated[float, Field(strict=True, ge=0.0, le=10.0)] = Field(
        1.0, description="Factor on the loss, no unit: 1 = in leaf, or as it was fitted."
    )

    @model_validator(mode="after")
    def _one_canopy(self) -> Self:
        if sum(given is not None for given in (self.heights, self.surface, self.top_m)) != 1:
            raise ValueError("A canopy needs exactly one of heights, surface and top_m.")
        depths = sum(given is not None for given in (self.depth_per_m, self.sky))
        if depths != (1 if self.model == "density" else 0):
            raise ValueError("One of a canopy's depth_per_m and sky belongs to the model density, and to no other.")
        return self


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
    return built if cover.canopy is None else with_foliage(built, _foliage(built, cover.canopy, max_cells))


def _foliage(grid: ElevationGrid, asked: CanopyIn, max_cells: int) -> Foliage:
    """The canopy of a request over a grid. Raises CoverError, DemReadError, FrameError."""
    if asked.heights is not None:
        canopy = resampled_canopy(grid, _raster(grid, asked.heights, max_cells), asked.base_m)
    elif asked.surface is not None:
        canopy = canopy_between(grid, _raster(grid, asked.surface, max_cells), asked.base_m)
    else:
        canopy = Canopy(
            grid, np.full(grid.shape, asked.top_m, np.float32), np.full(grid.shape, asked.base_m, np.float32)
        )
    sky = None if asked.sky is None else asked.sky.depths()
    return Foliage(canopy, asked.model, asked.depth_per_m, asked.season, sky)


def _raster(grid: ElevationGrid, asked: RasterIn, max_cells: int) -> ElevationGrid:
    """A raster in the frame of the grid; one in another is warped, which its provenance tells."""
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder:
        path = Path(folder) / asked.name
        path.write_bytes(asked.base64)
        return read_dem(path, target_crs=grid.crs, max_cells=max_cells)
