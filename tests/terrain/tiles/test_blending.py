"""Tiles of several resolutions, CRSs and qualities in one grid: finest first, voids filled, what is wrong told."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import (
    Box,
    Circle,
    DemTooLargeError,
    DemUnsupportedError,
    ElevationGrid,
    GroundChangedError,
    NoGroundError,
    plan_mosaic,
    read_mosaic,
    read_tile,
)
from tests.terrain.files import hill, write_tif
from tests.terrain.tiles.cutting import cut_tif, rough

FINE = rasterio.Affine(10, 0, 500_200, 0, -10, 4_999_800)
COARSE = rasterio.Affine(30, 0, 500_000, 0, -30, 5_000_000)


def plane(rows: int, cols: int, transform: rasterio.Affine) -> np.ndarray:
    """Ground that rises 2 cm a metre eastward and falls 1 cm a metre northward, at the middle of each cell."""
    col, row = np.meshgrid(np.arange(cols) + 0.5, np.arange(rows) + 0.5)
    east = transform.a * col + transform.c - 500_000.0
    north = transform.e * row + transform.f - 5_000_000.0
    return (1000.0 + 0.02 * east - 0.01 * north).astype(np.float32)


def both(folder: Path, fine: np.ndarray | None = None, **profile: object) -> list[Path]:
    fine = plane(40, 50, FINE) if fine is None else fine
    return [
        write_tif(folder / "coarse.tif", plane(40, 40, COARSE), transform=COARSE, **profile),
        write_tif(folder / "fine.tif", fine, transform=FINE),
    ]


def told(grid: ElevationGrid) -> str:
    provenance = grid.provenance
    return " ".join((*provenance.conversions, *provenance.warnings))


def test_the_finest_gives_its_posts_and_the_coarser_all_others(tmp_path: Path) -> None:
    fine = plane(40, 50, FINE) + rough(40, 50) / 100.0
    grid = read_mosaic(both(tmp_path, fine))
    assert (grid.cell_east_m, grid.cell_north_m) == (10.0, 10.0)
    top, left = (round(float(at)) for at in grid.post_at(500_205.0, 4_999_795.0))
    np.testing.assert_array_equal(grid.heights_m[top : top + 40, left : left + 50], fine.astype(np.float32))
    rest = np.ones(grid.shape, np.bool_)
    rest[top - 1 : top + 41, left - 1 : left + 51] = False
    east, north = grid.position_of(*np.meshgrid(np.arange(grid.rows), np.arange(grid.cols), indexing="ij"))
    expected = 1000.0 + 0.02 * (east - 500_000.0) - 0.01 * (north - 5_000_000.0)
    np.testing.assert_allclose(grid.heights_m[rest], expected[rest], atol=1e-3)
    assert grid.unknown_posts == 0
    assert "Finest first" in told(grid)
    assert "fine.tif: 1 tile, cells of 10 m" in told(grid)


def test_voids_are_filled_from_the_next_and_counted(tmp_path: Path) -> None:
    fine = plane(40, 50, FINE)
    fine[10:15, 20:27] = np.nan
    grid = read_mosaic(both(tmp_path, fine))
    assert grid.unknown_posts == 0
    assert "35 posts that are void in finer tiles were filled from coarse.tif" in told(grid)


def test_voids_are_filled_between_tiles_of_one_lattice(tmp_path: Path) -> None:
    heights = plane(30, 30, FINE)
    holed = heights.copy()
    holed[5:9, 25:30] = np.nan
    tiles = [
        write_tif(tmp_path / "a.tif", holed, transform=FINE),
        write_tif(tmp_path / "b.tif", heights[:, 20:], transform=FINE @ rasterio.Affine.translation(20, 0)),
    ]
    grid = read_mosaic(tiles)
    np.testing.assert_array_equal(grid.heights_m, heights)
    assert "20 posts that are void in one tile were filled from the next" in told(grid)


def test_between_zones_there_is_no_gap(tmp_path: Path) -> None:
    # Copernicus: north of 50 degrees the cells are wider; the last post of one band is a cell off the first of the next
    second = 1.0 / 1200.0
    south = rasterio.Affine(second, 0, 10.0, 0, -second, 50.0 + second / 2)
    north = rasterio.Affine(1.5 * second, 0, 10.0, 0, -second, 50.0 + second / 2 + 60 * second)
    flat = np.full((60, 90), 300.0, np.float32)
    tiles = [
        write_tif(tmp_path / "south.tif", flat, transform=south, crs="EPSG:4326"),
        write_tif(tmp_path / "north.tif", flat[:, :60], transform=north, crs="EPSG:4326"),
    ]
    grid = read_mosaic(tiles, Box(10.02, 49.98, 10.05, 50.02))
    assert grid.unknown_posts == 0
    assert set(np.unique(grid.heights_m)) == {np.float32(300.0)}


def test_other_zones_lie_on_the_same_ground(tmp_path: Path) -> None:
    # level ground in two UTM zones, on both sides of 12 degrees east
    level = np.full((300, 300), 412.0, np.float32)
    west = write_tif(tmp_path / "32.tif", level, transform=rasterio.Affine(30, 0, 716_000, 0, -30, 5_320_000))
    east = write_tif(
        tmp_path / "33.tif", level, transform=rasterio.Affine(30, 0, 276_000, 0, -30, 5_320_000), crs="EPSG:32633"
    )
    grid = read_mosaic([west, east], Circle(12.0, 47.95, 3000.0))
    assert grid.crs is not None
    assert grid.crs.to_epsg() in (32632, 32633)
    assert grid.unknown_posts == 0
    np.testing.assert_allclose(grid.heights_m, 412.0, atol=1e-3)


def test_tiles_that_contradict_one_another_are_told(tmp_path: Path) -> None:
    fine = plane(40, 50, FINE)
    fine[20:, :] += 250.0
    grid = read_mosaic(both(tmp_path, fine))
    assert "coarse.tif contradicts finer tiles by more than 100 m at 1,000 posts" in told(grid)
    twice = [
        write_tif(tmp_path / "a.tif", fine, transform=FINE),
        write_tif(tmp_path / "b.tif", plane(40, 50, FINE), transform=FINE),
    ]
    same_lattice = read_mosaic(twice)
    assert "Two tiles contradict one another by more than 100 m at 1,000 posts" in told(same_lattice)
    np.testing.assert_array_equal(same_lattice.heights_m, fine, "the first by name is taken")


def test_heights_from_different_zeros_that_no_header_names_are_not_mixed(tmp_path: Path) -> None:
    sea = write_tif(tmp_path / "sea.tif", plane(40, 40, COARSE), transform=COARSE, units=["m above mean sea level"])
    ellipsoid = write_tif(tmp_path / "fine.tif", plane(40, 50, FINE), transform=FINE, units=["m above the ellipsoid"])
    with pytest.raises(DemUnsupportedError, match="count heights from different zeros"):
        read_mosaic([sea, ellipsoid])


def test_an_area_beside_all_tiles_says_what_is_near(tmp_path: Path) -> None:
    tile = write_tif(tmp_path / "N.tif", hill())
    with pytest.raises(NoGroundError, match=r"the nearest is N\.tif, \d+(\.\d+)? km to the east"):
        read_mosaic([tile], Circle(8.0, 45.15, 500.0))


def test_too_large_an_area_is_refused_with_numbers(tmp_path: Path) -> None:
    tile = write_tif(tmp_path / "big.tif", np.ones((2000, 2000), np.float32), compress="deflate")
    with pytest.raises(DemTooLargeError, match=r"4,000,000 cells \(2,000 × 2,000\), more than the limit of 1,000,000"):
        read_mosaic([tile], max_cells=1_000_000)


def test_coarser_posts_may_be_asked_for(tmp_path: Path) -> None:
    grid = read_mosaic([write_tif(tmp_path / "fine.tif", plane(40, 50, FINE), transform=FINE)], cell_m=25.0)
    assert (grid.cell_east_m, grid.cell_north_m) == (25.0, 25.0)
    east, north = grid.position_of(*np.meshgrid(np.arange(grid.rows), np.arange(grid.cols), indexing="ij"))
    np.testing.assert_allclose(
        grid.heights_m, 1000.0 + 0.02 * (east - 500_000.0) - 0.01 * (north - 5_000_000.0), atol=1e-3
    )


def test_a_tile_that_was_changed_since_is_not_read(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "a.tif", hill())
    tile = read_tile(path)
    os.utime(path, ns=(tile.modified_ns + 10**9, tile.modified_ns + 10**9))
    with pytest.raises(GroundChangedError, match=r"a\.tif was changed since it was indexed"):
        read_mosaic([tile])
    path.unlink()
    with pytest.raises(GroundChangedError, match=r"a\.tif is not there any more"):
        read_mosaic([tile])


def test_a_plan_tells_what_is_taken_and_why(tmp_path: Path) -> None:
    tiles = [read_tile(path) for path in both(tmp_path)]
    plan = plan_mosaic(tiles, Box(500_000.0, 4_999_000.0, 501_000.0, 5_000_000.0, frame="EPSG:32632"))
    assert [planned.layer.name for planned in plan.layers] == ["fine.tif", "coarse.tif"]
    fine, coarse = plan.layers
    assert fine.adds == pytest.approx(0.2, abs=1e-3)  # 400 m × 500 m of a square kilometre
    assert coarse.adds == pytest.approx(0.8, abs=1e-3)
    assert coarse.covers == pytest.approx(1.0, abs=1e-6)
    assert plan.uncovered == pytest.approx(0.0, abs=1e-6)


def test_over_the_antimeridian_tiles_lie_side_by_side(tmp_path: Path) -> None:
    degree = 1.0 / 120.0
    level = np.full((120, 120), 5.0, np.float32)
    west = write_tif(tmp_path / "w.tif", level, transform=rasterio.Affine(degree, 0, 179, 0, -degree, -16), crs=4326)
    east = write_tif(tmp_path / "e.tif", level, transform=rasterio.Affine(degree, 0, -180, 0, -degree, -16), crs=4326)
    grid = read_mosaic([west, east], Box(179.8, -16.6, -179.8, -16.4))
    assert grid.unknown_posts == 0
    assert grid.cols * grid.cell_east_m < 60_000.0


def test_corners_of_the_box_around_a_circle_come_from_their_own_tiles(tmp_path: Path) -> None:
    tiles = cut_tif(tmp_path / "cut", rough(100, 100), FINE, shared=False, pieces=2)
    # in the north-west tile, near the point where all four meet; the box around it has a corner in the fourth
    circle = Circle(500_200.0 + 460.0, 4_999_800.0 - 460.0, 55.0, frame="EPSG:32632")
    grid = read_mosaic(tiles, circle)
    assert grid.unknown_posts == 0
    beside = rasterio.Affine(1, 0, 500_712, 0, -1, 4_999_280)
    fine = write_tif(tmp_path / "lidar.tif", np.ones((30, 30), "f4"), transform=beside)
    assert read_mosaic([*tiles, fine], circle).cell_east_m == 10.0, "what lies beside the area does not set its cells"


def test_an_area_that_tiles_cover_in_part_is_told(tmp_path: Path) -> None:
    """The box reaches as far beyond the tile's eastern border as it lies within."""
    tile = write_tif(tmp_path / "fine.tif", plane(40, 50, FINE), transform=FINE)
    east_m, south_m, north_m = FINE.c + 50 * FINE.a, FINE.f + 35 * FINE.e, FINE.f + 5 * FINE.e
    beyond = read_mosaic([tile], Box(east_m - 300.0, south_m, east_m + 300.0, north_m, "EPSG:32632"))
    (share,) = (float(one.split(" % of the area")[0]) for one in beyond.provenance.warnings if " % of the area" in one)
    assert share == pytest.approx(50.0, abs=0.1)
    within = read_mosaic([tile], Box(east_m - 400.0, south_m, east_m - 100.0, north_m, "EPSG:32632"))
    assert within.provenance.warnings == ()
