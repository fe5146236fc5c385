"""Protection over a map: the monitor's levels with the map's sight; what is hidden, out of reach, or unknown."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navigation.monitor import predict_protection
from planning.driving import protection_over_map
from planning.driving.protection import within_reach
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility import Anchor, AntennaLimits, lines_of_sight

POINTS_M = np.array([(WEST_M + 700.0, NORTH_M - 300.0, 40.0), (WEST_M + 200.0, NORTH_M - 300.0, 40.0)])
# high over the corners, where nothing hides, and low in the west, behind the wall
HIGH = [
    Anchor(name, WEST_M + east_m, NORTH_M - south_m, 900.0, ranging_sigma_m=0.3)
    for name, east_m, south_m in zip(
        "ABCDE", (0.0, 860.0, 0.0, 860.0, 430.0), (0.0, 0.0, 460.0, 460.0, 0.0), strict=True
    )
]
LOW = Anchor("W", WEST_M + 100.0, NORTH_M - 300.0, 30.0, ranging_sigma_m=0.3)


def test_where_all_is_in_sight_levels_are_those_of_the_geometry():
    grid = small_grid()
    known = replace(grid, heights_m=np.nan_to_num(grid.heights_m))
    found = protection_over_map(known, POINTS_M, HIGH, height_sigma_m=2.0)
    assert found.sight == pytest.approx(1.0, abs=1e-6)
    places_m = [(one.east_m, one.north_m, one.altitude_m) for one in HIGH]
    alone = predict_protection(POINTS_M, places_m, found.sight, 0.3, height_sigma_m=2.0)
    np.testing.assert_allclose(found.horizontal_m, alone.horizontal_m)
    np.testing.assert_allclose(found.vertical_m, alone.vertical_m)


def test_behind_a_wall_an_anchor_is_left_out_and_in_front_of_it_not():
    grid = small_grid()
    found = protection_over_map(grid, POINTS_M, [*HIGH, LOW], height_sigma_m=2.0)
    verdict = lines_of_sight(grid, POINTS_M, [(LOW.east_m, LOW.north_m, LOW.altitude_m)] * 2).verdict
    assert verdict.tolist() == [0, 1]
    assert found.sight[0, -1] < 0.01
    assert found.sight[1, -1] > 0.9
    without = protection_over_map(grid, POINTS_M[:1], HIGH, height_sigma_m=2.0)
    assert found.horizontal_m[0] == pytest.approx(without.horizontal_m[0])


def test_points_that_are_none_have_no_level_and_few_anchors_promise_nothing():
    points_m = np.vstack([POINTS_M, np.full(3, np.nan)])
    found = protection_over_map(small_grid(), points_m, HIGH[:3])
    assert np.isinf(found.horizontal_m[:2]).all()
    assert np.isnan(found.horizontal_m[2])
    assert np.isnan(found.sight[2]).all()


def test_an_antenna_reaches_what_its_limits_say():
    limits = AntennaLimits(
        10.0, 500.0, math.radians(80.0), math.radians(190.0), math.radians(-45.0), math.radians(10.0)
    )
    anchor = Anchor("L", 0.0, 0.0, 100.0, limits=limits)
    places_m = np.array(
        [
            (100.0, 0.0, 90.0),  # east
            (-100.0, 0.0, 90.0),  # west of its sector
            (600.0, 0.0, 90.0),  # too far
            (5.0, 0.0, 100.0),  # too near
            (100.0, 0.0, 150.0),  # too high
            (50.0, -50.0, 0.0),  # too steeply below
            (0.0, -300.0, 100.0),  # south
        ]
    )
    assert within_reach(anchor, places_m).tolist() == [True, False, False, False, False, False, True]
