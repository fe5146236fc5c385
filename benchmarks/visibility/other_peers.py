"""Viewsheds of others than GDAL, where they are installed: xarray-spatial in this process, GRASS in its own."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rasterio
import xarray
from rasterio.transform import Affine

from terrain import ElevationGrid

__all__ = ["GRASS", "Timed", "grass", "xarray_spatial"]

GRASS = "GRASS r.viewshed"
PROJECTED = "EPSG:32631"  # GRASS wants a location in metres; which one makes no difference to a flat viewshed
MEMORY_MB = 4000


@dataclass(frozen=True, slots=True)
class Timed:
    """How long a peer took for one viewshed, seconds; None where it could not run here, and why."""

    name: str
    seconds: float | None
    reason: str = ""


def xarray_spatial(grid: ElevationGrid, row: int, col: int, above_ground_m: float) -> Timed:
    """Of xarray-spatial's viewshed on the processor, the best of two; its first call, which compiles, apart."""
    name = "xarray-spatial viewshed"
    if importlib.util.find_spec("xrspatial") is None:
        return Timed(name, None, "not installed (pip install xarray-spatial)")
    from xrspatial import viewshed  # type: ignore[import-untyped, unused-ignore] # it ships no types

    def of(heights_m: np.ndarray) -> xarray.DataArray:
        north_m = -np.arange(heights_m.shape[0]) * grid.cell_north_m
        east_m = np.arange(heights_m.shape[1]) * grid.cell_east_m
        return xarray.DataArray(heights_m, dims=("y", "x"), coords={"y": north_m, "x": east_m})

    small, whole = of(grid.heights_m[:8, :8].astype(np.float64)), of(grid.heights_m.astype(np.float64))
    viewshed(small, x=0.0, y=0.0, observer_elev=above_ground_m)
    place = {"x": float(whole["x"][col]), "y": float(whole["y"][row])}
    return Timed(name, min(_seconds(lambda: viewshed(whole, **place, observer_elev=above_ground_m)) for _ in range(2)))


def grass(grid: ElevationGrid, row: int, col: int, above_ground_m: float) -> Timed:
    """Of GRASS r.viewshed, less what a GRASS session takes that does nothing."""
    program = shutil.which("grass")
    if program is None:
        return Timed(GRASS, None, "not installed (apt-get install grass-core)")
    with tempfile.TemporaryDirectory() as made:
        file, location = Path(made, "dem.tif"), Path(made, "location")
        rows, cols = grid.shape
        shape = {"height": rows, "width": cols, "count": 1, "dtype": "float32"}
        transform = Affine(grid.cell_east_m, 0.0, 0.0, 0.0, -grid.cell_north_m, rows * grid.cell_north_m)
        with rasterio.open(file, "w", driver="GTiff", crs=PROJECTED, transform=transform, **shape) as out:
            out.write(grid.heights_m, 1)

        def run(*arguments: str) -> None:
            done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
            if done.returncode:
                raise RuntimeError(f"grass {' '.join(arguments)} failed: {done.stderr.strip()[-400:]}")

        run("-c", str(file), "-e", str(location))
        mapset = str(location / "PERMANENT")
        run(mapset, "--exec", "r.in.gdal", f"input={file}", "output=dem", "--quiet")
        run(mapset, "--exec", "g.region", "raster=dem")
        east_m, north_m = (col + 0.5) * grid.cell_east_m, (rows - row - 0.5) * grid.cell_north_m
        question = ("r.viewshed", "input=dem", "output=seen", f"coordinates={east_m},{north_m}")
        heights = (f"observer_elevation={above_ground_m}", "target_elevation=0", f"memory={MEMORY_MB}", "--quiet")
        idle_s = _seconds(lambda: run(mapset, "--exec", "true"))
        return Timed(GRASS, max(_seconds(lambda: run(mapset, "--exec", *question, *heights)) - idle_s, 1e-9))


def _seconds(call: Callable[[], object]) -> float:
    begin_s = time.perf_counter()
    call()
    return time.perf_counter() - begin_s
