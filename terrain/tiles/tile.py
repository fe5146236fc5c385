"""A tile: a DEM file known by its header alone, where it lies and how fine it is."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import pyproj
import shapely

from ..crs.frames import body_of
from ..crs.texts import parse_crs
from ..errors import DemUnsupportedError
from ..files.arrays import npz_head
from ..files.formats import local_file, sniff_format, unchanged
from ..files.overviews import POSTS, cell_of, level_for, levels_of_file, to_degrees
from ..files.raster import read_raster_head
from ..files.raw import RawHead

__all__ = ["Tile", "as_indexed", "coarser_tile", "read_tile", "to_degrees"]

# points along each border: meridians bend on maps
BORDER_POINTS = 9


@dataclass(frozen=True)
class Tile:
    """What the header of a DEM file says.

    x0, y0: centre of post (0, 0), row 0 northmost; step_x > 0 eastward and step_y > 0 southward, in units of the CRS.
    cell_m: the ground that one cell covers at the middle, metres (geometric mean of both directions).
    outline_deg: corners (lon, lat) of its outermost cells, longitudes running on over the antimeridian.
    size_bytes, modified_ns: of the file when its header was read. from_grid: written by ``write_npz``.
    level: 0 where its posts are the file's own, from 1 on those of an overview in the file.
    """

    path: str
    size_bytes: int
    modified_ns: int
    driver: str
    rows: int
    cols: int
    x0: float
    y0: float
    step_x: float
    step_y: float
    crs_text: str
    vertical_datum: str | None
    from_grid: bool
    body: str
    cell_m: float
    outline_deg: tuple[tuple[float, float], ...]
    level: int = POSTS

    @property
    def name(self) -> str:
        """The file's name, without folders."""
        return Path(self.path).name

    @property
    def crs(self) -> pyproj.CRS:
        """The CRS of its posts."""
        return _crs(self.crs_text)

    @cached_property
    def outline(self) -> shapely.Polygon:
        """The outline in degrees."""
        return shapely.Polygon(self.outline_deg)

    @property
    def bounds_deg(self) -> tuple[float, float, float, float]:
        """(west, south, east, north) of the outline."""
        west, south, east, north = self.outline.bounds
        return float(west), float(south), float(east), float(north)


def read_tile(path: str | Path) -> Tile:
    """The header of a DEM file; no height is read.

    Raises DemReadError: as ``read_dem`` for what is no DEM, DemUnsupportedError for one that tells no place.
    """
    file = local_file(path)
    found = file.stat()
    driver = sniff_format(file)
    if driver == "NPY":
        raise DemUnsupportedError(f"{file.name} holds heights alone, so nothing tells where it lies.")
    head = npz_head(file) if driver == "NPZ" else read_raster_head(file, driver)
    if head.crs is None or head.crs.is_engineering:
        raise DemUnsupportedError(f"{file.name} has no CRS, so nothing tells where it lies; write one into it.")
    crs = head.crs
    if not (crs.is_projected or crs.is_geographic):
        raise DemUnsupportedError(f"{file.name} has the CRS {crs.name!r}, which is neither projected nor geographic.")
    outline, cell_m = _placed(file.name, head, crs)
    return Tile(
        str(file), found.st_size, found.st_mtime_ns, driver, head.rows, head.cols,
        head.x0, head.y0, head.step_x, head.step_y,
        crs_text=_text_of(crs),
        vertical_datum=head.vertical_datum,
        from_grid=head.from_grid,
        body=body_of(crs).name,
        cell_m=cell_m,
        outline_deg=outline,
    )  # fmt: skip


def coarser_tile(tile: Tile, resolution_m: float | None) -> tuple[Tile, str | None]:
    """(the tile with the posts of the level of its file that a resolution means, what there is to tell about it).

    Raises DemReadError, GroundChangedError.
    """
    if resolution_m is None:
        return tile, None
    with as_indexed(tile):
        number, told = level_for(Path(tile.path), tile.driver, resolution_m)
        if number == POSTS:
            return tile, told
        level = levels_of_file(Path(tile.path), tile.driver)[number]
    step_x, step_y = tile.step_x * tile.cols / level.cols, tile.step_y * tile.rows / level.rows
    coarser = replace(
        tile, level=number, rows=level.rows, cols=level.cols, step_x=step_x, step_y=step_y, cell_m=level.cell_m,
        x0=tile.x0 + (step_x - tile.step_x) / 2.0, y0=tile.y0 - (step_y - tile.step_y) / 2.0,
    )  # fmt: skip
    return coarser, told


def as_indexed(tile: Tile) -> AbstractContextManager[None]:
    """Read a tile's file within: GroundChangedError where it is not the file that was indexed."""
    return unchanged(tile, since="it was indexed", then="index the library again (sightline ground add)")


def _placed(name: str, head: RawHead, crs: pyproj.CRS) -> tuple[tuple[tuple[float, float], ...], float]:
    """(outline in degrees, metres of ground that a cell covers). Raises DemUnsupportedError."""
    x = head.x0 + head.step_x * np.linspace(-0.5, head.cols - 0.5, BORDER_POINTS)
    y = head.y0 - head.step_y * np.linspace(-0.5, head.rows - 0.5, BORDER_POINTS)
    if crs.is_geographic:  # straight from post to post
        x, y = x[[0, -1]], y[[0, -1]]
    top, bottom = np.full_like(x, y[0]), np.full_like(x, y[-1])
    left, right = np.full_like(y, x[0]), np.full_like(y, x[-1])
    ring_x = np.concatenate([x[:-1], right[:-1], x[:0:-1], left[:0:-1]])
    ring_y = np.concatenate([top[:-1], y[:-1], bottom[:0:-1], y[:0:-1]])
    lon, lat = to_degrees(crs, ring_x, ring_y)
    if not (np.isfinite(lon).all() and np.isfinite(lat).all()):
        raise DemUnsupportedError(f"{name} does not lie where its CRS {crs.name!r} is defined.")
    lon = np.unwrap(lon, period=360.0)
    lon -= 360.0 * math.floor((float(lon.mean()) + 180.0) / 360.0)
    lat = np.clip(lat, -90.0, 90.0)
    return tuple((float(a), float(b)) for a, b in zip(lon, lat, strict=True)), cell_of(name, head, crs)


def _text_of(crs: pyproj.CRS) -> str:
    """The shortest text that means the same."""
    code = crs.to_epsg(min_confidence=100)
    return crs.to_wkt() if code is None or pyproj.CRS.from_epsg(code) != crs else f"EPSG:{code}"


@lru_cache(maxsize=256)
def _crs(text: str) -> pyproj.CRS:
    return parse_crs(text)
