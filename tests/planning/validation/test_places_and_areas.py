"""Start, way-points, goals, no-go and keep-in areas."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.validation import PathLimit, validate_path
from tests.planning.validation.courses import ROVER, judged, level, problem_of

PATH = [(50.0, 200.0), (200.0, 200.0), (350.0, 300.0)]
# two metres south of the first leg
BOX = shapely.box(100.0, 100.0, 150.0, 198.0)


def check_in(problem, vertices_m, limit):
    return next(check for check in validate_path(problem, vertices_m).checks if check.limit is limit)


def test_a_path_begins_at_the_start_and_ends_at_the_goal():
    problem = problem_of(level(), PATH)
    assert validate_path(problem, PATH).passed
    assert not check_in(problem, PATH[1:], PathLimit.START).kept
    assert check_in(problem, PATH[1:], PathLimit.START).worst == pytest.approx(150.0)
    short = check_in(problem, PATH[:-1], PathLimit.GOAL)
    assert not short.kept
    assert short.worst == pytest.approx(180.3, abs=0.1)


def test_one_of_several_goals_will_do_and_an_area_is_reached_at_its_border():
    goals = ((10.0, 10.0), shapely.box(350.0, 300.0, 380.0, 380.0))
    assert check_in(problem_of(level(), PATH, goals=goals), PATH, PathLimit.GOAL).kept
    assert not check_in(problem_of(level(), PATH, goals=goals[:1]), PATH, PathLimit.GOAL).kept


def test_way_points_are_passed_in_their_order():
    path = [(50.0, 50.0), (100.0, 50.0), (150.0, 50.0), (100.0, 50.0), (200.0, 50.0)]
    ordered = problem_of(level(), path, way_points=((150.0, 50.0), (100.0, 50.0)))
    assert check_in(ordered, path, PathLimit.WAY_POINTS).kept
    backwards = problem_of(level(), path, way_points=((200.0, 50.0), (150.0, 50.0)))
    assert not check_in(backwards, path, PathLimit.WAY_POINTS).kept
    missed = check_in(problem_of(level(), path, way_points=((150.0, 53.0),)), path, PathLimit.WAY_POINTS)
    assert missed.worst == pytest.approx(3.0)


def test_the_whole_footprint_stays_out_of_a_no_go_area():
    assert judged(level(), PATH, PathLimit.NO_GO, no_go=(BOX,)).kept
    wide = judged(level(), PATH, PathLimit.NO_GO, no_go=(BOX,), rover=replace(ROVER, footprint_radius_m=2.5))
    assert not wide.kept
    assert wide.worst == pytest.approx(2.0)
    assert wide.allowed == 2.5


def test_a_path_through_a_no_go_area_says_for_how_long():
    check = judged(level(), PATH, PathLimit.NO_GO, no_go=(shapely.box(80.0, 150.0, 150.0, 250.0),))
    assert check.worst == pytest.approx(-70.0)


@pytest.mark.parametrize("footprint_m", [0.0, 1.0])
def test_a_no_go_area_narrower_than_any_sample_cannot_be_jumped(footprint_m):
    thread = shapely.box(123.456, 0.0, 123.4561, 400.0)
    rover = replace(ROVER, footprint_radius_m=footprint_m)
    assert not judged(level(), PATH, PathLimit.NO_GO, no_go=(thread,), rover=rover).kept


def test_a_rover_without_size_may_touch_a_no_go_area_from_outside_and_not_from_inside():
    rover = replace(ROVER, footprint_radius_m=0.0)
    beside = shapely.box(60.0, 200.0, 180.0, 260.0)
    assert judged(level(), PATH, PathLimit.NO_GO, no_go=(beside,), rover=rover).kept
    assert not judged(level(), PATH, PathLimit.NO_GO, no_go=(shapely.box(0.0, 0.0, 400.0, 400.0),), rover=rover).kept


def test_the_whole_footprint_stays_within_the_keep_in_areas_together():
    left, right = shapely.box(0.0, 198.0, 210.0, 210.0), shapely.box(190.0, 190.0, 400.0, 400.0)
    assert judged(level(), PATH, PathLimit.KEEP_IN, keep_in=(left, right)).kept
    wide = replace(ROVER, footprint_radius_m=2.5)
    assert judged(level(), PATH, PathLimit.KEEP_IN, keep_in=(left, right), rover=wide).worst == pytest.approx(2.0)
    outside = judged(level(), PATH, PathLimit.KEEP_IN, keep_in=(left,))
    assert not outside.kept
    assert outside.worst == pytest.approx(-140.0 * math.hypot(1.0, 2.0 / 3.0))


def test_a_path_wholly_outside_the_keep_in_areas_is_refused():
    assert not judged(level(), PATH, PathLimit.KEEP_IN, keep_in=(shapely.box(0.0, 0.0, 20.0, 20.0),)).kept


@given(
    st.floats(20.0, 380.0), st.floats(20.0, 380.0), st.floats(5.0, 60.0), st.floats(0.5, 8.0), st.floats(0.0, 3.14159)
)
@settings(max_examples=80, deadline=None)
def test_a_round_no_go_area_and_a_straight_way_agree_with_the_distance_from_its_middle(
    east_m, north_m, radius_m, footprint_m, turn
):
    # 64-cornered: its edge lies between the circle and a little inside it
    area = shapely.Point(east_m, north_m).buffer(radius_m, quad_segs=16)
    path = [(20.0, 20.0 + 100.0 * turn), (380.0, 330.0)]
    away_m = shapely.LineString(path).distance(shapely.Point(east_m, north_m)) - radius_m - footprint_m
    if -0.1 < away_m < 1e-3:
        return
    rover = replace(ROVER, footprint_radius_m=footprint_m)
    assert judged(level(), path, PathLimit.NO_GO, no_go=(area,), rover=rover).kept is bool(away_m > 0.0)
