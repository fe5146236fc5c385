"""Layers: tiles whose posts lie on one lattice, so that they are one DEM that was cut, and reading a part of one."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyproj

from ..datums.references import VerticalDatum
from ..files.raw import PostWindow
from ..files.reading import read_part
from ..files.warping import Posts
from ..units import degrees_per_unit
from .levelling import Step, levelled
from .tile import Tile, as_indexed

__all__ = ["CONTRADICTION_M", "Layer", "Part", "layers_of", "read_layer"]

# two heights of one place that differ by more are not of one ground
CONTRADICTION_M = 100.0
# posts of two tiles that are closer than this share of a cell are one post: files round their corners
SAME_POST = 1e-3


@dataclass(frozen=True, slots=True)
class Layer:
    """Tiles on one lattice, by name; the first that knows a post gives its height.

    at: (row, col) of each tile's north-west post in the lattice, whose post (0, 0) lies at x0, y0 (units of the CRS).
    cell_m: metres of ground that a cell covers, on average over the tiles.
    """

    tiles: tuple[Tile, ...]
    at: tuple[tuple[int, int], ...]
    x0: float
    y0: float
    step_x: float
    step_y: float
    rows: int
    cols: int
    cell_m: float

    @property
    def crs(self) -> pyproj.CRS:
        """The CRS of the lattice."""
        return self.tiles[0].crs

    @property
    def name(self) -> str:
        """What to call it in sentences."""
        return self.tiles[0].name if len(self.tiles) == 1 else f"{self.tiles[0].name} and {len(self.tiles) - 1} more"

    @property
    def from_grid(self) -> bool:
        """Whether every tile was written from a grid, whose CRS stays as it is."""
        return all(tile.from_grid for tile in self.tiles)

    def window_around(self, bounds: tuple[float, float, float, float], more: int = 0) -> PostWindow | None:
        """The posts that enclose (west, south, east, north), CRS units, and ``more`` around; None beside it."""
        west, south, east, north = bounds
        slack = 1e-6
        first_row = max(math.floor((self.y0 - north) / self.step_y + slack) - more, 0)
        last_row = min(math.ceil((self.y0 - south) / self.step_y - slack) + more, self.rows - 1)
        first_col = max(math.floor((west - self.x0) / self.step_x + slack) - more, 0)
        last_col = min(math.ceil((east - self.x0) / self.step_x - slack) + more, self.cols - 1)
        if first_row > last_row or first_col > last_col:
            return None
        return PostWindow(first_row, last_row, first_col, last_col)


@dataclass(slots=True)
class Part:
    """Heights of some posts of a layer, and what there is to tell about them.

    covered: (rows, cols) which posts lie in some tile. differing: posts that two tiles give other heights, by how much
    at most; contradictions: those more than CONTRADICTION_M apart, the first of them by (x, y). filled: voids of one
    tile that the next filled. conversions, warnings, datums: of reading, with the number of tiles. steps: what was
    added to the heights of tiles that counted from elsewhere, by that datum's name.
    """

    posts: Posts
    covered: npt.NDArray[np.bool_]
    differing: int = 0
    largest_m: float = 0.0
    contradictions: int = 0
    contradiction_at: tuple[float, float] | None = None
    filled: int = 0
    conversions: Counter[str] = field(default_factory=Counter)
    warnings: Counter[str] = field(default_factory=Counter)
    datums: Counter[str | None] = field(default_factory=Counter)
    steps: dict[str, Step] = field(default_factory=dict)


def layers_of(tiles: Sequence[Tile], near_lon_deg: float) -> tuple[Layer, ...]:
    """The tiles as layers, finest first; of equally fine ones the first by name.

    near_lon_deg: where to: tiles in degrees on both sides of the antimeridian lie side by side there.
    """
    groups: list[list[Tile]] = []
    for tile in sorted((_turned(tile, near_lon_deg) for tile in tiles), key=lambda tile: (tile.name, tile.path)):
        for group in groups:
            if _on_one_lattice(group[0], tile):
                group.append(tile)
                break
        else:
            groups.append([tile])
    return tuple(sorted(map(_layer, groups), key=lambda layer: (layer.cell_m, layer.name)))


def read_layer(
    layer: Layer,
    window: PostWindow,
    *,
    max_cells: int,
    datum: VerticalDatum | None = None,
    progress: Callable[[float], None] | None = None,
) -> Part:
    """Read a window of a layer out of its tiles, with heights above ``datum`` where tiles tell theirs.

    Raises DemReadError, GroundChangedError, VerticalDatumError.
    """
    heights_m = np.full(window.shape, np.nan, np.float32)
    posts = Posts(
        heights_m,
        layer.x0 + window.first_col * layer.step_x,
        layer.y0 - window.first_row * layer.step_y,
        layer.step_x, layer.step_y, layer.crs,
    )  # fmt: skip
    part = Part(posts, np.zeros(window.shape, np.bool_))
    for number, (tile, at) in enumerate(zip(layer.tiles, layer.at, strict=True)):
        _read_tile_into(part, tile, at, window, max_cells, datum)
        if progress is not None:
            progress((number + 1) / len(layer.tiles))
    return part


def _read_tile_into(
    part: Part, tile: Tile, at: tuple[int, int], window: PostWindow, max_cells: int, wanted: VerticalDatum | None
) -> None:
    row, col = at
    mine = PostWindow(
        max(window.first_row - row, 0), min(window.last_row - row, tile.rows - 1),
        max(window.first_col - col, 0), min(window.last_col - col, tile.cols - 1),
    )  # fmt: skip
    if mine.first_row > mine.last_row or mine.first_col > mine.last_col:
        return
    with as_indexed(tile):
        raw, heights, heights_m, warnings = read_part(
            Path(tile.path), tile.driver, mine, max_cells=max_cells, level=tile.level
        )
    heights_m, datum, step, told = levelled(tile, mine, heights_m, heights.vertical_datum, wanted)
    part.datums[datum] += 1
    part.warnings.update(told)
    if step is not None:
        name = str(heights.vertical_datum)
        part.steps[name] = step.with_more(part.steps[name]) if name in part.steps else step
    part.conversions.update((*raw.conversions, *heights.conversions))
    part.warnings.update(warnings)
    top, left = row + mine.first_row - window.first_row, col + mine.first_col - window.first_col
    here = np.s_[top : top + mine.shape[0], left : left + mine.shape[1]]
    there, covered = part.posts.heights_m[here], part.covered[here]
    if covered.any():
        _compare(part, there, heights_m, top, left)
        new = np.isnan(there) & ~np.isnan(heights_m)
        part.filled += int(np.count_nonzero(new & covered))
        there[new] = heights_m[new]
    else:
        there[...] = heights_m
    covered[...] = True


def _compare(
    part: Part, there_m: npt.NDArray[np.float32], heights_m: npt.NDArray[np.float32], top: int, left: int
) -> None:
    """Note where two tiles know one post and do not agree."""
    apart_m = np.abs(there_m - heights_m)
    differing = apart_m > 0.0  # not where one is unknown
    if not differing.any():
        return
    part.differing += int(np.count_nonzero(differing))
    part.largest_m = max(part.largest_m, float(apart_m[differing].max()))
    contradicting = apart_m > CONTRADICTION_M
    count = int(np.count_nonzero(contradicting))
    part.contradictions += count
    if count and part.contradiction_at is None:
        row, col = np.argwhere(contradicting)[0]
        posts = part.posts
        part.contradiction_at = posts.x0 + (left + col) * posts.step_x, posts.y0 - (top + row) * posts.step_y


def _turned(tile: Tile, near_lon_deg: float) -> Tile:
    """A tile in degrees, turned round the planet to where the others are."""
    if not tile.crs.is_geographic:
        return tile
    per_unit = degrees_per_unit(tile.crs)
    middle_deg = (tile.x0 + (tile.cols - 1) / 2.0 * tile.step_x) * per_unit
    turns = round((near_lon_deg - middle_deg) / 360.0)
    return tile if turns == 0 else replace(tile, x0=tile.x0 + turns * 360.0 / per_unit)


def _on_one_lattice(one: Tile, other: Tile) -> bool:
    if one.crs_text != other.crs_text:
        return False
    for step, other_step, posts, apart in (
        (one.step_x, other.step_x, max(one.cols, other.cols), other.x0 - one.x0),
        (one.step_y, other.step_y, max(one.rows, other.rows), one.y0 - other.y0),
    ):
        if abs(step - other_step) * posts > SAME_POST * step:
            return False
        if abs(apart / step - round(apart / step)) > SAME_POST:
            return False
    return True


def _layer(group: list[Tile]) -> Layer:
    first = group[0]
    rows = [round((first.y0 - tile.y0) / first.step_y) for tile in group]
    cols = [round((tile.x0 - first.x0) / first.step_x) for tile in group]
    top, left = min(rows), min(cols)
    # the corner as the tile that has it states it, without the rounding of a step
    x0 = next(tile.x0 for tile, col in zip(group, cols, strict=True) if col == left)
    y0 = next(tile.y0 for tile, row in zip(group, rows, strict=True) if row == top)
    return Layer(
        tuple(group),
        tuple((row - top, col - left) for row, col in zip(rows, cols, strict=True)),
        x0, y0, first.step_x, first.step_y,
        rows=max(row + tile.rows for row, tile in zip(rows, group, strict=True)) - top,
        cols=max(col + tile.cols for col, tile in zip(cols, group, strict=True)) - left,
        cell_m=sum(tile.cell_m for tile in group) / len(group),
    )  # fmt: skip
