"""Degrees become metres in the grid's CRS and come back, on every body."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyproj
import pytest

from terrain import ElevationGrid, FrameError, body_of, grid_north, to_grid_frame, to_lon_lat, true_offsets

# what an iterated inverse projection leaves, about a centimetre
ROUND_TRIP_M = 0.01
ROUND_TRIP_DEG = 1e-7


def grid_in(crs: Any) -> ElevationGrid:
    return ElevationGrid(np.zeros((2, 2)), 1.0, 1.0, crs=crs)


def test_known_positions() -> None:
    # Mont Blanc in UTM zone 32N; a zone's central meridian is 500 000 m east
    east_m, north_m = to_grid_frame(grid_in("EPSG:32632"), 6.864, 45.833)
    assert (east_m, north_m) == pytest.approx((334_120.0, 5_077_650.0), abs=200.0)
    assert to_grid_frame(grid_in("EPSG:32632"), 9.0, 0.0) == pytest.approx((500_000.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("crs", "lon", "lat"),
    [("EPSG:32632", 8.5, 46.5), ("EPSG:8353", 15.0, 49.5), ("ESRI:103885", 137.4, -4.6), ("EPSG:3031", 20.0, -80.0)],
)
def test_there_and_back(crs: str, lon: float, lat: float) -> None:
    grid = grid_in(crs)
    there = to_grid_frame(grid, lon, lat)
    assert all(type(value) is float for value in there)
    assert to_lon_lat(grid, *there) == pytest.approx((lon, lat), abs=ROUND_TRIP_DEG)
    again = to_grid_frame(grid, *to_lon_lat(grid, *there))
    assert again == pytest.approx(there, abs=ROUND_TRIP_M)


def test_on_mars_degrees_are_mars_degrees() -> None:
    east_m, north_m = to_grid_frame(grid_in("ESRI:103885"), 90.0, 1.0)
    assert (east_m, north_m) == pytest.approx((np.radians(90) * 3_396_190.0, np.radians(1) * 3_396_190.0))


def test_on_earth_degrees_are_wgs84_whatever_the_maps_own_ellipsoid() -> None:
    krovak = pyproj.CRS.from_epsg(8353)
    own = pyproj.Transformer.from_crs(krovak.geodetic_crs, krovak, always_xy=True).transform(15.0, 49.5)
    wgs84 = to_grid_frame(grid_in(krovak), 15.0, 49.5)
    assert 50.0 < np.hypot(wgs84[0] - own[0], wgs84[1] - own[1]) < 250.0


def test_arrays_keep_their_shape() -> None:
    lon, lat = np.full((2, 3), 9.0), np.linspace(45.0, 46.0, 6).reshape(2, 3)
    east_m, north_m = to_grid_frame(grid_in("EPSG:32632"), lon, lat)
    assert east_m.shape == north_m.shape == (2, 3)
    assert (np.diff(north_m.ravel()) > 0).all()
    assert to_lon_lat(grid_in("EPSG:32632"), east_m, 5e6)[0].shape == (2, 3)


def test_longitudes_to_360_are_the_same_places() -> None:
    grid = grid_in("EPSG:32619")
    assert to_grid_frame(grid, 289.0, 44.0) == pytest.approx(to_grid_frame(grid, -71.0, 44.0), abs=1e-6)


@pytest.mark.parametrize(
    ("lon", "lat", "words"),
    [
        (8.0, 91.0, "are they swapped"), (-500.0, 5.0, "not 5.0 and -500.0"), (np.nan, 5.0, "finite"),
        (500_000.0, 5_000_000.0, "in metres"), ([8.0, np.inf], [46.0, 46.0], "finite"),
    ],
)  # fmt: skip
def test_degrees_out_of_range_are_refused(lon: Any, lat: Any, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        to_grid_frame(grid_in("EPSG:32632"), lon, lat)


def test_a_local_grid_has_no_degrees() -> None:
    with pytest.raises(FrameError, match="no CRS"):
        to_grid_frame(grid_in(None), 8.0, 46.0)
    with pytest.raises(FrameError, match="no CRS"):
        to_lon_lat(grid_in(None), 0.0, 0.0)


def test_positions_that_do_not_project_are_refused() -> None:
    with pytest.raises(FrameError, match="lon_deg 0, lat_deg 90 cannot be projected"):
        to_grid_frame(grid_in("EPSG:3031"), 0.0, 90.0)
    with pytest.raises(FrameError, match="lon_deg 100, lat_deg 0 cannot be projected"):
        to_grid_frame(grid_in("EPSG:32632"), 100.0, 0.0)
    with pytest.raises(FrameError, match="cannot be projected"):
        to_lon_lat(grid_in("EPSG:32632"), 9e12, 9e12)
    with pytest.raises(FrameError, match="finite"):
        to_lon_lat(grid_in("EPSG:32632"), np.nan, 0.0)


@pytest.mark.parametrize(
    ("crs", "name", "radius_m"),
    [("EPSG:32632", "Earth", 6_371_008.8), ("ESRI:103885", "Mars", 3_396_190.0), ("ESRI:103881", "Moon", 1_737_400.0)],
)
def test_the_body_is_told_by_its_ellipsoid(crs: str, name: str, radius_m: float) -> None:
    body = body_of(pyproj.CRS.from_user_input(crs))
    assert (body.name, body.radius_m) == (name, pytest.approx(radius_m, rel=1e-6))


def test_a_crs_without_ellipsoid_has_no_body() -> None:
    engineering = pyproj.CRS.from_wkt('LOCAL_CS["hall",UNIT["metre",1],AXIS["x",EAST],AXIS["y",NORTH]]')
    with pytest.raises(FrameError, match="has no ellipsoid"):
        body_of(engineering)


@pytest.mark.parametrize(
    ("crs", "lon", "lat"),
    [
        ("EPSG:32632", 14.4, 64.0),  # 5.4° off the meridian of its zone: 4.86°
        ("EPSG:32719", -71.5, -33.0),
        ("EPSG:2154", -1.0, 45.0),
        ("EPSG:3413", 30.0, 80.0),
        ("EPSG:3031", 30.0, -75.0),
        ("IAU_2015:30130", 20.0, 85.0),
    ],
)
def test_the_grids_north_is_the_convergence_of_surveyors(crs: str, lon: float, lat: float) -> None:
    grid = grid_in(crs)
    factors = pyproj.Proj(grid.crs).get_factors(lon, lat)
    east_m, north_m = pyproj.Proj(grid.crs)(lon, lat)
    assert np.degrees(grid_north(grid, east_m, north_m)) == pytest.approx(factors.meridian_convergence, abs=1e-3)


def test_true_offsets_are_those_of_the_geodesic() -> None:
    grid = grid_in("EPSG:32632")
    origin_m = to_grid_frame(grid, 14.4, 64.0)
    azimuths_deg, ways_m = np.array([0.0, 90.0, -135.0]), np.array([2000.0, 3000.0, 10.0])
    lon, lat, _ = pyproj.Geod(ellps="WGS84").fwd([14.4] * 3, [64.0] * 3, azimuths_deg, ways_m)
    east_m, north_m = true_offsets(grid, origin_m, *to_grid_frame(grid, lon, lat))
    assert east_m == pytest.approx(ways_m * np.sin(np.radians(azimuths_deg)), abs=0.01)
    assert north_m == pytest.approx(ways_m * np.cos(np.radians(azimuths_deg)), abs=0.01)


def test_a_local_frame_has_no_north() -> None:
    with pytest.raises(FrameError, match="has no CRS"):
        grid_north(grid_in(None), 0.0, 0.0)
