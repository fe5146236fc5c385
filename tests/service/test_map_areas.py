"""Maps over a part of a DEM: inside the area every answer is that of the whole, and shares are of the part."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.parts.map_area import map_area
from service.parts.positioning import MorphingMapParameters
from service.products.dop.calculate import calculate_dop_map
from service.products.dop.request import DopMapParameters
from service.products.morphing.calculate import calculate_morphing_map
from service.products.visibility.calculate import calculate_visibility_map
from terrain import AreaError
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, NORTH_M, WEST_M, small_grid, small_parameters

# east of the wall, which hides the anchor in the west from here
BOX = {"west_m": WEST_M + 570.0, "south_m": NORTH_M - 300.0, "east_m": WEST_M + 780.0, "north_m": NORTH_M - 100.0}
CIRCLE = {"east_m": WEST_M + 400.0, "north_m": NORTH_M - 220.0, "radius_m": 150.0}
ROWS, COLS = slice(5, 16), slice(19, 27)
ANCHORS = [
    {"id": "a", "east_m": WEST_M + 95.0, "north_m": NORTH_M - 305.0, "above_ground_m": 90.0},
    {"id": "b", "east_m": WEST_M + 750.0, "north_m": NORTH_M - 200.0, "altitude_m": 160.0},
    {"id": "c", "east_m": WEST_M + 300.0, "north_m": NORTH_M - 20.0, "altitude_m": 190.0},
    {"id": "d", "east_m": WEST_M + 600.0, "north_m": NORTH_M - 440.0, "altitude_m": 140.0},
]


def test_a_visibility_map_of_a_box_is_the_window_of_the_whole() -> None:
    whole, part = (
        calculate_visibility_map(small_grid(), small_parameters()),
        calculate_visibility_map(small_grid(), small_parameters(area=BOX)),
    )
    assert part.grid.shape == (11, 8)
    assert part.grid.position_of(0, 0) == (WEST_M + 19 * CELL_EAST_M, NORTH_M - 5 * CELL_NORTH_M)
    for name in ("visible", "altitude_m", "count", "unknown_count"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[..., ROWS, COLS])
    west = part.answer.anchors[0]
    assert west.hidden_share == 1.0, "the wall lies outside the area and hides all the same"
    assert west.above_ground_m == whole.answer.anchors[0].above_ground_m
    assert sum(row.posts for row in part.answer.count_histogram) == 88
    assert "The answer is for an area of 88 posts of 720." in " ".join(part.answer.warnings)


def test_shares_of_a_circle_count_the_posts_within_it() -> None:
    whole, part = (
        calculate_visibility_map(small_grid(), small_parameters()),
        calculate_visibility_map(small_grid(), small_parameters(area=CIRCLE)),
    )
    col, row = np.meshgrid(np.arange(30), np.arange(24))
    inside = np.hypot(WEST_M + col * 30.0 - CIRCLE["east_m"], NORTH_M - row * 20.0 - CIRCLE["north_m"]) <= 150.0
    inside &= ~np.isnan(small_grid().heights_m)
    assert sum(row.posts for row in part.answer.count_histogram) == np.count_nonzero(inside)
    for number, anchor in enumerate(part.answer.anchors):
        seen = np.count_nonzero((whole.visible[number] == 1) & inside)
        assert anchor.visible_share == pytest.approx(seen / np.count_nonzero(inside))
    assert "files and pictures hold the box" in " ".join(part.answer.warnings)


@pytest.mark.parametrize("on_surface", [False, True])
def test_a_dop_map_of_a_box_is_the_window_of_the_whole(on_surface: bool) -> None:
    asked = {"anchors": ANCHORS, "on_surface": on_surface, "dop_limit": 3.0}
    whole = calculate_dop_map(small_grid(), DopMapParameters.model_validate(asked))
    part = calculate_dop_map(small_grid(), DopMapParameters.model_validate({**asked, "area": BOX}))
    for name in ("dop", "reasons", "count", "no_go", "sigmas_m"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[..., ROWS, COLS])
    go = np.count_nonzero(whole.no_go[ROWS, COLS] == 0) / 88
    assert part.answer.share_within_limit == pytest.approx(go)
    assert sum(part.answer.posts_by_reason.values()) == 88


def test_a_morphing_map_of_a_box_is_the_window_of_the_whole() -> None:
    asked = {"anchors": ANCHORS, "ceiling_altitude_m": 400.0, "dop_limit": 4.0}
    whole = calculate_morphing_map(small_grid(), MorphingMapParameters.model_validate(asked))
    part = calculate_morphing_map(small_grid(), MorphingMapParameters.model_validate({**asked, "area": BOX}))
    for name in ("altitude_m", "safe_above_m", "state", "no_flight_intervals", "dop", "no_go"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[..., ROWS, COLS])
    assert sum(state.posts for state in part.answer.states) == 88


@pytest.mark.parametrize(
    ("area", "sentence"),
    [
        ({"west_m": 0.0, "south_m": 0.0, "east_m": 9.0, "north_m": 9.0}, "lies beside the DEM"),
        ({"east_m": WEST_M + 15.0, "north_m": NORTH_M - 10.0, "radius_m": 2.0}, "lies between the posts"),
    ],
)
def test_an_area_without_posts_is_refused(area: dict[str, Any], sentence: str) -> None:
    asked = small_parameters(area=area)
    with pytest.raises(AreaError, match=sentence):
        map_area(small_grid(), asked.area)


def test_a_box_and_the_same_ring_hold_the_same_posts() -> None:
    west, south, east, north = WEST_M + 100.0, NORTH_M - 333.0, WEST_M + 555.0, NORTH_M - 91.0
    corners = [(west, south), (east, south), (east, north), (west, north)]
    ring = small_parameters(area={"ring": [{"east_m": x, "north_m": y} for x, y in corners]}).area
    box = small_parameters(area={"west_m": west, "south_m": south, "east_m": east, "north_m": north}).area
    of_ring, of_box = map_area(small_grid(), ring), map_area(small_grid(), box)
    assert of_ring.window == of_box.window == (4, 17, 3, 19)
    assert of_ring.inside is not None
    assert of_box.inside is not None
    np.testing.assert_array_equal(of_ring.inside, of_box.inside)
    assert np.count_nonzero(of_box.inside) == 12 * 15, "the outermost posts of the box around it lie outside"
