"""The map and what it says about itself."""

import json
from dataclasses import replace

import numpy as np
import pytest

from service.products import Work
from service.products.visibility.calculate import calculate_visibility_map
from service.products.visibility.request import VisibilityMapParameters
from tests.service.small_maps import COLS, HOLE, NORTH_M, ROWS, WEST_M, small_grid, small_map
from visibility import FLAT, Curvature, min_visible_altitude


def test_the_map_is_what_the_engine_answers():
    finished = small_map()
    answer = min_visible_altitude(small_grid(), finished.anchors, "fast")
    np.testing.assert_array_equal(finished.altitude_m, answer.altitude_m)
    np.testing.assert_array_equal(finished.visible, answer.visible(above_ground_m=1.5))


def test_counts_are_those_of_the_bands():
    finished = small_map()
    np.testing.assert_array_equal(finished.count, (finished.visible == 1).sum(axis=0))
    np.testing.assert_array_equal(finished.unknown_count, (finished.visible == 255).sum(axis=0))
    assert finished.count.dtype == np.uint8
    assert set(np.unique(finished.count)) >= {0, 1, 2}


def test_many_anchors_are_counted_without_overflow():
    anchors = [
        {"id": f"A{i}", "east_m": 400_100.0, "north_m": 3_799_900.0, "altitude_m": 500.0 + i} for i in range(260)
    ]
    finished = calculate_visibility_map(small_grid(), VisibilityMapParameters.model_validate({"anchors": anchors}))
    assert finished.count.dtype == np.uint16
    assert finished.count.max() == 260


def test_shares_of_known_ground_add_up_to_one():
    answer = small_map().answer
    for anchor in answer.anchors:
        assert anchor.visible_share + anchor.hidden_share + anchor.unknown_share == pytest.approx(1.0)
    assert sum(row.posts for row in answer.count_histogram) == ROWS * COLS - 9
    assert sum(row.share for row in answer.count_histogram) == pytest.approx(1.0)


def test_the_share_of_an_anchor_counts_known_posts_only():
    finished = small_map()
    known = np.ones((ROWS, COLS), bool)
    known[HOLE] = False
    expected = np.count_nonzero(finished.visible[0][known] == 1) / np.count_nonzero(known)
    assert finished.answer.anchors[0].visible_share == pytest.approx(expected, abs=1e-12)


def test_the_answer_carries_what_every_answer_must_carry():
    summary = small_map(mode="exact").answer.model_dump(mode="json")
    json.dumps(summary, allow_nan=False)
    assert summary["mode"] == "exact"
    assert summary["error_statement"]
    assert "refraction factor k = 1.333" in summary["curvature"]
    assert summary["dem"]["sha256"] == small_grid().digest
    assert summary["dem"]["name"] == "small.tif"
    assert summary["version"]
    assert summary["timing"]["calculation_s"] >= 0.0
    assert any("made-up" in warning for warning in summary["warnings"])
    assert any("outside" in warning for warning in summary["warnings"])


def test_an_anchor_over_nothing_has_no_height_above_ground():
    by_id = {anchor.id: anchor for anchor in small_map().answer.anchors}
    assert by_id["outside"].above_ground_m is None
    assert by_id["west"].above_ground_m == pytest.approx(12.0, abs=1e-3)


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("auto", Curvature.of(small_grid())),
        ("flat", FLAT),
        ({"radius_m": 1.0e5, "refraction_k": 2.0}, Curvature(1.0e5, 2.0)),
    ],
)
def test_curvature_is_as_asked(asked, meant):
    finished = small_map(curvature=asked)
    assert finished.answer.curvature == meant.sentence()
    answer = min_visible_altitude(small_grid(), finished.anchors, "fast", meant)
    np.testing.assert_array_equal(finished.altitude_m, answer.altitude_m)


def test_a_receiver_altitude_is_compared_directly():
    finished = small_map(receiver_altitude_m=85.0)
    known = np.isfinite(finished.altitude_m)
    np.testing.assert_array_equal((finished.visible == 1)[known], (finished.altitude_m <= 85.0)[known])


@pytest.mark.parametrize(("altitude_m", "below"), [(20.0, True), (1000.0, False)])
def test_a_receiver_altitude_under_the_ground_is_warned_of(altitude_m, below):
    finished = small_map(receiver_altitude_m=altitude_m)
    underground = finished.grid.heights_m > altitude_m
    assert not np.any(finished.visible[:, underground] == 1)
    sentence = f"below the ground at {np.count_nonzero(underground):,} of {ROWS * COLS - 9:,} known posts"
    assert any(sentence in warning for warning in finished.answer.warnings) == below


def test_progress_grows_to_one():
    anchors = [{"id": f"A{i}", "east_m": 400_100.0, "north_m": 3_799_900.0, "altitude_m": 90.0 + i} for i in range(9)]
    shares = []
    calculate_visibility_map(
        small_grid(), VisibilityMapParameters.model_validate({"anchors": anchors}), Work(shares.append)
    )
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert len(set(shares)) >= 3


def test_ground_that_is_all_unknown_has_no_shares():
    nowhere = replace(small_grid(), heights_m=np.full((ROWS, COLS), np.nan, np.float32))
    anchors = [{"id": "A", "east_m": WEST_M, "north_m": NORTH_M, "altitude_m": 90.0}]
    finished = calculate_visibility_map(nowhere, VisibilityMapParameters.model_validate({"anchors": anchors}))
    assert {anchor.visible_share for anchor in finished.answer.anchors} == {None}
