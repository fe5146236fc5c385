"""Satellites in a grid's own axes, as the line-of-sight machinery takes them."""

import math

import numpy as np
import pyproj
import pytest

from gnss import Place
from terrain import ElevationGrid, FrameError, to_grid_frame
from tests.visibility.satellites.constellation import NOON, walker
from visibility import FLAT, min_visible_altitude
from visibility.satellites import place_on_grid, satellite_eyes

DAY = [NOON.plus(3600.0 * step) for step in range(24)]

# east of, on and west of a central meridian, both hemispheres, a polar map, a stretched one
GRIDS = [
    ("EPSG:32611", 680_000.0, 3_800_000.0),
    ("EPSG:32611", 500_000.0, 3_800_000.0),
    ("EPSG:32611", 250_000.0, 5_500_000.0),
    ("EPSG:32719", 300_000.0, 6_300_000.0),
    ("EPSG:3413", -200_000.0, -2_300_000.0),
    ("EPSG:3857", -9_158_000.0, 4_268_000.0),
]


def flat_grid(crs, east_m, north_m):
    return ElevationGrid(np.full((21, 21), 300.0), 30.0, 30.0, east_m, north_m, crs)


def unwound(angle_rad):
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


@pytest.mark.parametrize("where", GRIDS, ids=lambda where: f"{where[0]} {where[1]:.0f}")
def test_azimuths_turn_by_meridian_convergence(where):
    grid = flat_grid(*where)
    eyes = satellite_eyes(grid, walker(), DAY)
    factors = pyproj.Proj(grid.crs).get_factors(eyes.view.place.lon_deg, eyes.view.place.lat_deg)
    # PROJ's convergence is the true azimuth of grid north, ours the grid azimuth of true north
    assert eyes.convergence_rad == pytest.approx(-math.radians(factors.meridian_convergence), abs=2e-6) or (
        where[0] == "EPSG:3857" and eyes.convergence_rad == pytest.approx(0.0, abs=1e-9)
    )
    if where[0] != "EPSG:3857":  # that one's scales differ, as it maps an ellipsoid as if a sphere
        turn_rad = unwound(eyes.azimuth_rad - eyes.view.azimuth_rad)
        np.testing.assert_allclose(turn_rad, eyes.convergence_rad, rtol=0, atol=1e-6)


def test_true_north_lies_west_of_grid_north_in_the_east_of_a_zone():
    east, middle, west = (satellite_eyes(flat_grid(*GRIDS[n]), walker(), NOON).convergence_rad for n in range(3))
    assert math.degrees(east) == pytest.approx(-1.11, abs=0.02)
    assert abs(math.degrees(middle)) < 0.01
    assert west > 0.0


@pytest.mark.parametrize("where", GRIDS, ids=lambda where: f"{where[0]} {where[1]:.0f}")
def test_a_landmark_far_along_the_line_lies_on_the_grids_azimuth(where):
    grid = flat_grid(*where)
    eyes = satellite_eyes(grid, walker(), NOON, math.radians(60.0))
    start_east_m, start_north_m = to_grid_frame(grid, eyes.view.place.lon_deg, eyes.view.place.lat_deg)
    geod = pyproj.Geod(ellps="WGS84")
    for anchor in eyes.distant_anchors():
        row = eyes.view.ids.index(anchor.id)
        true_deg = math.degrees(eyes.view.azimuth_rad[row, 0])
        lon_deg, lat_deg, _ = geod.fwd(eyes.view.place.lon_deg, eyes.view.place.lat_deg, true_deg, 500.0)
        east_m, north_m = to_grid_frame(grid, lon_deg, lat_deg)
        grid_azimuth_rad = math.atan2(east_m - start_east_m, north_m - start_north_m)
        assert unwound(grid_azimuth_rad - anchor.azimuth_rad) == pytest.approx(0.0, abs=5e-5)
        # rising over 500 true metres by as much as over their image on the map
        grid_m = math.hypot(east_m - start_east_m, north_m - start_north_m)
        rise_m = 500.0 * math.tan(eyes.view.elevation_rad[row, 0])
        assert grid_m * math.tan(anchor.elevation_rad) == pytest.approx(rise_m, rel=1e-4)


def test_utm_changes_elevations_by_its_scale_only():
    eyes = satellite_eyes(flat_grid(*GRIDS[0]), walker(), DAY, math.pi / 2)
    assert np.abs(eyes.elevation_rad - eyes.view.elevation_rad).max() < math.radians(0.015)


def test_anchors_are_the_satellites_in_view_with_their_angles():
    eyes = satellite_eyes(flat_grid(*GRIDS[0]), walker(unhealthy=(1, 2)), DAY)
    for time in (0, 7):
        anchors = eyes.distant_anchors(time, ranging_sigma_m=3.0)
        assert tuple(anchor.id for anchor in anchors) == eyes.view.ids_in_view(time)
        for anchor in anchors:
            row = eyes.view.ids.index(anchor.id)
            assert anchor.azimuth_rad == eyes.azimuth_rad[row, time]
            assert anchor.elevation_rad == eyes.elevation_rad[row, time]
            assert anchor.range_m == eyes.view.range_m[row, time]
            assert anchor.ranging_sigma_m == 3.0


def test_satellites_below_the_horizon_are_no_anchors_however_wide_the_cone():
    eyes = satellite_eyes(flat_grid(*GRIDS[0]), walker(), NOON, math.pi)
    assert len(eyes.view.ids_in_view()) == 24
    assert 4 <= len(eyes.distant_anchors()) <= 13


def test_a_wall_throws_the_shadow_of_a_real_sky():
    heights_m = np.zeros((61, 61))
    heights_m[:, 30] = 80.0
    grid = ElevationGrid(heights_m, 30.0, 30.0, 679_000.0, 3_800_900.0, "EPSG:32611")
    anchors = satellite_eyes(grid, walker(), NOON).distant_anchors()
    assert len(anchors) >= 4
    hidden = min_visible_altitude(grid, anchors, "exact", FLAT).altitude_m[:, 30, :]
    for anchor, lowest_m in zip(anchors, hidden, strict=True):
        # the slope of the line in the plane across the wall
        slope = math.tan(anchor.elevation_rad) / abs(math.sin(anchor.azimuth_rad))
        shaded = np.arange(30, 0, -1) if math.sin(anchor.azimuth_rad) > 0 else np.arange(30, 60)
        near = lowest_m[shaded[1]]
        run_m = abs(math.tan(math.pi / 2 - anchor.azimuth_rad)) * 30.0
        if run_m < 800.0:  # the line meets the wall within the map
            assert near == pytest.approx(max(0.0, 80.0 - 30.0 * slope), abs=0.05)


def test_a_grid_without_crs_needs_a_place_and_has_true_north():
    grid = ElevationGrid(np.zeros((5, 5)), 10.0, 10.0)
    with pytest.raises(FrameError, match="no CRS"):
        satellite_eyes(grid, walker(), NOON)
    place = Place(-82.265, 35.765, 1500.0)
    eyes = satellite_eyes(grid, walker(), DAY, place=place)
    assert eyes.convergence_rad == 0.0
    np.testing.assert_allclose(unwound(eyes.azimuth_rad - eyes.view.azimuth_rad), 0.0, atol=1e-12)
    np.testing.assert_allclose(eyes.elevation_rad, eyes.view.elevation_rad, rtol=0, atol=1e-12)


def test_a_grid_with_crs_takes_no_other_place():
    with pytest.raises(FrameError, match="leave out the other place"):
        satellite_eyes(flat_grid(*GRIDS[0]), walker(), NOON, place=Place(0, 0))


def test_other_bodies_have_no_gps():
    mars = flat_grid("ESRI:103885", 0.0, 0.0)
    with pytest.raises(FrameError, match="lies on Mars"):
        satellite_eyes(mars, walker(), NOON)
    with pytest.raises(FrameError, match="leave out"):
        satellite_eyes(mars, walker(), NOON, place=place_on_grid(flat_grid(*GRIDS[0])))


def test_a_pole_is_a_place_like_any_other():
    grid = ElevationGrid(np.zeros((5, 5)), 30.0, 30.0, -60.0, 60.0, "EPSG:3413")
    eyes = satellite_eyes(grid, walker(), NOON)
    assert eyes.view.place.lat_deg == pytest.approx(90.0, abs=1e-6)
    assert np.isfinite(eyes.azimuth_rad).all()
