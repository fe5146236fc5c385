"""A DEM for whoever draws maps: heights at resolution levels, its CRS in words of others, its bounds in degrees.

Each level halves the rows and columns of the one before, as means of what is known.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj
from pydantic import BaseModel, Field, JsonValue

from terrain import ElevationGrid, FrameError, to_lon_lat

__all__ = ["LevelOut", "Levels", "at_level", "levels_of", "place_of", "write_level"]

# the coarsest level has no side longer than this
COARSEST_POSTS = 256
POSTS_AT_ONCE = 16_000_000
BORDER_POINTS = 65


class LevelOut(BaseModel):
    """One level: a (rows, cols) array of float32, little-endian, rows from the north, NaN where nothing is known."""

    level: int = Field(description="Its number; 0 holds the posts themselves.")
    rows: int = Field(description="Rows, north to south.")
    cols: int = Field(description="Columns, west to east.")
    cell_east_m: float = Field(description="Distance of neighbours from west to east, metres.")
    cell_north_m: float = Field(description="Distance of neighbours from north to south, metres.")
    origin_east_m: float = Field(description="East of the centre of the north-west value, metres.")
    origin_north_m: float = Field(description="North of the centre of the north-west value, metres.")
    bytes: int = Field(description="Size of the array, bytes.")
    href: str = Field(description="Path of the array.")


class Levels(BaseModel):
    """All levels of a DEM, finest first."""

    levels: list[LevelOut] = Field(description="The levels; each value is the mean of the known posts under it.")


def levels_of(dem_id: str, summary: Mapping[str, Any]) -> Levels:
    """The levels of a DEM, from what the store keeps of it."""
    rows, cols = int(summary["rows"]), int(summary["cols"])
    east_m, north_m = float(summary["cell_east_m"]), float(summary["cell_north_m"])
    bounds = summary["bounds_of_posts_m"]
    levels = list[LevelOut]()
    while not levels or max(levels[-1].rows, levels[-1].cols) > COARSEST_POSTS:
        level = len(levels)
        posts = 2**level
        at_rows, at_cols = -(-rows // posts), -(-cols // posts)
        levels.append(
            LevelOut(
                level=level,
                rows=at_rows,
                cols=at_cols,
                cell_east_m=posts * east_m,
                cell_north_m=posts * north_m,
                origin_east_m=bounds["west"] + (posts - 1) / 2.0 * east_m,
                origin_north_m=bounds["north"] - (posts - 1) / 2.0 * north_m,
                bytes=4 * at_rows * at_cols,
                href=f"/dems/{dem_id}/heights?level={level}",
            )
        )
    return Levels(levels=levels)


def write_level(grid: ElevationGrid, level: int, path: Path) -> None:
    """Write the heights of a level, some rows at a time. Raises OSError."""
    posts = 2**level
    at_once = max(1, POSTS_AT_ONCE // (grid.cols * posts)) * posts
    with path.open("wb") as file:
        for first in range(0, grid.rows, at_once):
            file.write(_means(grid.heights_m[first : first + at_once], posts).astype("<f4").tobytes())


def at_level(grid: ElevationGrid, level: int) -> ElevationGrid:
    """The grid whose posts are the values of a level, its trees likewise; the same grid at level 0."""
    if level == 0:
        return grid
    posts = 2**level
    trees = grid.trees
    if trees is not None:
        trees = trees.over_posts(lambda values: _means(values, posts))
        # where a part of them is unknown the two are means of different posts
        top_m, base_m = trees.top_m, trees.base_m
        trees = replace(trees, base_m=np.fmin(base_m, np.where(top_m > 0.0, top_m, base_m)))
    return replace(
        grid,
        heights_m=_means(grid.heights_m, posts),
        trees=trees,
        cell_east_m=posts * grid.cell_east_m,
        cell_north_m=posts * grid.cell_north_m,
        origin_east_m=grid.origin_east_m + (posts - 1) / 2.0 * grid.cell_east_m,
        origin_north_m=grid.origin_north_m - (posts - 1) / 2.0 * grid.cell_north_m,
    )


def _means(heights_m: npt.NDArray[np.float32], posts: int) -> npt.NDArray[np.float32]:
    """Means of the known heights of each posts × posts square; NaN where none is known."""
    if posts == 1:
        return heights_m
    rows, cols = heights_m.shape
    padded = np.pad(heights_m, ((0, -rows % posts), (0, -cols % posts)), constant_values=np.nan)
    squares = padded.reshape(padded.shape[0] // posts, posts, padded.shape[1] // posts, posts)
    known = ~np.isnan(squares)
    number = np.count_nonzero(known, axis=(1, 3))
    total_m = np.where(known, squares, np.float32(0.0)).sum(axis=(1, 3), dtype=np.float64)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(number > 0, total_m / np.maximum(number, 1), np.nan), np.float32)


def place_of(grid: ElevationGrid) -> dict[str, JsonValue]:
    """crs_wkt, crs_proj and bounds_deg of a DEM, ready for JSON."""
    return {
        "crs_wkt": None if grid.crs is None else grid.crs.to_wkt("WKT2_2019"),
        "crs_proj": None if grid.crs is None else _proj_string(grid.crs),
        "bounds_deg": _bounds_deg(grid),
    }


def _proj_string(crs: pyproj.CRS) -> str | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that it says less than WKT, which is given as well
        return str(crs.to_proj4()) or None


def _bounds_deg(grid: ElevationGrid) -> dict[str, JsonValue] | None:
    if grid.crs is None:
        return None
    west, south, east, north = grid.bounds_m
    x, y = np.linspace(west, east, BORDER_POINTS), np.linspace(south, north, BORDER_POINTS)
    ring_x = np.concatenate([x, np.full_like(y, east), x[::-1], np.full_like(y, west)])
    ring_y = np.concatenate([np.full_like(x, south), y, np.full_like(x, north), y[::-1]])
    try:
        lon, lat = to_lon_lat(grid, ring_x, ring_y)
    except FrameError:
        return None  # a border where the CRS is not defined has no degrees
    lon = np.unwrap(lon, period=360.0)
    if abs(lon[-1] - lon[0]) > 180.0:  # round a pole
        pole = 90.0 if lat.mean() > 0.0 else -90.0
        south, north = min(float(lat.min()), pole), max(float(lat.max()), pole)
        return {"west": -180.0, "south": south, "east": 180.0, "north": north}
    lon -= 360.0 * np.floor((lon.min() + 180.0) / 360.0)
    return {"west": float(lon.min()), "south": float(lat.min()), "east": float(lon.max()), "north": float(lat.max())}
