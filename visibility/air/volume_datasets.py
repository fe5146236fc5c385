"""A control volume as an xarray dataset, for people who work there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from visibility.air.control_volumes import BLOCK_VOXELS, ControlVolume, volume_slab
from visibility.dilution.dop_questions import set_words

if TYPE_CHECKING:
    import xarray

__all__ = ["volume_dataset"]


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
