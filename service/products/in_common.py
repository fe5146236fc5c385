"""What files of products that lie on a grid have in common: rasters, arrays, pictures."""

from __future__ import annotations

import importlib
import math
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
import rasterio
from rasterio.transform import Affine

from service.estimates import Demand, signals_over
from service.parts.anchors import SightParameters
from service.parts.map_facts import MapSummary
from terrain import ElevationGrid

__all__ = [
    "BYTES",
    "FLOATS",
    "QUANTILES",
    "Drawn",
    "Later",
    "Raster",
    "add_array",
    "common_tags",
    "signals_demand",
    "transform_of",
    "write_cog",
]

# A download waits for the writer: 1024² posts and 4 anchors take 0.03 s as bytes and 0.1 s as floats with these,
# against 0.3 s with DEFLATE floats. Nearest-neighbour overviews keep classes classes and infinities apart.
BYTES = {"compress": "DEFLATE", "level": "1"}
FLOATS = {"compress": "ZSTD", "level": "1"}
QUANTILES = {"p05": 0.05, "p50": 0.5, "p95": 0.95}


def write_cog(
    path: Path,
    grid: ElevationGrid,
    bands: Iterable[npt.NDArray[Any]],
    descriptions: list[str],
    nodata: float | None,
    tags: dict[str, str],
    compression: dict[str, str],
) -> None:
    """Write bands (rows, cols), each with its description; float bands whose tags say metres get that unit."""
    bands = list(bands)
    profile = {
        "driver": "COG",
        "height": grid.rows,
        "width": grid.cols,
        "count": len(bands),
        "dtype": bands[0].dtype,
        "nodata": nodata,
        "crs": None if grid.crs is None else rasterio.crs.CRS.from_wkt(grid.crs.to_wkt()),
        "transform": transform_of(grid),
        "overview_resampling": "NEAREST",
        "bigtiff": "IF_SAFER",
        **compression,
    }
    with rasterio.open(path, "w", **profile) as dataset:
        for number, (band, description) in enumerate(zip(bands, descriptions, strict=True), start=1):
            dataset.write(band, number)
            dataset.set_band_description(number, description)
            if tags["units"] == "metre":
                dataset.set_band_unit(number, "metre")
        dataset.update_tags(**tags)


def transform_of(grid: ElevationGrid) -> Affine:
    """Pixel corners to metres: posts are cell centres, so the corner of the first cell is half a cell out."""
    west_m = grid.origin_east_m - 0.5 * grid.cell_east_m
    north_m = grid.origin_north_m + 0.5 * grid.cell_north_m
    return Affine(grid.cell_east_m, 0.0, west_m, 0.0, -grid.cell_north_m, north_m)


def common_tags(grid: ElevationGrid, answer: MapSummary, product: str) -> dict[str, str]:
    """What every raster of a map says about where it came from."""
    return {
        "product": product,
        "version": answer.version,
        "mode": answer.mode,
        "error_statement": answer.error_statement,
        "curvature": answer.curvature,
        "dem_sha256": grid.digest,
    }


def add_array(archive: zipfile.ZipFile, name: str, array: npt.NDArray[Any]) -> None:
    """One array of an .npz."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)


class OnAGrid(Protocol):
    """A finished product that lies on a grid."""

    @property
    def grid(self) -> ElevationGrid:
        """The ground it lies on."""
        ...


Finished = TypeVar("Finished", bound=OnAGrid)


@dataclass(frozen=True, slots=True)
class Raster(Generic[Finished]):
    """A layer's writer: bands over the grid's posts as a GeoTIFF, each (rows, cols), with their names.

    tags: what is told about them besides the unit. nodata: NaN for floats, a value of whole numbers, None where every
    value says something. infinity: what +inf means.
    """

    tags: Callable[[Finished], dict[str, str]]
    bands: Callable[[Finished], Iterable[npt.NDArray[Any]]]
    names: Callable[[Finished], list[str]]
    units: str
    nodata: float | None = math.nan
    infinity: str | None = None

    def __call__(self, finished: Finished, path: Path) -> None:
        """Write it."""
        tags = {**self.tags(finished), "units": self.units}
        if self.infinity is not None:
            tags["infinity"] = self.infinity
        compression = FLOATS if self.nodata is not None and math.isnan(self.nodata) else BYTES
        bands, names = self.bands(finished), self.names(finished)
        write_cog(path, finished.grid, bands, names, self.nodata, tags, compression)


@dataclass(frozen=True, slots=True)
class Later:
    """A layer's writer in a module that only a process that draws loads: matplotlib and dask take a second each.

    place: ``package.module:function``, called with what is finished, the path, and ``more``.
    """

    place: str
    more: Mapping[str, object] = field(default_factory=dict)

    def function(self) -> Any:
        """What stands there."""
        module, _, name = self.place.partition(":")
        return getattr(importlib.import_module(module), name)

    def __call__(self, finished: object, path: Path) -> None:
        """Write it."""
        self.function()(finished, path, **self.more)


class Drawn(Later):
    """The same of a picture: the function makes the figure, without a path."""

    def __call__(self, finished: object, path: Path) -> None:
        """Write it as PNG."""
        sheet = importlib.import_module("service.drawing.sheet")
        sheet.save_png(self.function()(finished, **self.more), path)


def signals_demand(
    grid: ElevationGrid, parameters: SightParameters, sources: int | None = None, *, one_height: bool = False
) -> tuple[Demand, ...]:
    """What it takes that a request asks for what is usable; nothing where it asks for sight.

    sources: how many maps; left out = one of each anchor. one_height: as in ``signals_over``.
    """
    if not parameters.usable:
        return ()
    trees = parameters.cover is not None and parameters.cover.canopy is not None
    sources = len(parameters.anchors) if sources is None else sources
    return (signals_over(grid.heights_m.size, sources, trees, one_height=one_height),)
