"""Rows of observations whose satellite stands behind the terrain, as the horizon of the place says."""

import math

import numpy as np
import pytest

from gnss.differential import hidden_rows, parse_observations, read_orbits
from gnss.sky import place_ecef_m
from terrain import ElevationGrid
from tests.gnss.differential import world
from visibility import VisibilityInputError
from visibility.satellites import hidden_observations, place_on_grid, terrain_horizon

PLACE_UTM = (462_000.0, 5_205_000.0)  # near world.PLACE


@pytest.fixture(scope="module")
def orbits(tmp_path_factory):
    path = tmp_path_factory.mktemp("orbits") / "made.nav"
    path.write_text(world.navigation_text())
    return read_orbits(path)


@pytest.fixture(scope="module")
def observed():
    names = [one.id for one in world.ORBITS.sets]
    told = world.heard([world.base_m()] * 2, np.random.default_rng(1), names=names)
    return parse_observations(world.observation_text(told, world.base_m()))


@pytest.fixture(scope="module")
def valley():
    """A rough valley, walls of 900 m about a floor 800 m wide."""
    rng = np.random.default_rng(2)
    across_m = np.abs(np.arange(121) - 60) * 25.0
    heights = np.tile(np.clip(across_m - 400.0, 0.0, 900.0), (121, 1)) + rng.uniform(0.0, 20.0, (121, 121))
    west, north = PLACE_UTM[0] - 60 * 25.0, PLACE_UTM[1] + 60 * 25.0
    return ElevationGrid(heights, 25.0, 25.0, west, north, "EPSG:32632")


def test_it_is_what_the_horizon_of_the_place_says(valley, observed, orbits):
    place = place_on_grid(valley, *PLACE_UTM)
    horizon = terrain_horizon(valley, *PLACE_UTM, 2.0, azimuths=3600)
    rover_m = np.tile(place_ecef_m(place), (2, 1))
    rover_m[1] = math.nan  # the epoch before it serves
    found = hidden_observations(valley, observed, orbits, rover_m)
    expected = hidden_rows(observed, orbits, place, horizon.mask)
    np.testing.assert_array_equal(found, expected)
    bare = hidden_rows(observed, orbits, place, type(horizon.mask)(np.zeros(1), np.zeros(1)))
    assert bare.sum() < found.sum() < len(found)


def test_a_dem_that_never_has_the_rover_is_refused(valley, observed, orbits):
    away_m = np.tile(world.base_m() + np.array([0.0, 9e4, 0.0]), (2, 1))
    with pytest.raises(VisibilityInputError, match="nowhere on the DEM"):
        hidden_observations(valley, observed, orbits, away_m)
    away_m[0] = place_ecef_m(place_on_grid(valley, *PLACE_UTM))
    found = hidden_observations(valley, observed, orbits, away_m)
    assert found[observed.epoch == 0].sum() > found[observed.epoch == 1].sum() > 0


def test_without_a_place_there_is_no_answer(valley, observed, orbits):
    with pytest.raises(VisibilityInputError, match="not one place"):
        hidden_observations(valley, observed, orbits, np.full((2, 3), math.nan))
    with pytest.raises(VisibilityInputError, match="a place for each epoch"):
        hidden_observations(valley, observed, orbits, np.zeros((5, 3)))
