"""The safety bubble: room to what may not be driven against the radius that the filter's covariance asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.questions.models import NavigationModel, PathLimits
from planning.validation import PathLimit
from planning.validation.bubble import room_m
from planning.validation.walking import walk_along
from tests.planning.validation.courses import ROVER, grid_of, judged, level, mast, walled
from visibility.sight import AnchorTrack

# all of them west of the wall, whose foot is 190 m east
MASTS = tuple(
    mast(f"A{n}", *at)
    for n, at in enumerate([(20.0, 20.0, 60.0), (180.0, 60.0, 20.0), (20.0, 380.0, 40.0), (170, 350)])
)
STEEPEST = ROVER.max_slope_rad


def beside(away_m: float) -> list[tuple[float, float]]:
    return [(190.0 - away_m, 100.0), (190.0 - away_m, 300.0)]


def check_with(epsilon: float, away_m: float, anchors=MASTS, **more):
    limits = PathLimits(bubble_epsilon=epsilon, dem_sigma_m=more.pop("dem_sigma_m", 0.0))
    return judged(walled(), beside(away_m), PathLimit.BUBBLE, anchors=anchors, limits=limits, **more)


def test_room_enough_is_room_and_too_little_is_not():
    model = NavigationModel(initial_sigma_m=0.2)
    assert check_with(3.0, 40.0, navigation=model).kept
    near = check_with(3.0, 0.05, navigation=model)
    assert not near.kept
    assert near.worst < 0.0


def test_a_larger_epsilon_and_an_unsure_dem_ask_for_more_room():
    worst = [check_with(epsilon, 40.0).worst for epsilon in (1.0, 2.0, 4.0)]
    assert worst == sorted(worst, reverse=True)
    assert check_with(2.0, 40.0, dem_sigma_m=5.0).worst == pytest.approx(check_with(2.0, 40.0).worst - 5.0)


def test_with_fewer_anchors_in_sight_the_bubble_grows():
    east_of_the_wall = tuple(replace(anchor, east_m=390.0) for anchor in MASTS[1:])
    assert check_with(2.0, 40.0, (MASTS[0], *east_of_the_wall)).worst < check_with(2.0, 40.0).worst


@pytest.mark.parametrize("velocity_sigma", [None, 0.05])
def test_at_the_start_the_bubble_is_that_of_the_first_covariance(velocity_sigma):
    # one range an hour: nothing is known at the start but the first sigma, and at the first epoch the ranges there
    far = tuple(replace(anchor, ranging_sigma_m=1e6) for anchor in MASTS)
    told = {} if velocity_sigma is None else {"initial_velocity_sigma_m_per_s": velocity_sigma}
    model = NavigationModel(initial_sigma_m=4.0, interval_s=3600.0, ground_sigma_m=1e6, **told)
    check = check_with(1.0, 100.0, far, navigation=model)
    grown_m = 90.0 - check.worst  # to the border of the map, nearer than the wall
    unknown_m = (velocity_sigma or 0.3) * 200.0
    # 200 s of unknown velocity, 0.3 m/s unless told otherwise, and white noise, on three axes
    assert grown_m == pytest.approx(np.sqrt(3.0) * np.sqrt(4.0**2 + unknown_m**2 + 0.01 * 200.0**3 / 3.0), rel=0.02)


def test_a_moving_anchor_counts_from_where_it_is():
    still = MASTS[:3]
    tracks = tuple(AnchorTrack(a.id, [0.0, 1000.0], [(a.east_m, a.north_m, a.altitude_m)] * 2) for a in still)
    assert check_with(2.0, 40.0, tracks).worst == pytest.approx(check_with(2.0, 40.0, still).worst, rel=1e-2)


@given(st.floats(20.0, 180.0), st.floats(20.0, 380.0), st.floats(1.0, 150.0))
@settings(max_examples=60, deadline=None)
def test_the_room_beside_a_straight_wall_is_the_distance_to_its_foot(east_m, north_m, reach_m):
    walk = walk_along(walled(), np.array([(east_m, north_m)]), np.ones_like, 2.5)
    found = room_m(walk, reach_m, STEEPEST, (), ())[0]
    room = min(190.0 - east_m, east_m, north_m, 400.0 - north_m)
    assert found == pytest.approx(min(room, reach_m), abs=1e-6)


def test_unknown_ground_and_areas_and_the_border_of_keep_in_leave_no_room():
    heights_m = np.zeros((41, 41))
    heights_m[20, 20] = np.nan
    here = walk_along(grid_of(heights_m), np.array([(200.0, 240.0)]), np.ones_like, 2.5)
    everywhere = 1e3
    # the triangles around the unknown post end 10 m north of it
    assert room_m(here, everywhere, STEEPEST, (), ())[0] == pytest.approx(30.0)
    walk = walk_along(level(), np.array([(200.0, 240.0)]), np.ones_like, 2.5)
    assert room_m(walk, everywhere, STEEPEST, (shapely.box(0, 0, 400, 235),), ())[0] == pytest.approx(5.0)
    assert room_m(walk, everywhere, STEEPEST, (), (shapely.box(190, 100, 300, 300),))[0] == pytest.approx(10.0)
    assert room_m(walk, everywhere, STEEPEST, (), (shapely.box(0, 0, 10, 10),))[0] == 0.0
