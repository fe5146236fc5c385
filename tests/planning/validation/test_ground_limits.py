"""Slope, pitch, roll, steps and unknown ground: hand-made paths that keep each limit, and ones that break it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.validation import PathLimit, validate_path
from tests.planning.validation.courses import ROVER, grid_of, judged, level, problem_of, tilted, walled

ACROSS = [(50.0, 205.0), (350.0, 205.0)]


def test_level_ground_is_never_too_steep():
    check = judged(level(), ACROSS, PathLimit.SLOPE)
    assert check.kept
    assert check.worst == 0.0


def test_a_wall_is_too_steep_and_the_report_says_where_and_by_how_much():
    check = judged(walled(), ACROSS, PathLimit.SLOPE)
    assert not check.kept
    assert check.worst == pytest.approx(math.atan(5.0))
    assert check.allowed == ROVER.max_slope_rad
    assert check.first_m == pytest.approx((190.0, 205.0), abs=3.0)
    assert check.along_m == pytest.approx(140.0, abs=8.0)
    assert "slope of the ground: 78.69 degrees where 25.00 degrees is the limit; broken at" in check.sentence


def test_a_path_beside_the_wall_is_good_to_the_last_centimetre():
    along = [(189.99, 50.0), (189.99, 350.0)]
    assert judged(walled(), along, PathLimit.SLOPE).kept
    assert not judged(walled(), [(190.01, 50.0), (190.01, 350.0)], PathLimit.SLOPE).kept


def test_a_path_that_cuts_a_millimetre_off_the_corner_of_a_steep_triangle_is_found_out():
    heights_m = np.zeros((41, 41))
    heights_m[20, 20] = 50.0  # six steep triangles around one post, the nearest corner of them at post (21, 20)
    grid = grid_of(heights_m)
    corner_east_m, corner_north_m = 200.0, 400.0 - 21 * 10.0
    # north of the corner the square's triangles are steep: one millimetre that way, seen from far
    for off_m, kept in ((-0.001, True), (0.001, False)):
        path = [(corner_east_m - 9.0, corner_north_m + off_m - 0.0009), (corner_east_m + 9.0, corner_north_m + off_m)]
        check = judged(grid, path, PathLimit.SLOPE, rover=replace(ROVER, footprint_radius_m=0.0))
        assert check.kept is kept, off_m


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(0.0, 2.0 * math.pi))
@settings(max_examples=60, deadline=None)
def test_on_a_plane_slope_pitch_and_roll_are_what_geometry_says(rise_east, rise_north, heading_rad):
    grid = tilted(rise_east, rise_north)
    end = (200.0 + 120.0 * math.sin(heading_rad), 200.0 + 120.0 * math.cos(heading_rad))
    path = [(200.0, 200.0), end]
    rover = replace(ROVER, max_slope_rad=1.5, max_pitch_rad=1.5, max_roll_rad=1.5)
    answer = {check.limit: check for check in validate_path(problem_of(grid, path, rover=rover), path).checks}
    along = rise_east * math.sin(heading_rad) + rise_north * math.cos(heading_rad)
    across = rise_east * math.cos(heading_rad) - rise_north * math.sin(heading_rad)
    for limit, tangent in (
        (PathLimit.SLOPE, math.hypot(rise_east, rise_north)),
        (PathLimit.PITCH, abs(along)),
        (PathLimit.ROLL, abs(across)),
    ):
        assert answer[limit].worst == pytest.approx(math.atan(tangent), abs=2e-5)
        assert answer[limit].kept


@pytest.mark.parametrize(
    ("limit", "rover", "good", "bad"),
    [
        (PathLimit.PITCH, {"max_pitch_rad": math.radians(10.0)}, [(200, 50), (200, 350)], [(50, 200), (350, 200)]),
        (PathLimit.ROLL, {"max_roll_rad": math.radians(10.0)}, [(50, 200), (350, 200)], [(200, 50), (200, 350)]),
    ],
)
def test_a_slope_may_be_driven_in_one_direction_and_not_in_the_other(limit, rover, good, bad):
    grid, rover = tilted(rise_east=0.3), replace(ROVER, **rover)
    assert judged(grid, good, limit, rover=rover).kept
    broken = judged(grid, bad, limit, rover=rover)
    assert broken.worst == pytest.approx(math.atan(0.3), abs=1e-5)
    assert broken.broken == broken.samples


@given(st.permutations(range(4)))
@settings(max_examples=10, deadline=None)
def test_a_path_driven_backwards_breaks_the_same_limits(order):
    places = np.array([(60.0, 60.0), (340.0, 80.0), (300.0, 340.0), (90.0, 310.0)])[list(order)]
    grid = grid_of(np.random.default_rng(3).normal(0.0, 2.0, (41, 41)))
    there, back = (validate_path(problem_of(grid, path), path) for path in (places, places[::-1]))
    for one, other in zip(there.checks, back.checks, strict=True):
        assert one.kept == other.kept
        assert one.worst == pytest.approx(other.worst, rel=1e-9, nan_ok=True)


def test_a_step_is_how_far_the_ground_departs_from_the_plane_under_the_middle():
    heights_m = np.zeros((41, 41))
    heights_m[:, 21:] = 2.0  # a ramp of 10 m, 2 m high, that begins 200 m east
    grid, rover = grid_of(heights_m), replace(ROVER, footprint_radius_m=3.0)
    beside = [(198.0, 50.0), (198.0, 350.0)]
    # the rim of the footprint is 1 m up a ramp of 0.2
    check = judged(grid, beside, PathLimit.STEP, rover=replace(rover, max_step_m=0.21))
    assert check.worst == pytest.approx(0.2, abs=0.003)
    assert check.kept
    assert not judged(grid, beside, PathLimit.STEP, rover=replace(rover, max_step_m=0.19)).kept


def test_a_post_under_the_footprint_is_a_step_though_the_rim_is_level():
    heights_m = np.zeros((41, 41))
    heights_m[20, 20] = 1.0
    rover = replace(ROVER, footprint_radius_m=22.0, max_step_m=0.5)
    path = [(200.0, 178.0 + 11.0), (200.5, 178.0 + 11.0)]
    check = judged(grid_of(heights_m), path, PathLimit.STEP, rover=rover)
    assert check.worst >= 1.0 - 0.02
    assert not check.kept


def test_without_a_limit_on_steps_none_is_looked_for():
    limits = {check.limit for check in validate_path(problem_of(level(), ACROSS), ACROSS).checks}
    assert PathLimit.STEP not in limits


def with_a_hole(row: int = 20, col: int = 20):
    heights_m = np.zeros((41, 41))
    heights_m[row, col] = np.nan
    return grid_of(heights_m)


def test_no_path_leads_over_unknown_ground():
    check = judged(with_a_hole(), ACROSS, PathLimit.KNOWN_GROUND)
    assert not check.kept
    assert check.first_m == pytest.approx((190.0, 205.0), abs=8.0)


@pytest.mark.parametrize(("north_m", "kept"), [(211.5, True), (210.5, False)])
def test_unknown_ground_must_not_even_be_under_the_rim_of_the_footprint(north_m, kept):
    # the unknown post is at north 200; the triangles around it end at north 210, the rim reaches 1 m
    path = [(200.5, north_m), (206.0, north_m)]
    assert judged(with_a_hole(), path, PathLimit.KNOWN_GROUND).kept is kept


def test_a_path_off_the_map_leads_over_unknown_ground():
    check = judged(level(), [(200.0, 200.0), (200.0, 420.0)], PathLimit.KNOWN_GROUND)
    assert not check.kept
    assert check.first_m[1] == pytest.approx(400.0, abs=2.5)


def test_the_border_of_the_map_is_on_the_map_for_a_rover_without_size():
    path = [(0.0, 0.0), (400.0, 0.0), (400.0, 400.0)]
    assert judged(level(), path, PathLimit.KNOWN_GROUND, rover=replace(ROVER, footprint_radius_m=0.0)).kept
