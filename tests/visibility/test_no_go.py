"""Zones as polygons and dilutions as contour lines."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.path import Path as DrawnPath

from terrain import ElevationGrid
from visibility import VisibilityInputError
from visibility.dilution.dop_maps import contour_lines, zones


def flat(rows, cols):
    return ElevationGrid(np.zeros((rows, cols), np.float32), 30.0, 20.0, 5000.0, 9000.0)


def covered(grid, found):
    """(rows, cols) bool: posts that lie in a zone."""
    rows, cols = np.mgrid[0 : grid.rows, 0 : grid.cols]
    posts_m = np.column_stack([part.ravel() for part in grid.position_of(rows, cols)])
    inside = np.zeros(len(posts_m), bool)
    for zone in found:
        within = DrawnPath(zone.exterior).contains_points(posts_m)
        for hole in zone.holes:
            within &= ~DrawnPath(hole).contains_points(posts_m)
        inside |= within
    return inside.reshape(grid.shape)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("shape", [(12, 17), (1, 9), (9, 1)], ids=str)
def test_exactly_the_posts_inside_are_in_a_polygon(shape, share):
    mask = np.random.default_rng(4).uniform(size=shape) < share
    grid = flat(*shape)
    np.testing.assert_array_equal(covered(grid, zones(grid, mask)), mask)


def test_a_zone_with_an_island_of_good_ground_has_a_hole():
    mask = np.ones((9, 9), bool)
    mask[3:6, 3:6] = False
    (zone,) = zones(flat(9, 9), mask)
    assert len(zone.holes) == 1
    # the edge of the grid is half a cell out; a hole's corners are cut, an eighth of a cell each
    assert zone.area_m2 == pytest.approx((81 - 9 + 4 * 0.125) * 600.0)
    for ring in (zone.exterior, *zone.holes):
        np.testing.assert_array_equal(ring[0], ring[-1])


def test_ground_that_is_all_inside_is_one_rectangle_and_none_is_nothing():
    grid = flat(4, 5)
    (zone,) = zones(grid, np.ones(grid.shape, bool))
    assert zone.area_m2 == pytest.approx(4 * 5 * 600.0)
    assert zones(grid, np.zeros(grid.shape, bool)) == ()


def test_a_contour_line_runs_where_the_dilution_has_its_level():
    grid = flat(30, 40)
    east_m, _ = grid.position_of(*np.mgrid[0:30, 0:40])
    dop = 1.0 / (0.1 + 0.01 * (east_m - 5000.0) / 30.0)
    dop[:, 0] = np.inf
    lines = contour_lines(grid, dop, [4.0, 2.5])
    assert set(lines) == {4.0, 2.5}
    for level, (line,) in lines.items():
        np.testing.assert_allclose(line[:, 0], 5000.0 + 3000.0 * (1.0 / level - 0.1))


def test_no_contour_line_crosses_unknown_ground():
    grid = flat(30, 40)
    east_m, _ = grid.position_of(*np.mgrid[0:30, 0:40])
    dop = 1.0 / (0.1 + 0.01 * (east_m - 5000.0) / 30.0)
    dop[10:20] = np.nan
    assert len(contour_lines(grid, dop, [4.0])[4.0]) == 2


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: zones(flat(3, 4), np.ones((4, 3))), r"A mask of zones must have the grid's shape \(3, 4\)"),
        (lambda: contour_lines(flat(1, 4), np.ones((1, 4)), [2.0]), "Contours need two rows and columns"),
        (lambda: contour_lines(flat(3, 4), np.ones((3, 4)), [0.0]), "Contour levels of a dilution must be numbers > 0"),
    ],
)
def test_what_makes_no_zone_or_line_is_refused(ask, sentence):
    with pytest.raises(VisibilityInputError, match=sentence):
        ask()
