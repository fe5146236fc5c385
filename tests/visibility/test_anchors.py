"""Anchors that make sense, anchors that do not, and what is said about them."""

import math

import numpy as np
import pytest

from terrain import ElevationGrid
from visibility import Anchor, AnchorError, VisibilityInputError, anchor_above_ground, min_visible_altitude
from visibility.sight.curvature import FLAT, Curvature

HEIGHTS_M = np.full((5, 6), 100.0)
HEIGHTS_M[2, 3] = np.nan
GRID = ElevationGrid(HEIGHTS_M, 10.0, 10.0)


def test_a_height_above_ground_becomes_an_altitude():
    assert anchor_above_ground(GRID, "A", 5.0, -5.0, 80.0).altitude_m == 180.0


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((30.0, -20.0), "A stands on unknown ground; give its altitude_m"),
        ((500.0, 0.0), "A stands outside the DEM"),
        ((0.0, 0.0, -3.0), "above_ground_m must be a number of metres >= 0"),
        ((0.0, 0.0, math.nan), "above_ground_m must be a number"),
    ],
)
def test_a_height_above_ground_needs_ground(place, words):
    with pytest.raises(AnchorError, match=words):
        anchor_above_ground(GRID, "A", *place[:2], place[2] if len(place) > 2 else 10.0)


@pytest.mark.parametrize(
    ("anchors", "words"),
    [
        ([], "At least one anchor"),
        ([Anchor("A", 0, 0, 200), Anchor("A", 10, 0, 200)], "unique; repeated: A"),
        ([Anchor("A", 5, -5, 90)], "A is 10.0 m below the ground"),
        ([Anchor("A", 2e6, 0, 200)], "2000 km outside the DEM"),
    ],
)
def test_anchors_that_make_no_question_are_refused(anchors, words):
    with pytest.raises(AnchorError, match=words):
        min_visible_altitude(GRID, anchors)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (("", 0, 0, 0), "non-empty id"),
        (("A", math.nan, 0, 0), "east_m must be a finite number"),
        (("A", 0, math.inf, 0), "north_m must be a finite number"),
        (("A", 0, 0, -math.inf), "altitude_m must be a finite number"),
        (("A", 0, 0, 0, -1.0), "ranging_sigma_m must be >= 0"),
        (("A", 0, 0, 0, 0.1, math.nan), "pose_sigma_m must be >= 0"),
    ],
)
def test_impossible_anchors_are_refused(fields, words):
    with pytest.raises(AnchorError, match=words):
        Anchor(*fields)


def test_an_anchor_outside_the_map_is_warned_about():
    result = min_visible_altitude(GRID, [Anchor("D7", -500.0, 0.0, 300.0)])
    assert "D7 is 500 m outside the DEM" in result.warnings[0]


def test_an_anchor_on_the_ground_is_not_below_it():
    sloping = ElevationGrid(np.add.outer(np.arange(9) * 0.37, np.arange(9) * 1.13), 10.0, 10.0)
    for east_m in np.linspace(0, 80, 33):
        min_visible_altitude(sloping, [anchor_above_ground(sloping, "A", float(east_m), -33.3, 0.0)])


@pytest.mark.parametrize("height", [{}, {"above_ground_m": 1.0, "altitude_m": 2.0}])
def test_a_receiver_needs_exactly_one_height(height):
    result = min_visible_altitude(GRID, [Anchor("A", 0, 0, 200)])
    with pytest.raises(VisibilityInputError, match="exactly one"):
        result.visible(**height)


@pytest.mark.parametrize("height", [{"above_ground_m": -1.0}, {"above_ground_m": math.nan}, {"altitude_m": math.inf}])
def test_an_impossible_receiver_height_is_refused(height):
    result = min_visible_altitude(GRID, [Anchor("A", 0, 0, 200)])
    with pytest.raises(VisibilityInputError, match="Receiver"):
        result.visible(**height)


def test_the_margin_is_the_receivers_altitude_less_the_lowest_visible_one():
    result = min_visible_altitude(GRID, [Anchor("A", 0, 0, 200)])
    np.testing.assert_array_equal(result.margin_m(altitude_m=150.0), np.float32(150.0) - result.altitude_m)


def test_curvature_follows_the_body_of_the_crs():
    heights_m = np.zeros((2, 2))
    assert Curvature.of(ElevationGrid(heights_m, 1, 1)) == FLAT
    earth = Curvature.of(ElevationGrid(heights_m, 1, 1, crs="EPSG:32611"))
    assert earth.radius_m == pytest.approx(6_371_008.8, abs=1.0)
    assert earth.refraction_k == pytest.approx(4.0 / 3.0)
    mars = Curvature.of(ElevationGrid(heights_m, 1, 1, crs="ESRI:103885"))
    assert mars.radius_m == pytest.approx(3_390_000.0, abs=7000.0)
    assert mars.refraction_k == 1.0
    assert earth.drop_m(10_000.0) == pytest.approx(1e8 / (2 * 4 / 3 * 6_371_008.8))


@pytest.mark.parametrize("numbers", [(0.0, 1.0), (-5.0, 1.0), (math.nan, 1.0), (6e6, 0.0), (6e6, math.inf)])
def test_impossible_curvature_is_refused(numbers):
    with pytest.raises(VisibilityInputError, match="positive radius"):
        Curvature(*numbers)


@pytest.mark.parametrize("numbers", [(1e-320, 1e-320), (1e-10, 1.0), (6e6, 1e-300)])
def test_curvature_beyond_any_number_is_refused(numbers):
    with pytest.raises(VisibilityInputError, match="radius times factor >= 1 m"):
        Curvature(*numbers)


def test_the_answer_says_how_it_was_made():
    result = min_visible_altitude(GRID, [Anchor("A", 0, 0, 200)], mode="exact")
    assert (result.mode, result.unknown, result.curvature) == ("exact", "unknown", FLAT)
    assert result.version
    assert result.elapsed_s > 0
    assert "edge" in result.error_statement
