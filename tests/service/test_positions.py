"""Positions of requests in the grid's frame."""

import math

import numpy as np
import pytest

from service.parts.anchors import AnchorIn
from service.parts.points import PointIn
from service.parts.shapes_in_grid import resolve_anchor, resolve_point
from terrain import ElevationGrid, FrameError, height_at, to_lon_lat
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility import AnchorError, VisibilityInputError

MILLIMETRE = 1e-3
IN_THE_HOLE = {"east_m": WEST_M + 270.0, "north_m": NORTH_M - 100.0}
OUTSIDE = {"east_m": WEST_M - 5000.0, "north_m": NORTH_M}
ON_THE_SLOPE = {"east_m": WEST_M + 45.0, "north_m": NORTH_M - 333.0}


def test_a_height_above_ground_stands_on_the_surface():
    grid = small_grid()
    anchor = resolve_anchor(grid, AnchorIn(id="D1", **ON_THE_SLOPE, above_ground_m=80.0))
    assert anchor.altitude_m == pytest.approx(float(height_at(grid, **ON_THE_SLOPE)) + 80.0, abs=MILLIMETRE)
    assert (anchor.east_m, anchor.north_m) == (ON_THE_SLOPE["east_m"], ON_THE_SLOPE["north_m"])


def test_degrees_of_limits_become_radians():
    asked = AnchorIn(
        id="D1", **ON_THE_SLOPE, altitude_m=500.0, min_range_m=5.0, max_range_m=900.0, azimuth_from_deg=350.0,
        azimuth_to_deg=90.0, min_elevation_deg=-45.0, max_elevation_deg=30.0, ranging_sigma_m=0.3, pose_sigma_m=2.0,
    )  # fmt: skip
    anchor = resolve_anchor(small_grid(), asked)
    limits = anchor.limits
    assert (limits.azimuth_from_rad, limits.azimuth_to_rad) == (math.radians(350.0), math.radians(90.0))
    assert (limits.min_elevation_rad, limits.max_elevation_rad) == (math.radians(-45.0), math.radians(30.0))
    assert (limits.min_range_m, limits.max_range_m) == (5.0, 900.0)
    assert (anchor.ranging_sigma_m, anchor.pose_sigma_m, anchor.altitude_m) == (0.3, 2.0, 500.0)


def test_longitude_and_latitude_come_to_the_same_place_as_metres():
    grid = small_grid()
    lon_deg, lat_deg = to_lon_lat(grid, **ON_THE_SLOPE)
    by_degrees = resolve_anchor(grid, AnchorIn(id="D1", lon_deg=lon_deg, lat_deg=lat_deg, above_ground_m=3.0))
    by_metres = resolve_anchor(grid, AnchorIn(id="D1", **ON_THE_SLOPE, above_ground_m=3.0))
    assert by_degrees.east_m == pytest.approx(by_metres.east_m, abs=MILLIMETRE)
    assert by_degrees.north_m == pytest.approx(by_metres.north_m, abs=MILLIMETRE)


def test_degrees_mean_nothing_on_a_local_grid():
    with pytest.raises(FrameError, match="no CRS"):
        resolve_anchor(small_grid(None), AnchorIn(id="D1", lon_deg=1.0, lat_deg=2.0, altitude_m=3.0))


@pytest.mark.parametrize(("place", "words"), [(IN_THE_HOLE, "unknown ground"), (OUTSIDE, "outside the DEM")])
def test_a_height_above_unknown_ground_is_refused_with_what_to_do(place, words):
    with pytest.raises(AnchorError, match=f"Anchor D1 .*{words}.*give its altitude_m"):
        resolve_anchor(small_grid(), AnchorIn(id="D1", **place, above_ground_m=3.0))
    with pytest.raises(VisibilityInputError, match=f"Rover .*{words}.*give its altitude_m"):
        resolve_point(small_grid(), PointIn(**place, above_ground_m=3.0), "Rover")


@pytest.mark.parametrize("place", [IN_THE_HOLE, OUTSIDE])
def test_an_altitude_is_good_anywhere(place):
    assert resolve_point(small_grid(), PointIn(**place, altitude_m=70.0)) == (place["east_m"], place["north_m"], 70.0)


def test_a_point_above_ground_gets_its_altitude():
    grid = ElevationGrid(np.full((3, 3), 100.0), 10.0, 10.0)
    assert resolve_point(grid, PointIn(east_m=5.0, north_m=-5.0, above_ground_m=2.0)) == (5.0, -5.0, 102.0)
