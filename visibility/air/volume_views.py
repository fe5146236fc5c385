"""A control volume for people and for other tools: sections through it, and all of it as a dataset of xarray."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from terrain import height_at
from visibility.air.control_volumes import (
    BLOCK_VOXELS,
    AltitudeLayers,
    ControlVolume,
    volume_blocks,
    volume_slab,
    whole_volume,
)
from visibility.dilution.dop_questions import set_words
from visibility.errors import VisibilityInputError

if TYPE_CHECKING:
    import xarray

__all__ = ["HorizontalSection", "VerticalSection", "horizontal_section", "vertical_section", "volume_dataset"]


@dataclass(frozen=True, eq=False)
class VerticalSection:
    """A cut along a line on the map; arrays (layers, samples), the first layer lowest.

    distance_m, east_m, north_m, ground_m: (samples,) along the line; the surface there, NaN = unknown.
    altitude_m: (layers, samples). count, unknown_count: anchors in sight, and those of which it is not known.
    dop: float32, +inf = no fix, NaN = unknown. below_ground: bool; nothing is in sight there.
    """

    distance_m: npt.NDArray[np.float64]
    east_m: npt.NDArray[np.float64]
    north_m: npt.NDArray[np.float64]
    ground_m: npt.NDArray[np.float32]
    altitude_m: npt.NDArray[np.float64]
    count: npt.NDArray[np.uint16]
    unknown_count: npt.NDArray[np.uint16]
    dop: npt.NDArray[np.float32]

    @property
    def below_ground(self) -> npt.NDArray[np.bool_]:
        """(layers, samples): below the surface."""
        below: npt.NDArray[np.bool_] = self.altitude_m < self.ground_m
        return below


@dataclass(frozen=True, eq=False)
class HorizontalSection:
    """A cut at one altitude, or one height above ground; arrays (rows, cols) of the volume, as in VerticalSection."""

    altitude_m: npt.NDArray[np.float64]
    count: npt.NDArray[np.uint16]
    unknown_count: npt.NDArray[np.uint16]
    dop: npt.NDArray[np.float32]


def vertical_section(
    volume: ControlVolume, points_m: npt.ArrayLike, *, spacing_m: float | None = None
) -> VerticalSection:
    """A vertical cut along a line of two or more points (n, 2), east and north, within the volume.

    spacing_m: between samples; None takes the smaller cell. Each sample is the column of the post nearest to it, since
    visible sets are known at posts; where that post's ground is the higher, its lowest air goes down to the surface.
    Raises VisibilityInputError.
    """
    grid = volume.grid
    corners_m = np.array(points_m, np.float64)
    if corners_m.ndim != 2 or corners_m.shape[1] != 2 or len(corners_m) < 2 or not np.isfinite(corners_m).all():
        raise VisibilityInputError(f"A section needs two or more points (east_m, north_m), not {corners_m.tolist()}.")
    outside = [corner for corner in corners_m.tolist() if not grid.contains(*corner)]
    if outside:
        raise VisibilityInputError(f"The section's point {tuple(outside[0])} lies outside the volume.")
    spacing_m = min(grid.cell_east_m, grid.cell_north_m) if spacing_m is None else spacing_m
    if not (math.isfinite(spacing_m) and spacing_m > 0.0):
        raise VisibilityInputError(f"spacing_m must be a number of metres > 0, not {spacing_m}.")
    lengths_m = np.hypot(*np.diff(corners_m, axis=0).T)
    ends_m = np.concatenate([[0.0], np.cumsum(lengths_m)])
    if ends_m[-1] == 0.0:
        raise VisibilityInputError("A section's points must not all be the same.")
    samples = max(math.ceil(ends_m[-1] / spacing_m), 1) + 1
    distance_m = np.linspace(0.0, ends_m[-1], samples)
    east_m = np.interp(distance_m, ends_m, corners_m[:, 0])
    north_m = np.interp(distance_m, ends_m, corners_m[:, 1])
    row = np.clip(np.rint((grid.origin_north_m - north_m) / grid.cell_north_m).astype(int), 0, grid.rows - 1)
    col = np.clip(np.rint((east_m - grid.origin_east_m) / grid.cell_east_m).astype(int), 0, grid.cols - 1)

    layers = len(volume.layers)
    count, unknown_count = np.zeros((layers, samples), np.uint16), np.zeros((layers, samples), np.uint16)
    dop = np.empty((layers, samples), np.float32)
    strip = replace(
        volume,
        first_row=volume.first_row + int(row.min()),
        last_row=volume.first_row + int(row.max()),
        first_col=volume.first_col + int(col.min()),
        last_col=volume.first_col + int(col.max()),
        middle_m=volume.middle_position_m,
    )
    for block in volume_blocks(strip):
        first = int(row.min()) + block.first_row
        here = np.flatnonzero((row >= first) & (row < first + block.dop.shape[1]))
        place = (slice(None), row[here] - first, col[here] - int(col.min()))
        count[:, here] = block.count[place]
        unknown_count[:, here] = block.unknown_count[place]
        dop[:, here] = block.dop[place]
    ground_m = np.asarray(height_at(grid, east_m, north_m), np.float32)
    if volume.layers.above_ground:
        altitude_m = volume.layers.altitudes_m[:, None] + ground_m.astype(np.float64)
        return VerticalSection(distance_m, east_m, north_m, ground_m, altitude_m, count, unknown_count, dop)
    altitude_m = np.repeat(volume.layers.altitudes_m[:, None], samples, axis=1)
    lowest = np.argmax(altitude_m >= grid.heights_m[row, col], axis=0)
    layer = np.maximum(np.arange(layers)[:, None], lowest)
    count, unknown_count, dop = (np.take_along_axis(values, layer, 0) for values in (count, unknown_count, dop))
    buried = altitude_m < ground_m
    count[buried], unknown_count[buried], dop[buried] = 0, 0, np.inf
    return VerticalSection(distance_m, east_m, north_m, ground_m, altitude_m, count, unknown_count, dop)


def horizontal_section(
    volume: ControlVolume, *, altitude_m: float | None = None, above_ground_m: float | None = None
) -> HorizontalSection:
    """A horizontal cut over the volume's posts at one altitude, or at one height above ground.

    Raises VisibilityInputError unless exactly one is given.
    """
    if (altitude_m is None) == (above_ground_m is None):
        raise VisibilityInputError("Give exactly one of altitude_m and above_ground_m for a horizontal section.")
    above_ground = above_ground_m is not None
    layer = AltitudeLayers(np.array([above_ground_m if above_ground else altitude_m], np.float64), above_ground)
    cut = whole_volume(replace(volume, layers=layer, middle_m=volume.middle_position_m))
    base_m = volume.grid.heights_m.astype(np.float64) if above_ground else np.zeros(volume.shape[1:])
    return HorizontalSection(base_m + layer.altitudes_m[0], cut.count[0], cut.unknown_count[0], cut.dop[0])


def volume_dataset(volume: ControlVolume, *, block_voxels: int = BLOCK_VOXELS) -> xarray.Dataset:
    """The volume with its coordinates; slabs of layers are calculated when they are asked for, and not kept.

    Variables over (layer, north, east): ``dop`` float32 (+inf = no fix, NaN = unknown), ``count`` and ``unknown_count``
    uint16, and over (..., word) ``seen`` and ``unknown`` uint64, bit a % 64 of word a // 64 being anchor a.
    Coordinates: ``layer`` (altitudes, or heights above ground), ``north``, ``east`` in metres; ``anchor`` lists the
    ids, ``ground`` (north, east) is the terrain, NaN = unknown. The CRS is WKT in ``spatial_ref``, as CF has it.
    block_voxels: about so many are in memory at once.
    """
    # half a second, which only those wait for who want it
    import dask
    import dask.array
    import xarray

    layers, rows, cols = volume.shape
    words = set_words(len(volume.surfaces.anchors))
    step = max(block_voxels // (rows * cols), 1)
    slabs = [
        (dask.delayed(volume_slab, pure=False)(volume, first, min(step, layers - first)), min(step, layers - first))
        for first in range(0, layers, step)
    ]

    def joined(name: str, dtype: npt.DTypeLike, *more: int) -> Any:
        parts = [
            dask.array.from_delayed(getattr(slab, name), (thick, rows, cols, *more), dtype) for slab, thick in slabs
        ]
        return dask.array.concatenate(parts)

    grid = volume.grid
    voxel = ("layer", "north", "east")
    above = volume.layers.above_ground
    height = {"units": "m", "positive": "up", "long_name": "height above ground" if above else "altitude"}
    unit = {"units": "1", "grid_mapping": "spatial_ref"}
    return xarray.Dataset(
        {
            "dop": (voxel, joined("dop", np.float32), {**unit, "long_name": f"{volume.measure} of {volume.kind}"}),
            "count": (voxel, joined("count", np.uint16), {**unit, "long_name": "anchors surely in sight"}),
            "unknown_count": (voxel, joined("unknown_count", np.uint16), {**unit, "long_name": "anchors unknown"}),
            "seen": ((*voxel, "word"), joined("seen", np.uint64, words), {**unit, "long_name": "bit set: in sight"}),
            "unknown": (
                (*voxel, "word"),
                joined("unknown", np.uint64, words),
                {**unit, "long_name": "bit set: unknown"},
            ),
            "ground": (
                ("north", "east"),
                grid.heights_m,
                {"units": "m", "long_name": "altitude of the ground", "grid_mapping": "spatial_ref"},
            ),
            "spatial_ref": ((), np.int32(0), {} if grid.crs is None else {"crs_wkt": grid.crs.to_wkt()}),
        },
        {
            "layer": ("layer", volume.layers.altitudes_m, height),
            "north": ("north", _posts_m(grid.origin_north_m, -grid.cell_north_m, rows), _axis("y")),
            "east": ("east", _posts_m(grid.origin_east_m, grid.cell_east_m, cols), _axis("x")),
            "anchor": ("anchor", [anchor.id for anchor in volume.surfaces.anchors]),
        },
        {
            "kind": volume.kind,
            "dilution": volume.measure,
            "one_dop_per_set": int(volume.one_dop_per_set),
            "mode": volume.surfaces.mode,
            "error_statement": volume.surfaces.error_statement,
            "curvature": volume.surfaces.curvature.sentence(),
            "version": volume.surfaces.version,
        },
    )


def _posts_m(origin_m: float, step_m: float, posts: int) -> npt.NDArray[np.float64]:
    return origin_m + np.arange(posts, dtype=np.float64) * step_m


def _axis(letter: str) -> dict[str, str]:
    return {"units": "m", "axis": letter.upper(), "standard_name": f"projection_{letter}_coordinate"}
