"""The control volume Ω in layers: who is in sight in each voxel, how well it is positioned (De Vivo et al., II-C)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.air.kernels import volume as kernel
from visibility.dilution.dop_questions import MEASURES, DopKind, Measure, Sources, kind_code, set_words
from visibility.dilution.sets_in_sight import ColumnTables, column_tables
from visibility.errors import VisibilityInputError
from visibility.sight.minimum_altitude import MinimumVisibleAltitude

__all__ = [
    "AltitudeLayers",
    "ControlVolume",
    "VoxelBlock",
    "altitude_layers",
    "control_volume",
    "posts_within",
    "volume_blocks",
    "volume_slab",
    "volume_slabs",
    "whole_volume",
]

MOST_LAYERS = 100_000
BLOCK_VOXELS = 4_000_000
WHOLE_VOXELS = 200_000_000


@dataclass(frozen=True, eq=False)
class AltitudeLayers:
    """Layers of a control volume, from low to high.

    altitudes_m: (layers,) float64, ascending; altitudes, or heights above each post's ground if ``above_ground``.
    Raises VisibilityInputError.
    """

    altitudes_m: npt.NDArray[np.float64]
    above_ground: bool = False

    def __post_init__(self) -> None:
        altitudes_m = np.array(self.altitudes_m, np.float64)
        if altitudes_m.ndim != 1 or altitudes_m.size == 0:
            raise VisibilityInputError(f"Layers must be a list of altitudes, not of shape {altitudes_m.shape}.")
        if not np.isfinite(altitudes_m).all() or (np.diff(altitudes_m) <= 0.0).any():
            raise VisibilityInputError("Layer altitudes must be finite and ascend.")
        if self.above_ground and altitudes_m[0] < 0.0:
            raise VisibilityInputError(f"Layers above ground must be >= 0 m, not {altitudes_m[0]:g} m.")
        altitudes_m.setflags(write=False)
        object.__setattr__(self, "altitudes_m", altitudes_m)

    def __len__(self) -> int:
        return int(self.altitudes_m.size)


def altitude_layers(lowest_m: float, highest_m: float, step_m: float, *, above_ground: bool = False) -> AltitudeLayers:
    """Layers every ``step_m`` from lowest_m up to highest_m, which is one of them only where the steps end on it.

    Raises VisibilityInputError, also for more than MOST_LAYERS layers.
    """
    if not (math.isfinite(step_m) and step_m > 0.0):
        raise VisibilityInputError(f"step_m must be a number of metres > 0, not {step_m}.")
    if not (math.isfinite(lowest_m) and math.isfinite(highest_m) and lowest_m <= highest_m):
        raise VisibilityInputError(f"Layers must go from a low to a higher altitude, not {lowest_m} to {highest_m} m.")
    layers = math.floor((highest_m - lowest_m) / step_m * (1.0 + 1e-12)) + 1
    if layers > MOST_LAYERS:
        raise VisibilityInputError(
            f"{layers:,} layers every {step_m:g} m are more than the limit of {MOST_LAYERS:,}; take a larger step_m."
        )
    return AltitudeLayers(lowest_m + np.arange(layers, dtype=np.float64) * step_m, above_ground)


@dataclass(frozen=True, eq=False)
class ControlVolume:
    """A box of voxels over posts (first_row to last_row, first_col to last_col, both included) and altitude layers.

    one_dop_per_set: the shortcut of De Vivo et al. (II-C): dilutions are those in the middle of the volume, so that
        they depend on the visible set only.
    middle_m: (east, north, altitude) that this middle is; None = of this volume. Parts of a volume keep the whole's.
    """

    surfaces: MinimumVisibleAltitude
    layers: AltitudeLayers
    first_row: int
    last_row: int
    first_col: int
    last_col: int
    measure: Measure
    kind: DopKind
    one_dop_per_set: bool
    middle_m: tuple[float, float, float] | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """(layers, rows, cols)."""
        return len(self.layers), self.last_row - self.first_row + 1, self.last_col - self.first_col + 1

    @property
    def voxels(self) -> int:
        """Number of voxels."""
        layers, rows, cols = self.shape
        return layers * rows * cols

    @property
    def grid(self) -> ElevationGrid:
        """The ground of the volume's part of the map."""
        return self.surfaces.grid.window(self.first_row, self.last_row, self.first_col, self.last_col)

    @property
    def middle_position_m(self) -> tuple[float, float, float]:
        """(east, north, altitude) of the middle of the volume, or the one that it was given."""
        if self.middle_m is not None:
            return self.middle_m
        grid = self.grid
        altitude_m = float(self.layers.altitudes_m[[0, -1]].mean())
        if self.layers.above_ground and grid.unknown_posts < grid.rows * grid.cols:
            altitude_m += float(np.nanmean(grid.heights_m))
        return (*grid.position_of((grid.rows - 1) / 2.0, (grid.cols - 1) / 2.0), altitude_m)


@dataclass(frozen=True, eq=False)
class VoxelBlock:
    """Some layers over some rows of a control volume; arrays (layers, rows, cols).

    first_row, first_layer: of the block, counted in the volume. seen, unknown: (..., words) uint64, bit a % 64 of word
    a // 64 is anchor a: in sight for certain, and not known. Nothing is in sight below the ground.
    dop: float32; +inf = no fix, NaN = unknown.
    """

    first_row: int
    seen: npt.NDArray[np.uint64]
    unknown: npt.NDArray[np.uint64]
    dop: npt.NDArray[np.float32]
    first_layer: int = 0

    @property
    def count(self) -> npt.NDArray[np.uint16]:
        """How many anchors are in sight for certain."""
        count: npt.NDArray[np.uint16] = np.bitwise_count(self.seen).sum(axis=-1, dtype=np.uint16)
        return count

    @property
    def unknown_count(self) -> npt.NDArray[np.uint16]:
        """How many anchors may or may not be in sight."""
        count: npt.NDArray[np.uint16] = np.bitwise_count(self.unknown).sum(axis=-1, dtype=np.uint16)
        return count


def control_volume(
    surfaces: MinimumVisibleAltitude,
    layers: AltitudeLayers,
    *,
    bounds_m: tuple[float, float, float, float] | None = None,
    measure: Measure = "pdop",
    kind: DopKind = "ranging",
    one_dop_per_set: bool = False,
) -> ControlVolume:
    """The volume over the posts within bounds_m (west, south, east, north; None = all) and the layers.

    Nothing is calculated yet: see volume_blocks, whole_volume and the sections. Raises VisibilityInputError for bounds
    without posts, layers that all lie below the ground, or a kind or measure that does not exist.
    """
    kind_code(kind)
    if measure not in MEASURES:
        raise VisibilityInputError(f"measure must be one of {', '.join(MEASURES)}, not {measure!r}.")
    if measure == "tdop" and kind != "pseudorange":
        raise VisibilityInputError(f"tdop needs kind 'pseudorange'; {kind!r} solves for no clock.")
    posts = posts_within(surfaces.grid, bounds_m)
    heights_m = surfaces.grid.window(*posts).heights_m
    known = heights_m[~np.isnan(heights_m)]
    if not layers.above_ground and known.size and layers.altitudes_m[-1] < known.min():
        raise VisibilityInputError(
            f"The ceiling, the highest layer at {layers.altitudes_m[-1]:g} m, is below the ground, which begins at "
            f"{known.min():.1f} m; raise it."
        )
    return ControlVolume(surfaces, layers, *posts, measure, kind, one_dop_per_set)


def posts_within(
    grid: ElevationGrid, bounds_m: tuple[float, float, float, float] | None = None
) -> tuple[int, int, int, int]:
    """(first_row, last_row, first_col, last_col) of the posts within bounds_m, ends included; None = all.

    Raises VisibilityInputError where there are none.
    """
    rows, cols = (0, grid.rows - 1), (0, grid.cols - 1)
    if bounds_m is not None:
        west_m, south_m, east_m, north_m = bounds_m
        slack = 1e-6  # of a cell
        top, left = grid.post_at(west_m, north_m)
        bottom, right = grid.post_at(east_m, south_m)
        rows = _posts_between(top - slack, bottom + slack, grid.rows)
        cols = _posts_between(left - slack, right + slack, grid.cols)
        if rows[0] > rows[1] or cols[0] > cols[1]:
            raise VisibilityInputError(
                f"No post lies within west {west_m:g}, south {south_m:g}, east {east_m:g}, north {north_m:g} m; the "
                "DEM spans {:g}, {:g}, {:g}, {:g} m.".format(*grid.bounds_m)
            )
    return *rows, *cols


def _posts_between(low: float, high: float, posts: int) -> tuple[int, int]:
    if not (low <= posts and high >= -1.0):  # also NaN
        return 1, 0
    return max(int(np.ceil(low)), 0), min(int(np.floor(high)), posts - 1)


def volume_blocks(volume: ControlVolume, *, block_voxels: int = BLOCK_VOXELS) -> Iterator[VoxelBlock]:
    """The voxels of a volume in blocks of whole rows, from north to south; memory is bounded by one block.

    block_voxels: most voxels of a block, though a block has at least one row.
    """
    layers, rows, cols = volume.shape
    step = max(block_voxels // (layers * cols), 1)
    tables = column_tables(volume.surfaces)
    for first in range(0, rows, step):
        yield _block(volume, tables, first, min(step, rows - first))


def volume_slabs(
    volume: ControlVolume, *, block_voxels: int = BLOCK_VOXELS, sets_only: bool = False
) -> Iterator[VoxelBlock]:
    """The voxels of a volume in blocks of whole layers, from low to high, as files that go layer by layer want them.

    block_voxels: most voxels of a block, though a block has at least one layer. sets_only: leaves ``dop`` empty.
    """
    layers, rows, cols = volume.shape
    step = max(block_voxels // (rows * cols), 1)
    tables = column_tables(volume.surfaces)
    for first in range(0, layers, step):
        yield volume_slab(volume, first, min(step, layers - first), sets_only=sets_only, tables=tables)


def volume_slab(
    volume: ControlVolume, first_layer: int, layers: int, *, sets_only: bool = False, tables: ColumnTables | None = None
) -> VoxelBlock:
    """Some whole layers of a volume, counted from the lowest. tables: of its surfaces, where they are at hand."""
    altitudes_m = volume.layers.altitudes_m[first_layer : first_layer + layers]
    some = replace(volume, layers=replace(volume.layers, altitudes_m=altitudes_m), middle_m=volume.middle_position_m)
    tables = column_tables(volume.surfaces) if tables is None else tables
    return replace(_block(some, tables, 0, volume.shape[1], sets_only=sets_only), first_layer=first_layer)


def whole_volume(volume: ControlVolume, *, max_voxels: int = WHOLE_VOXELS) -> VoxelBlock:
    """All voxels at once; raises VisibilityInputError, with the numbers, where they are more than max_voxels."""
    if volume.voxels > max_voxels:
        layers, rows, cols = volume.shape
        gigabytes = volume.voxels * (4 + 16 * set_words(len(volume.surfaces.anchors))) / 1e9
        raise VisibilityInputError(
            f"The volume has {volume.voxels:,} voxels ({layers:,} layers × {rows:,} × {cols:,}), more than the limit "
            f"of {max_voxels:,}, and would take about {gigabytes:.3g} GB; take fewer layers, smaller bounds, or blocks."
        )
    return _block(volume, column_tables(volume.surfaces), 0, volume.shape[1])


def _block(
    volume: ControlVolume, tables: ColumnTables, first: int, rows: int, *, sets_only: bool = False
) -> VoxelBlock:
    layers, _, cols = volume.shape
    seen = np.empty((layers, rows, cols, set_words(len(volume.surfaces.anchors))), np.uint64)
    unknown, dop = np.empty_like(seen), np.empty((0 if sets_only else layers, rows, cols), np.float32)
    sources = _seen_from(volume.middle_position_m, tables.sources) if volume.one_dop_per_set else tables.sources
    kernel.volume_layers(
        tables.surfaces,
        tables.window(volume.surfaces.grid, volume.first_row + first, volume.first_col),
        kernel.Layers(volume.layers.altitudes_m, volume.layers.above_ground),
        tables.antennas,
        sources,
        kind_code(volume.kind),
        MEASURES[volume.measure],
        kernel.Voxels(seen, unknown, dop),
    )
    return VoxelBlock(first, seen, unknown, dop)


def _seen_from(position_m: tuple[float, float, float], sources: Sources) -> Sources:
    """Every anchor as a direction seen from a position."""
    anchors, distant, variances = sources
    away_m = np.where(distant[:, None], anchors, anchors - position_m)
    return Sources(away_m / np.linalg.norm(away_m, axis=1, keepdims=True), np.ones_like(distant), variances)
