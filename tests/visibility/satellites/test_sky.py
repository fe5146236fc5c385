"""Azimuth, elevation and range over a place, against another library's rows, and the cone of eq. 1."""

import csv
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss import Place, ecef_to_enu_m, enu_to_ecef_m, look_angles, off_axis_rad, place_ecef_m
from gnss.errors import GnssInputError
from tests.visibility.satellites.constellation import shared_file

PLACES = st.builds(Place, st.floats(-180, 360), st.floats(-90, 90), st.floats(-500, 9000))
OFFSETS_M = st.tuples(*[st.floats(-3e7, 3e7)] * 3)
EQUATOR_M, POLE_M = 6_378_137.0, 6_356_752.314245


def test_directions_are_those_of_gnss_lib_py():
    with shared_file("gnsslibpy_sp3_g05.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 119

    def column(name):
        return np.array([float(row[name]) for row in rows])

    position_ecef_m = np.stack([column("x_sv_m"), column("y_sv_m"), column("z_sv_m")], axis=-1)
    angles = look_angles(Place(-34.62755517700375, -77.87386688990695, 0.0), position_ecef_m)
    np.testing.assert_allclose(np.degrees(angles.elevation_rad), column("el_sv_deg"), rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.degrees(angles.azimuth_rad), column("az_sv_deg"), rtol=0, atol=1e-9)


def test_the_earth_is_where_it_is():
    np.testing.assert_allclose(place_ecef_m(Place(0, 0)), [EQUATOR_M, 0, 0], atol=1e-6)
    np.testing.assert_allclose(place_ecef_m(Place(90, 0, 100)), [0, EQUATOR_M + 100, 0], atol=1e-6)
    np.testing.assert_allclose(place_ecef_m(Place(33, 90)), [0, 0, POLE_M], atol=1e-6)
    np.testing.assert_allclose(place_ecef_m(Place(33, -90)), [0, 0, -POLE_M], atol=1e-6)


@given(PLACES, OFFSETS_M)
def test_local_axes_and_back(place, offset_m):
    np.testing.assert_allclose(ecef_to_enu_m(place, enu_to_ecef_m(place, offset_m)), offset_m, rtol=0, atol=1e-6)


@given(PLACES, OFFSETS_M)
def test_local_axes_keep_lengths(place, offset_m):
    there_m = enu_to_ecef_m(place, offset_m)
    assert np.linalg.norm(there_m - place_ecef_m(place)) == pytest.approx(np.linalg.norm(offset_m), abs=1e-6)


@given(PLACES, st.floats(0, 6.28), st.floats(-1.57, 1.57), st.floats(1e6, 4e7))
def test_a_direction_and_range_come_back(place, azimuth_rad, elevation_rad, range_m):
    across_m = range_m * math.cos(elevation_rad)
    offset_m = (
        across_m * math.sin(azimuth_rad), across_m * math.cos(azimuth_rad), range_m * math.sin(elevation_rad)
    )  # fmt: skip
    angles = look_angles(place, enu_to_ecef_m(place, offset_m))
    assert angles.range_m == pytest.approx(range_m, rel=1e-12)
    assert angles.elevation_rad == pytest.approx(elevation_rad, abs=1e-12)
    assert 0.0 <= angles.azimuth_rad < 2 * math.pi
    across = math.cos(elevation_rad) * math.sin((float(angles.azimuth_rad) - azimuth_rad) / 2)
    assert abs(across) < 1e-12


@pytest.mark.parametrize(
    ("offset_m", "azimuth_deg"), [((0, 1, 1), 0), ((1, 0, 1), 90), ((0, -1, 1), 180), ((-1, 0, 1), 270)]
)
def test_azimuth_runs_clockwise_from_north(offset_m, azimuth_deg):
    place = Place(-82.27, 35.77, 2000.0)
    angles = look_angles(place, enu_to_ecef_m(place, 1e6 * np.array(offset_m)))
    assert math.degrees(angles.azimuth_rad) == pytest.approx(azimuth_deg, abs=1e-9)
    assert math.degrees(angles.elevation_rad) == pytest.approx(45.0)


@given(PLACES, OFFSETS_M)
def test_the_angle_from_the_axis_is_that_of_equation_1(place, offset_m):
    position_ecef_m = enu_to_ecef_m(place, offset_m)
    p_ecef_m = place_ecef_m(place)
    line_m = position_ecef_m - p_ecef_m
    if np.linalg.norm(line_m) < 1000.0:
        return
    n = p_ecef_m / np.linalg.norm(p_ecef_m)
    expected = np.clip(n @ line_m / np.linalg.norm(line_m), -1, 1)
    assert math.cos(off_axis_rad(place, position_ecef_m)) == pytest.approx(expected, abs=1e-12)


@given(PLACES, OFFSETS_M)
def test_from_the_vertical_the_angle_is_the_elevations_complement(place, offset_m):
    position_ecef_m = enu_to_ecef_m(place, np.add(offset_m, (0.0, 0.0, 1e5)))
    angles = look_angles(place, position_ecef_m)
    if angles.range_m < 1000.0:
        return
    theta_rad = off_axis_rad(place, position_ecef_m, "vertical")
    assert theta_rad + angles.elevation_rad == pytest.approx(math.pi / 2, abs=1e-9)
    # the seed's axis points to the Earth's middle, the vertical does not
    assert abs(off_axis_rad(place, position_ecef_m) - theta_rad) < math.radians(0.1925)


def test_a_pointed_antenna_has_its_own_axis():
    place = Place(10.0, 50.0)
    east_ecef_m = enu_to_ecef_m(place, [1e6, 0, 0])
    assert off_axis_rad(place, east_ecef_m, (2.0, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-9)
    assert off_axis_rad(place, east_ecef_m, (0.0, 1.0, 1.0)) == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("axis", ["up", (0.0, 0.0, 0.0), (1.0, 2.0), (math.nan, 0.0, 1.0)])
def test_axes_that_point_nowhere_are_refused(axis):
    with pytest.raises(GnssInputError, match="axis must be"):
        off_axis_rad(Place(0, 0), [7e6, 0, 0], axis)


@pytest.mark.parametrize("numbers", [(400, 0), (-181, 0), (0, 91), (math.nan, 0), (0, math.nan)])
def test_places_off_the_map_are_refused(numbers):
    with pytest.raises(GnssInputError, match="A place needs lon_deg"):
        Place(*numbers)


@pytest.mark.parametrize("height_m", [math.nan, 2e6, -math.inf])
def test_heights_off_the_earth_are_refused(height_m):
    with pytest.raises(GnssInputError, match="height_m must lie"):
        Place(0.0, 0.0, height_m)
