"""What ranges said against a map: near there an anchor that the map has in sight is unknown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from terrain import ElevationGrid
from visibility import HIDDEN, UNKNOWN, VISIBLE, Anchor, VisibilityInputError, min_visible_altitude, visible_sets
from visibility.sight import SightDoubt, SurfaceCache, doubted, weighed_sight

LINE = ((120.0, 150.0), (300.0, 160.0), (330.0, 320.0))
DOUBT = SightDoubt(LINE, 0.99, reach_m=25.0)


def wall() -> ElevationGrid:
    """A plain of 10 m cells with a wall: what is north of it is hidden from the south."""
    heights_m = np.zeros((50, 60), np.float32)
    heights_m[20] = 40.0
    return ElevationGrid(heights_m, 10.0, 10.0, origin_east_m=0.0, origin_north_m=490.0)


ANCHOR = Anchor("A", 250.0, 20.0, 30.0)


def posts_m(grid: ElevationGrid) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    east_m = grid.origin_east_m + grid.cell_east_m * np.arange(grid.cols)
    north_m = grid.origin_north_m - grid.cell_north_m * np.arange(grid.rows)
    return np.stack(np.meshgrid(east_m, north_m), axis=-1).reshape(-1, 2)


def test_a_doubt_weighs_what_it_is_sure_of_and_falls_off_as_a_gaussian() -> None:
    points_m = np.array([[200.0, 150.0 + 80.0 / 18.0], [330.0, 345.0], [330.0, 370.0], [np.nan, 0.0]])
    expected = [0.99, 0.99 * math.exp(-0.5), 0.99 * math.exp(-2.0), 0.0]
    assert DOUBT.weight(points_m) == pytest.approx(expected, abs=1e-12)
    assert DOUBT.weight(np.array([[330.0, 320.0 + DOUBT.furthest_m]])) == pytest.approx([0.5])


def test_probabilities_are_mixed_with_the_opposite() -> None:
    shadow = SightDoubt(((0.0, 0.0),), 0.8, has_sight=False, reach_m=10.0)
    p_sight = np.array([0.9, 0.1, np.nan, 0.9])
    points_m = np.array([[330.0, 320.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    mixed = weighed_sight(p_sight, (DOUBT, shadow), points_m)
    assert mixed[[0, 1, 3]] == pytest.approx([0.9 * 0.01, 0.1 + 0.9 * 0.8, 0.9 + 0.1 * 0.8])
    assert np.isnan(mixed[2])


@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_near_a_doubt_what_was_visible_is_unknown_and_nothing_else_changes(mode) -> None:
    grid = wall()
    plain = min_visible_altitude(grid, [ANCHOR], mode).visible(above_ground_m=1.5)[0]
    found = min_visible_altitude(grid, [replace(ANCHOR, doubts=(DOUBT,))], mode)
    seen = found.visible(above_ground_m=1.5)[0]
    off_m = shapely.distance(shapely.LineString(LINE), shapely.points(posts_m(grid))).reshape(grid.shape)
    near = off_m < 25.0 * math.sqrt(2.0 * math.log(2.0 * 0.99))
    assert (near & (plain == VISIBLE)).sum() > 50
    assert (near & (plain == HIDDEN)).sum() > 5
    assert (seen[near & (plain == VISIBLE)] == UNKNOWN).all()
    assert (seen[near & (plain == HIDDEN)] == HIDDEN).all()
    assert (seen[~near] == plain[~near]).all()
    assert any("Ranges of anchor A contradicted its sight along 1 stretch" in one for one in found.warnings)
    again = SurfaceCache(grid, mode).surfaces((replace(ANCHOR, doubts=(DOUBT,)),))
    assert (again.visible(above_ground_m=1.5)[0] == seen).all()


def test_points_between_posts_know_the_doubt_too() -> None:
    found = min_visible_altitude(wall(), [replace(ANCHOR, doubts=(DOUBT,))])
    sets = visible_sets(found, np.array([[205.0, 153.0, 1.5], [205.0, 100.0, 1.5]]))
    assert sets.visible()[:, 0].tolist() == [False, True]


@pytest.mark.parametrize("doubt", [replace(DOUBT, has_sight=False), replace(DOUBT, probability=0.5)])
def test_a_doubt_about_a_shadow_and_one_that_is_as_likely_wrong_change_no_map(doubt) -> None:
    plain = min_visible_altitude(wall(), [ANCHOR])
    found = min_visible_altitude(wall(), [replace(ANCHOR, doubts=(doubt,))])
    assert np.array_equal(found.altitude_m, plain.altitude_m)
    assert not doubted((doubt,), np.array(LINE)).any()
    assert found.warnings == plain.warnings


@pytest.mark.parametrize(
    "words", [{"places_m": ()}, {"places_m": ((math.nan, 0.0),)}, {"probability": 1.2}, {"reach_m": 0.0}]
)
def test_what_is_no_doubt_is_refused(words) -> None:
    with pytest.raises(VisibilityInputError, match="doubt"):
        replace(DOUBT, **words)
