"""Makes the bundled DEMs and their manifest again: ``python -m dem_samples.make [FOLDER]``."""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj
import rasterio
from matplotlib.cbook import get_sample_data
from pyproj.crs import ProjectedCRS
from pyproj.crs.coordinate_operation import AzimuthalEquidistantConversion

from terrain import ElevationGrid, write_npz

__all__ = ["make_all"]

VOID = -32768
JACKSBORO_STEP_DEG = 3.0 / 3600.0

ABOUT: dict[str, dict[str, str]] = {
    "jacksboro": {
        "file": "jacksboro.tif",
        "title": "Jacksboro fault, Tennessee, USA",
        "kind": "real",
        "source": "NASA Shuttle Radar Topography Mission, 3 arc seconds; cut-out jacksboro_fault_dem.npz of "
        "matplotlib's sample data, its wrong southern bound put right",
        "licence": "public domain (US Government work)",
        "shows": "two mountain fronts with a valley between them: anchors over the ridge see little of the valley; "
        "degrees, pixel-is-point, warped to UTM on reading",
    },
    "valley": {
        "file": "valley.npz",
        "title": "A winding valley between two ridges",
        "kind": "synthetic",
        "source": "made by dem_samples/make.py",
        "licence": "CC0-1.0",
        "shows": "a river valley with spurs that hide its bends from one another; metric (UTM), nothing unknown",
    },
    "crater": {
        "file": "crater.tif",
        "title": "A crater on the Moon with an unmapped shadow",
        "kind": "synthetic",
        "source": "made by dem_samples/make.py",
        "licence": "CC0-1.0",
        "shows": "another body, cells that are not square, scaled integers, and unknown ground in the permanent shadow",
    },
}


def make_all(folder: Path) -> None:
    """Write the three DEMs and manifest.json into a folder."""
    shapes = {
        "jacksboro": make_jacksboro(folder / "jacksboro.tif"),
        "valley": make_valley(folder / "valley.npz"),
        "crater": make_crater(folder / "crater.tif"),
    }
    manifest: dict[str, dict[str, str | int]] = {}
    for name, (rows, cols) in shapes.items():
        sha256 = hashlib.sha256((folder / ABOUT[name]["file"]).read_bytes()).hexdigest()
        manifest[name] = {**ABOUT[name], "rows": rows, "cols": cols, "sha256": sha256}
    text = json.dumps(manifest, indent=2, ensure_ascii=False)
    (folder / "manifest.json").write_text(text + "\n", encoding="utf-8")


def make_jacksboro(path: Path) -> tuple[int, int]:
    """SRTM posts as int16 in EPSG:4326, pixel-is-point; (rows, cols).

    The npz gives cell edges (its width is columns × dx), half a cell outside posts that lie on whole 3 arc seconds as
    SRTM's do. Its row 0 is north and its ymax the northern edge; its ymin is wrong (one height of the DEM north of ymax
    instead of south). The ground itself says so: the highest post then falls on the summit of Cross Mountain,
    36.1983° N 84.2306° W, and La Follette, Caryville, Jacksboro and Rocky Top get their heights.
    """
    with np.load(get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)) as dem:
        heights, west, north = dem["elevation"], float(dem["xmin"]), float(dem["ymax"])
    transform = rasterio.Affine(JACKSBORO_STEP_DEG, 0.0, west, 0.0, -JACKSBORO_STEP_DEG, north)
    return _write_tif(path, heights, "EPSG:4326", transform, {"AREA_OR_POINT": "Point"})


def make_valley(path: Path) -> tuple[int, int]:
    """240 × 320 posts of 25 m in UTM zone 32N; (rows, cols)."""
    rows, cols, cell_m = 240, 320, 25.0
    east_m, south_m = np.meshgrid(np.arange(cols) * cell_m, np.arange(rows) * cell_m)
    river_m = 3000.0 + 700.0 * np.sin(east_m / 900.0)
    away_m = np.abs(south_m - river_m)
    flank_m = 650.0 * (1.0 - np.exp(-((away_m / 1100.0) ** 2)))
    spurs_m = 90.0 * np.sin(east_m / 350.0 + south_m / 700.0) * np.clip(away_m / 1500.0, 0.0, 1.0)
    # half metres: coarse enough to pack well and to come out the same on every machine
    heights_m = np.round(2.0 * (420.0 + flank_m + spurs_m - 0.004 * east_m)) / 2.0
    grid = ElevationGrid(
        heights_m.astype(np.float32), cell_m, cell_m, 644_000.0, 5_140_000.0,
        crs=pyproj.CRS.from_epsg(32632), vertical_datum="made up",
    )  # fmt: skip
    write_npz(grid, path)
    return rows, cols


def make_crater(path: Path) -> tuple[int, int]:
    """200 × 240 posts of 25 m east × 30 m north about the crater's middle, near the Moon's south pole; (rows, cols)."""
    rows, cols, cell_east_m, cell_north_m = 200, 240, 25.0, 30.0
    east_m, north_m = np.meshgrid(
        (np.arange(cols) - (cols - 1) / 2.0) * cell_east_m, ((rows - 1) / 2.0 - np.arange(rows)) * cell_north_m
    )
    radius_m = np.hypot(east_m, north_m)
    inside_m = -480.0 + 600.0 * np.minimum(radius_m / 1800.0, 1.0) ** 2
    outside_m = 120.0 * np.exp(-np.maximum(radius_m - 1800.0, 0.0) / 500.0)
    peak_m = 180.0 * np.exp(-((radius_m / 250.0) ** 2))
    waves_m = 6.0 * np.sin(east_m / 170.0) * np.cos(north_m / 210.0)
    decimetres = np.round(10.0 * (np.where(radius_m < 1800.0, inside_m, outside_m) + peak_m + waves_m)).astype(np.int16)
    shadow = np.hypot(east_m / 420.0, (north_m - 900.0) / 240.0) < 1.0
    decimetres[shadow] = VOID
    transform = rasterio.Affine(
        cell_east_m, 0.0, -cols / 2.0 * cell_east_m, 0.0, -cell_north_m, rows / 2.0 * cell_north_m
    )
    around = AzimuthalEquidistantConversion(latitude_natural_origin=-85.0, longitude_natural_origin=30.0)
    moon = ProjectedCRS(around, name="Moon 2000 / azimuthal equidistant", geodetic_crs="ESRI:104903")
    return _write_tif(path, decimetres, moon.to_wkt(), transform, {"AREA_OR_POINT": "Area"}, scale=0.1)


def _write_tif(
    path: Path,
    values: npt.NDArray[np.int16],
    crs: str,
    transform: Any,
    tags: dict[str, str],
    *,
    scale: float = 1.0,
) -> tuple[int, int]:
    rows, cols = values.shape
    with rasterio.open(
        path, "w", driver="GTiff", height=rows, width=cols, count=1, dtype="int16", crs=crs, transform=transform,
        nodata=VOID, compress="deflate", predictor=2, zlevel=9, tiled=False,
    ) as dataset:  # fmt: skip
        dataset.update_tags(**tags)
        dataset.units = ("m",)
        if scale != 1.0:
            dataset.scales = (scale,)
        dataset.write(values, 1)
    return rows, cols


if __name__ == "__main__":
    make_all(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
