"""Heights go from one vertical datum to another through a geoid model, or are refused; nothing is relabelled."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
from rasterio import Affine

from terrain import (
    ElevationGrid,
    HeightReference,
    VerticalDatumError,
    altitude_step,
    egm96_height_m,
    parse_vertical_datum,
    to_lon_lat,
    with_vertical_datum,
)
from terrain.datums import surfaces

EGM96, HAE = parse_vertical_datum("EGM96"), parse_vertical_datum("hae")


def ground(datum: str | None, crs: str | None = "EPSG:32611", posts: int = 60, cell_m: float = 90.0) -> ElevationGrid:
    heights_m = np.random.default_rng(5).uniform(-80.0, 4000.0, (posts, posts + 7)).astype(np.float32)
    heights_m[3, 4] = np.nan
    return ElevationGrid(heights_m, cell_m, cell_m / 3.0, 400_000.0, 3_790_000.0, crs, datum)


@pytest.fixture
def proj_with_egm2008(tmp_path: Path, monkeypatch):
    """A folder of PROJ grids with one under the name of EGM2008's: a plane, which PROJ's own interpolation meets."""
    lon, lat = np.meshgrid(np.arange(-120.0, -115.9, 0.25), np.arange(36.0, 31.9, -0.25))
    plane_m = (-30.0 + 0.5 * (lon + 118.0) - 0.25 * (lat - 34.0)).astype(np.float32)
    profile = {"driver": "GTiff", "height": lat.shape[0], "width": lat.shape[1], "count": 1, "dtype": "float32"}
    transform = Affine(0.25, 0.0, -120.125, 0.0, -0.25, 36.125)
    with rasterio.open(tmp_path / "us_nga_egm08_25.tif", "w", crs="EPSG:4979", transform=transform, **profile) as file:
        file.write(plane_m, 1)
        file.update_tags(TYPE="VERTICAL_OFFSET_GEOGRAPHIC_TO_VERTICAL", AREA_OR_POINT="Point")
        file.update_tags(1, DESCRIPTION="geoid_undulation")
        file.set_band_description(1, "geoid_undulation")
    before = pyproj.datadir.get_data_dir()
    pyproj.datadir.append_data_dir(tmp_path)
    surfaces._ways.cache_clear()
    yield
    pyproj.datadir.set_data_dir(before)
    surfaces._ways.cache_clear()


def egm2008_of_the_plane(grid: ElevationGrid, east_m: float, north_m: float) -> float:
    lon, lat = to_lon_lat(grid, east_m, north_m)
    return -30.0 + 0.5 * (lon + 118.0) - 0.25 * (lat - 34.0)


@pytest.mark.parametrize(
    ("text", "name", "reference"),
    [
        ("msl", "mean sea level", HeightReference.SEA_LEVEL),
        ("hae", "ellipsoid of WGS 84", HeightReference.ELLIPSOID),
        ("EGM96", "EGM96 geoid", HeightReference.SEA_LEVEL),
        ("egm2008", "EGM2008 geoid", HeightReference.SEA_LEVEL),
        ("EGM2008 height", "EGM2008 geoid", HeightReference.SEA_LEVEL),
        ("EPSG:3855", "EGM2008 geoid", HeightReference.SEA_LEVEL),
        ("EPSG:5703", "NAVD88 height", HeightReference.SEA_LEVEL),
        ("ellipsoid of ETRS89", "ellipsoid of ETRS89", HeightReference.ELLIPSOID),
    ],
)
def test_datums_are_known_by_words_codes_and_names(text: str, name: str, reference: HeightReference) -> None:
    datum = parse_vertical_datum(text)
    assert (datum.name, datum.reference) == (name, reference)


@pytest.mark.parametrize(
    "text", ["", "made up", "EPSG:32611", "EPSG:99999", "+init=epsg:5773", "/etc/hosts", "x" * 500]
)
def test_what_is_no_vertical_datum_is_refused(text: str) -> None:
    with pytest.raises(VerticalDatumError, match="is not known; name msl"):
        parse_vertical_datum(text)


def test_heights_are_lifted_by_the_geoid_below_each_post() -> None:
    grid = ground("EGM96 geoid")
    lifted = with_vertical_datum(grid, "hae")
    rows, cols = np.meshgrid(np.arange(grid.rows), np.arange(grid.cols), indexing="ij")
    lon, lat = to_lon_lat(grid, *grid.position_of(rows.astype(float), cols.astype(float)))
    expected = grid.heights_m + egm96_height_m(lon, lat)
    assert np.nanmax(np.abs(lifted.heights_m - expected)) < 1e-3
    assert np.array_equal(np.isnan(lifted.heights_m), np.isnan(grid.heights_m))
    assert lifted.vertical_datum == "ellipsoid of WGS 84"
    assert lifted.provenance.conversions[-1].startswith("Heights brought from EGM96 geoid to ellipsoid of WGS 84: -33.")
    assert lifted.provenance.warnings == ()


@pytest.mark.parametrize("crs", ["EPSG:32611", "EPSG:32702", "EPSG:3031", "EPSG:2056"])
def test_there_and_back_is_the_same_to_a_millimetre(crs: str) -> None:
    grid = ground("EGM96 geoid", crs)
    if crs == "EPSG:2056":
        grid = replace(grid, origin_east_m=2_600_000.0, origin_north_m=1_200_000.0)
    there = with_vertical_datum(grid, "hae")
    assert np.nanmin(np.abs(there.heights_m - grid.heights_m)) > 0.5
    back = with_vertical_datum(there, "EGM96")
    assert np.nanmax(np.abs(back.heights_m - grid.heights_m)) <= 1e-3
    assert back.vertical_datum == grid.vertical_datum


def test_between_nodes_the_geoid_is_as_straight_as_is_said() -> None:
    """At the steepest bend that the grid has: from the middle of the Indian Ocean to the Himalayas and New Guinea."""
    for lon, lat in ((86.9, 27.9), (145.0, -5.0), (-70.0, -24.0), (140.0, 30.0)):
        zone = 32600 + int((lon + 180.0) // 6.0) + 1 + (100 if lat < 0.0 else 0)
        east, north = pyproj.Transformer.from_crs(4326, zone, always_xy=True).transform(lon, lat)
        grid = ElevationGrid(np.zeros((400, 400), np.float32), 50.0, 50.0, east, north, f"EPSG:{zone}", "EGM96")
        lifted = with_vertical_datum(grid, "hae").heights_m
        rows, cols = np.meshgrid(np.arange(400.0), np.arange(400.0), indexing="ij")
        own = egm96_height_m(*to_lon_lat(grid, *grid.position_of(rows, cols)))
        assert np.abs(lifted - own).max() < 1e-3


def test_a_grid_that_proj_has_is_used(proj_with_egm2008) -> None:
    grid = ground("EGM2008 geoid")
    lifted = with_vertical_datum(grid, "hae")
    east_m, north_m = grid.position_of(20, 30)
    expected = grid.heights_m[20, 30] + egm2008_of_the_plane(grid, east_m, north_m)
    assert lifted.heights_m[20, 30] == pytest.approx(expected, abs=2e-3)
    assert lifted.provenance.warnings == ()
    to_96 = with_vertical_datum(grid, "EGM96")
    lon, lat = to_lon_lat(grid, east_m, north_m)
    assert to_96.heights_m[20, 30] == pytest.approx(expected - float(egm96_height_m(lon, lat)), abs=2e-3)


def test_where_projs_grid_does_not_reach_egm96_stands_in(proj_with_egm2008) -> None:
    far = replace(ground("EGM2008 geoid", "EPSG:32632"), origin_east_m=500_000.0, origin_north_m=5_000_000.0)
    lifted = with_vertical_datum(far, "hae")
    (told,) = lifted.provenance.warnings
    assert "EGM96 stood in for EGM2008 geoid" in told


@pytest.mark.parametrize("own", ["EGM2008 geoid", "LN02 height", "NAVD88 height (ftUS)"])
def test_a_model_that_is_missing_is_told_and_never_hides_between_two_sea_levels(own: str) -> None:
    if surfaces.zero_surface(parse_vertical_datum(own), np.array([-118.0]), np.array([34.2])).missing == "":
        pytest.skip(f"PROJ has a grid of {own} here")
    grid = ground(own)
    lifted = with_vertical_datum(grid, "hae")
    (told,) = lifted.provenance.warnings
    assert "EGM96 stood in for" in told
    with pytest.raises(VerticalDatumError, match="cannot be brought to EGM96 geoid: PROJ lacks"):
        with_vertical_datum(grid, "EGM96")
    assert with_vertical_datum(grid, own).heights_m is grid.heights_m


def test_mean_sea_level_without_a_model_is_the_sea_level_of_the_other_side() -> None:
    grid = ground("mean sea level")
    named = with_vertical_datum(grid, "EGM2008")
    assert named.vertical_datum == "EGM2008 geoid"
    assert np.array_equal(named.heights_m, grid.heights_m, equal_nan=True)
    assert named.provenance.conversions == (
        "The file's heights above mean sea level were taken as above EGM2008 geoid.",
    )


@pytest.mark.parametrize("datum", [None, "made up"])
def test_what_nobody_knows_is_what_the_caller_says_and_that_is_told(datum: str | None) -> None:
    grid = ground(datum)
    named = with_vertical_datum(grid, "hae")
    assert np.array_equal(named.heights_m, grid.heights_m, equal_nan=True)
    assert named.vertical_datum == "ellipsoid of WGS 84"
    assert "vertical_datum= says: ellipsoid of WGS 84." in named.provenance.conversions[-1]


@pytest.mark.parametrize(
    ("crs", "sentence"), [("IAU_2015:30110", "lies on Moon"), ("IAU_2015:49910", "lies on Mars"), (None, "no CRS")]
)
def test_off_the_earth_there_is_no_geoid(crs: str | None, sentence: str) -> None:
    grid = ground("EGM96 geoid", crs)
    with pytest.raises(VerticalDatumError, match=sentence):
        with_vertical_datum(grid, "hae")
    with pytest.raises(VerticalDatumError, match=sentence):
        altitude_step(grid, 0.0, 0.0, given=EGM96, wanted=HAE)


def test_altitudes_of_places_go_the_same_way() -> None:
    grid = ground("EGM96 geoid")
    east_m, north_m = np.array([401_000.0, 500_000.0]), np.array([3_789_000.0, 3_600_000.0])
    step_m, told = altitude_step(grid, east_m, north_m, given=HAE, wanted=EGM96)
    assert told == ()
    assert step_m == pytest.approx(-egm96_height_m(*to_lon_lat(grid, east_m, north_m)), abs=1e-9)
