"""Places in degrees agree with GDAL's, whatever datum, axes, prime meridian or angular unit the file's CRS has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import rasterio
import rasterio.warp

from terrain import ElevationGrid, ElevationGridError, height_at, read_dem, to_grid_frame, write_npz
from tests.terrain.files import hill, sentences, write_asc, write_tif

SHIFT = "+towgs84=577.326,90.129,463.919,5.137,1.474,5.297,2.4232"
MGI = f"+proj=tmerc +lat_0=0 +lon_0=13.3333333333333 +k=1 +x_0=0 +y_0=-5000000 +ellps=bessel {SHIFT} +units=m +no_defs"


def plane() -> np.ndarray:
    """Heights that tell both directions, and stay what they are when they are resampled."""
    row, col = np.mgrid[0:30, 0:40]
    return (1000.0 + 7.0 * row + 3.0 * col).astype("f4")


def dem_at(folder: Path, crs: Any, lon_deg: float, lat_deg: float, cell: float = 10.0) -> tuple[Path, float, float]:
    """A file around a place as GDAL puts it, and the place of its post (11, 13) in degrees of WGS 84."""
    crs = rasterio.crs.CRS.from_user_input(crs)
    (x,), (y,) = rasterio.warp.transform("EPSG:4326", crs, [lon_deg], [lat_deg])
    transform = rasterio.Affine(cell, 0, x, 0, -cell, y)
    path = write_tif(folder / "dem.tif", plane(), crs=crs, transform=transform)
    with rasterio.open(path) as dataset:
        (lon,), (lat,) = rasterio.warp.transform(dataset.crs, "EPSG:4326", *([v] for v in dataset.xy(11, 13)))
    return path, lon, lat


@pytest.mark.parametrize(
    ("crs", "place", "cell"),
    [
        (MGI, (14.67, 47.37), 10.0),
        (MGI.replace("units=m", "units=us-ft"), (14.67, 47.37), 30.0),
        (f"+proj=longlat +ellps=bessel {SHIFT} +no_defs", (14.67, 47.37), 0.0002),
        (f"+proj=longlat +ellps=bessel {SHIFT} +no_defs", (14.67, 85.0), 0.0002),
        (f"+proj=merc +ellps=bessel {SHIFT} +units=m +no_defs", (14.67, 47.37), 10.0),
        (27700, (-0.1, 51.1), 10.0), (30166, (138.0, 35.0), 10.0), (23032, (9.0, 47.0), 10.0),
        (31467, (9.0, 48.0), 10.0),
        (27572, (2.5, 47.0), 10.0), (27563, (2.5, 44.0), 10.0), (4807, (2.5, 47.0), 0.0002), (3408, (10.0, 60.0), 10.0),
        (3413, (-45.0, 70.0), 10.0), (3995, (30.0, 71.0), 10.0), (32661, (20.0, 82.0), 10.0),
        (5041, (20.0, 82.0), 10.0),
        (3031, (20.0, -71.0), 10.0), (3976, (20.0, -71.0), 10.0), (32761, (20.0, -82.0), 10.0),
        (3571, (170.0, 75.0), 10.0),
        ("+proj=stere +lat_0=90 +lat_ts=70 +lon_0=-45 +datum=WGS84 +units=m", (-45.0, 70.0), 10.0),
        ("+proj=utm +zone=33 +datum=WGS84 +units=km", (15.0, 49.0), 0.01),
        ("+proj=utm +zone=33 +datum=WGS84 +to_meter=0.5", (15.0, 49.0), 10.0),
    ],
)  # fmt: skip
def test_a_post_stands_where_gdal_has_it(tmp_path: Path, crs: Any, place: tuple[float, float], cell: float) -> None:
    path, lon, lat = dem_at(tmp_path, crs, *place, cell)
    grid = read_dem(path)
    assert float(height_at(grid, *to_grid_frame(grid, lon, lat))) == pytest.approx(float(plane()[11, 13]), abs=0.05)
    write_npz(grid, tmp_path / "again.npz")
    again = read_dem(tmp_path / "again.npz")
    assert (again.digest, again.provenance.warnings) == (grid.digest, grid.provenance.warnings)
    assert again.crs == grid.crs


def test_a_stated_datum_shift_is_kept_and_told(tmp_path: Path) -> None:
    path, lon, lat = dem_at(tmp_path, MGI, 14.67, 47.37)
    grid = read_dem(path)
    assert grid.crs is not None
    assert grid.crs.is_bound
    assert "datum shift (TOWGS84) that the CRS states" in sentences(*grid.provenance.conversions)
    assert grid.provenance.warnings == ()
    without = read_dem(path, crs=MGI.replace(SHIFT, ""))
    metres = np.hypot(*np.subtract(to_grid_frame(without, lon, lat), to_grid_frame(grid, lon, lat)))
    assert 50.0 < metres < 150.0, "so much it matters"


def test_a_shift_that_says_what_proj_says_leaves_the_registered_crs(tmp_path: Path) -> None:
    crs = pyproj.CRS.from_wkt(
        pyproj.CRS("+proj=utm +zone=32 +ellps=GRS80 +towgs84=0,0,0 +type=crs").to_wkt()
    ).to_json_dict() | {"source_crs": pyproj.CRS(25832).to_json_dict()}
    path = write_tif(tmp_path / "dem.tif", hill(), crs="EPSG:25832")
    grid = read_dem(path, crs=crs)
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 25832


@pytest.mark.parametrize("ellipsoid", ["airy", "intl", "GRS80"])
def test_an_unknown_datum_is_told(tmp_path: Path, ellipsoid: str) -> None:
    crs = f"+proj=tmerc +lat_0=49 +lon_0=-2 +x_0=400000 +y_0=-100000 +ellps={ellipsoid} +units=m"
    transform = rasterio.Affine(10, 0, 532_000, 0, -10, 132_000)
    path = write_tif(tmp_path / "dem.tif", hill(), crs=crs, transform=transform)
    told = sentences(*read_dem(path).provenance.warnings)
    assert "lies to WGS 84 is not known" in told
    known = read_dem(path, crs=f"{crs} +towgs84=0,0,0")
    assert "is not known" not in sentences(*known.provenance.warnings)


@pytest.mark.parametrize("code", [27700, 23032, 26911, 3857, 2154, 2056, 32632])
def test_a_datum_that_proj_knows_needs_no_word(tmp_path: Path, code: int) -> None:
    place = {27700: (-0.1, 51.1), 26911: (-117.0, 34.0), 2154: (3.0, 47.0), 2056: (8.0, 47.0)}.get(code, (9.0, 47.0))
    assert read_dem(dem_at(tmp_path, code, *place)[0]).provenance.warnings == ()


def test_lambert_in_grads_from_paris_measures_truly_and_is_not_warped(tmp_path: Path) -> None:
    grid = read_dem(dem_at(tmp_path, 27572, 2.5, 47.0)[0])
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 27572
    assert grid.provenance.conversions == ()


@pytest.mark.parametrize(
    ("crs", "axes"),
    [
        ("EPSG:2053", "west and south"), ("EPSG:2048", "west and south"), ("EPSG:5513", "west and south"),
        ("+proj=tmerc +lon_0=29 +ellps=WGS84 +axis=wsu", "west and south"),
        ("+proj=utm +zone=33 +datum=WGS84 +axis=esu", "south and east"),
        ("+proj=utm +zone=33 +datum=WGS84 +axis=wnu", "west and north"),
    ],
)  # fmt: skip
def test_axes_that_run_otherwise_than_east_and_north_are_refused_everywhere(
    tmp_path: Path, crs: str, axes: str
) -> None:
    path = write_tif(tmp_path / "dem.tif", hill())
    for options in ({"crs": crs}, {"target_crs": crs}):
        with pytest.raises(Exception, match=f"run {axes}; warp the DEM"):
            read_dem(path, **options)
    with pytest.raises(ElevationGridError, match=f"run {axes}"):
        ElevationGrid(hill(), 1.0, 1.0, crs=crs)


def test_a_grid_in_feet_is_refused() -> None:
    with pytest.raises(ElevationGridError, match="are in US survey foot; a grid needs metres"):
        ElevationGrid(hill(), 1.0, 1.0, crs="EPSG:2229")


def ascii_at(folder: Path, heights: np.ndarray, west: float, south: float, cell: float) -> Path:
    path = write_asc(folder / "dem.asc", heights, cell=cell)
    text = path.read_text().replace("corner 100", f"corner {west}").replace("corner 200", f"corner {south}")
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("west", "south"),
    [(0.0, 50.0), (-0.0004166667, 50.0), (10.0, 0.0), (0.0, 0.0), (-0.0125, 50.0), (10.0, -0.01), (0.5, 50.0)],
)
def test_a_tile_in_degrees_may_lie_on_greenwich_or_the_equator(tmp_path: Path, west: float, south: float) -> None:
    grid = read_dem(ascii_at(tmp_path, hill(), west, south, 1 / 1200))
    assert grid.crs is not None
    assert grid.cell_north_m == pytest.approx(92.6, abs=0.6)
    assert "look like degrees" in sentences(*grid.provenance.warnings)


@pytest.mark.parametrize(("west", "south"), [(0.0, 0.0), (12.5, 3.25)])
def test_a_small_model_is_in_metres_where_its_heights_say_so(tmp_path: Path, west: float, south: float) -> None:
    grid = read_dem(ascii_at(tmp_path, hill() / 1000.0, west, south, 0.02))
    assert grid.crs is None
    assert grid.cell_east_m == pytest.approx(0.02)
    assert "no CRS" in sentences(*grid.provenance.warnings)


def test_level_ground_at_zero_that_may_be_either_is_asked_for(tmp_path: Path) -> None:
    path = ascii_at(tmp_path, np.full((12, 15), 3.0), 0.0, 50.0, 1 / 1200)
    with pytest.raises(Exception, match='may be degrees or metres; give crs="EPSG:4326"'):
        read_dem(path)
    assert read_dem(path, crs="EPSG:4326").crs is not None
    assert read_dem(path, crs="local").crs is None


def test_local_in_place_of_the_files_crs_is_told(tmp_path: Path) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill()), crs="local")
    assert "its numbers were taken as local metres" in sentences(*grid.provenance.warnings)
