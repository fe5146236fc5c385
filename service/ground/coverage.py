"""The ground library of a data folder: what it covers, as GeoJSON, and which of it an area takes."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, Field, JsonValue

from service.files.geojson import cut
from terrain import GroundLibrary, MosaicPlan, Tile, area_in_degrees, read_library

__all__ = [
    "LIBRARY",
    "STORE",
    "Coverage",
    "PlanOut",
    "coverage_of",
    "fingerprint",
    "library_in",
    "name_of",
    "plan_told",
    "posts_about",
]

# in a data folder, beside the store: an index of tiles, which stay where they are; and what was read of remote sources
LIBRARY, STORE = "ground.json", "ground-store"
DECIMALS = 7


class TileOutline(BaseModel):
    """A polygon in longitude and latitude, cut at 180 degrees."""

    type: Literal["Polygon", "MultiPolygon"]
    coordinates: list[JsonValue] = Field(description="Rings of longitude and latitude, degrees (RFC 7946).")


class TileFacts(BaseModel):
    """What the header of a tile says; of its file only the name, not where it lies."""

    name: str = Field(description="Name of the file.")
    driver: str = Field(description="Format that it is read as.")
    crs: str = Field(description="CRS of its posts: its code, or its name where it has none.")
    body: str = Field(description="Celestial body that it lies on.")
    rows: int = Field(description="Rows of posts.")
    cols: int = Field(description="Columns of posts.")
    cell_m: float = Field(description="Ground that a cell covers in its middle, metres.")
    vertical_datum: str | None = Field(description="What heights count from, where its header says so.")
    file_bytes: int = Field(description="Size of the file, bytes.")


class TileFeature(BaseModel):
    """One tile."""

    type: Literal["Feature"] = "Feature"
    geometry: TileOutline
    properties: TileFacts


class Coverage(BaseModel):
    """GeoJSON: the outline of every tile of the ground library."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[TileFeature] = Field(description="A tile each.")
    sources: list[str] = Field([], description="Names of the remote sources that may be asked for as `source`.")


class LayerOut(BaseModel):
    """Tiles on one lattice, and what they give of an area."""

    tiles: list[str] = Field(description="Names of the files.")
    crs: str = Field(description="CRS of their posts.")
    cell_m: float = Field(description="Ground that a cell covers, metres.")
    covers_share: float = Field(description="Share of the area that they cover, 0..1.")
    gives_share: float = Field(description="Share of the area that no finer ones cover, 0..1.")
    reason: str = Field(description="The same in words.")


class PlanOut(BaseModel):
    """Which tiles an area takes, finest first."""

    uncovered_share: float = Field(description="Share of the area that lies in no tile, 0..1.")
    layers: list[LayerOut]


def library_in(root: Path) -> GroundLibrary:
    """The library of a data folder, read again only when it was changed. Raises DemReadError."""
    path = root / LIBRARY
    try:
        found = path.stat()
    except OSError:
        return GroundLibrary()
    return _read(path, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=2)
def _read(path: Path, modified_ns: int, size_bytes: int) -> GroundLibrary:
    return read_library(path)


def coverage_of(library: GroundLibrary, sources: Iterable[str] = ()) -> Coverage:
    """The outline of every tile, and which sources there are besides."""
    return Coverage(features=[_feature(tile) for tile in library.tiles], sources=sorted(sources))


def fingerprint(tiles: Iterable[Tile]) -> str:
    """SHA-256 of which tiles are taken, and of the state of their files."""
    sha = hashlib.sha256()
    for tile in tiles:
        sha.update(f"{tile.path}\0{tile.size_bytes}\0{tile.modified_ns}\0".encode("utf-8", "surrogateescape"))
    return sha.hexdigest()


def posts_about(plan: MosaicPlan, cell_m: float | None) -> float:
    """About how many posts the grid of a plan has, before any height is read; cell_m: between them, if it is given."""
    finest = plan.layers[0].layer
    ellipsoid = finest.crs.ellipsoid
    assert plan.area is not None, "a request names its area"
    assert ellipsoid is not None, "reading the tiles has measured their cells on it"
    west, south, east, north = np.radians(area_in_degrees(plan.area, finest.crs).bounds).tolist()
    across_m = ellipsoid.semi_major_metre * np.array([north - south, (east - west) * np.cos((north + south) / 2.0)])
    return float(np.prod(across_m / (cell_m or finest.cell_m)))


def plan_told(plan: MosaicPlan) -> PlanOut:
    """Which tiles, in which order and why."""
    layers = [
        LayerOut(
            tiles=[name_of(tile) for tile in planned.layer.tiles],
            crs=_crs_name(planned.layer.tiles[0]),
            cell_m=planned.layer.cell_m,
            covers_share=min(planned.covers, 1.0),
            gives_share=min(planned.adds, 1.0),
            reason=planned.reason(),
        )
        for planned in plan.layers
    ]
    return PlanOut(uncovered_share=plan.uncovered, layers=layers)


def _feature(tile: Tile) -> TileFeature:
    ring = [[round(lon, DECIMALS), round(lat, DECIMALS)] for lon, lat in (*tile.outline_deg, tile.outline_deg[0])]
    # GeoJSON turns anticlockwise
    outline = TileOutline.model_validate(cut({"type": "Polygon", "coordinates": [ring[::-1]]}))
    facts = TileFacts(
        name=name_of(tile),
        driver=tile.driver,
        crs=_crs_name(tile),
        body=tile.body,
        rows=tile.rows,
        cols=tile.cols,
        cell_m=round(tile.cell_m, 4),
        vertical_datum=tile.vertical_datum,
        file_bytes=tile.size_bytes,
    )
    return TileFeature(geometry=outline, properties=facts)


def name_of(tile: Tile) -> str:
    """The file's name as text: it may hold bytes that are none."""
    return tile.name.encode("utf-8", "replace").decode()


def _crs_name(tile: Tile) -> str:
    return tile.crs_text if tile.crs_text.startswith("EPSG:") else str(tile.crs.name)
