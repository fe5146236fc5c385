"""Protection levels as a product: the library's numbers over posts and along a path, areas, spacing, refusals."""

import numpy as np
import pytest
from pydantic import ValidationError

from planning.driving import protection_over_map
from service.products.protection_levels.calculate import PATH_COLUMNS, calculate_protection
from service.products.protection_levels.request import ProtectionParameters, anchors_of
from tests.service.asked import ASKED
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, NORTH_M, WEST_M, small_grid

ANCHORS = [
    {"id": name, "east_m": WEST_M + east_m, "north_m": NORTH_M - south_m, "altitude_m": 900.0, "ranging_sigma_m": 0.3}
    for name, east_m, south_m in zip(
        "ABCDE", (0.0, 860.0, 0.0, 860.0, 430.0), (0.0, 0.0, 460.0, 460.0, 0.0), strict=True
    )
]


def asked(**fields):
    return calculate_protection(small_grid(), ProtectionParameters.model_validate({"anchors": ANCHORS, **fields}))


def test_a_post_has_the_level_of_an_antenna_over_it():
    finished, grid = asked(height_sigma_m=2.0, receiver_above_ground_m=3.0), small_grid()
    row, col = 12, 25
    place_m = (WEST_M + col * CELL_EAST_M, NORTH_M - row * CELL_NORTH_M, float(grid.heights_m[row, col]) + 3.0)
    anchors = anchors_of(grid, finished.parameters)
    one = protection_over_map(grid, [place_m], anchors, height_sigma_m=2.0, risk=finished.parameters.risk())
    assert finished.horizontal[row, col] == pytest.approx(one.horizontal_m[0], rel=1e-6)
    assert finished.vertical[row, col] == pytest.approx(one.vertical_m[0], rel=1e-6)
    assert (np.isnan(finished.horizontal) == np.isnan(grid.heights_m)).all()


def test_fewer_posts_are_some_of_the_same():
    whole, some = asked(height_sigma_m=2.0), asked(height_sigma_m=2.0, spacing_m=60.0)
    np.testing.assert_array_equal(some.horizontal, whole.horizontal[::3, ::2])
    assert (some.grid.cell_east_m, some.grid.cell_north_m) == (60.0, 60.0)


def test_along_a_path_the_first_point_beyond_the_alert_limits_is_told():
    fields = dict(ASKED["protection-levels"])
    finished = calculate_protection(small_grid(), ProtectionParameters.model_validate(fields))
    told, numbers = finished.answer.path, finished.path_numbers
    level = numbers[:, PATH_COLUMNS.index("horizontal_m")]
    vertical = numbers[:, PATH_COLUMNS.index("vertical_m")]
    within = (level <= 10.0) & (vertical <= 10.0)
    assert (told.points, told.within_alert) == (9, int(within.sum()))
    assert told.first_beyond == int(np.argmin(within))
    # eight steps of 60 m, up and down the wall as well
    assert numbers[-1, 0] == pytest.approx(480.0, abs=10.0)


def test_what_makes_no_question_is_refused():
    for changes, sentence in (
        ({"anchors": []}, "at least 1"),
        ({"anchors": ANCHORS + ANCHORS[:1]}, "must be unique"),
        ({"unwatched": 0.5}, "unwatched must be below missed"),
        ({"most_faults": 9}, "less than or equal to 6"),
    ):
        with pytest.raises(ValidationError, match=sentence):
            ProtectionParameters.model_validate({"anchors": ANCHORS, **changes})
