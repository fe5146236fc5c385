"""Unknown ground is a third answer."""

import numpy as np
import pytest

from terrain import ElevationGrid
from tests.reference.minimum_altitude import minimum_altitude
from tests.visibility.grounds import eye, rough
from visibility import HIDDEN, UNKNOWN, VISIBLE, VisibilityInputError, min_visible_altitude

MODES = ["fast", "exact"]


def with_voids(seed, share=0.04):
    grid = rough(seed, 15, 18)
    heights_m = grid.heights_m.copy()
    heights_m[np.random.default_rng(seed).random(heights_m.shape) < share] = np.nan
    return ElevationGrid(heights_m, 30.0, 30.0)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("place", [(7.0, 8.0), (3.3, 11.7), (-6.0, 4.0), (9.5, 30.0)])
def test_exactly_the_lines_that_meet_unknown_edges_are_unknown(seed, place):
    grid = with_voids(seed)
    result = min_visible_altitude(grid, [eye(grid, *place, 55.0)], mode="exact")
    lowest_m, unknown = minimum_altitude(grid.heights_m, (*place, 55.0), (30.0, 30.0))
    np.testing.assert_array_equal(np.isnan(result.altitude_m[0]), unknown)
    known = ~np.isnan(lowest_m) & np.isfinite(lowest_m)
    np.testing.assert_allclose(result.hidden_below_m[0][known], lowest_m[known], rtol=0, atol=1e-3)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("along", ["a row", "a column", "a diagonal"])
def test_a_post_with_unknown_ground_on_both_sides_hides_what_is_straight_behind_it(along, mode):
    heights_m = np.full((9, 9), np.nan)
    line = {"a row": (4, slice(None)), "a column": (slice(None), 4), "a diagonal": (range(9), range(9))}[along]
    heights_m[line] = [0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    grid = ElevationGrid(heights_m, 30.0, 30.0)
    at = {"a row": (4, 0), "a column": (0, 4), "a diagonal": (0, 0)}[along]
    result = min_visible_altitude(grid, [eye(grid, *at, 5.0)], mode=mode)
    expected_m = [0.0, 0.0, 10.0, 12.5, 15.0, 17.5, 20.0, 22.5, 25.0]
    np.testing.assert_allclose(result.altitude_m[0][line], expected_m, rtol=0, atol=1e-3)


@pytest.mark.parametrize("mode", MODES)
def test_known_ground_that_blocks_makes_hidden_out_of_unknown(mode):
    heights_m = np.zeros((5, 9))
    heights_m[:, 3] = np.nan
    heights_m[:, 5] = 20.0
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    result = min_visible_altitude(grid, [eye(grid, 2, 0, 5.0)], mode=mode)
    low, high = result.visible(altitude_m=1.0)[0, 2], result.visible(altitude_m=500.0)[0, 2]
    assert low[1] == VISIBLE
    assert low[4] == UNKNOWN
    assert low[7] == HIDDEN
    assert high[7] == UNKNOWN
    assert np.isnan(result.altitude_m[0, 2, 7])
    assert result.hidden_below_m[0, 2, 7] == pytest.approx(5.0 + 15.0 / 5.0 * 7.0)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("unknown", "answer"), [("unknown", UNKNOWN), ("open", VISIBLE), ("blocked", HIDDEN)])
def test_the_caller_may_choose_what_unknown_ground_does(mode, unknown, answer):
    heights_m = np.zeros((5, 9))
    heights_m[:, 3] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    result = min_visible_altitude(grid, [eye(grid, 2, 0, 5.0)], mode=mode, unknown=unknown)
    assert (result.visible(above_ground_m=1.0)[0, :, 5:] == answer).all()
    # a receiver above unknown ground has no altitude, whatever lines over it do
    assert (result.visible(above_ground_m=1.0)[0, :, 3] == UNKNOWN).all()


def test_unknown_ground_never_clears_what_open_ground_hides():
    for seed in range(6):
        grid = with_voids(seed)
        anchor = eye(grid, 7, 8, 55.0)
        open_, third = (
            min_visible_altitude(grid, [anchor], unknown=u).visible(above_ground_m=2.0) for u in ("open", "unknown")
        )
        assert not ((open_ == HIDDEN) & (third == VISIBLE)).any()
        assert not ((open_ == VISIBLE) & (third == HIDDEN)).any()


def test_an_anchor_over_unknown_ground_is_warned_about_and_sees_nothing_for_certain():
    heights_m = np.zeros((7, 7))
    heights_m[3, 3] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    result = min_visible_altitude(grid, [eye(grid, 3, 3, 30.0)], mode="exact")
    assert "unknown ground" in result.warnings[0]
    assert (result.visible(above_ground_m=1.0) != VISIBLE).all()


def test_a_misspelt_choice_is_refused_with_the_choices():
    grid = rough(0, 4, 4)
    with pytest.raises(VisibilityInputError, match="unknown, open, blocked"):
        min_visible_altitude(grid, [eye(grid, 1, 1, 99.0)], unknown="ignore")
    with pytest.raises(VisibilityInputError, match="fast, exact"):
        min_visible_altitude(grid, [eye(grid, 1, 1, 99.0)], mode="quick")


@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_a_void_post_straight_below_the_anchor_is_open_like_its_neighbours_when_asked(mode):
    heights_m = np.zeros((9, 9))
    heights_m[4, 4] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    answer = min_visible_altitude(grid, [eye(grid, 4, 4, 100.0)], mode, unknown="open")
    assert (answer.visible(altitude_m=50.0) == VISIBLE).all()
    assert not np.isnan(answer.altitude_m).any()
