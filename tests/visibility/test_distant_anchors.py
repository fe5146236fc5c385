"""Satellites and other anchors far beyond the map: parallel rays as the limit of a far anchor."""

import itertools
import math

import numpy as np
import pytest

from terrain import ElevationGrid
from terrain.synthetic import fractal
from tests.reference.minimum_altitude import minimum_altitude
from tests.visibility.grounds import eye, hills, real_dem, rough, window
from visibility import FLAT, VISIBLE, AnchorError, Curvature, DistantAnchor, min_visible_altitude

MODES = ["fast", "exact"]
DIRECTIONS = [(0, 12), (45, 30), (100, 7), (180, 60), (213, 5), (270, 23), (315, 85), (359, 44)]


def satellite(azimuth_deg, elevation_deg, name="G01", **more):
    return DistantAnchor(name, math.radians(azimuth_deg), math.radians(elevation_deg), **more)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("range_m", [3e5, 2.2e7, 1e8])
def test_exact_mode_agrees_with_every_edge_however_far_the_anchor(direction, range_m):
    grid = rough(4, 15, 19, (30.0, 21.0), relief_m=150.0)
    anchor = satellite(*direction, range_m=range_m)
    east_m, north_m, altitude_m = anchor.position_m(grid)
    got = min_visible_altitude(grid, [anchor], mode="exact", curvature=FLAT).altitude_m[0]
    expected, _ = minimum_altitude(grid.heights_m, (*grid.post_at(east_m, north_m), altitude_m), (21.0, 30.0))
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-3)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_fast_mode_misclassifies_no_more_than_for_near_anchors(direction):
    grid = window(real_dem("bigtujunga.tif"), 100, 300, 300, 400)
    fast, exact = (min_visible_altitude(grid, [satellite(*direction)], mode=mode) for mode in MODES)
    wrong = fast.visible(above_ground_m=0.0) != exact.visible(above_ground_m=0.0)
    assert wrong.mean() <= 0.002
    assert np.quantile(np.abs(fast.altitude_m - exact.altitude_m), 0.5) < 0.05


@pytest.mark.parametrize("mode", MODES)
def test_a_wall_throws_the_shadow_that_the_elevation_says(mode):
    heights_m = np.zeros((9, 60))
    heights_m[:, 40] = 50.0
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    lowest_m = min_visible_altitude(grid, [satellite(90, 30)], mode=mode).altitude_m[0, 4]
    behind_m = (40 - np.arange(40)) * 10.0
    expected_m = np.maximum(0.0, 50.0 - behind_m * math.tan(math.radians(30)))
    np.testing.assert_allclose(lowest_m[:40], expected_m, atol=5e-3)
    assert (lowest_m[41:] == 0.0).all()


@pytest.mark.parametrize("mode", MODES)
def test_a_satellite_in_the_zenith_sees_all(mode):
    assert (min_visible_altitude(hills(65), [satellite(0, 90)], mode=mode).visible(above_ground_m=0.0) == VISIBLE).all()


def test_a_higher_satellite_hides_nothing_that_a_lower_one_sees():
    grid = hills(65)
    lowest_m = [min_visible_altitude(grid, [satellite(120, e)], mode="exact").altitude_m for e in (5, 10, 20, 40, 80)]
    for lower, higher in itertools.pairwise(lowest_m):
        assert (higher <= lower + 2e-3).all()


def test_the_curved_plain_falls_away_from_the_middle():
    world = Curvature(6_371_000.0)
    grid = ElevationGrid(np.zeros((3, 2001)), 100.0, 100.0)
    lowest_m = min_visible_altitude(grid, [satellite(90, 0.2)], mode="exact", curvature=world).altitude_m[0, 1]
    # a ray at 0.2 deg touches the sphere 22.2 km before the middle and rises from there
    touch_m = -math.tan(math.radians(0.2)) * world.radius_m
    east_m = (np.arange(2001) - 1000) * 100.0
    drop_m = east_m**2 / (2 * world.radius_m)
    line_m = -(touch_m**2) / (2 * world.radius_m) + (east_m - touch_m) * math.tan(math.radians(0.2))
    expected_m = np.where(east_m < touch_m, line_m + drop_m, 0.0)
    np.testing.assert_allclose(lowest_m, expected_m, atol=0.05)  # rays from 1e8 m away are not quite parallel


def test_near_and_distant_anchors_may_be_mixed_in_any_order():
    grid = fractal(49, seed=5, relief_m=300.0)
    anchors = [eye(grid, 9, 9, 700.0, "D1"), satellite(10, 20), eye(grid, 30, 3, 800.0, "D2"), satellite(200, 9, "G02")]
    together = min_visible_altitude(grid, anchors, progress=lambda share: None)
    for number, anchor in enumerate(anchors):
        np.testing.assert_array_equal(together.altitude_m[number], min_visible_altitude(grid, [anchor]).altitude_m[0])


def test_unknown_ground_is_unknown_to_satellites_too():
    heights_m = np.zeros((9, 30))
    heights_m[:, 12] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    for mode in MODES:
        lowest_m = min_visible_altitude(grid, [satellite(90, 20)], mode=mode).altitude_m[0]
        assert np.isnan(lowest_m[:, :13]).all()
        assert (lowest_m[:, 13:] == 0.0).all()


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (("", 0.0, 1.0), "non-empty id"),
        (("G", math.nan, 1.0), "azimuth_rad"),
        (("G", 0.0, 0.0), "above the horizon"),
        (("G", 0.0, 1.7), "above the horizon"),
        (("G", 0.0, 1.0, -1.0), "range_m"),
        (("G", 0.0, 1.0, 1e7, -1.0), "ranging_sigma_m"),
    ],
)
def test_impossible_distant_anchors_are_refused(fields, words):
    with pytest.raises(AnchorError, match=words):
        DistantAnchor(*fields)
