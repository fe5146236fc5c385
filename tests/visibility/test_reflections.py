"""Single reflections: a mirror's closed form on a plane; a valley whose far side lights what the near one hides."""

import math

import numpy as np
import pytest

from terrain import ElevationGrid
from visibility import (
    FLAT,
    Anchor,
    AnchorError,
    DistantAnchor,
    VisibilityInputError,
    line_of_sight,
    min_visible_altitude,
)
from visibility.sight import reflections

CELL_M = 20.0
SLOPE = np.array([0.6, 0.3])


def plane() -> ElevationGrid:
    """Rises to the east and to the north, through altitude 0 at the origin in its middle."""
    rows, cols = 121, 121
    east_m = (np.arange(cols) - 60) * CELL_M
    north_m = (60 - np.arange(rows)) * 25.0
    return ElevationGrid(
        np.add.outer(SLOPE[1] * north_m, SLOPE[0] * east_m).astype(np.float32), CELL_M, 25.0, -1200, 1500
    )


def valley() -> ElevationGrid:
    """A valley from north to south: floor at 0 m, sides that rise by 3 in 1 to 600 m, 500 m apart at the floor."""
    east_m = (np.arange(151) - 75) * CELL_M
    profile_m = np.clip(3.0 * (np.abs(east_m) - 250.0), 0.0, 600.0)
    return ElevationGrid(np.tile(profile_m, (101, 1)).astype(np.float32), CELL_M, CELL_M, -1500.0, 1000.0)


def mirror_excess_m(receiver_m, anchor_m):
    """What a mirror in place of the plane would add: the way from the receiver's image, less the straight one."""
    normal = np.array([-SLOPE[0], -SLOPE[1], 1.0])
    normal /= np.linalg.norm(normal)
    image_m = receiver_m - 2.0 * (receiver_m @ normal) * normal
    return np.linalg.norm(anchor_m - image_m) - np.linalg.norm(anchor_m - receiver_m)


@pytest.mark.parametrize("receiver_m", [(0.0, 0.0, 200.0), (-150.0, 220.0, 160.0), (300.0, -400.0, 300.0)])
@pytest.mark.parametrize("anchor_m", [(-700.0, 100.0, 900.0), (-500.0, -600.0, 1500.0)])
def test_a_plane_adds_what_a_mirror_adds(receiver_m, anchor_m):
    surfaces = min_visible_altitude(plane(), [Anchor("A", *anchor_m)], curvature=FLAT)
    found = reflections(surfaces, [receiver_m])
    mirror_m = mirror_excess_m(np.array(receiver_m), np.array(anchor_m))
    # no way over the plane is shorter (Fermat), and the nearest post is less than a cell away: an error of second order
    assert -1e-3 <= found.excess_m[0, 0] - mirror_m < CELL_M**2 / 100.0
    east_m, north_m, altitude_m = found.point_m[0, 0]
    assert altitude_m == pytest.approx(SLOPE @ (east_m, north_m), abs=1e-3)


def test_a_satellite_adds_twice_the_distance_times_the_sine():
    satellite = DistantAnchor("G1", azimuth_rad=math.radians(250.0), elevation_rad=math.radians(50.0), range_m=2.2e7)
    surfaces = min_visible_altitude(plane(), [satellite], curvature=FLAT)
    receiver_m = np.array([0.0, 0.0, 250.0])
    normal = np.array([-SLOPE[0], -SLOPE[1], 1.0]) / math.sqrt(1.0 + SLOPE @ SLOPE)
    towards = np.array(satellite.position_m(plane())) - receiver_m
    sine = normal @ (towards / np.linalg.norm(towards))
    assert reflections(surfaces, [receiver_m]).excess_m[0, 0] == pytest.approx(
        2.0 * receiver_m @ normal * sine, abs=4.0
    )


def test_the_far_side_of_a_valley_lights_a_receiver_that_the_near_side_hides():
    grid = valley()
    hidden = Anchor("west", -1400.0, 0.0, 1400.0)
    receiver_m = (-200.0, 0.0, 30.0)
    assert line_of_sight(grid, receiver_m, (-1400.0, 0.0, 1400.0), curvature=FLAT).verdict == "blocked"
    found = reflections(min_visible_altitude(grid, [hidden], curvature=FLAT), [receiver_m])
    # there and back over half a valley at least, as De Vivo et al. say of canyons
    assert 250.0 < found.excess_m[0, 0] < 2000.0
    point_m = found.point_m[0, 0] + (0.0, 0.0, 1.0)
    assert point_m[0] >= 240.0
    for end_m in (receiver_m, (hidden.east_m, hidden.north_m, hidden.altitude_m)):
        assert line_of_sight(grid, point_m, end_m, curvature=FLAT).verdict == "clear"
    way_m = math.dist(found.point_m[0, 0], receiver_m) + math.dist(found.point_m[0, 0], (-1400.0, 0.0, 1400.0))
    assert found.excess_m[0, 0] == pytest.approx(way_m - math.dist(receiver_m, (-1400.0, 0.0, 1400.0)))


def test_ground_that_is_turned_another_way_reflects_nothing():
    found = reflections(
        min_visible_altitude(valley(), [Anchor("low", -1400.0, 0.0, 700.0)], curvature=FLAT),
        [(-200.0, 0.0, 30.0)],
        roughness_rad=math.radians(1.0),
    )
    assert np.isnan(found.excess_m).all()
    assert np.isnan(found.point_m).all()


def test_ground_out_of_reach_reflects_nothing():
    surfaces = min_visible_altitude(plane(), [Anchor("A", -700.0, 100.0, 900.0)], curvature=FLAT)
    found = reflections(surfaces, [(0.0, 0.0, 200.0)])
    away_m = math.dist(found.point_m[0, 0], (0.0, 0.0, 200.0))
    assert reflections(surfaces, [(0.0, 0.0, 200.0)], reach_m=away_m + 1.0).excess_m == found.excess_m
    assert np.isnan(reflections(surfaces, [(0.0, 0.0, 200.0)], reach_m=100.0).excess_m)


def test_only_pairs_that_are_asked_for_are_worked_out():
    anchors = [Anchor("A", -700.0, 100.0, 900.0), Anchor("B", -500.0, -600.0, 1500.0)]
    receivers_m = [(0.0, 0.0, 200.0), (100.0, 0.0, 300.0)]
    surfaces = min_visible_altitude(plane(), anchors, curvature=FLAT)
    every = reflections(surfaces, receivers_m)
    some = reflections(surfaces, receivers_m, [[True, False], [False, False]])
    assert some.excess_m[0, 0] == every.excess_m[0, 0]
    assert np.isnan(some.excess_m[0, 1])
    assert np.isnan(some.excess_m[1]).all()


def test_what_makes_no_question_is_refused():
    surfaces = min_visible_altitude(plane(), [Anchor("A", -700.0, 100.0, 900.0)], curvature=FLAT)
    with pytest.raises(VisibilityInputError, match="receivers_m"):
        reflections(surfaces, [(0.0, math.nan, 1.0)])
    with pytest.raises(VisibilityInputError, match="asked"):
        reflections(surfaces, [(0.0, 0.0, 200.0)], [[True, True]])
    with pytest.raises(VisibilityInputError, match="roughness_rad"):
        reflections(surfaces, [(0.0, 0.0, 200.0)], roughness_rad=0.0)
    with pytest.raises(VisibilityInputError, match="reach_m"):
        reflections(surfaces, [(0.0, 0.0, 200.0)], reach_m=0.0)
    with pytest.raises(AnchorError, match="below the ground"):
        reflections(surfaces, [(0.0, 0.0, -200.0)])
