"""Heights at resolution levels: each halves the rows and columns of the one before, as means of what is known."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from terrain import ElevationGrid

__all__ = ["LevelOut", "Levels", "levels_of", "write_level"]

# the coarsest level has no side longer than this
COARSEST_POSTS = 256
POSTS_AT_ONCE = 16_000_000


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
