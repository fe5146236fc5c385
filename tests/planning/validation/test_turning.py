"""Turning radius: arcs, corners, cusps and the heading at the start."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.validation import PathLimit, validate_path
from tests.planning.validation.courses import ROVER, judged, level, problem_of

RADIUS_M = 20.0
ROUND = replace(ROVER, min_turning_radius_m=RADIUS_M)


def arc(radius_m: float, turn_rad: float, points: int = 60) -> np.ndarray:
    """A turn to the right that begins in the middle of the map, heading north."""
    angle = np.linspace(0.0, turn_rad, points)
    return np.column_stack([200.0 + radius_m * (1.0 - np.cos(angle)), 200.0 + radius_m * np.sin(angle)])


@given(st.floats(RADIUS_M, 80.0), st.floats(0.3, 6.0), st.integers(30, 200))
@settings(max_examples=50, deadline=None)
def test_an_arc_of_the_radius_or_more_can_be_driven(radius_m, turn_rad, points):
    check = judged(level(), arc(radius_m, turn_rad, points), PathLimit.TURNING, rover=ROUND)
    assert check.kept
    assert check.worst == pytest.approx(radius_m, rel=1e-4)


@given(st.floats(2.0, 0.97 * RADIUS_M), st.floats(0.3, 6.0), st.integers(30, 200))
@settings(max_examples=50, deadline=None)
def test_a_tighter_arc_cannot(radius_m, turn_rad, points):
    check = judged(level(), arc(radius_m, turn_rad, points), PathLimit.TURNING, rover=ROUND)
    assert not check.kept
    assert check.worst == pytest.approx(radius_m, rel=1e-3)


def test_a_corner_is_no_arc_however_long_its_legs():
    corner = [(50.0, 200.0), (200.0, 200.0), (200.0, 350.0)]
    check = judged(level(), corner, PathLimit.TURNING, rover=ROUND)
    assert check.worst == 0.0
    assert check.first_m == (200.0, 200.0)
    assert judged(level(), corner, PathLimit.SLOPE).kept


def test_a_straight_way_and_an_arc_that_begins_between_two_vertices_can_be_driven():
    straight = np.column_stack([np.full(21, 200.0), np.linspace(100.0, 200.0, 21)])
    path = np.concatenate([straight[:-1], arc(RADIUS_M, 2.0)[1:]])
    assert judged(level(), path, PathLimit.TURNING, rover=ROUND).kept


def test_at_a_cusp_only_a_rover_that_reverses_turns_back():
    forth = arc(RADIUS_M, 1.0)
    # back along an arc to the other side, tangent to where the first one ended
    end, ahead = forth[-1], np.array([math.sin(1.0), math.cos(1.0)])
    right = np.array([ahead[1], -ahead[0]])
    angle = np.linspace(0.0, 1.0, 60)[1:, None]
    back = end - RADIUS_M * np.sin(angle) * ahead - RADIUS_M * (1.0 - np.cos(angle)) * right
    path = np.concatenate([forth, back])
    assert judged(level(), path, PathLimit.TURNING, rover=replace(ROUND, can_reverse=True)).kept
    assert judged(level(), path, PathLimit.TURNING, rover=ROUND).worst == 0.0


@pytest.mark.parametrize(("heading_deg", "kept"), [(0.0, True), (1.0, True), (20.0, False), (180.0, False)])
def test_the_way_sets_out_as_the_rover_stands(heading_deg, kept):
    question = {"rover": ROUND, "start_heading_rad": math.radians(heading_deg)}
    assert judged(level(), arc(RADIUS_M, 1.5), PathLimit.START_HEADING, **question).kept is kept


def test_a_rover_that_reverses_may_set_out_backwards():
    rover = replace(ROUND, can_reverse=True)
    assert judged(level(), arc(RADIUS_M, 1.5), PathLimit.START_HEADING, rover=rover, start_heading_rad=math.pi).kept


def test_a_rover_that_turns_on_the_spot_may_take_any_corner():
    corner = [(50.0, 200.0), (200.0, 200.0), (60.0, 201.0)]
    limits = {c.limit for c in validate_path(problem_of(level(), corner, start_heading_rad=0.0), corner).checks}
    assert not limits & {PathLimit.TURNING, PathLimit.START_HEADING}
