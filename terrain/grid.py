"""The one ground type: a frozen, north-up grid of post heights in metres."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import numpy as np
import numpy.typing as npt
import pyproj

from .crs.parts import axes_fault
from .crs.texts import parse_crs
from .errors import ElevationGridError, FrameError
from .standing import Standing, Trees

__all__ = ["ElevationGrid", "Provenance", "RasterFile"]

Numbers = npt.NDArray[np.integer[Any]] | npt.NDArray[np.floating[Any]]
Reals = npt.NDArray[np.float64]

# posts closer than this lie on one another in UTM coordinates; no planet has room for two that are further apart
SMALLEST_CELL_M, LARGEST_CELL_M = 1e-6, 1e8


@dataclass(frozen=True, slots=True)
class RasterFile:
    """A raster in metres whose posts are those of its file.

    path: absolute; size_bytes and modified_ns: of the file when it was opened. rows, cols, cell_east_m, cell_north_m,
    origin_east_m, origin_north_m, crs, vertical_datum: as those of an ElevationGrid of the whole. nodata, height_unit:
    as ``read_dem`` takes them, wanted_datum: the vertical datum that it was asked for.
    """

    path: str
    driver: str
    size_bytes: int
    modified_ns: int
    rows: int
    cols: int
    cell_east_m: float
    cell_north_m: float
    origin_east_m: float
    origin_north_m: float
    crs: pyproj.CRS | None
    vertical_datum: str | None
    nodata: float | None = None
    height_unit: str | None = None
    wanted_datum: str | None = None

    @property
    def name(self) -> str:
        """The file's name, without folders."""
        return Path(self.path).name


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a grid came from: source, driver, what was converted on the way, and every warning, as sentences.

    overview_of: the raster whose posts are finer, where the grid was made of one to be read by windows.
    """

    source: str = ""
    driver: str = ""
    conversions: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    overview_of: RasterFile | None = None


@dataclass(frozen=True, eq=False)
class ElevationGrid:
    """Post heights of a piece of ground.

    Posts are cell centres. Row 0 is northmost, column 0 westmost; ``origin_east_m, origin_north_m`` is the post
    (row 0, col 0). The surface is the triangulation that cuts each square of four posts by the diagonal from
    (row, col) to (row + 1, col + 1). A single row or column of posts is a line of ground, level across it,
    with nothing beside it.

    heights_m: (rows, cols) float32, metres above ``vertical_datum``; NaN = unknown ground. Read-only.
    cell_east_m, cell_north_m: distance between neighbouring posts, metres, > 0; they may differ.
    crs: metric CRS of the east/north axes (anything pyproj understands), or None for a local metric frame.
    standing: buildings, which hide wherever sight is asked for; heights_m remain those of the ground.
    trees: canopy over the same posts, which weakens signals.
    Raises ElevationGridError.
    """

    heights_m: npt.NDArray[np.float32]
    cell_east_m: float
    cell_north_m: float
    origin_east_m: float = 0.0
    origin_north_m: float = 0.0
    crs: pyproj.CRS | None = None
    vertical_datum: str | None = None
    provenance: Provenance = field(default_factory=Provenance)
    standing: Standing | None = None
    trees: Trees | None = None

    def __post_init__(self) -> None:
        heights_m = np.asarray(self.heights_m)
        if heights_m.ndim != 2 or heights_m.size == 0:
            raise ElevationGridError(f"heights_m must be a (rows, cols) array with posts in it, not {heights_m.shape}.")
        if heights_m.dtype.kind not in "fiu":
            raise ElevationGridError(f"heights_m must hold numbers, not {heights_m.dtype}.")
        if heights_m.flags.writeable or heights_m.dtype != np.float32 or not heights_m.flags.c_contiguous:
            heights_m = np.array(heights_m, dtype=np.float32, order="C")
        extremes = float(heights_m.min()), float(heights_m.max())  # NaN where one post is
        infinite = 0 if all(map(math.isfinite, extremes)) else int(np.count_nonzero(np.isinf(heights_m)))
        if infinite:
            raise ElevationGridError(f"{infinite} heights are infinite; unknown ground is NaN.")
        heights_m.setflags(write=False)
        object.__setattr__(self, "heights_m", heights_m)
        for name in ("cell_east_m", "cell_north_m"):
            value = float(getattr(self, name))
            if not (math.isfinite(value) and value > 0.0):
                raise ElevationGridError(f"{name} must be a positive number of metres, not {value}.")
            if not SMALLEST_CELL_M <= value <= LARGEST_CELL_M:
                raise ElevationGridError(
                    f"{name} must lie between {SMALLEST_CELL_M:g} and {LARGEST_CELL_M:g} m, not be {value:g} m."
                )
            object.__setattr__(self, name, value)
        if self.trees is not None and self.trees.top_m.shape != heights_m.shape:
            raise ElevationGridError(f"Trees over {self.trees.top_m.shape} posts do not fit {heights_m.shape}.")
        for name in ("origin_east_m", "origin_north_m"):
            value = float(getattr(self, name))
            if not math.isfinite(value):
                raise ElevationGridError(f"{name} must be a finite number of metres, not {value}.")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "crs", _as_metric_crs(self.crs))

    @property
    def rows(self) -> int:
        """Number of post rows, north to south."""
        return int(self.heights_m.shape[0])

    @property
    def cols(self) -> int:
        """Number of post columns, west to east."""
        return int(self.heights_m.shape[1])

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.rows, self.cols

    @cached_property
    def unknown_posts(self) -> int:
        """How many posts have unknown height."""
        return int(np.count_nonzero(np.isnan(self.heights_m))) if np.isnan(self.heights_m.min()) else 0

    @cached_property
    def digest(self) -> str:
        """SHA-256 of heights, geometry, CRS and what stands there: two grids with one digest give the same answers."""
        sha = hashlib.sha256()
        geometry = (self.shape, self.cell_east_m, self.cell_north_m, self.origin_east_m, self.origin_north_m)
        sha.update(repr(geometry).encode())
        sha.update((self.crs.to_wkt() if self.crs is not None else "local").encode())
        sha.update(self.heights_m.data)
        if self.standing is not None:
            sha.update(self.standing.digest.encode())
        if self.trees is not None:
            sha.update(self.trees.digest.encode())
        return sha.hexdigest()

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """(west, south, east, north) of the outermost posts, metres."""
        east_m = self.origin_east_m + (self.cols - 1) * self.cell_east_m
        south_m = self.origin_north_m - (self.rows - 1) * self.cell_north_m
        return self.origin_east_m, south_m, east_m, self.origin_north_m

    @overload
    def post_at(self, east_m: float, north_m: float) -> tuple[float, float]: ...

    @overload
    def post_at(self, east_m: Numbers, north_m: Numbers) -> tuple[Reals, Reals]: ...

    def post_at(self, east_m: Any, north_m: Any) -> tuple[Any, Any]:
        """Fractional (row, col) of a position, or of arrays of them; whole numbers are posts. Works outside too."""
        row = (self.origin_north_m - north_m) / self.cell_north_m
        col = (east_m - self.origin_east_m) / self.cell_east_m
        return row, col

    @overload
    def position_of(self, row: float, col: float) -> tuple[float, float]: ...

    @overload
    def position_of(self, row: Numbers, col: Numbers) -> tuple[Reals, Reals]: ...

    def position_of(self, row: Any, col: Any) -> tuple[Any, Any]:
        """(east_m, north_m) of a fractional post position, or of arrays of them: north of rows, east of columns."""
        return self.origin_east_m + col * self.cell_east_m, self.origin_north_m - row * self.cell_north_m

    def window(self, first_row: int, last_row: int, first_col: int, last_col: int) -> ElevationGrid:
        """The ground of some of the posts, ends included."""
        east_m, north_m = self.position_of(first_row, first_col)
        rows, cols = slice(first_row, last_row + 1), slice(first_col, last_col + 1)
        trees = None if self.trees is None else self.trees.window(rows, cols)
        heights_m = self.heights_m[rows, cols]
        return replace(self, heights_m=heights_m, origin_east_m=east_m, origin_north_m=north_m, trees=trees)

    def contains(self, east_m: float, north_m: float) -> bool:
        """Whether a position lies between the outermost posts (borders included)."""
        row, col = self.post_at(east_m, north_m)
        slack = 1e-6  # of a cell: the rounding of a border post's own position does not put it outside
        return -slack <= row <= self.rows - 1 + slack and -slack <= col <= self.cols - 1 + slack


def _as_metric_crs(crs: Any) -> pyproj.CRS | None:
    if crs is None:
        return None
    try:
        parsed = parse_crs(crs)
    except FrameError as error:
        raise ElevationGridError(str(error)) from error
    if not parsed.is_projected:
        raise ElevationGridError(
            f"The CRS {parsed.name!r} is not projected; a grid needs metres east and north. "
            "Map files in degrees are warped when they are read; arrays of heights are not."
        )
    fault = axes_fault(parsed)
    if fault is not None:
        raise ElevationGridError(fault)
    if parsed.axis_info[0].unit_conversion_factor != 1.0:
        raise ElevationGridError(
            f"The axes of {parsed.name!r} are in {parsed.axis_info[0].unit_name}; a grid needs metres east and north."
        )
    return parsed
