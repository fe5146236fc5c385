"""What a whole path amounts to is judged at every place of it, not at its vertices."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planning.paths import CostWeights, PathLimits, PathProblem, PathStatus, RoverModel, plan_path
from planning.paths.checks import hidden_places
from planning.paths.exact_lines import Enough
from planning.paths.fields import cost_field
from planning.paths.places import middles, steepest_rad
from planning.paths.sight_maps import sight_maps
from terrain import ElevationGrid, height_at
from terrain.synthetic import fractal
from visibility import VISIBLE, Anchor, anchor_above_ground, dop, lines_of_sight, min_visible_altitude
from visibility.dilution import surface_normals
from visibility.sight import AnchorTrack

ROUGH = fractal(24, 5, relief_m=150.0, cell_m=30.0)
GRID = ElevationGrid(ROUGH.heights_m, 30.0, 20.0)
PLACES = st.lists(st.tuples(st.floats(0.0, 23.0), st.floats(0.0, 23.0)), min_size=2, max_size=4)


def steps_of(corners):
    """A way over corners with a vertex every cell or less."""
    out = [np.array(corners[:1], np.float64)]
    for begin, end in itertools.pairwise(corners):
        count = max(math.ceil(math.dist(begin, end)), 1)
        out.append(np.linspace(begin, end, count + 1)[1:])
    return np.concatenate(out)


def dense(places, each=400):
    """Many places on every piece of a way, its ends left out."""
    share = (np.arange(each) + 0.5)[None, :, None] / each
    return (places[:-1, None] + share * np.diff(places, axis=0)[:, None]).reshape(-1, 2)


def slope_rad(places):
    return np.arccos(surface_normals(GRID, *GRID.position_of(places[:, 0], places[:, 1]))[:, 2])


@settings(max_examples=60, deadline=None)
@given(PLACES)
@example([(0.0, 0.0), (5e-324, 1.0)])
@example([(1.5, 2.5), (2.5, 2.5 + 1e-310)])
def test_the_steepest_slope_is_that_of_the_steepest_triangle_on_the_way(corners):
    places = steps_of(corners)
    if np.hypot(*np.diff(places, axis=0).T).min() < 0.05:
        return
    found, sampled = steepest_rad(GRID, places), slope_rad(dense(places)).max()
    assert found >= sampled - 1e-9
    # what lies between two samples is a corner of a triangle that the way cuts; along an edge both sides count
    hair = [(down, across) for down in (-1e-6, 0.0, 1e-6) for across in (-1e-6, 0.0, 1e-6)]
    around = np.vstack([np.vstack([dense(places, 4000), middles(places)[0]]) + step for step in hair])
    assert found <= np.nanmax(slope_rad(around)) + 1e-9


@pytest.mark.parametrize("moving", [False, True], ids=["standing", "one of them moving"])
@pytest.mark.parametrize("lines", [0, 1, 2, 4])
def test_who_is_asked_no_further_has_enough_in_sight(lines, moving):
    anchors = [anchor_above_ground(GRID, f"A{n}", 80.0 + 100.0 * n, -60.0 - 70.0 * n, 25.0) for n in range(4)]
    if moving:
        # there from second 30 on
        points_m = np.array([[100.0, -300.0, 150.0], [600.0, -100.0, 190.0]])
        anchors[1] = AnchorTrack("T", np.array([30.0, 90.0]), points_m)
    problem = PathProblem(GRID, (100.0, -100.0), (600.0, -300.0), anchors=tuple(anchors))
    maps = sight_maps(problem)
    random = np.random.default_rng(8)
    places, times_s = random.uniform(0.5, 22.5, (300, 2)), random.uniform(0.0, 80.0, 300)
    whole = maps.sightings(places, times_s)
    for order in ((0, 1, 2, 3), (2, 3, 1, 0)):
        asked = maps.sightings(places, times_s, Enough(lines, 0.5, order))
        assert not (asked.visible & ~whole.visible).any()
        has_enough = whole.visible.sum(axis=1) >= lines
        np.testing.assert_array_equal(asked.visible.sum(axis=1) >= lines, has_enough)
        known = np.isfinite(asked.margin_m)
        np.testing.assert_array_equal(asked.margin_m[known], whole.margin_m[known])
        np.testing.assert_array_equal(asked.visible[known], whole.visible[known])
        sure = (asked.visible & (asked.margin_m >= 0.5)).sum(axis=1)
        short = sure < lines
        np.testing.assert_array_equal(asked.visible[short], whole.visible[short])
        assert np.isnan(asked.dop).all()
    assert 0 < np.count_nonzero(whole.visible.sum(axis=1) >= 2) < 300


@pytest.mark.parametrize("width", [0.4, 0.1, 0.05, 0.025, 0.012])
@pytest.mark.parametrize("shift", [0.0, 0.275])
def test_the_shadow_of_a_spike_is_found_however_narrow_it_is(width, shift):
    """A way passes behind a single high post, over which the only anchor looks but for so many cells of the way."""
    cell_m, high_m, antenna_m = 10.0, 20.0, 1.5
    heights_m = np.zeros((21, 41), np.float32)
    heights_m[10, 20] = high_m
    grid = ElevationGrid(heights_m, cell_m, cell_m)
    behind_m, before_m = 65.0, 95.0  # from the spike to the way, and to the anchor
    # what the line lacks at the tip is what the spike falls over half of the width of its shadow there
    lacks_m = 0.5 * width * high_m * before_m / (behind_m + before_m)
    slope = (high_m - lacks_m - antenna_m) / behind_m
    anchor = Anchor("A", 200.0, -100.0 + before_m, antenna_m + slope * (behind_m + before_m))
    problem = PathProblem(
        grid,
        (15.0, -165.0),
        ((385.0, -165.0),),
        rover=RoverModel(footprint_radius_m=0.0, max_slope_rad=1.0, receiver_above_ground_m=antenna_m),
        weights=CostWeights(length=1.0),
        maps=min_visible_altitude(grid, [anchor], "exact"),
        limits=PathLimits(min_anchors=1),
    )
    ends = np.array([[16.5, 1.5 + shift], [16.5, 38.5 + shift]])
    cols = np.linspace(*ends[:, 1], 40_001)
    on_the_way_m = np.column_stack([cols * cell_m, np.full(len(cols), -165.0), np.full(len(cols), antenna_m)])
    at_m = np.tile((anchor.east_m, anchor.north_m, anchor.altitude_m), (len(cols), 1))
    lost = cols[lines_of_sight(grid, at_m, on_the_way_m).clearance_m <= 0.0]
    assert lost[-1] - lost[0] == pytest.approx(width, rel=0.3)
    maps = sight_maps(problem)
    found = hidden_places(problem, cost_field(problem, maps), maps, ends, everywhere=True)
    assert len(found)
    assert found[:, 1].min() >= lost[0] - 1e-3
    assert found[:, 1].max() <= lost[-1] + 1e-3


def test_a_way_along_an_edge_is_as_steep_as_the_steeper_side():
    for begin, end, sides in (
        ((5.0, 3.0), (5.0, 4.0), ((4.9, 3.7), (5.1, 3.3))),
        ((5.0, 3.0), (6.0, 3.0), ((5.7, 2.9), (5.3, 3.1))),
        ((5.0, 3.0), (6.0, 4.0), ((5.4, 3.6), (5.6, 3.4))),
    ):
        expected = slope_rad(np.array(sides)).max()
        assert steepest_rad(GRID, np.array([begin, end])) == pytest.approx(expected, abs=1e-9)


def test_the_middles_lie_one_in_each_triangle():
    middle, at = middles(np.array([[2.1, 3.2], [2.7, 3.9]]))
    # from the square's north-eastern half, never over its diagonal
    np.testing.assert_allclose(middle, [[2.4, 3.55]])
    np.testing.assert_allclose(at, [0.5])
    middle, _ = middles(np.array([[2.1, 3.9], [2.9, 3.1]]))
    np.testing.assert_allclose(middle, [[2.3, 3.7], [2.7, 3.3]])


@pytest.mark.parametrize("on_surface", [False, True])
def test_the_totals_of_a_path_hold_between_its_vertices(on_surface):
    spread = ((100.0, -60.0), (600.0, -80.0), (300.0, -400.0), (40.0, -430.0), (640.0, -420.0))
    anchors = [anchor_above_ground(GRID, f"A{n}", *place, 600.0) for n, place in enumerate(spread)]
    minimum = min_visible_altitude(GRID, anchors, "exact")
    problem = PathProblem(
        GRID,
        (45.0, -410.0),
        ((640.0, -40.0),),
        rover=RoverModel(footprint_radius_m=0.0, max_slope_rad=math.radians(60.0), receiver_above_ground_m=1.5),
        weights=CostWeights(length=1.0),
        maps=minimum,
        limits=PathLimits(on_surface=on_surface),
    )
    outcome = plan_path(problem)
    assert outcome.status == PathStatus.FOUND
    path = outcome.path
    row, col = GRID.post_at(path.east_m, path.north_m)
    places = np.column_stack([row, col])
    assert path.totals.steepest_rad >= slope_rad(dense(places, 50)).max() - 1e-9
    assert path.totals.steepest_rad >= path.slope_rad.max() - 1e-9
    middle, _ = middles(places)
    east_m, north_m = GRID.position_of(middle[:, 0], middle[:, 1])
    points_m = np.column_stack([east_m, north_m, height_at(GRID, east_m, north_m) + 1.5])
    eyes_m = np.array([(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors])
    verdicts = [lines_of_sight(GRID, np.tile(eye_m, (len(points_m), 1)), points_m).verdict for eye_m in eyes_m]
    normals = surface_normals(GRID, east_m, north_m) if on_surface else None
    between = dop(eyes_m, points_m, visible=np.array(verdicts).T == VISIBLE, surface_normal=normals)
    assert path.totals.worst_dop == pytest.approx(max(between.pdop.max(), path.dop.max()), rel=1e-9)
