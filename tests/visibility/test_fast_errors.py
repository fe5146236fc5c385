"""What fast mode says of its own errors on a ground, against what it is off by there."""

import numpy as np
import pytest

from benchmarks.terrains import fractal_grid
from benchmarks.visibility.situations import SITUATIONS, judged, window_of
from terrain import ElevationGrid
from tests.visibility.grounds import clearing_eye, hills, real_dem, rough
from visibility import FLAT, min_visible_altitude
from visibility.sight.fast_errors import fast_errors


def holed(grid, seed=0):
    """The same with a pond and single posts of unknown ground."""
    heights_m = grid.heights_m.copy()
    heights_m[20:34, 40:49] = np.nan
    heights_m[np.random.default_rng(seed).random(grid.shape) < 0.002] = np.nan
    return ElevationGrid(heights_m, grid.cell_east_m, grid.cell_north_m)


@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize("seed", range(5))
def test_errors_on_made_ground_stay_within_what_the_answer_says(situation, seed):
    random = np.random.default_rng(100 + seed)
    grid = fractal_grid(256, seed=20 + seed)
    for ground in (window_of(grid, 60, random), window_of(grid, 200, random), holed(grid, seed)):
        assert judged(ground, situation, random).used_up <= 1.0


@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize(
    "name",
    ["bigtujunga.tif", "N44W072.hgt", "N46E008.tif", "mmgis_gale_missionDEM.tif", "gvi_vancouver_DSM.tif",
     "viewscape_test_dsm.tif", "jancaha_dsm.tif", "n43.dt0"],
)  # fmt: skip
def test_errors_on_windows_of_real_ground_stay_within_what_the_answer_says(name, situation):
    grid, random = real_dem(name), np.random.default_rng(hash_of(name, situation))
    parts = [window_of(grid, 100, random) for _ in range(3)]
    for part in parts:
        assert part is None or judged(part, situation, random).used_up <= 1.0


def hash_of(*words):
    return sum(ord(letter) for word in words for letter in word)


def test_a_ground_that_hides_nothing_is_said_to_be_nearly_right():
    grid = rough(0, 200, 200, relief_m=0.0)
    answer = min_visible_altitude(grid, [clearing_eye(grid, 40.0, 50.0, above_m=80.0)], "fast", FLAT)
    said = fast_errors(grid.heights_m, answer.altitude_m)
    assert said.misclassified == 0.0
    assert said.misclassified_most < 0.001
    assert said.unknown_most == 0.0
    assert said.large_error_m == 0.0


def test_the_sentence_tells_the_figures_of_this_ground():
    grid = hills()
    answer = min_visible_altitude(grid, [clearing_eye(grid, 10.0, 12.0)], "fast", FLAT)
    said = fast_errors(grid.heights_m, answer.altitude_m)
    assert answer.error_statement == said.sentence()
    assert f"at most {100.0 * said.misclassified_most:.2g} %" in answer.error_statement
    assert "unknown" not in answer.error_statement
    other = min_visible_altitude(holed(fractal_grid(64)), [clearing_eye(grid, 10.0, 12.0, 2000.0)], "fast", FLAT)
    assert "called unknown" in other.error_statement
    assert min_visible_altitude(grid, answer.anchors, "exact", FLAT).error_statement.startswith("every edge")


@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (1, 1), (2, 2)])
def test_a_ground_of_a_line_or_a_post_has_a_statement_too(shape):
    grid = ElevationGrid(np.zeros(shape, np.float32), 30.0, 30.0)
    answer = min_visible_altitude(grid, [clearing_eye(grid, 0.0, 0.0)], "fast", FLAT)
    assert answer.error_statement.startswith("rays in float32")
