"""What maps of every kind say about themselves: the ground, the calculation, shares of the known posts."""

from __future__ import annotations

import importlib.metadata
import math
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Annotated, Any, Protocol, TypedDict

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from service.parts.anchors import CurvatureIn
from service.parts.cover_told import CoverTold, cover_told
from terrain import ElevationGrid, FrameError, body_of, grid_north, height_reference_of, vertical_datum_of
from visibility import FLAT, Curvature

__all__ = [
    "DEM_ID",
    "BareGround",
    "BoundsOfPosts",
    "DemId",
    "Ground",
    "MapSummary",
    "Preamble",
    "altitude_datum_of",
    "body_name",
    "check_bodies",
    "crs_label",
    "curvature_of",
    "dem_name",
    "grid_north_deg",
    "ground_of",
    "preamble",
    "share_of",
]

DEM_ID = "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11"

DemId = Annotated[str, Field(min_length=1, max_length=64, description="The DEM, as POST /dems named it.")]


class BoundsOfPosts(BaseModel):
    """The outermost posts, metres in the DEM's frame."""

    west: float = Field(description="East of the westmost posts, metres.")
    south: float = Field(description="North of the southmost posts, metres.")
    east: float = Field(description="East of the eastmost posts, metres.")
    north: float = Field(description="North of the northmost posts, metres.")


class BareGround(BaseModel):
    """Which ground it was: name, digest, size, place and what was converted."""

    name: str = Field(description="What the DEM is called.")
    sha256: str = Field(description="Digest of heights and geometry, hexadecimal digits.")
    rows: int = Field(description="Rows of posts.")
    cols: int = Field(description="Columns of posts.")
    cell_east_m: float = Field(description="Distance of the posts from west to east, metres.")
    cell_north_m: float = Field(description="Distance of the posts from north to south, metres.")
    bounds_of_posts_m: BoundsOfPosts
    crs: str | None = Field(description="The metric CRS; null for a local frame.")
    crs_name: str = Field(description="How people call it.")
    body: str | None = Field(None, description="The celestial body it lies on; null for a local frame.")
    grid_north_deg: float | None = Field(
        None, description="True azimuth of the grid's north at its middle, degrees; null for a local frame."
    )
    vertical_datum: str | None = Field(description="What heights count from, where that is known.")
    heights_count_from: str = Field("unknown", description="What heights count from: sea level, ellipsoid, or unknown.")
    unknown_posts: int = Field(description="Posts without a known height.")
    conversions: list[str] = Field(description="What was converted when it was read, in sentences.")


class Ground(BareGround):
    """The same with what a request put onto it."""

    cover: CoverTold | None = Field(None, description="What is known of what stands on it; null = nothing.")


class MapSummary(BaseModel):
    """How far to trust a map, and what it was made from."""

    model_config = ConfigDict(extra="allow", defer_build=True)

    version: str = Field(description="Version of Sightline that calculated it.")
    mode: str = Field(description="fast or exact; rays for maps of sites.")
    error_statement: str = Field(description="Measured error of that mode.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    unknown: str = Field(description="What a sight line over unknown ground was taken as.")
    dem: Ground
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    parameters: dict[str, JsonValue] = Field(description="What was asked, defaults filled in.")


class Preamble(TypedDict):
    """The fields of ``MapSummary``, but how long what took."""

    version: str
    mode: str
    error_statement: str
    curvature: str
    unknown: str
    dem: Ground
    warnings: list[str]
    parameters: dict[str, JsonValue]


class SightLines(Protocol):
    """Sight lines, or a map of them, that say how far to trust them."""

    @property
    def error_statement(self) -> str:
        """Measured error of their mode."""
        ...

    @property
    def curvature(self) -> Curvature:
        """Curvature and refraction that were used."""
        ...


class AskedCurvature(Protocol):
    """A request that says how the ground curves."""

    @property
    def curvature(self) -> CurvatureIn | str:
        """auto, flat, or numbers."""
        ...


def crs_label(grid: ElevationGrid) -> str:
    """How people call the grid's CRS: its code, its name where it has none, or that it is local."""
    if grid.crs is None:
        return "local frame"
    authority = grid.crs.to_authority()
    return ":".join(authority) if authority else str(grid.crs.name)


def dem_name(grid: ElevationGrid) -> str:
    """What to call the DEM in titles: the name of its file without folders, or a word for one made in memory."""
    name = PurePath(grid.provenance.source).name or "unnamed grid"
    # a file's name may hold bytes that are no text, which no picture can draw and no file of ours can hold
    return name.encode("utf-8", "replace").decode()


def ground_of(grid: ElevationGrid) -> Ground:
    """Which ground this is."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    return Ground(
        name=dem_name(grid),
        sha256=grid.digest,
        rows=grid.rows,
        cols=grid.cols,
        cell_east_m=grid.cell_east_m,
        cell_north_m=grid.cell_north_m,
        bounds_of_posts_m=BoundsOfPosts(west=west_m, south=south_m, east=east_m, north=north_m),
        crs=None if grid.crs is None else grid.crs.to_string(),
        crs_name=crs_label(grid),
        body=body_name(grid),
        grid_north_deg=grid_north_deg(grid),
        vertical_datum=grid.vertical_datum,
        heights_count_from=height_reference_of(grid).value,
        unknown_posts=grid.unknown_posts,
        conversions=list(grid.provenance.conversions),
        cover=cover_told(grid),
    )


def preamble(
    grid: ElevationGrid,
    asked: BaseModel,
    lines: SightLines | None,
    warnings: Iterable[str],
    *,
    mode: str,
    unknown: str,
    besides: Mapping[str, Any] | None = None,
) -> Preamble:
    """How far to trust an answer, and what it was made from.

    lines: what it stands on, None where nothing is ranged to; mode, unknown: how they were made. warnings: besides
    those of the grid's provenance; each is told once. besides: what of the parameters is too long to be told.
    """
    return Preamble(
        version=importlib.metadata.version("sightline"),
        mode=mode,
        error_statement="" if lines is None else lines.error_statement,
        curvature="" if lines is None else lines.curvature.sentence(),
        unknown=unknown,
        dem=ground_of(grid),
        warnings=list(dict.fromkeys((*grid.provenance.warnings, *warnings))),
        parameters=asked.model_dump(mode="json", exclude_none=True, exclude=None if besides is None else dict(besides)),
    )


def altitude_datum_of(grid: ElevationGrid) -> dict[str, str]:
    """What stands beside altitudes in files of anchors, so that another DEM can take them; nothing where unknown."""
    return {} if (own := vertical_datum_of(grid)) is None else {"altitude_datum": own.name}


def body_name(grid: ElevationGrid) -> str | None:
    """The celestial body that the grid lies on; None for a local frame."""
    return None if grid.crs is None else body_of(grid.crs).name


def check_bodies(grid: ElevationGrid, named: Iterable[str | None]) -> None:
    """Raises FrameError where degrees are named as those of another body than the grid's; None: not named."""
    others = {name for name in named if name is not None} - {body_name(grid)}
    if others and grid.crs is not None:
        raise FrameError(f"Longitude and latitude on {min(others)} have no place on a DEM of {body_name(grid)}.")


def grid_north_deg(grid: ElevationGrid) -> float | None:
    """True azimuth of the grid's north at its middle, degrees, to 0.0001; None for a local frame."""
    if grid.crs is None:
        return None
    west_m, south_m, east_m, north_m = grid.bounds_m
    try:
        return round(math.degrees(grid_north(grid, (west_m + east_m) / 2.0, (south_m + north_m) / 2.0)), 4)
    except FrameError:
        return None  # a middle where the CRS is not defined has no north


def curvature_of(parameters: AskedCurvature) -> Curvature | None:
    """The curvature asked for; None leaves it to the grid's CRS."""
    if isinstance(parameters.curvature, CurvatureIn):
        return Curvature(parameters.curvature.radius_m, parameters.curvature.refraction_k)
    return FLAT if parameters.curvature == "flat" else None


def share_of(posts: int, known_posts: int) -> float | None:
    """Part of the known posts; None where nothing is known."""
    return posts / known_posts if known_posts else None
