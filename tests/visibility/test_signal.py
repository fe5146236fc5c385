"""Links against ITU-R's published validation values, closed forms, and lines of sight; what cannot be asked."""

import math

import numpy as np
import pytest
import shapely

from terrain import ElevationGrid
from tests.visibility.meshes import level
from visibility import FLAT, SignalError, lines_of_sight
from visibility.cover import Canopy, Footprint, standing_footprints, weissberger_loss, with_standing
from visibility.signal import (
    RADIOS,
    Foliage,
    Radio,
    arrival_probability,
    free_space_loss_db,
    profile_diffraction_db,
    signals,
)
from visibility.signal.kernels.diffraction import SUMS, bullington_loss, clear_sums, put_obstacle, round_body_loss
from visibility.signal.kernels.spherical import spherical_loss

# ITU-R Study Group 3, "Validation examples for the delta Bullington diffraction prediction method": four paths, each
# with five pairs of antennas, effective radius 8500 km, c = 3e8 m/s, horizontal polarisation. Of each path only the
# places that are an extreme for some pair, and the ground under its ends, decide Bullington's loss.
ITU_RADIUS_M, ITU_LIGHT, ITU_TOLERANCE_DB = 8_500_000.0, 3e8, 0.1
ITU_PATHS = {
    1: (83079.93853, 800.0, 302.0, [(48100.0, 570.0), (54900.0, 549.0), (55050.0, 548.0)]),
    2: (
        132315.397,
        569.0,
        528.0,
        [(32950.0, 556.0), (46650.0, 551.0), (68900.0, 505.0), (82250.0, 475.0), (131650.0, 539.0)],
    ),
    3: (17396.88966, 697.0, 569.0, [(12700.0, 639.0)]),
    4: (40511.12702, 720.0, 1408.0, [(2300.0, 778.0), (40500.0, 1408.0)]),
}
ITU_ANTENNAS = [
    (30.0, 30.0, 1000e6),
    (50.0, 10.0, 2500e6),
    (20.0, 20.0, 600e6),
    (40.0, 50.0, 200e6),
    (70.0, 5.0, 150e6),
]
# of each pair: Bullington's loss; effective heights of both antennas; loss over the smooth body; both together
ITU_VALUES = {
    1: [
        (32.84284766, 211.3366061, 30.0, 15.3485837, 34.44302652),
        (37.229036, 233.4945304, 10.0, 23.6973069, 42.32928281),
        (31.22595813, 204.7165548, 20.0, 20.91384864, 36.34606901),
        (24.87792613, 215.727222, 50.0, 14.32933641, 27.69744396),
        (24.78223928, 252.3138569, 5.0, 33.13883693, 42.99074274),
    ],
    2: [
        (36.20419305, 37.97366242, 119.2363492, 69.45434151, 69.83036947),
        (44.81240928, 57.97664284, 99.82603022, 85.53863749, 90.68232743),
        (34.43917939, 27.97366242, 109.2363492, 66.31647651, 66.46062522),
        (28.37368149, 47.97366242, 139.2363492, 45.7547348, 46.38832061),
        (34.61746032, 78.00115495, 99.67579634, 43.35361839, 51.38547874),
    ],
    3: [
        (17.62040631, 110.1894677, 30.0, 0.0, 17.62040631),
        (25.1016907, 132.6734925, 11.9416848, 0.0, 25.1016907),
        (20.25488733, 102.8893122, 22.52524312, 0.0, 20.25488733),
        (10.1899085, 118.7202148, 50.0, 0.0, 10.1899085),
        (16.27593106, 152.2011247, 5.664441408, 10.63765222, 20.73949248),
    ],
    4: [
        (7.8709851352, 139.8495825, 543.1729418, 0.0, 7.870985135),
        (0.0, 159.8495825, 523.1729418, 0.0, 0.0),
        (15.30876397, 129.8495825, 533.1729418, 0.0, 15.30876397),
        (6.526730443, 149.8495825, 563.1729418, 0.0, 6.526730443),
        (0.0, 179.8495825, 518.1729418, 0.0, 0.0),
    ],
}


@pytest.mark.parametrize("path", ITU_PATHS)
@pytest.mark.parametrize("pair", range(5))
def test_diffraction_is_what_itu_r_publishes_for_its_own_paths(path, pair):
    reach_m, from_ground_m, to_ground_m, places = ITU_PATHS[path]
    from_above_m, to_above_m, frequency_hz = ITU_ANTENNAS[pair]
    bullington_db, from_height_m, to_height_m, smooth_db, whole_db = ITU_VALUES[path][pair]
    ends_m, wavelength_m = (from_ground_m + from_above_m, to_ground_m + to_above_m), ITU_LIGHT / frequency_hz
    sums = np.zeros(SUMS)
    clear_sums(sums)
    for place_m, ground_m in places:
        t = place_m / reach_m
        bulge_m = reach_m**2 * t * (1.0 - t) / (2.0 * ITU_RADIUS_M)
        put_obstacle(sums, t, ground_m + bulge_m - ends_m[0] - t * (ends_m[1] - ends_m[0]), bulge_m)
    found_db = bullington_loss(sums, reach_m, ends_m, wavelength_m)
    assert found_db == pytest.approx(bullington_db, abs=ITU_TOLERANCE_DB)
    heights_m = (from_height_m, to_height_m)
    over_db = spherical_loss(reach_m, heights_m, ITU_RADIUS_M, wavelength_m, False)
    assert over_db == pytest.approx(smooth_db, abs=ITU_TOLERANCE_DB)
    more_db = round_body_loss(reach_m, heights_m, ITU_RADIUS_M, wavelength_m, False)
    assert found_db + more_db == pytest.approx(whole_db, abs=ITU_TOLERANCE_DB)


def test_effective_heights_over_even_ground_are_those_of_the_antennas():
    # an even slope without obstacles: no loss beyond the smooth body's, whose antennas stand 40 and 30 m over it
    places_m = np.linspace(0.0, 30_000.0, 301)
    ground_m = 100.0 + places_m * 0.004
    found_db = profile_diffraction_db(places_m, ground_m, 140.0, 250.0, 400e6, effective_radius_m=8.5e6)
    alone_db = spherical_loss(30_000.0, (40.0, 30.0), 8.5e6, 299_792_458.0 / 400e6, True)
    assert alone_db > 5.0
    # Bullington's edge over the same profile is within it, so that the sum is the smooth body's
    assert found_db == pytest.approx(alone_db, abs=0.1)


@pytest.mark.parametrize(
    ("distance_m", "frequency_hz", "loss_db"),
    # Rec. ITU-R P.525: 32.4 + 20 lg f (MHz) + 20 lg d (km)
    [(1000.0, 1e6, 32.4), (100.0, 2440e6, 32.4 + 67.748 - 20.0), (25_240_000.0, 1575.42e6, 32.4 + 63.948 + 88.042)],
)
def test_free_space_is_that_of_the_recommendation(distance_m, frequency_hz, loss_db):
    assert free_space_loss_db([distance_m], frequency_hz)[0] == pytest.approx(loss_db, abs=0.06)


def test_gps_arrives_with_the_power_that_its_specification_promises():
    gps = RADIOS["gnss-l1"]
    arrives_dbm = gps.transmit_power_dbm - float(free_space_loss_db(25_240_000.0, gps.frequency_hz))
    assert arrives_dbm == pytest.approx(-128.5, abs=0.2)


def ridge(height_m=30.0):
    """A level plain of 1 km with a ridge one post wide in its middle, 10 m cells."""
    heights_m = np.zeros((21, 101), np.float32)
    heights_m[:, 50] = height_m
    return ElevationGrid(heights_m, 10.0, 10.0)


def test_a_ridge_costs_what_bullington_s_formula_says_of_its_edge():
    grid, radio = ridge(), RADIOS["868MHz"]
    found = signals(grid, [(100.0, -100.0, 10.0)], [(900.0, -100.0, 10.0)], radio, curvature=FLAT)
    # the edge, 20 m over the middle of 800 m: J(v), and what Bullington adds to it; the plain lies far below the zone
    v = 20.0 * math.sqrt(2.0 / radio.wavelength_m * (1.0 / 400.0 + 1.0 / 400.0))
    edge_db = 6.9 + 20.0 * math.log10(math.hypot(v - 0.1, 1.0) + v - 0.1)
    wanted_db = edge_db + (1.0 - math.exp(-edge_db / 6.0)) * (10.0 + 0.02 * 0.8)
    assert found.diffraction_db[0] == pytest.approx(wanted_db, abs=0.01)
    assert found.margin_db[0] == pytest.approx(
        14.0 + 2.15 + 123.0 - float(free_space_loss_db(800.0, 868e6)) - wanted_db, abs=0.01
    )
    assert found.margin_db[0] > 0.0  # hidden, and usable
    assert lines_of_sight(grid, [(100.0, -100.0, 10.0)], [(900.0, -100.0, 10.0)]).verdict[0] == 0
    back = signals(grid, [(900.0, -100.0, 10.0)], [(100.0, -100.0, 10.0)], radio, curvature=FLAT)
    assert back.margin_db[0] == pytest.approx(found.margin_db[0], abs=1e-9)


def test_a_building_costs_what_a_wall_of_ground_as_high_would():
    grid, radio = level(0.0, 21, 101, 10.0), RADIOS["868MHz"]
    house = Footprint(shapely.box(505.0, -200.0, 515.0, 0.0), 30.0)
    built = with_standing(grid, [standing_footprints(grid, [house])])
    ends = [(100.0, -100.0, 10.0)], [(900.0, -100.0, 10.0)]
    found = signals(built, *ends, radio, curvature=FLAT).diffraction_db[0]
    # both edges of its roof as one edge where the two horizons meet
    wanted = profile_diffraction_db([0, 405, 405, 415, 415, 800], [0, 0, 30, 30, 0, 0], 10.0, 10.0, 868e6)
    assert found == pytest.approx(wanted, abs=0.05)
    inside = signals(built, [(510.0, -100.0, 5.0)], ends[1], radio)
    assert inside.margin_db[0] == -math.inf
    assert inside.probability[0] == 0.0


def test_canopy_takes_what_its_model_says_on_top():
    grid, radio = level(0.0, 21, 101, 10.0), RADIOS["868MHz"]
    top_m = np.where(np.arange(101)[None, :] < 60, 20.0, 0.0) * np.ones((21, 1))
    forest = Canopy(grid, np.asarray(top_m, np.float32), np.zeros(grid.shape, np.float32))
    ends = [(300.0, -100.0, 10.0)], [(900.0, -100.0, 10.0)]
    bare, covered = signals(grid, *ends, radio), signals(grid, *ends, radio, foliage=Foliage(forest))
    # to the post after which it falls from 20 m to nothing over 10 m: half of that is above the line
    assert covered.canopy_m[0] == pytest.approx(295.0)
    wanted_db = weissberger_loss([295.0], 868e6).loss_db[0]
    assert bare.margin_db[0] - covered.margin_db[0] == pytest.approx(wanted_db)
    winter = signals(grid, *ends, radio, foliage=Foliage(forest, season=0.5))
    assert winter.canopy_db[0] == pytest.approx(wanted_db / 2.0)
    fitted = signals(grid, *ends, radio, foliage=Foliage(forest, "density", 0.01))
    assert fitted.canopy_db[0] == pytest.approx(295.0 * 0.01 * 10.0 / math.log(10.0))
    beyond = signals(grid, *ends, Radio(120e6, 10.0, -120.0), foliage=Foliage(forest))
    assert np.isnan(beyond.margin_db[0])
    assert "nothing is told at 120 MHz" in beyond.warnings[0]


def test_unknown_ground_is_an_unknown_signal():
    heights_m = np.zeros((21, 101), np.float32)
    heights_m[:, 40:60] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    ends = [(100.0, -100.0, 10.0)], [(900.0, -100.0, 10.0)]
    assert np.isnan(signals(grid, *ends, RADIOS["uwb"]).probability[0])
    assert signals(grid, *ends, RADIOS["uwb"], unknown="blocked").margin_db[0] == -math.inf
    assert np.isfinite(signals(grid, *ends, RADIOS["uwb"], unknown="open").margin_db[0])


def test_the_probability_is_that_of_a_log_normal_power():
    np.testing.assert_allclose(arrival_probability([0.0, 6.0, -6.0], 6.0), [0.5, 0.841345, 0.158655], atol=1e-6)
    np.testing.assert_array_equal(arrival_probability([0.0, -0.1, np.nan], 0.0), [1.0, 0.0, np.nan])


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"frequency_hz": 1e6}, "frequency_hz must lie between"),
        ({"spread_db": -1.0}, "spread_db must be >= 0"),
        ({"transmit_power_dbm": math.nan}, "transmit_power_dbm must be a finite number"),
        ({"polarization": "round"}, "polarization must be one of"),
    ],
)
def test_a_radio_that_is_none_is_refused(wrong, sentence):
    with pytest.raises(SignalError, match=sentence):
        Radio(**{"frequency_hz": 868e6, "transmit_power_dbm": 14.0, "sensitivity_dbm": -123.0, **wrong})


def test_profiles_that_are_none_are_refused():
    for places_m, ground_m in (
        ([0.0], [1.0]),
        ([0.0, 1.0], [1.0]),
        ([1.0, 0.0], [0.0, 0.0]),
        ([0.0, 1.0], [0.0, math.nan]),
    ):
        with pytest.raises(SignalError):
            profile_diffraction_db(places_m, ground_m, 10.0, 10.0, 1e9)
