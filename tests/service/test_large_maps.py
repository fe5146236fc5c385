"""Maps by windows say, post for post, what maps in memory say of the ground in reach."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import shapely

from service.errors import LimitError, RequestError
from service.products import Work
from service.products.visibility.calculate import calculate_visibility_map
from service.products.windows import WINDOW_MAP
from service.products.windows.answer import AnchorInReach
from service.products.windows.calculate import make_large_map
from service.products.windows.files import COUNT, LOWEST
from service.products.windows.ground import posts_asked_about
from service.settings import Settings
from terrain import AreaError, DemUnsupportedError, GroundChangedError, LargeDem, open_dem, read_dem
from terrain.files import large_dem
from tests.service.large_dems import NORTH_M, WEST_M, anchors, hills_m, parameters, write_cog
from visibility import Anchor, AntennaLimits, min_visible_altitude
from visibility.sight.in_reach import ReachOptions, in_reach, reach_of


@pytest.fixture(scope="module")
def cog(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_cog(tmp_path_factory.mktemp("large") / "hills.tif", hills_m())


def bands(path: Path, dem: LargeDem) -> list[Any]:
    """The bands of a file, laid upon all posts of the DEM."""
    with rasterio.open(path) as file:
        row, col = dem.post_at(file.transform.c + dem.cell_east_m / 2.0, file.transform.f - dem.cell_north_m / 2.0)
        assert (row, col) == (round(row), round(col))
        assert file.transform.a == dem.cell_east_m
        whole = []
        for number in file.indexes:
            band = np.full(dem.shape, file.nodata, file.dtypes[number - 1])
            band[round(row) : round(row) + file.height, round(col) : round(col) + file.width] = file.read(number)
            whole.append(band)
        return whole


@pytest.fixture(scope="module")
def in_memory(cog: Path) -> Any:
    return calculate_visibility_map(read_dem(cog), parameters(mode="exact"))


def test_windows_are_the_whole_read_in_parts(cog: Path) -> None:
    whole, dem = read_dem(cog), open_dem(cog)
    assert dem.shape == whole.shape
    assert dem.bounds_m == whole.bounds_m
    part, same = dem.window(330, 470, 390, 611), whole.window(330, 470, 390, 611)
    assert np.array_equal(part.heights_m, same.heights_m, equal_nan=True)
    assert (part.bounds_m, part.cell_east_m, part.crs) == (same.bounds_m, same.cell_east_m, same.crs)
    assert np.isnan(part.heights_m).any()


def test_exact_maps_are_equal_to_those_in_memory(cog: Path, in_memory: Any, tmp_path: Path) -> None:
    shares: list[float] = []
    answer = make_large_map(open_dem(cog), parameters(mode="exact"), tmp_path, Work(progress=shares.append))
    dem = open_dem(cog)
    visible, unknown = bands(tmp_path / COUNT, dem)
    (lowest_m,) = bands(tmp_path / LOWEST, dem)
    within = np.array([posts_asked_about(dem, one, None, (0, dem.rows), (0, dem.cols)) for one in in_memory.anchors])
    reach = within.any(axis=0)
    known = reach & ~np.isnan(in_memory.grid.heights_m)
    # what is beyond a range is hidden here, and unknown in memory where unknown ground lies between
    sure = known & (in_memory.unknown_count == 0)
    assert np.array_equal(visible[sure], in_memory.count[sure])
    assert np.array_equal(unknown[sure], in_memory.unknown_count[sure])
    expected_m = np.fmin.reduce(np.where(within, in_memory.altitude_m, np.float32(np.nan)), axis=0)
    assert np.array_equal(lowest_m, expected_m, equal_nan=True)
    assert (visible[~reach] == 255).all()
    assert (unknown[~reach] == 255).all()
    assert np.isnan(lowest_m[~reach]).all()
    assert 0 < sure.sum() < known.sum() < reach.sum() < visible.size
    assert {path.name for path in tmp_path.iterdir()} == {COUNT, LOWEST}
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert answer.posts_in_reach == sum(anchor.posts_in_reach for anchor in answer.anchors)


@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_an_anchor_has_the_answer_of_the_ground_in_its_reach(cog: Path, in_memory: Any, mode: Any) -> None:
    dem, whole = open_dem(cog), read_dem(cog)
    for anchor in in_memory.anchors:
        reach = reach_of(dem, anchor)
        found = in_reach(dem, anchor, reach, ReachOptions(1.5, None, mode))
        ground = whole.window(reach.first_row, reach.last_row, reach.first_col, reach.last_col)
        expected = min_visible_altitude(ground, [anchor], mode)
        assert np.array_equal(found.altitude_m, expected.altitude_m[0], equal_nan=True)
        assert np.array_equal(found.seen, expected.visible(above_ground_m=1.5)[0])


def test_fast_maps_differ_from_the_whole_by_no_more_than_they_say(cog: Path, in_memory: Any, tmp_path: Path) -> None:
    make_large_map(open_dem(cog), parameters(mode="fast"), tmp_path)
    visible, unknown = bands(tmp_path / COUNT, open_dem(cog))
    sure = (visible != 255) & (unknown == 0) & (in_memory.unknown_count == 0)
    assert np.count_nonzero(visible[sure] != in_memory.count[sure]) / sure.sum() < 0.01


def test_the_files_are_cogs_with_overviews(cog: Path, tmp_path: Path) -> None:
    make_large_map(open_dem(cog), parameters(), tmp_path)
    for name in (COUNT, LOWEST):
        with rasterio.open(tmp_path / name) as file, rasterio.open(cog) as ground:
            assert file.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
            assert file.overviews(1)
            assert file.block_shapes[0] == (512, 512)
            assert file.crs == ground.crs
            assert file.width < ground.width


def test_a_range_limit_is_needed_and_the_estimate_says_why(cog: Path, tmp_path: Path) -> None:
    unlimited = [{key: value for key, value in one.items() if key != "max_range_m"} for one in anchors()]
    with pytest.raises(RequestError, match=r"A has no range limit, so all 1,440,000 posts of hills.tif .* GB"):
        make_large_map(open_dem(cog), parameters(unlimited), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_more_memory_than_is_allowed_is_refused_with_numbers(cog: Path, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match=r"anchor B has \d\d\d,\d\d\d posts, .*more than the limit of 0.0 GB"):
        make_large_map(open_dem(cog), parameters(), tmp_path, memory_limit_bytes=1_000_000)


def test_what_takes_longer_than_a_job_may_is_refused_before_it_is_one(cog: Path) -> None:
    asked = WINDOW_MAP.parameters.model_validate({"anchors": anchors()})
    with pytest.raises(LimitError, match=r"posts in reach of 4 anchors would take .*, more than the limit of 0.001 s"):
        WINDOW_MAP.refuse(open_dem(cog).frame(), asked, Settings(max_job_s=0.001))


def test_within_an_area_the_map_is_that_of_the_whole(cog: Path, tmp_path: Path) -> None:
    dem, ring = open_dem(cog), [(1200.0, 1100.0), (2900.0, 1300.0), (1900.0, 2300.0)]
    corners = [{"east_m": WEST_M + east_m, "north_m": NORTH_M - south_m} for east_m, south_m in ring]
    for name, changes in (("whole", {}), ("part", {"area": {"ring": corners}})):
        (tmp_path / name).mkdir()
        answer = make_large_map(dem, parameters(**changes), tmp_path / name)
    posts = np.meshgrid(np.arange(dem.rows), np.arange(dem.cols), indexing="ij")
    inside = shapely.intersects_xy(
        shapely.Polygon([tuple(corner.values()) for corner in corners]),
        dem.origin_east_m + posts[1] * dem.cell_east_m,
        dem.origin_north_m - posts[0] * dem.cell_north_m,
    )
    for file in (COUNT, LOWEST):
        with rasterio.open(tmp_path / "part" / file) as part:
            assert (part.height, part.width) == (241, 341)
        for of_part, of_whole in zip(*(bands(tmp_path / name / file, dem) for name in ("part", "whole")), strict=True):
            assert np.array_equal(of_part[inside], of_whole[inside], equal_nan=True)
            nothing = np.full_like(of_part, np.nan if of_part.dtype == np.float32 else 255)
            assert np.array_equal(of_part[~inside], nothing[~inside], equal_nan=True)
    counted = sum(
        np.count_nonzero(posts_asked_about(dem, resolve, None, (0, dem.rows), (0, dem.cols)) & inside)
        for resolve in (_anchor(one) for one in answer.anchors[:2])
    )
    assert answer.posts_in_reach == counted > 0
    assert "No post of the area lies in the reach of C, D." in answer.warnings
    far = {"west_m": WEST_M + 5500.0, "south_m": NORTH_M - 600.0, "east_m": WEST_M + 5900.0, "north_m": NORTH_M}
    with pytest.raises(AreaError, match=r"No post of hills\.tif in the area lies in any anchor's reach"):
        make_large_map(dem, parameters(area=far), tmp_path)


def _anchor(told: AnchorInReach) -> Anchor:
    limits = AntennaLimits(max_range_m=told.max_range_m)
    return Anchor(told.id, told.east_m, told.north_m, told.altitude_m, limits=limits)


def test_anchors_beside_the_ground_are_told_or_refused(cog: Path, tmp_path: Path) -> None:
    far = {"id": "far", "east_m": WEST_M - 9000.0, "north_m": NORTH_M, "altitude_m": 900.0, "max_range_m": 500.0}
    answer = make_large_map(open_dem(cog), parameters([anchors()[0], far]), tmp_path)
    assert "No post of the DEM lies in the reach of far." in answer.warnings
    assert answer.anchors[1].posts_in_reach == 0
    with pytest.raises(RequestError, match=r"No post of hills.tif lies in any anchor's reach"):
        make_large_map(open_dem(cog), parameters([far]), tmp_path)


def test_a_map_that_is_ended_leaves_nothing(cog: Path, tmp_path: Path) -> None:
    shares: list[float] = []
    with pytest.raises(RequestError, match="ended before it was done"):
        make_large_map(open_dem(cog), parameters(), tmp_path, Work(shares.append, lambda: len(shares) > 1))
    assert len(shares) >= 2
    assert list(tmp_path.iterdir()) == []


def test_ground_that_changes_underneath_is_noticed(tmp_path: Path) -> None:
    path = write_cog(tmp_path / "hills.tif", hills_m(300))
    dem = open_dem(path)
    write_cog(path, hills_m(300, seed=3))
    with pytest.raises(GroundChangedError, match="was changed since it was opened"):
        dem.window(0, 9, 0, 9)
    path.write_bytes(b"half")
    with pytest.raises(GroundChangedError, match="was changed since it was opened"):
        dem.window(0, 9, 0, 9)
    path.unlink()
    with pytest.raises(GroundChangedError, match=r"hills\.tif is not there any more; ask again"):
        dem.window(0, 9, 0, 9)


@pytest.mark.parametrize("taken", [False, True])
def test_ground_that_changes_while_it_is_read_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, taken: bool
) -> None:
    """Whether the posts could be read meanwhile or not."""
    path = write_cog(tmp_path / "hills.tif", hills_m(300))
    dem, reads = open_dem(path), large_dem.read_raster

    def meanwhile(*asked: Any, **more: Any) -> Any:
        if taken:
            path.unlink()
            return reads(*asked, **more)
        read = reads(*asked, **more)
        write_cog(path, hills_m(300, seed=3))
        return read

    monkeypatch.setattr(large_dem, "read_raster", meanwhile)
    with pytest.raises(GroundChangedError, match="is not there any more" if taken else "was changed since"):
        dem.window(0, 9, 0, 9)


def test_degrees_and_other_formats_are_refused_with_what_to_do(tmp_path: Path) -> None:
    path = write_cog(tmp_path / "deg.tif", hills_m(64), "EPSG:32611")
    with rasterio.open(path, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as file:
        file.crs, file.transform = "EPSG:4326", rasterio.Affine(0.001, 0.0, 10.0, 0.0, -0.001, 46.0)
    with pytest.raises(DemUnsupportedError, match=r"is in degrees; .*gdalwarp"):
        open_dem(path)
    (tmp_path / "a.asc").write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n")
    with pytest.raises(DemUnsupportedError, match="only GeoTIFFs are read by windows"):
        open_dem(tmp_path / "a.asc")


def test_heights_come_above_the_datum_that_is_asked_for(cog: Path) -> None:
    plain, lifted = open_dem(cog, vertical_datum="EGM96"), read_dem(cog, vertical_datum="EGM96")
    assert plain.vertical_datum == lifted.vertical_datum == "EGM96 geoid"
    assert np.array_equal(plain.window(0, 9, 0, 9).heights_m, lifted.heights_m[:10, :10], equal_nan=True)


def test_the_reach_of_an_anchor_is_all_that_its_range_can_touch(cog: Path) -> None:
    dem = open_dem(cog)
    anchor = Anchor("A", WEST_M + 1500.0, NORTH_M - 1700.0, 900.0, limits=AntennaLimits(max_range_m=900.0))
    reach = reach_of(dem, anchor)
    within = posts_asked_about(dem, anchor, None, (0, dem.rows), (0, dem.cols))
    rows, cols = np.nonzero(within)
    assert reach.first_row < rows.min()
    assert rows.max() < reach.last_row
    assert reach.first_col < cols.min()
    assert cols.max() < reach.last_col
    assert reach.posts < 1.4 * within.sum()  # a square round a circle, and its rim
    assert reach_of(dem, replace(anchor, east_m=WEST_M - 5000.0)) is None
