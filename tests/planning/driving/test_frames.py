"""The frame of a drive beside PROJ's own topocentric conversion; directions beside its azimuths."""

import math

import numpy as np
import pyproj
import pytest

from navigation import StateError
from planning.driving import map_frame
from terrain import ElevationGrid, to_lon_lat
from tests.service.small_maps import NORTH_M, WEST_M, small_grid

FROM_CORNER_M = np.array([(0.0, 0.0, 30.0), (9000.0, -7000.0, 900.0), (-80.0, 0.0, -50.0)])
PLACES_M = FROM_CORNER_M + np.array([WEST_M, NORTH_M, 0.0])


def test_places_are_where_proj_has_them_and_come_back():
    grid = small_grid()
    frame = map_frame(grid, PLACES_M[0])
    lon, lat = to_lon_lat(grid, PLACES_M[:, 0], PLACES_M[:, 1])
    proj = pyproj.Transformer.from_pipeline(
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lon_0={lon[0]} +lat_0={lat[0]} +h_0={PLACES_M[0, 2]}"
    )
    expected = np.column_stack(proj.transform(lon, lat, PLACES_M[:, 2]))
    found = frame.to_frame(PLACES_M)
    np.testing.assert_allclose(found, expected, atol=1e-4)
    np.testing.assert_allclose(frame.to_grid(found), PLACES_M, atol=1e-4)
    assert np.isnan(frame.to_frame(np.vstack([PLACES_M, np.full(3, np.nan)]))[-1]).all()


def test_a_vector_along_true_north_is_turned_into_the_grid():
    frame = map_frame(small_grid(), PLACES_M[0])
    assert abs(frame.grid_north_rad) > 0.005
    ahead = frame.to_grid(np.array([(0.0, 0.0, 0.0), (0.0, 100.0, 0.0)]))
    step = ahead[1] - ahead[0]
    np.testing.assert_allclose(step[:2] / np.linalg.norm(step[:2]), (frame.turn @ (0.0, 1.0, 0.0))[:2], atol=1e-5)


def test_a_map_that_lies_nowhere_is_told_so_and_latitude_is_of_no_other():
    local = ElevationGrid(np.zeros((5, 5), np.float32), 10.0, 10.0)
    assert "lat_deg" in map_frame(local, (0.0, 0.0, 0.0)).warnings[0]
    polar = map_frame(local, (0.0, 0.0, 0.0), 90.0)
    assert polar.warnings == ()
    assert polar.tangent.latitude_rad == pytest.approx(math.pi / 2.0)
    with pytest.raises(StateError, match="for a DEM without CRS"):
        map_frame(small_grid(), PLACES_M[0], 34.0)
