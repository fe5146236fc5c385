"""Sightline's own .npz gives the same grid back, and numpy files made by others are read with care."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest

from terrain import DemUnsupportedError, ElevationGrid, Provenance, read_dem, write_npz
from tests.terrain.files import hill


def voided() -> np.ndarray:
    heights = hill()
    heights[2, 2] = np.nan
    heights[3, 3] = -9999.0  # kept as a height on purpose by whoever wrote the grid
    return heights


@pytest.mark.parametrize("crs", [None, pyproj.CRS.from_epsg(32632), pyproj.CRS.from_user_input("ESRI:103885")])
def test_writing_and_reading_changes_nothing(tmp_path: Path, crs: pyproj.CRS | None) -> None:
    told = Provenance("a.tif", "GTiff", ("Heights converted.",), ("2 posts are odd.",))
    grid = ElevationGrid(voided(), 10.0, 12.5, 1e5 + 1 / 3, 5e6, crs, "EGM96 geoid", told)
    write_npz(grid, tmp_path / "dem.npz")
    again = read_dem(tmp_path / "dem.npz")
    assert again.digest == grid.digest
    assert again.vertical_datum == "EGM96 geoid"
    assert again.provenance.conversions == told.conversions
    assert set(told.warnings) <= set(again.provenance.warnings)
    assert (again.provenance.source, again.provenance.driver) == ("dem.npz", "NPZ")


def test_the_same_grid_is_written_as_the_same_bytes(tmp_path: Path) -> None:
    grid = ElevationGrid(hill(), 10.0, 10.0)
    write_npz(grid, tmp_path / "a.npz")
    write_npz(read_dem(tmp_path / "a.npz"), tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_heights_and_cell_sizes_are_enough(tmp_path: Path) -> None:
    heights = hill()
    heights[0, 0] = -9999.0
    np.savez(tmp_path / "dem.npz", heights_m=heights, cell_east_m=2.0, cell_north_m=3.0)
    grid = read_dem(tmp_path / "dem.npz")
    assert (grid.cell_east_m, grid.cell_north_m, grid.position_of(0, 0)) == (2.0, 3.0, (0.0, 0.0))
    assert grid.unknown_posts == 1, "others' files are searched for fill values"
    np.savez(tmp_path / "bare.npz", heights_m=hill())
    with pytest.raises(DemUnsupportedError, match="lacks cell_east_m and cell_north_m"):
        read_dem(tmp_path / "bare.npz")


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<i2", ">i2", "<f8", "|u1"])
def test_bare_heights_are_read_with_the_cell_size_given(tmp_path: Path, dtype: str, order: str) -> None:
    heights = np.array(hill() / 4, dtype=dtype, order=order)
    np.save(tmp_path / "dem.npy", heights)
    grid = read_dem(tmp_path / "dem.npy", cell_m=(2.0, 3.0), crs="EPSG:32632")
    np.testing.assert_array_equal(grid.heights_m, heights.astype("f4"))
    assert (grid.cell_east_m, grid.cell_north_m) == (2.0, 3.0)


@pytest.mark.parametrize("shape", [(0, 4), (4,), (2, 3, 4)])
def test_other_shapes_are_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    np.save(tmp_path / "dem.npy", np.zeros(shape))
    with pytest.raises(DemUnsupportedError, match="must hold a \\(rows, cols\\) array of real heights"):
        read_dem(tmp_path / "dem.npy", cell_m=1.0)


def test_half_precision_heights_are_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "dem.npz", heights_m=hill().astype("f2"), cell_east_m=2.0, cell_north_m=3.0)
    np.testing.assert_array_equal(read_dem(tmp_path / "dem.npz").heights_m, hill().astype("f2").astype("f4"))
