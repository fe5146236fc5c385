"""What range, azimuth and elevation limits take away, and that they take nothing else."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain import ElevationGrid
from tests.visibility.grounds import eye, rough
from visibility import HIDDEN, VISIBLE, AnchorError, AntennaLimits, Curvature, min_visible_altitude

PLAIN = ElevationGrid(np.zeros((41, 41)), 10.0, 10.0)


def seen(limits, grid=PLAIN, altitude_m=50.0, **receiver):
    return min_visible_altitude(grid, [eye(grid, 20, 20, altitude_m, limits=limits)]).visible(**receiver)[0]


def test_maximum_range_is_a_slant_range():
    visible = seen(AntennaLimits(max_range_m=130.0), above_ground_m=0.0)
    assert visible[20, 32] == VISIBLE  # 120 m out and 50 m down: 130 m
    assert visible[20, 33] == HIDDEN


def test_minimum_range_leaves_a_hole_under_the_anchor():
    visible = seen(AntennaLimits(min_range_m=64.0), above_ground_m=0.0)
    assert visible[20, 20] == HIDDEN
    assert visible[20, 23] == HIDDEN
    assert visible[20, 24] == VISIBLE  # 40 m out and 50 m down: 64.03 m


def test_a_receiver_above_the_hole_is_in_range_again():
    limits = AntennaLimits(min_range_m=64.0)
    assert seen(limits, altitude_m=10.0, above_ground_m=0.0)[20, 21] == HIDDEN
    lowest_m = min_visible_altitude(PLAIN, [eye(PLAIN, 20, 20, 10.0, limits=limits)]).altitude_m
    assert lowest_m[0, 20, 21] == pytest.approx(10.0 + math.sqrt(64.0**2 - 10.0**2))


def test_an_azimuth_sector_runs_clockwise_from_north_and_may_cross_it():
    visible = seen(
        AntennaLimits(azimuth_from_rad=math.radians(330), azimuth_to_rad=math.radians(45)), above_ground_m=0.0
    )
    assert visible[10, 20] == VISIBLE
    assert visible[10, 29] == VISIBLE
    assert visible[20, 30] == HIDDEN
    assert visible[30, 20] == HIDDEN
    assert visible[10, 16] == VISIBLE
    assert visible[10, 13] == HIDDEN


@pytest.mark.parametrize(("start_deg", "end_deg"), [(10, 10), (350, -10), (10, 370 + 360), (370, 10), (0.1, 0.1)])
def test_an_empty_azimuth_sector_is_refused(start_deg, end_deg):
    with pytest.raises(AnchorError, match=f"from {start_deg} to {end_deg} deg is empty; leave both out"):
        AntennaLimits(azimuth_from_rad=math.radians(start_deg), azimuth_to_rad=math.radians(end_deg))


@pytest.mark.parametrize("start_deg", [-180, -10, 0, 1, 10, 33.3, 90])
def test_a_whole_turn_is_all_round(start_deg):
    limits = AntennaLimits(azimuth_from_rad=math.radians(start_deg), azimuth_to_rad=math.radians(start_deg + 360))
    assert (seen(limits, above_ground_m=0.0) == VISIBLE).all()


def test_an_antenna_that_cannot_look_down_steeply_sees_ground_only_further_out():
    limits = AntennaLimits(min_elevation_rad=math.radians(-45))
    lowest_m = min_visible_altitude(PLAIN, [eye(PLAIN, 20, 20, 50.0, limits=limits)]).altitude_m[0]
    for out in range(1, 20):
        assert lowest_m[20, 20 + out] == pytest.approx(max(0.0, 50.0 - 10.0 * out), abs=1e-4)


def test_an_antenna_that_cannot_look_up_loses_what_stands_higher():
    limits = AntennaLimits(max_elevation_rad=0.0)
    assert (seen(limits, above_ground_m=60.0) == HIDDEN).all()
    assert (seen(limits, above_ground_m=40.0) == VISIBLE).all()


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 1000),
    st.floats(0.0, 150.0),
    st.floats(1.0, 400.0),
    st.floats(-80.0, 20.0),
    st.floats(5.0, 60.0),
    st.floats(0.0, 80.0),
)
def test_visible_means_clear_and_within_every_limit(seed, min_range_m, more_range_m, lowest_deg, more_deg, above_m):
    grid = rough(seed, 19, 23, (10.0, 10.0))
    limits = AntennaLimits(
        min_range_m=min_range_m,
        max_range_m=min_range_m + more_range_m,
        min_elevation_rad=math.radians(lowest_deg),
        max_elevation_rad=math.radians(lowest_deg + more_deg),
    )
    world = Curvature(40_000.0)
    free, limited = (
        min_visible_altitude(grid, [eye(grid, 7.3, 9.1, 60.0, limits=limit)], curvature=world).visible(
            above_ground_m=above_m
        )[0]
        for limit in (AntennaLimits(), limits)
    )
    rows, cols = np.mgrid[0:19, 0:23]
    distance_m = np.hypot((rows - 7.3) * 10.0, (cols - 9.1) * 10.0)
    rise_m = grid.heights_m + above_m - world.drop_per_m2 * distance_m**2 - 60.0
    slant_m = np.hypot(distance_m, rise_m)
    elevation_rad = np.arctan2(rise_m, distance_m)
    within = (slant_m >= limits.min_range_m) & (slant_m <= limits.max_range_m)
    within &= (elevation_rad >= limits.min_elevation_rad) & (elevation_rad <= limits.max_elevation_rad)
    near_a_limit = np.abs(slant_m - limits.min_range_m) < 0.01
    near_a_limit |= np.abs(slant_m - limits.max_range_m) < 0.01
    near_a_limit |= np.abs(elevation_rad - limits.min_elevation_rad) < 1e-4
    near_a_limit |= np.abs(elevation_rad - limits.max_elevation_rad) < 1e-4
    expected = np.where(within, free, HIDDEN)
    np.testing.assert_array_equal(limited[~near_a_limit], expected[~near_a_limit])


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"max_range_m": -1.0}, "Range limits"),
        ({"min_range_m": 10.0, "max_range_m": 5.0}, "Range limits"),
        ({"min_elevation_rad": 1.0, "max_elevation_rad": 0.5}, "Elevation limits"),
        ({"max_elevation_rad": 4.0}, "Elevation limits"),
        ({"azimuth_from_rad": 1.0}, "both its start and its end"),
        ({"azimuth_from_rad": math.nan, "azimuth_to_rad": 1.0}, "finite"),
    ],
)
def test_impossible_limits_are_refused(limits, words):
    with pytest.raises(AnchorError, match=words):
        AntennaLimits(**limits)
