"""Anchors in sight, dilution, morphing map: by exact sight lines at every sample, at the time the rover is there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.errors import PathError, PathProblemError
from planning.questions.models import PathLimits
from planning.validation import PathLimit, validate_path
from planning.validation.sight import dilution_along, sight_along
from terrain.synthetic import fractal
from tests.planning.validation.courses import grid_of, judged, level, mast, problem_of, walled
from visibility import (
    FLAT,
    Anchor,
    AntennaLimits,
    Curvature,
    DistantAnchor,
    FlightLimit,
    dop_map,
    min_visible_altitude,
    morphing_map,
)
from visibility.sight import AnchorTrack

# west of a wall that no rover crosses here, with masts on both sides
BESIDE = [(150.0, 60.0), (150.0, 340.0)]
MASTS = (mast("A", 20.0, 200.0), mast("B", 120.0, 30.0), mast("C", 120.0, 380.0), mast("D", 390.0, 200.0))


def test_an_anchor_behind_the_wall_does_not_count():
    question = {"anchors": MASTS}
    three = judged(walled(), BESIDE, PathLimit.ANCHORS, limits=PathLimits(min_anchors=3), **question)
    assert three.kept
    assert three.worst == 3
    four = judged(walled(), BESIDE, PathLimit.ANCHORS, limits=PathLimits(min_anchors=4), **question)
    assert not four.kept
    assert four.broken == four.samples
    assert "anchors in sight: 3 where 4 is the limit" in four.sentence


def test_a_post_that_hides_the_anchor_from_one_metre_of_the_path_is_noticed():
    heights_m = np.zeros((41, 41))
    heights_m[20, 16] = 40.0
    grid = grid_of(heights_m)
    # the shadow of one post, ten metres from the path
    limits = PathLimits(min_anchors=1)
    check = judged(grid, [(175.0, 60.0), (175.0, 340.0)], PathLimit.ANCHORS, anchors=MASTS[:1], limits=limits)
    assert not check.kept
    assert 0 < check.broken < 0.3 * check.samples
    assert judged(level(), [(175.0, 60.0), (175.0, 340.0)], PathLimit.ANCHORS, anchors=MASTS[:1], limits=limits).kept


def test_a_sight_line_over_unknown_ground_does_not_count_unless_it_was_said_to():
    heights_m = np.zeros((41, 41))
    heights_m[:, 10] = np.nan
    grid, limits = grid_of(heights_m), PathLimits(min_anchors=1)
    anchors = (mast("A", 20.0, 200.0),)
    assert not judged(grid, BESIDE, PathLimit.ANCHORS, anchors=anchors, limits=limits).kept
    opened = min_visible_altitude(grid, anchors, "exact", unknown="open")
    assert judged(grid, BESIDE, PathLimit.ANCHORS, maps=opened, limits=limits).kept


def test_the_dilution_along_a_path_is_that_of_the_geometry_there():
    limits = PathLimits(dop_limit=50.0)
    check = judged(walled(), BESIDE, PathLimit.DOP, anchors=MASTS, limits=limits)
    assert check.kept
    assert 1.0 < check.worst < 50.0
    tight = PathLimits(dop_limit=check.worst * 0.999)
    broken = judged(walled(), BESIDE, PathLimit.DOP, anchors=MASTS, limits=tight)
    assert not broken.kept
    assert broken.where_m == check.where_m
    # a dilution that reaches the limit is no good one (eq. 15)
    at_it, above_it = (PathLimits(dop_limit=limit) for limit in (check.worst, math.nextafter(check.worst, math.inf)))
    assert judged(walled(), BESIDE, PathLimit.DOP, anchors=MASTS, limits=at_it).broken == 1
    assert judged(walled(), BESIDE, PathLimit.DOP, anchors=MASTS, limits=above_it).kept


def test_without_a_fix_the_dilution_is_infinite_and_no_limit_is_kept():
    check = judged(walled(), BESIDE, PathLimit.DOP, anchors=MASTS[:2], limits=PathLimits(dop_limit=1e6))
    assert check.worst == math.inf
    assert check.broken == check.samples


def test_bound_to_the_ground_two_anchors_fix_a_position():
    limits = PathLimits(dop_limit=50.0, on_surface=True)
    assert judged(level(), BESIDE, PathLimit.DOP, anchors=MASTS[:2], limits=limits).worst < 50.0


@given(st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_at_posts_sight_and_dilution_are_those_of_exact_maps(seed):
    draw = np.random.default_rng(seed)
    grid = fractal(33, seed % 7, relief_m=300.0, cell_m=20.0)
    west_m, south_m, east_m, north_m = grid.bounds_m
    top_m = float(grid.heights_m.max())
    limited = AntennaLimits(
        max_range_m=float(draw.uniform(150.0, 600.0)),
        azimuth_from_rad=float(draw.uniform(0.0, 6.0)),
        azimuth_to_rad=float(draw.uniform(0.0, 6.0)),
        min_elevation_rad=float(draw.uniform(-1.0, -0.3)),
    )
    anchors = (
        Anchor("N", draw.uniform(west_m, east_m), draw.uniform(south_m, north_m), top_m + 20.0),
        Anchor("L", draw.uniform(west_m, east_m), draw.uniform(south_m, north_m), top_m + 5.0, limits=limited),
        Anchor("O", west_m - 300.0, north_m + 100.0, top_m),
        DistantAnchor("S", draw.uniform(0.0, 6.28), draw.uniform(0.05, 1.0)),
        DistantAnchor("Z", draw.uniform(0.0, 6.28), draw.uniform(0.6, 1.5)),
    )
    for curvature in (FLAT, Curvature(30_000.0, 1.1)):
        minimum = min_visible_altitude(grid, anchors, "exact", curvature)
        rows, cols = (index.ravel() for index in np.mgrid[0:33:4, 0:33:4])
        east, north = grid.position_of(rows, cols)
        antenna_m = np.column_stack([east, north, grid.heights_m[rows, cols] + 2.0])
        sight = sight_along(grid, antenna_m, np.zeros(len(rows)), anchors, curvature)
        seen, margin_m = (
            array[:, rows, cols].T
            for array in (minimum.visible(above_ground_m=2.0), minimum.margin_m(above_ground_m=2.0))
        )
        # a surface within a millimetre of exact may differ where a line all but touches the ground
        decided = (np.abs(margin_m) > 2e-3) & (np.abs(sight.margin_m) > 2e-4)
        assert (sight.seen == (seen == 1))[decided].all()
        assert decided.mean() > 0.9
        certain = decided.all(axis=1)
        dilution = dilution_along(sight, "pseudorange", "pdop")
        assert dilution[certain] == pytest.approx(
            dop_map(minimum, 2.0, "pseudorange").dop[rows, cols][certain].astype(float), rel=1e-4
        )


def test_a_moving_anchor_is_met_where_it_is_when_the_rover_comes_by():
    # the rover drives 280 m at 1 m/s; the anchor crosses from behind the wall to the rover's side at 100 s
    track = AnchorTrack(
        "M", [0.0, 100.0, 101.0, 1000.0], [(390, 200, 30), (390, 200, 30), (20, 200, 30), (20, 200, 30)]
    )
    antenna_m = np.column_stack([np.full(281, 150.0), np.linspace(60.0, 340.0, 281), np.full(281, 1.5)])
    sight = sight_along(walled(), antenna_m, np.arange(281.0), (track,), FLAT)
    assert not sight.seen[:99, 0].any()
    assert sight.seen[101:, 0].all()


def test_the_dilution_follows_moving_anchors():
    still = tuple(MASTS[:3])
    track = AnchorTrack("B", [0.0, 1000.0], [(120.0, 30.0, 30.0), (120.0, 30.0, 30.0)])
    moving = AnchorTrack("B", [0.0, 1000.0], [(120.0, 30.0, 30.0), (140.0, 30.0, 300.0)])
    antenna_m = np.column_stack([np.full(9, 150.0), np.linspace(60.0, 340.0, 9), np.full(9, 1.5)])
    time_s = np.linspace(0.0, 900.0, 9)
    expected, followed, moved = (
        dilution_along(sight_along(level(), antenna_m, time_s, anchors, FLAT), "ranging", "pdop")
        for anchors in (still, (still[0], track, still[2]), (still[0], moving, still[2]))
    )
    assert followed == pytest.approx(expected)
    assert moved[0] == pytest.approx(expected[0])
    assert abs(moved[-1] - expected[-1]) > 0.05


def test_an_anchor_that_is_not_there_is_not_in_sight():
    class Set:
        def at(self, time_s):
            return mast("A", 20.0, 200.0) if time_s < 3.0 else None

    antenna_m = np.tile([150.0, 200.0, 1.5], (6, 1))
    sight = sight_along(level(), antenna_m, np.arange(6.0), (Set(),), FLAT)
    assert sight.seen[:, 0].tolist() == [True] * 3 + [False] * 3


def test_a_morphing_map_is_kept_by_the_antenna_and_holds_between_posts():
    corners = [mast(f"A{n}", *at) for n, at in enumerate(((5, 5, 90), (395, 10, 120), (10, 390, 70), (390, 390, 100)))]
    surfaces = min_visible_altitude(walled(height_m=20.0), corners, "exact")
    air = morphing_map(surfaces, FlightLimit(60.0), ceiling_m=30.0)
    question = {"maps": air}
    clear = [(350.0, 200.0), (350.0, 250.0)]
    assert judged(walled(height_m=20.0), clear, PathLimit.MORPHING_MAP, **question).kept
    shadowed = [(195.0, 200.0), (200.0 - 12.0, 200.0)]
    check = judged_loosely(walled(height_m=20.0), shadowed, PathLimit.MORPHING_MAP, question)
    assert not check.kept
    assert check.worst < 0.0


def judged_loosely(grid, vertices_m, limit, question):
    answer = validate_path(problem_of(grid, vertices_m, **question), vertices_m)
    return next(check for check in answer.checks if check.limit is limit)


def test_the_whole_report_passes_only_when_every_check_does():
    limits = PathLimits(min_anchors=3, dop_limit=50.0)
    good = validate_path(problem_of(walled(), BESIDE, anchors=MASTS, limits=limits), BESIDE)
    assert good.passed
    assert good.failures == ()
    assert good.length_m == pytest.approx(280.0)
    assert "keeps all" in good.sentence
    through = [(150.0, 60.0), (250.0, 65.0)]
    bad = validate_path(problem_of(walled(), through, anchors=MASTS, limits=limits), through)
    assert not bad.passed
    assert {check.limit for check in bad.failures} >= {PathLimit.SLOPE, PathLimit.ANCHORS}
    assert "slope of the ground" in bad.sentence


def test_the_question_still_refuses_limits_without_anchors():
    with pytest.raises(PathProblemError):
        problem_of(level(), BESIDE, limits=PathLimits(min_anchors=1))


@pytest.mark.parametrize(
    ("vertices_m", "sentence"),
    [
        ([], "not shape"),
        ([(1.0, 2.0, 3.0)], "not shape"),
        ([(1.0, 2.0), (math.nan, 2.0)], "Vertex 1 of the path is not finite"),
        ([("a", "b")], "east and north of each vertex in metres"),
    ],
)
def test_what_is_no_path_is_refused(vertices_m, sentence):
    with pytest.raises(PathError, match=sentence):
        validate_path(problem_of(level(), BESIDE), vertices_m)


@pytest.mark.parametrize("step_m", [0.0, -1.0, math.nan, math.inf])
def test_a_step_that_is_none_is_refused(step_m):
    with pytest.raises(PathError, match="step_m must be"):
        validate_path(problem_of(level(), BESIDE), BESIDE, step_m=step_m)
