"""What one line of sight answers where the answer has a closed form."""

import math

import numpy as np
import pytest
from scipy.special import fresnel

from terrain import ElevationGrid
from tests.reference.line_of_sight import shortest_way_over
from visibility import FLAT, Anchor, Curvature, line_of_sight, lines_of_sight, min_visible_altitude, profile
from visibility.sight import fresnel_radius_m, knife_edge_loss_db

ROUNDING_M = 1e-6
FOUR_THIRDS_EARTH = Curvature(6_371_000.0, 4.0 / 3.0)


def ridge(height_m=10.0, cols=41, rows=21, cell_m=10.0):
    """Level ground with a knife-edge ridge along its middle column."""
    heights_m = np.zeros((rows, cols), np.float32)
    heights_m[:, cols // 2] = height_m
    return ElevationGrid(heights_m, cell_m, cell_m)


# -- closed forms


@pytest.mark.parametrize("altitude_m", [3.0, 9.0, 10.0, 11.0, 40.0])
def test_clearance_over_a_knife_ridge_is_altitude_minus_its_height(altitude_m):
    sight = line_of_sight(ridge(), (0.0, -95.0, altitude_m), (400.0, -95.0, altitude_m))
    assert sight.clearance_m == pytest.approx(altitude_m - 10.0, abs=ROUNDING_M)
    assert sight.verdict == ("clear" if altitude_m >= 10.0 else "blocked")
    assert sight.blocked_by == (None if altitude_m >= 10.0 else "ground")
    assert sight.blocking_point_m == pytest.approx((200.0, -95.0, 10.0))
    assert sight.blocking_distance_m == pytest.approx(200.0)
    assert sight.distance_m == pytest.approx(400.0)


def test_a_slanted_line_clears_the_ridge_by_its_altitude_there():
    sight = line_of_sight(ridge(), (100.0, -20.0, 2.0), (400.0, -180.0, 62.0))
    assert sight.clearance_m == pytest.approx(2.0, abs=ROUNDING_M)  # at its start; over the ridge it is 22 - 10 m up
    assert sight.blocking_distance_m == 0.0
    shallow = line_of_sight(ridge(), (100.0, -20.0, 14.0), (400.0, -180.0, 5.0))
    assert shallow.clearance_m == pytest.approx(1.0, abs=ROUNDING_M)


def test_curvature_lifts_the_ground_between_by_d1_d2_over_2kr():
    flat = ElevationGrid(np.zeros((3, 201), np.float32), 100.0, 100.0)
    sight = line_of_sight(flat, (0, -100, 50.0), (20_000, -100, 50.0), curvature=FOUR_THIRDS_EARTH)
    bulge_m = 10_000.0 * 10_000.0 / (2.0 * 4.0 / 3.0 * 6_371_000.0)
    assert sight.clearance_m == pytest.approx(50.0 - bulge_m, abs=ROUNDING_M)
    assert sight.blocking_distance_m == pytest.approx(10_000.0)
    assert "6371.0 km" in sight.curvature.sentence()
    assert line_of_sight(flat, (0, -100, 50.0), (20_000, -100, 50.0)).clearance_m == pytest.approx(50.0)


@pytest.mark.parametrize("bearing", ["east", "west", "oblique"])
def test_the_horizon_over_a_plane_is_seen_at_99_percent_and_lost_at_101(bearing):
    cell_m, low_m, high_m = 200.0, 2.0, 30.0
    plane = ElevationGrid(np.zeros((120, 150), np.float32), cell_m, cell_m, 500_000.0, 3_800_000.0, crs="EPSG:32611")
    assumed = Curvature.of(plane)
    assert assumed.refraction_k == pytest.approx(4.0 / 3.0)
    reach_m = sum(math.sqrt(2.0 * assumed.refraction_k * assumed.radius_m * h) for h in (low_m, high_m))
    assert 28_000.0 < reach_m < 29_000.0
    start, along = {
        "east": ((500_050.0, 3_799_000.0), (1.0, 0.0)),
        "west": ((529_700.0, 3_799_130.0), (-1.0, 0.0)),
        "oblique": ((500_100.0, 3_799_900.0), (0.8, -0.6)),
    }[bearing]
    for share, verdict in ((0.99, "clear"), (1.01, "blocked")):
        end = [start[i] + share * reach_m * along[i] for i in (0, 1)]
        assert line_of_sight(plane, (*start, low_m), (*end, high_m)).verdict == verdict
        assert line_of_sight(plane, (*start, high_m), (*end, low_m)).verdict == verdict
        assert line_of_sight(plane, (*start, high_m), (*end, low_m), curvature=FLAT).verdict == "clear"


def test_the_first_fresnel_zone_is_the_published_radius_and_the_ridge_cuts_it():
    # 2.4 GHz over 400 m: 3.53 m at the middle
    wavelength_m = 299_792_458.0 / 2.4e9
    assert float(fresnel_radius_m(wavelength_m, 200.0, 200.0)) == pytest.approx(3.534, abs=1e-3)
    assert float(fresnel_radius_m(0.1, 100.0, 300.0)) == pytest.approx(math.sqrt(7.5))
    sight = line_of_sight(ridge(), (0, -95, 12.0), (400, -95, 12.0), wavelength_m=wavelength_m)
    assert sight.fresnel_clearance == pytest.approx(2.0 / 3.534, abs=1e-3)
    assert sight.diffraction_loss_db == 0.0  # v = -sqrt(2)·0.566 = -0.80: just free of loss


def test_the_knife_edge_loss_is_that_of_the_fresnel_integrals():
    np.testing.assert_allclose(knife_edge_loss_db(0.0), 6.02, atol=0.05)  # half the wave front
    depth = np.linspace(-6.0, 0.5, 200)
    sine, cosine = fresnel(-np.sqrt(2.0) * depth)
    exact_db = -20.0 * np.log10(np.hypot(1.0 - cosine - sine, cosine - sine) / 2.0)
    np.testing.assert_allclose(knife_edge_loss_db(depth), exact_db, atol=0.25)  # the recommendation's approximation


def test_the_fresnel_clearance_is_found_between_edges_too():
    rng = np.random.default_rng(1)
    heights_m = rng.uniform(0.0, 20.0, (6, 7)).astype(np.float32)
    grid = ElevationGrid(heights_m, 300.0, 200.0)
    start_m = np.column_stack([rng.uniform(0, 1800, 30), rng.uniform(-1000, 0, 30), rng.uniform(21.0, 60.0, 30)])
    end_m = np.column_stack([rng.uniform(0, 1800, 30), rng.uniform(-1000, 0, 30), rng.uniform(21.0, 60.0, 30)])
    answers = lines_of_sight(grid, start_m, end_m, wavelength_m=0.3).fresnel_clearance
    for start, end, answer in zip(start_m, end_m, answers, strict=True):
        ground = profile(grid, start, end)
        reach_m, length_m = ground.distance_m[-1], math.dist(start, end)
        share = np.linspace(0.0, 1.0, 20_001)[1:-1]
        above_m = np.interp(share * reach_m, ground.distance_m, ground.clearance_m) * reach_m / length_m
        zone_m = fresnel_radius_m(0.3, share * length_m, (1.0 - share) * length_m)
        assert answer == pytest.approx((above_m / zone_m).min(), rel=1e-4)


def test_an_end_on_the_ground_touches_its_zone_and_one_below_has_none():
    on_ground = line_of_sight(ridge(), (20, -95, 0.0), (100, -95, 50.0), wavelength_m=0.1)
    assert (on_ground.verdict, on_ground.fresnel_clearance) == ("clear", 0.0)
    below = line_of_sight(ridge(), (20, -95, -1.0), (100, -95, 50.0), wavelength_m=0.1)
    assert (below.verdict, below.fresnel_clearance, below.excess_path_m) == ("blocked", -math.inf, math.inf)
    assert below.diffraction_loss_db == math.inf
    assert below.warnings == ("The line ends below the ground and is blocked there.",)


@pytest.mark.parametrize("altitude_m", [0.5, 5.0, 9.9])
def test_the_excess_path_over_a_knife_edge_is_its_two_slants_minus_the_straight_line(altitude_m):
    sight = line_of_sight(ridge(), (0, -95, altitude_m), (400, -95, altitude_m))
    assert sight.excess_path_m == pytest.approx(2.0 * math.hypot(200.0, 10.0 - altitude_m) - 400.0, abs=1e-9)


def test_the_excess_path_is_zero_when_clear():
    assert line_of_sight(ridge(), (0, -95, 10.0), (400, -95, 10.0)).excess_path_m == 0.0


def test_the_excess_path_is_the_shortest_way_over_any_profile():
    rng = np.random.default_rng(2)
    for _ in range(40):
        ground_m = rng.uniform(0.0, 30.0, 12).astype(np.float32)
        grid = ElevationGrid(ground_m[None, :], 10.0, 10.0)
        start_m, end_m = float(ground_m[0]) + rng.uniform(0, 8), float(ground_m[-1]) + rng.uniform(0, 8)
        sight = line_of_sight(grid, (0.0, 0.0, start_m), (110.0, 0.0, end_m))
        way_m = shortest_way_over(np.arange(12) * 10.0, ground_m.astype(float), start_m, end_m)
        assert sight.excess_path_m == pytest.approx(way_m - sight.distance_m, abs=1e-7)


def test_probability_is_phi_of_clearance_over_sigma():
    over = {
        h: line_of_sight(ridge(), (0, -95, h), (400, -95, h), dem_sigma_m=5.0).probability_clear for h in (5, 10, 15)
    }
    assert over[10] == pytest.approx(0.5)
    assert over[15] == pytest.approx(0.841345, abs=1e-6)
    assert over[5] == pytest.approx(1.0 - 0.841345, abs=1e-6)


def test_the_profile_meets_every_edge_once_and_says_where_the_line_is():
    ground = profile(ridge(), (0.0, -100.0, 5.0), (400.0, -100.0, 25.0))
    np.testing.assert_allclose(ground.distance_m, np.arange(41) * 10.0)
    np.testing.assert_allclose(ground.ground_m, np.where(np.arange(41) == 20, 10.0, 0.0))
    np.testing.assert_allclose(ground.line_m, 5.0 + np.arange(41) * 0.5)
    np.testing.assert_allclose(ground.clearance_m, ground.line_m - ground.ground_m)
    slanted = profile(ridge(), (3.0, -7.0, 5.0), (391.0, -188.0, 25.0), curvature=FOUR_THIRDS_EARTH)
    assert (np.diff(slanted.distance_m) > 0.0).all()
    assert slanted.clearance_m.min() == pytest.approx(
        line_of_sight(ridge(), (3.0, -7.0, 5.0), (391.0, -188.0, 25.0), curvature=FOUR_THIRDS_EARTH).clearance_m
    )


# -- touching, vertical, equal


def test_a_line_that_touches_the_ground_is_clear_and_one_a_millimetre_below_is_not():
    assert line_of_sight(ridge(), (0, -95, 10.0), (400, -95, 10.0)).verdict == "clear"
    assert line_of_sight(ridge(), (0, -95, 0.0), (100, -95, 0.0)).verdict == "clear"
    assert line_of_sight(ridge(), (0, -95, 9.999), (400, -95, 9.999)).verdict == "blocked"


def test_a_vertical_line_is_clear_above_the_ground_and_blocked_through_it():
    assert line_of_sight(ridge(), (200, -95, 10.0), (200, -95, 500.0), wavelength_m=0.1).verdict == "clear"
    through = line_of_sight(ridge(), (200, -95, 5.0), (200, -95, 500.0))
    assert (through.verdict, through.clearance_m) == ("blocked", pytest.approx(-5.0))


def test_two_equal_points_see_each_other_above_ground():
    sight = line_of_sight(ridge(), (55.0, -95.0, 3.0), (55.0, -95.0, 3.0), wavelength_m=0.1, dem_sigma_m=1.0)
    assert (sight.verdict, sight.clearance_m, sight.distance_m, sight.excess_path_m) == ("clear", 3.0, 0.0, 0.0)


# -- profiles of one row or column


@pytest.mark.parametrize("turned", [False, True])
def test_a_single_row_is_a_line_of_ground_with_nothing_beside_it(turned):
    profile_m = np.array([[0, 0, 9, 0, 0]], np.float32)
    grid = ElevationGrid(profile_m.T if turned else profile_m, 10.0, 10.0)

    def along(*ends):
        return line_of_sight(grid, *([(north, -east, up) for east, north, up in ends] if turned else ends))

    on_it = along((0.0, 0.0, 5.0), (40.0, 0.0, 5.0))
    assert (on_it.clearance_m, on_it.warnings) == (pytest.approx(-4.0), ())
    across = along((0.0, 70.0, 5.0), (40.0, -70.0, 5.0))
    assert across.clearance_m == pytest.approx(-4.0)
    assert across.blocking_distance_m == pytest.approx(math.hypot(20.0, 70.0))
    for aside_m in (10.0, -10.0):
        beside = along((0.0, aside_m, 5.0), (40.0, aside_m, 5.0))
        assert (beside.verdict, beside.clearance_m) == ("clear", math.inf)
        assert "outside the DEM" in beside.warnings[0]


@pytest.mark.parametrize("shape", [(1, 9), (9, 1), (1, 1)])
@pytest.mark.parametrize("mode", ["exact", "fast"])
def test_lines_and_maps_agree_on_a_single_row_or_column(shape, mode):
    rng = np.random.default_rng(5)
    grid = ElevationGrid(rng.uniform(100.0, 130.0, shape).astype(np.float32), 30.0, 20.0, 1000.0, 5000.0)
    for beside_m in (0.0, 60.0, -60.0, 7.0, -7.0):
        along_m = 45.0 if max(shape) > 1 else 0.0
        east_m, north_m = (along_m, beside_m) if shape[0] == 1 else (beside_m, -along_m)
        eye = Anchor("A", 1000.0 + east_m, 5000.0 + north_m, 128.0)
        lowest_m = min_visible_altitude(grid, [eye], mode=mode, curvature=FLAT).altitude_m[0]
        for row, col in np.ndindex(shape):
            above_m = max(float(lowest_m[row, col]), float(grid.heights_m[row, col]))
            for step_m, verdict in ((0.01, "clear"), (-0.01, "blocked")):
                end = (*grid.position_of(row, col), above_m + step_m)
                sight = line_of_sight(grid, (eye.east_m, eye.north_m, eye.altitude_m), end, curvature=FLAT)
                assert sight.verdict == verdict, (beside_m, row, col)


def test_ground_beside_a_single_row_hides_nothing():
    grid = ElevationGrid(np.array([[100, 100, 150, 100, 100]], np.float32), 30.0, 30.0)
    for side in (1.0, -1.0):
        assert line_of_sight(grid, (45.0, side * 60.0, 110.0), (0.0, 0.0, 101.0)).verdict == "clear"
        lowest_m = min_visible_altitude(grid, [Anchor("A", 45.0, side * 60.0, 110.0)], mode="exact").altitude_m
        np.testing.assert_array_equal(lowest_m[0], grid.heights_m)


def test_a_single_post_is_ground_where_it_stands():
    grid = ElevationGrid(np.array([[7.0]], np.float32), 10.0, 10.0)
    assert line_of_sight(grid, (-10.0, 4.0, 9.0), (20.0, -8.0, 12.0)).clearance_m == pytest.approx(3.0)
    assert line_of_sight(grid, (-5.0, 3.0, 9.0), (50.0, 80.0, 12.0)).clearance_m == math.inf
