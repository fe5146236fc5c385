"""The terrain's horizon: closed forms, and sight lines to where a satellite would be."""

import math

import numpy as np
import pytest

from terrain import ElevationGrid, height_at
from visibility import FLAT, VisibilityInputError
from visibility.satellites import terrain_horizon
from visibility.sight import line_of_sight


def test_a_wall_rises_by_its_height_over_its_distance():
    heights = np.zeros((101, 101))
    heights[:, 70] = 40.0  # a ridge of one post 200 m to the east
    grid = ElevationGrid(heights, 10.0, 10.0, 0.0, 1000.0)
    found = terrain_horizon(grid, 500.0, 500.0, 2.0, azimuths=360, curvature=FLAT)
    assert found.unknown_share == 0.0
    assert found.mask.elevation_rad[90] == pytest.approx(math.atan2(38.0, 200.0), abs=1e-9)
    assert found.mask.elevation_rad[270] == pytest.approx(math.atan2(-2.0, 500.0), abs=1e-6)
    assert found.mask.hides(math.pi / 2.0, math.atan2(37.9, 200.0))
    assert not found.mask.hides(math.pi / 2.0, math.atan2(38.1, 200.0))
    assert found.mask.hides(math.pi / 2.0, math.nan)


def test_a_satellite_is_below_it_where_the_line_towards_it_is_blocked():
    grid = _rough()
    east_m, north_m = (grid.bounds_m[0] + grid.bounds_m[2]) / 2.0, (grid.bounds_m[1] + grid.bounds_m[3]) / 2.0
    found = terrain_horizon(grid, east_m, north_m, 2.0, azimuths=720, curvature=FLAT)
    from_m = (east_m, north_m, float(height_at(grid, east_m, north_m)) + 2.0)
    rng = np.random.default_rng(2)
    for number in rng.integers(0, 720, 60):
        azimuth_rad = found.mask.azimuth_rad[number]
        for more_rad, verdict in ((2e-4, "clear"), (-2e-4, "blocked")):
            rise = math.tan(found.mask.elevation_rad[number] + more_rad)
            reach_m = 3000.0  # beyond the DEM
            to_m = (
                east_m + reach_m * math.sin(azimuth_rad),
                north_m + reach_m * math.cos(azimuth_rad),
                from_m[2] + reach_m * rise,
            )
            assert line_of_sight(grid, from_m, to_m, curvature=FLAT).verdict == verdict


def _rough():
    rng = np.random.default_rng(7)
    return ElevationGrid(rng.uniform(0.0, 120.0, (61, 61)), 20.0, 25.0, 1000.0, 5000.0)


def test_unknown_ground_is_no_horizon_and_is_told():
    heights = np.full((21, 21), 5.0)
    heights[:, 15:] = np.nan
    found = terrain_horizon(ElevationGrid(heights, 10.0, 10.0, 0.0, 200.0), 100.0, 100.0, azimuths=8, curvature=FLAT)
    assert 0.0 < found.unknown_share < 1.0
    assert (found.mask.elevation_rad < 0.0).all()


@pytest.mark.parametrize(
    ("place", "options"),
    [((5000.0, 100.0), {}), ((100.0, 100.0), {"azimuths": 2}), ((190.0, 100.0), {}), ((100.0, 100.0, math.nan), {})],
)
def test_places_without_known_ground_are_refused(place, options):
    heights = np.full((21, 21), 5.0)
    heights[:, 18:] = np.nan
    with pytest.raises(VisibilityInputError):
        terrain_horizon(ElevationGrid(heights, 10.0, 10.0, 0.0, 200.0), *place, **options)
