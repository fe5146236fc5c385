"""Which satellites a place has in view."""

import itertools
import math
from datetime import UTC, date, datetime

import numpy as np
import pytest

from gnss import Almanac, GpsTime, Place, enu_to_ecef_m, place_ecef_m, read_almanac, read_rinex_navigation
from gnss.errors import AlmanacError
from terrain import ElevationGrid, FrameError
from tests.visibility.satellites.constellation import NOON, satellite, shared_file, walker
from visibility import VisibilityInputError
from visibility.satellites import place_on_grid, satellites_in_view

MOUNT_MITCHELL = Place(-82.265, 35.765, 2000.0)
DAY = [NOON.plus(1800.0 * step) for step in range(48)]


def grid_at(east_m=400_000.0, north_m=3_800_000.0, crs="EPSG:32611", **fields):
    return ElevationGrid(np.full((11, 21), 1500.0), 30.0, 30.0, east_m, north_m, crs, **fields)


def test_a_full_constellation_shows_four_to_twelve_satellites_everywhere_and_always():
    for place in [MOUNT_MITCHELL, Place(0, 0), Place(20, 78), Place(150, -45)]:
        view = satellites_in_view(walker(), DAY, place)
        assert view.in_view.shape == view.azimuth_rad.shape == (24, 48)
        assert view.position_ecef_m.shape == (24, 48, 3)
        counts = view.in_view.sum(axis=0)
        assert counts.min() >= 4
        assert counts.max() <= 13


def test_what_is_in_view_stands_at_its_range_and_direction():
    view = satellites_in_view(walker(), DAY, MOUNT_MITCHELL)
    across_m = view.range_m * np.cos(view.elevation_rad)
    offset_m = np.stack(
        [
            across_m * np.sin(view.azimuth_rad),
            across_m * np.cos(view.azimuth_rad),
            view.range_m * np.sin(view.elevation_rad),
        ],
        axis=-1,
    )
    np.testing.assert_allclose(enu_to_ecef_m(MOUNT_MITCHELL, offset_m), view.position_ecef_m, rtol=0, atol=1e-5)
    assert (view.elevation_rad[view.in_view] > math.radians(4.8)).all()
    assert (view.range_m[view.in_view] < 26e6).all()


def test_a_narrower_cone_never_shows_more():
    views = [satellites_in_view(walker(), DAY, MOUNT_MITCHELL, math.radians(cone)) for cone in (90, 85, 65, 20)]
    for wide, narrow in itertools.pairwise(views):
        assert not (narrow.in_view & ~wide.in_view).any()
    assert views[0].in_view.sum() > views[-1].in_view.sum() > 0


def test_a_satellite_beyond_the_earth_is_never_in_view():
    view = satellites_in_view(walker(), DAY, MOUNT_MITCHELL, math.pi / 2)
    n = place_ecef_m(MOUNT_MITCHELL)
    behind = view.position_ecef_m @ (n / np.linalg.norm(n)) < 6.3e6
    assert behind.any()
    assert not view.in_view[behind].any()


def test_unhealthy_satellites_are_left_out_and_listed():
    view = satellites_in_view(walker(unhealthy=(3, 17)), NOON, MOUNT_MITCHELL, math.pi)
    assert view.unhealthy_ids == ("G03", "G17")
    assert len(view.ids) == 22
    assert not {"G03", "G17"} & set(view.ids_in_view())
    with pytest.raises(AlmanacError, match="All 24 satellites"):
        satellites_in_view(walker(unhealthy=range(1, 25)), NOON, MOUNT_MITCHELL)


def test_rows_are_in_the_order_of_the_names():
    almanac = Almanac((satellite(30), satellite(2), satellite(11)))
    assert satellites_in_view(almanac, NOON, MOUNT_MITCHELL).ids == ("G02", "G11", "G30")


def test_utc_and_gps_time_of_one_instant_show_one_sky():
    utc = datetime(2015, 12, 31, 11, 59, 43, tzinfo=UTC)
    by_utc = satellites_in_view(walker(), utc, MOUNT_MITCHELL)
    by_gps = satellites_in_view(walker(), NOON, MOUNT_MITCHELL)
    np.testing.assert_array_equal(by_utc.position_ecef_m, by_gps.position_ecef_m)
    a_second_off = satellites_in_view(walker(), utc, MOUNT_MITCHELL, leap_seconds=16)
    assert 2e3 < np.linalg.norm(a_second_off.position_ecef_m - by_gps.position_ecef_m, axis=-1).max() < 5e3


def test_real_ephemerides_show_a_sky():
    ephemerides = read_rinex_navigation(shared_file("rtklib_brdc0910.09n"))
    view = satellites_in_view(ephemerides, datetime(2009, 4, 1, 12, tzinfo=UTC), MOUNT_MITCHELL)
    assert view.unhealthy_ids == ("G01", "G05")
    assert 6 <= len(view.ids_in_view()) <= 12


def test_an_old_almanac_serves_its_own_week_and_no_other():
    almanac = read_almanac(shared_file("gpstk_test_input_sem387.txt"), date(2007, 1, 22))
    view = satellites_in_view(almanac, datetime(2007, 1, 27, 12, tzinfo=UTC), MOUNT_MITCHELL)
    assert view.unhealthy_ids == ("G04",)
    assert 6 <= len(view.ids_in_view()) <= 12
    with pytest.raises(AlmanacError, match="of GPS week 1411"):
        satellites_in_view(almanac, datetime(2026, 9, 9, tzinfo=UTC), MOUNT_MITCHELL)
    kept = satellites_in_view(almanac, datetime(2026, 9, 9, tzinfo=UTC), MOUNT_MITCHELL, max_age_s=math.inf)
    assert len(kept.ids) == 29


def test_a_grid_stands_for_its_middle_on_the_ground():
    grid = grid_at()
    place = place_on_grid(grid)
    assert place.height_m == 1500.0
    assert place.lon_deg == pytest.approx(-118.08, abs=0.01)
    assert place.lat_deg == pytest.approx(34.34, abs=0.01)
    by_grid = satellites_in_view(walker(), NOON, grid)
    by_place = satellites_in_view(walker(), NOON, place)
    np.testing.assert_array_equal(by_grid.elevation_rad, by_place.elevation_rad)


def test_unknown_ground_takes_the_mean_of_the_known():
    heights_m = np.full((11, 21), 800.0)
    heights_m[3:8, 5:16] = np.nan
    assert place_on_grid(ElevationGrid(heights_m, 30.0, 30.0, 4e5, 3.8e6, "EPSG:32611")).height_m == 800.0
    nothing = ElevationGrid(np.full((3, 3), np.nan), 30.0, 30.0, 4e5, 3.8e6, "EPSG:32611")
    assert place_on_grid(nothing).height_m == 0.0
    assert place_on_grid(grid_at(), 400_000.0 - 5_000.0, 3_800_000.0).height_m == 1500.0


@pytest.mark.parametrize(
    ("crs", "words"),
    [
        (None, "no CRS, so its place on Earth is unknown; give the place"),
        ("ESRI:103885", "lies on Mars; GPS satellites serve places on Earth only"),
    ],
)
def test_grids_without_a_place_on_earth_are_refused(crs, words):
    with pytest.raises(FrameError, match=words):
        satellites_in_view(walker(), NOON, grid_at(0.0, 0.0, crs))


@pytest.mark.parametrize("cone_rad", [0.0, -1.0, 85.0, math.nan])
def test_impossible_cones_are_refused(cone_rad):
    with pytest.raises(VisibilityInputError, match="cone_rad must lie"):
        satellites_in_view(walker(), NOON, MOUNT_MITCHELL, cone_rad)


@pytest.mark.parametrize("max_age_s", [-1.0, math.nan])
def test_impossible_ages_are_refused(max_age_s):
    with pytest.raises(VisibilityInputError, match="max_age_s must be"):
        satellites_in_view(walker(), GpsTime(1877, 0.0), MOUNT_MITCHELL, max_age_s=max_age_s)
