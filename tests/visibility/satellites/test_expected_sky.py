"""What a map leaves of satellites' signals: a wall, a wood of one height, places and directions it cannot tell."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyproj import CRS

from gnss import Place
from terrain import ElevationGrid
from visibility import VisibilityInputError
from visibility.cover.canopy import Canopy
from visibility.satellites import expected_sky, place_on_grid
from visibility.signal import Foliage, with_foliage

UTM = CRS.from_epsg(32632)


def ground(wall_m=0.0):
    heights = np.zeros((81, 81), np.float32)
    heights[:21] = wall_m  # from 190 m north of the middle on
    return ElevationGrid(heights, 10.0, 10.0, 500_000.0 - 400.0, 5_200_000.0 + 400.0, UTM)


def test_a_wall_hides_what_is_lower_than_it_and_on_its_side():
    grid = ground(100.0)
    place = place_on_grid(grid, 500_000.0, 5_200_000.0)
    edge = math.atan2(98.0, 200.0)  # from 2 m above the ground to the wall's top
    azimuths = np.array([0.0, 0.0, math.pi, math.pi / 2.0, 0.0])
    elevations = np.array([edge - 0.03, edge + 0.03, 0.1, 0.1, -0.01])
    told = expected_sky(grid, place, azimuths, elevations, 2.0)
    assert told.hidden.tolist() == [True, False, False, False, True]
    assert told.loss_db.tolist() == [math.inf, 0.0, 0.0, 0.0, math.inf]


def test_trees_cost_by_the_way_through_them():
    bare = ground()
    grid = with_foliage(bare, Foliage(Canopy(bare, np.full((81, 81), 20.0), np.full((81, 81), 5.0)), "density", 0.03))
    place = place_on_grid(grid, 500_000.0, 5_200_000.0)
    elevations = np.radians([20.0, 45.0, 89.9])
    told = expected_sky(grid, place, np.array([0.3, 2.0, 4.0]), elevations, 2.0)
    # Beer's law: 4.34 dB of each unit of depth, over crowns of 15 m
    assert told.loss_db == pytest.approx(10.0 / math.log(10.0) * 0.03 * 15.0 / np.sin(elevations), rel=0.01)
    above = expected_sky(grid, place, [0.3], [0.5], 25.0)
    assert above.loss_db.tolist() == [0.0]


def test_places_and_directions_that_make_no_question_are_refused():
    grid = ground()
    with pytest.raises(VisibilityInputError, match="knows no ground at longitude 10"):
        expected_sky(grid, Place(10.0, 47.0), [0.0], [0.5])
    for azimuths, elevations in (([0.0, 1.0], [0.5]), ([math.nan], [0.5]), ([[0.0]], [[0.5]])):
        with pytest.raises(VisibilityInputError, match="as many finite azimuths as elevations"):
            expected_sky(grid, place_on_grid(grid, 500_000.0, 5_200_000.0), azimuths, elevations)
