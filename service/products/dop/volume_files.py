"""The control volume of a DOP map as files: arrays, GeoTIFFs with a band per layer, NetCDF. Written slab by slab."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dask
import numpy as np
import numpy.typing as npt
import rasterio

from service.errors import RequestError
from service.products.in_common import BYTES, FLOATS, add_array, common_tags, transform_of
from visibility.air import ControlVolume, VoxelBlock, volume_dataset, volume_slabs

from .calculate import FinishedDopMap
from .volumes import volume_of

__all__ = ["write_volume_arrays", "write_volume_count", "write_volume_dataset", "write_volume_dop"]

MOST_BANDS = 65_535  # of a TIFF
LIGHT = {"zlib": True, "complevel": 1}

Part = Callable[[VoxelBlock], npt.NDArray[Any]]


def write_volume_arrays(finished: FinishedDopMap, path: Path) -> None:
    """An .npz without pickles: visible sets, count and dilution over (layers, rows, cols), and what places them."""
    volume = volume_of(finished.surfaces(), finished.parameters)
    grid = volume.grid
    placing: dict[str, npt.NDArray[Any]] = {
        "heights_m": grid.heights_m,
        "layers_m": volume.layers.altitudes_m,
        "layers_above_ground": np.array(volume.layers.above_ground),
        "anchor_ids": np.array([anchor.id for anchor in finished.anchors]),
        "origin_m": np.array([grid.origin_east_m, grid.origin_north_m]),
        "cell_m": np.array([grid.cell_east_m, grid.cell_north_m]),
        "crs": np.array("" if grid.crs is None else grid.crs.to_wkt()),
    }
    parts: dict[str, Part] = {
        "dop": lambda slab: slab.dop,
        "count": lambda slab: slab.count,
        "seen": lambda slab: slab.seen,
        "unknown": lambda slab: slab.unknown,
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in placing.items():
            add_array(archive, name, array)
        for name, part in parts.items():
            _add_slabs(archive, name, volume, part, sets_only=name != "dop")


def write_volume_dop(finished: FinishedDopMap, path: Path) -> None:
    """float32, a band per layer: the dilution; NaN unknown (nodata), +inf no fix."""
    tags = {"units": "1", "infinity": "no fix", "measure": finished.parameters.measure}
    _write_bands(finished, path, lambda slab: slab.dop, np.float32, float("nan"), tags, FLOATS)


def write_volume_count(finished: FinishedDopMap, path: Path) -> None:
    """A band per layer: anchors surely in sight; the largest value (nodata) where that of some is unknown."""
    dtype = np.uint8 if len(finished.anchors) < 255 else np.uint16
    nodata = int(np.iinfo(dtype).max)

    def known(slab: VoxelBlock) -> npt.NDArray[Any]:
        return np.where(slab.unknown_count > 0, nodata, slab.count).astype(dtype)

    _write_bands(finished, path, known, dtype, nodata, {"units": "anchors"}, BYTES, sets_only=True)


def write_volume_dataset(finished: FinishedDopMap, path: Path) -> None:
    """NetCDF 4 of ``visibility.air.volume_dataset``."""
    dataset = volume_dataset(volume_of(finished.surfaces(), finished.parameters))
    voxels = [name for name, array in dataset.data_vars.items() if "layer" in array.dims]
    # one slab at a time: the kernels are parallel themselves, and memory is bounded
    with dask.config.set(scheduler="synchronous"):
        dataset.to_netcdf(path, engine="netcdf4", encoding=dict.fromkeys(voxels, LIGHT))


def _add_slabs(archive: zipfile.ZipFile, name: str, volume: ControlVolume, part: Part, *, sets_only: bool) -> None:
    """One array of an .npz, its layers as they are calculated."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        for slab in volume_slabs(volume, sets_only=sets_only):
            array = part(slab)
            if slab.first_layer == 0:
                described = np.lib.format.header_data_from_array_1_0(array)
                shape = (len(volume.layers), *array.shape[1:])
                np.lib.format.write_array_header_1_0(member, {**described, "shape": shape, "fortran_order": False})
            member.write(np.ascontiguousarray(array).tobytes())


def _write_bands(
    finished: FinishedDopMap,
    path: Path,
    part: Part,
    dtype: npt.DTypeLike,
    nodata: float,
    tags: dict[str, str],
    compression: dict[str, str],
    *,
    sets_only: bool = False,
) -> None:
    volume = volume_of(finished.surfaces(), finished.parameters)
    layers, rows, cols = volume.shape
    if layers > MOST_BANDS:
        raise RequestError(f"{layers:,} layers are more than the {MOST_BANDS:,} bands that a GeoTIFF holds.")
    grid = volume.grid
    profile = {
        "driver": "GTiff",
        "height": rows,
        "width": cols,
        "count": layers,
        "dtype": dtype,
        "nodata": nodata,
        "crs": None if grid.crs is None else rasterio.crs.CRS.from_wkt(grid.crs.to_wkt()),
        "transform": transform_of(grid),
        "interleave": "band",
        "bigtiff": "IF_SAFER",
        "compress": compression["compress"],
    }
    height = "above ground" if volume.layers.above_ground else "altitude"
    with rasterio.open(path, "w", **profile) as dataset:
        for slab in volume_slabs(volume, sets_only=sets_only):
            bands = range(slab.first_layer + 1, slab.first_layer + slab.seen.shape[0] + 1)
            dataset.write(part(slab), list(bands))
            for number in bands:
                dataset.set_band_description(number, f"{height} {volume.layers.altitudes_m[number - 1]:g} m")
        common = common_tags(finished.grid, finished.answer, "sightline control volume")
        dataset.update_tags(**common, kind=finished.parameters.kind, **tags)
