"""What one line of sight, and many, answer over unknown ground, over borders, and to bad input."""

import math

import numpy as np
import pytest

from terrain import ElevationGrid
from visibility import HIDDEN, UNKNOWN, VISIBLE, Curvature, VisibilityInputError, line_of_sight, lines_of_sight

ROUNDING_M = 1e-6
FOUR_THIRDS_EARTH = Curvature(6_371_000.0, 4.0 / 3.0)


def ridge(height_m=10.0, cols=41, rows=21, cell_m=10.0):
    """Level ground with a knife-edge ridge along its middle column."""
    heights_m = np.zeros((rows, cols), np.float32)
    heights_m[:, cols // 2] = height_m
    return ElevationGrid(heights_m, cell_m, cell_m)


# -- unknown ground


def void_strip():
    heights_m = np.zeros((11, 21), np.float32)
    heights_m[:, 10] = np.nan
    return ElevationGrid(heights_m, 10.0, 10.0)


def test_unknown_ground_under_the_line_makes_it_unknown_unless_known_ground_blocks_it():
    sight = line_of_sight(void_strip(), (0, -45, 5), (200, -45, 5), wavelength_m=0.1, dem_sigma_m=1.0)
    assert (sight.verdict, sight.blocked_by) == ("unknown", None)
    assert sight.clearance_m == 5.0  # over the known ground
    assert all(math.isnan(v) for v in (sight.fresnel_clearance, sight.excess_path_m, sight.probability_clear))
    assert math.isnan(sight.diffraction_loss_db)
    assert sight.warnings == ("The line passes over unknown ground, so what depends on the ground there is not known.",)


def test_known_ground_that_blocks_tells_the_probability_also_beside_unknown_ground():
    heights_m = void_strip().heights_m.copy()
    heights_m[:, 5] = 10.0
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    for altitude_m, expected in ((5.0, 0.5 * math.erfc(5.0 / math.sqrt(2.0))), (-90.0, 0.0)):
        sight = line_of_sight(grid, (0, -45, altitude_m), (200, -45, altitude_m), dem_sigma_m=1.0)
        assert (sight.verdict, sight.blocked_by) == ("blocked", "ground")
        assert sight.probability_clear == pytest.approx(expected, abs=1e-12)
        assert "passes over unknown ground" in sight.warnings[-1]
    assert math.isnan(line_of_sight(grid, (0, -45, 11), (200, -45, 11), dem_sigma_m=1.0).probability_clear)


def test_the_caller_may_take_unknown_ground_as_open_or_as_blocking():
    ends = (0, -45, 5), (200, -45, 5)
    opened = line_of_sight(void_strip(), *ends, unknown="open", wavelength_m=0.1, dem_sigma_m=1.0)
    assert (opened.verdict, opened.excess_path_m, opened.blocked_by) == ("clear", 0.0, None)
    assert opened.warnings == ("The line passes over unknown ground, which was taken as not blocking, as asked.",)
    assert opened.probability_clear == pytest.approx(1.0)
    shut = line_of_sight(void_strip(), *ends, unknown="blocked", dem_sigma_m=1.0)
    assert (shut.verdict, shut.blocked_by, shut.probability_clear) == ("blocked", "unknown ground", 0.0)


def test_a_line_along_a_known_edge_beside_unknown_ground_is_known():
    heights_m = np.zeros((5, 5), np.float32)
    heights_m[3:, :] = np.nan
    grid = ElevationGrid(heights_m, 7.3, 11.1, 123.4, 567.8)
    north_m = grid.position_of(2, 0)[1]
    assert line_of_sight(grid, (123.4, north_m, 1.0), (123.4 + 4 * 7.3, north_m, 1.0)).verdict == "clear"
    assert line_of_sight(grid, (123.4, north_m - 0.01, 1.0), (150.0, north_m - 0.01, 1.0)).verdict == "unknown"


def test_an_end_over_unknown_ground_makes_the_line_unknown():
    heights_m = np.zeros((4, 4), np.float32)
    heights_m[3, 3] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    assert line_of_sight(grid, (29, -29, 5), (29, -29, 50)).verdict == "unknown"
    assert line_of_sight(grid, (5, -5, 5), (28, -28, 50)).verdict == "unknown"
    assert line_of_sight(grid, (5, -5, 5), (20, -20, 50)).verdict == "clear"


def test_all_unknown_ground_answers_unknown_with_nothing_in_the_way():
    grid = ElevationGrid(np.full((4, 4), np.nan, np.float32), 10.0, 10.0)
    sight = line_of_sight(grid, (5, -5, 5), (25, -25, 5), wavelength_m=0.1)
    assert (sight.verdict, sight.clearance_m, sight.blocking_point_m) == ("unknown", math.inf, None)
    assert sight.blocking_distance_m is None


# -- outside the DEM


def test_ground_outside_the_dem_does_not_block_and_is_warned_about():
    sight = line_of_sight(ridge(), (-500, -95, 5.0), (900, -95, 5.0))
    assert (sight.verdict, sight.clearance_m) == ("blocked", pytest.approx(-5.0))
    (warning,) = sight.warnings
    assert "outside the DEM" in warning
    beside = line_of_sight(ridge(), (-500, 10, -5.0), (900, 10, -5.0), wavelength_m=0.1)
    assert (beside.verdict, beside.clearance_m, beside.blocking_point_m) == ("clear", math.inf, None)
    assert beside.warnings == sight.warnings


def test_many_lines_carry_one_warning_with_their_count():
    sight = lines_of_sight(ridge(), [(0, -95, 5)] * 3, [(400, -95, 5), (500, -95, 5), (600, -95, 50)])
    assert sight.verdict.tolist() == [HIDDEN, HIDDEN, VISIBLE]
    assert sight.leaves_dem.tolist() == [False, True, True]
    assert [warning.split(":")[0] for warning in sight.warnings] == ["2 of 3 lines"]


def test_a_batch_says_what_each_line_alone_says():
    heights_m = np.random.default_rng(3).uniform(0, 30, (15, 18)).astype(np.float32)
    heights_m[4, 5] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 14.0)
    rng = np.random.default_rng(4)
    start_m = np.column_stack([rng.uniform(-30, 200, 40), rng.uniform(-230, 30, 40), rng.uniform(0, 60, 40)])
    end_m = np.column_stack([rng.uniform(-30, 200, 40), rng.uniform(-230, 30, 40), rng.uniform(0, 60, 40)])
    many = lines_of_sight(grid, start_m, end_m, wavelength_m=0.1, dem_sigma_m=2.0, excess_path=True)
    words = {int(VISIBLE): "clear", int(HIDDEN): "blocked", int(UNKNOWN): "unknown"}
    for i in range(40):
        one = line_of_sight(grid, start_m[i], end_m[i], wavelength_m=0.1, dem_sigma_m=2.0)
        assert one.verdict == words[int(many.verdict[i])]
        assert one.clearance_m == many.clearance_m[i]
        for name in ("excess_path_m", "fresnel_clearance", "probability_clear"):
            np.testing.assert_equal(getattr(one, name), getattr(many, name)[i])


def test_no_lines_are_no_answers():
    sight = lines_of_sight(ridge(), [], [], wavelength_m=0.1, dem_sigma_m=1.0, excess_path=True)
    assert sight.verdict.shape == sight.clearance_m.shape == sight.fresnel_clearance.shape == (0,)
    assert sight.blocking_point_m.shape == (0, 3)


# -- bad input


@pytest.mark.parametrize(
    ("from_point", "sentence"),
    [
        ((1.0, 2.0), "from_point must be three numbers"),
        ([(1.0, 2.0, 3.0)], "from_point must be three numbers"),
        ((1.0, math.nan, 3.0), r"from_point must be three finite numbers, not \[1.0, nan, 3.0\]"),
        ((1.0, -math.inf, 3.0), "from_point must be three finite numbers"),
        (("a", "b", "c"), "from_point must hold numbers"),
        ((2e6, 0.0, 3.0), "from_point is 2000 km outside the DEM .*are its coordinates in the DEM's CRS?"),
    ],
)
def test_points_that_make_no_question_are_refused_by_name(from_point, sentence):
    with pytest.raises(VisibilityInputError, match=sentence):
        line_of_sight(ridge(), from_point, (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"to_points_m": np.zeros((2, 3))}, "Each line needs two points, not 3 from_points_m and 2 to_points_m"),
        ({"to_points_m": np.zeros((3, 2))}, r"to_points_m must hold one row of east, north and altitude .*\(3, 2\)"),
        ({"to_points_m": np.zeros((1, 3, 3))}, "to_points_m must hold one row of east, north and altitude"),
        ({"to_points_m": [(0, 0, 1), (0, 0, 1), (0, 0, math.nan)]}, r"to_points_m\[2\] must be three finite numbers"),
        ({"unknown": "maybe"}, "unknown must be one of unknown, open, blocked, not 'maybe'"),
        ({"wavelength_m": 0.0}, "wavelength_m must be a positive number of metres, not 0.0"),
        ({"wavelength_m": math.nan}, "wavelength_m must be a positive number"),
        ({"dem_sigma_m": -1.0}, "dem_sigma_m must be a positive number of metres, not -1.0"),
    ],
)
def test_questions_that_cannot_be_answered_are_refused_in_one_sentence(arguments, sentence):
    question = {"from_points_m": np.zeros((3, 3)), "to_points_m": np.zeros((3, 3))} | arguments
    with pytest.raises(VisibilityInputError, match=sentence):
        lines_of_sight(ridge(), **question)


def test_nobody_writes_into_the_callers_points():
    start_m, end_m = np.array([[0.0, -95.0, 5.0]]), np.array([[400.0, -95.0, 5.0]])
    before = start_m.copy(), end_m.copy()
    lines_of_sight(ridge(), start_m, end_m, excess_path=True, wavelength_m=0.1)
    np.testing.assert_array_equal((start_m, end_m), before)
