"""Drives by RINEX files over a map: the way they tell, clocks of readings, whom the ground hides, what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError
from pyproj import CRS

from gnss import AlmanacFileError, GnssInputError
from navigation import MeasurementError, StateError
from service.products.navigations import NAVIGATION
from service.products.navigations.calculate import calculate_navigation
from service.products.navigations.receiver import _zero
from service.products.navigations.request import NavigationParameters
from service.settings import Settings
from terrain import ElevationGrid, to_grid_frame
from tests.gnss.differential import world
from tests.service.satellite_drives import ZERO_GPS_S, drive_by_satellites, true_enu_m
from tests.service.small_maps import small_grid

WEEK_S = 604_800.0
GROUND_M = 450.0  # with EGM96's 50 m there, the receivers of the world drive on it


def valley(wall_m=0.0):
    """Level ground about the world's place, above EGM96; wall_m: how high it stands from 40 m on in the south."""
    crs = CRS.from_epsg(32632)
    flat = ElevationGrid(np.zeros((2, 2), np.float32), 1.0, 1.0, 460_000.0, 5_210_000.0, crs)
    east_m, north_m = to_grid_frame(flat, world.PLACE.lon_deg, world.PLACE.lat_deg)
    heights_m = np.full((101, 101), GROUND_M, np.float32)
    heights_m[59:] += wall_m
    return ElevationGrid(
        heights_m, 5.0, 5.0, float(east_m) - 250.0, float(north_m) + 250.0, crs, vertical_datum="EGM96"
    )


def asked(grid=None, **changes):
    request = drive_by_satellites(ZERO_GPS_S, **changes)
    return calculate_navigation(grid or valley(), NavigationParameters.model_validate(request))


def shape_m(finished):
    """How far the track, moved as a whole, is from the truth."""
    numbers = finished.numbers()
    grid = finished.grid
    middle = np.array([grid.bounds_m[0] + 250.0, grid.bounds_m[3] - 250.0])
    told = np.column_stack([numbers["east_m"], numbers["north_m"]]) - middle
    left = told - true_enu_m(numbers["time_s"] - ZERO_GPS_S)[:, :2]
    return np.linalg.norm(left - left.mean(axis=0), axis=1), left.mean(axis=0), numbers["altitude_m"]


def test_a_drive_is_found_by_satellites_alone():
    finished = asked()
    off_m, moved_m, altitude_m = shape_m(finished)
    assert off_m.max() < 0.3
    # the world has no air, whose delays the models take away all the same
    assert np.linalg.norm(moved_m) < 4.0
    assert np.abs(altitude_m - GROUND_M).max() < 30.0
    sources = {one.source: one for one in finished.answer.sources}
    assert set(sources) == {"pseudorange", "phase"}
    assert sources["phase"].used > 0.9 * sources["phase"].measurements
    told = " ".join(finished.answer.warnings)
    assert "The readings' times are GPS time." in told
    assert "course" in told


@pytest.mark.parametrize(
    ("zero_s", "words"),
    [
        (ZERO_GPS_S % WEEK_S, "are seconds of the GPS week."),
        (ZERO_GPS_S + 315_964_800.0 - 17.0, "are UTC."),
    ],
)
def test_the_readings_clock_is_found(zero_s, words):
    found = calculate_navigation(valley(), NavigationParameters.model_validate(drive_by_satellites(zero_s)))
    assert any(words in one for one in found.answer.warnings)
    assert found.answer.way_m == pytest.approx(asked().answer.way_m, abs=0.5)


def test_a_clock_of_its_own_has_to_be_told():
    with pytest.raises(MeasurementError, match="give zero_gps_s"):
        calculate_navigation(valley(), NavigationParameters.model_validate(drive_by_satellites(5.0)))
    satellites = drive_by_satellites()["satellites"]
    request = drive_by_satellites(5.0, satellites={**satellites, "zero_gps_s": ZERO_GPS_S - 5.0})
    found = calculate_navigation(valley(), NavigationParameters.model_validate(request))
    assert any("zero_gps_s tells" in one for one in found.answer.warnings)
    request = drive_by_satellites(5.0, satellites={**satellites, "zero_gps_s": 0.0})
    with pytest.raises(MeasurementError, match="s from the observations"):
        calculate_navigation(valley(), NavigationParameters.model_validate(request))


def test_satellites_behind_a_wall_are_left_out():
    settings = {"imu": "tactical", "antenna_above_ground_m": 0.5}
    free, hidden = (asked(valley(wall_m), settings=settings) for wall_m in (0.0, 60.0))
    counts = [
        next(one.measurements for one in found.answer.sources if one.source == "pseudorange")
        for found in (free, hidden)
    ]
    assert counts[1] < 0.9 * counts[0]
    assert any("the ground hides" in one for one in hidden.answer.warnings)
    assert not any("the ground hides" in one for one in free.answer.warnings)


def test_files_that_are_none_are_refused_before_anything_is_calculated():
    whole = drive_by_satellites(ZERO_GPS_S)["satellites"]
    cut = "\n".join(whole["observations"].splitlines()[:-2])
    for satellites, sentence in (
        ({**whole, "observations": cut}, r"the observation file: .* truncated"),
        ({**whole, "observations": "lat,lon\n1,2\n"}, "no RINEX observation file"),
        ({**whole, "orbits": [whole["orbits"][0][:-200]]}, "the orbit file: its last record has"),
        ({**whole, "orbits": [whole["orbits"][0], "#cP2016\n"]}, r"orbits\[1\] does not end with EOF"),
    ):
        request = NavigationParameters.model_validate(drive_by_satellites(ZERO_GPS_S, satellites=satellites))
        with pytest.raises(AlmanacFileError, match=sentence):
            NAVIGATION.check(valley(), request, Settings())
    with pytest.raises(ValidationError, match="Give fixes, ranges or satellites"):
        NavigationParameters.model_validate(drive_by_satellites(satellites=None))


def test_orbits_of_another_day_and_maps_that_lie_nowhere_are_refused():
    whole = drive_by_satellites(ZERO_GPS_S)["satellites"]
    later = drive_by_satellites()["satellites"]["observations"].replace(" 15 12 31 ", " 16  1  9 ")
    assert later != whole["observations"]
    with pytest.raises(GnssInputError, match="days away"):
        asked(satellites={**whole, "observations": later})
    nowhere = ElevationGrid(np.zeros((5, 5), np.float32), 10.0, 10.0, 0.0, 0.0, None)
    with pytest.raises(StateError, match="need a DEM with a CRS"):
        asked(nowhere)
    assert small_grid().crs is not None


@pytest.mark.parametrize(("heard_from_s", "read_from_s"), [(-5.0, -10.0), (2.0, -5.0)])
def test_a_week_that_ends_on_the_way_goes_on(heard_from_s, read_from_s):
    begin_s = 1878 * WEEK_S
    # seconds of the week as the logs' reader unrolls them: past the end of the week in which the readings begin
    readings_s = WEEK_S + read_from_s + np.arange(0.0, 40.0, 0.1)
    zero_s, sentence = _zero(None, begin_s + heard_from_s + np.arange(30.0), readings_s)
    assert zero_s == begin_s - WEEK_S
    assert "of the GPS week" in sentence
