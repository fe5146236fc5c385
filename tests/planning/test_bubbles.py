"""Safety bubbles along a path over a map are what ground, sight and navigation say when they are asked one by one."""

from __future__ import annotations

import numpy as np
import pytest

import navigation
from navigation import BubbleError
from planning.bubbles import BubbleFilter, bubbles_along, surroundings, way_m
from terrain import ElevationGrid, nearest_surface
from visibility import Anchor, min_visible_altitude, visible_sets


@pytest.fixture
def grid() -> ElevationGrid:
    """A plain with a wall across it."""
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[:, 30] = 80.0
    return ElevationGrid(heights_m, 10.0, 10.0)


ANCHORS = [
    Anchor("A", 50.0, -50.0, 60.0, ranging_sigma_m=0.5),
    Anchor("B", 100.0, -350.0, 70.0, ranging_sigma_m=0.5, pose_sigma_m=0.5),
    Anchor("C", 560.0, -200.0, 90.0, ranging_sigma_m=0.5),
    Anchor("D", 250.0, -20.0, 140.0, ranging_sigma_m=0.5),
]
POINTS_M = np.column_stack([np.arange(100.0, 280.0, 20.0), np.full(9, -200.0), np.full(9, 45.0)])
TIMES_S = 2.0 * np.arange(9)


def test_the_bubbles_are_those_of_the_pieces(grid: ElevationGrid) -> None:
    found = bubbles_along(grid, POINTS_M, TIMES_S, ANCHORS, epsilon=2.0, dem_sigma_m=1.0, mode="exact")
    visible = visible_sets(min_visible_altitude(grid, ANCHORS, "exact"), POINTS_M).visible()
    np.testing.assert_array_equal(found.visible, visible)
    assert 0 < visible.sum() < visible.size, "the wall hides some"
    sigma_m = np.sqrt([0.25, 0.5, 0.25, 0.25])
    anchors_m = [(a.east_m, a.north_m, a.altitude_m) for a in ANCHORS]
    bubble = navigation.predict_bubble(
        POINTS_M,
        TIMES_S,
        anchors_m,
        visible,
        np.tile(sigma_m, (9, 1)),
        initial_covariance=navigation.initial_state(0.0, POINTS_M[0]).covariance,
        motion=navigation.MotionNoise(),
        epsilon=2.0,
        dem_sigma_m=1.0,
    )
    np.testing.assert_allclose(found.radius_m, bubble.radius_m, rtol=1e-12)
    np.testing.assert_allclose(found.around.distance_m, nearest_surface(grid, POINTS_M).distance_m)
    np.testing.assert_allclose(found.check.margin_m, found.around.distance_m - found.radius_m)


def test_a_history_of_poses_needs_no_anchors(grid: ElevationGrid) -> None:
    covariance_m2 = np.tile(4.0 * np.eye(3), (9, 1, 1))
    found = bubbles_along(grid, POINTS_M, TIMES_S, covariance_m2=covariance_m2, epsilon=3.0)
    np.testing.assert_allclose(found.radius_m, 3.0 * np.sqrt(12.0))
    assert found.visible is None
    assert found.sight is None


def test_a_rover_on_the_ground_knows_its_height(grid: ElevationGrid) -> None:
    on_ground = POINTS_M - (0.0, 0.0, 44.0)
    flying = bubbles_along(grid, on_ground, TIMES_S, ANCHORS)
    driving = bubbles_along(grid, on_ground, TIMES_S, ANCHORS, filter=BubbleFilter(on_ground=True, ground_sigma_m=0.1))
    assert (driving.radius_m <= flying.radius_m).all()
    assert driving.covariance_m2[-1, 2, 2] <= 0.1**2 + 1e-9


def test_points_off_the_map_and_under_ground_are_named(grid: ElevationGrid) -> None:
    with pytest.raises(BubbleError, match="Point 1 lies outside the DEM"):
        surroundings(grid, np.array([[100.0, -200.0, 45.0], [9000.0, -200.0, 45.0]]))
    below = POINTS_M - (0.0, 0.0, 50.0)
    with pytest.raises(BubbleError):
        bubbles_along(grid, below, TIMES_S, ANCHORS)
    assert bubbles_along(grid, below, TIMES_S, ANCHORS, under_ground="violated").check.first_violation == 0


def test_the_way_is_measured_in_space() -> None:
    np.testing.assert_allclose(way_m(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 4.0, 12.0]])), [0.0, 5.0, 17.0])
