"""The Digital Morphing Map against a scan of every column, and what must hold of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from terrain import ElevationGrid
from tests.visibility.grounds import hills
from tests.visibility.morphing_cases import TOLERANCE_M, check_all, low_anchors, satellites
from visibility import FLAT, Anchor, AntennaLimits, DistantAnchor, VisibilityInputError, min_visible_altitude
from visibility.air.morphing_maps import ColumnState, morphing_map
from visibility.dilution.dop_questions import FlightLimit


@pytest.mark.parametrize(
    ("limit", "anchors"),
    [
        (FlightLimit(2.5), 6),
        (FlightLimit(1.6), 9),
        (FlightLimit(4.0, anchors=5), 7),
        (FlightLimit(6.0, "gdop", "pseudorange"), 8),
        (FlightLimit(4.0, "pdop", "pseudorange"), 8),
        (FlightLimit(1.5, "hdop"), 7),
        (FlightLimit(3.0, "vdop"), 7),
        (FlightLimit(3.0, "tdop", "pseudorange"), 8),
        (FlightLimit(5.0, "gdop", "tdoa"), 8),
    ],
    ids=lambda value: f"{value.measure} {value.kind}" if isinstance(value, FlightLimit) else f"{value} anchors",
)
def test_every_column_agrees_with_a_scan_at_five_centimetres(limit, anchors):
    grid, anchors, ceiling_m = low_anchors(anchors)
    surfaces = min_visible_altitude(grid, anchors, "exact")
    found = morphing_map(surfaces, limit, ceiling_m=ceiling_m)
    check_all(surfaces, found)
    assert len({state for state, posts in found.states().items() if posts}) > 1 or limit.anchors


def test_satellites_alone_and_with_drones_agree_with_a_scan():
    grid, drones, ceiling_m = low_anchors(4)
    for anchors in (satellites(9, seed=1), (*satellites(4, seed=2), *drones)):
        surfaces = min_visible_altitude(grid, anchors)
        check_all(surfaces, morphing_map(surfaces, FlightLimit(3.0, "pdop", "pseudorange"), ceiling_m=ceiling_m))


@pytest.mark.parametrize(
    "limits",
    [
        AntennaLimits(max_range_m=190.0),
        AntennaLimits(min_range_m=130.0),
        AntennaLimits(max_elevation_rad=math.radians(10.0)),
        AntennaLimits(min_range_m=90.0, max_range_m=600.0, max_elevation_rad=math.radians(25.0)),
    ],
    ids=["range", "too near", "elevation", "all"],
)
def test_what_an_antenna_does_not_reach_from_above_is_in_the_map(limits):
    grid, anchors, ceiling_m = low_anchors(9, limits=limits)
    surfaces = min_visible_altitude(grid, anchors, "exact", FLAT)
    found = morphing_map(surfaces, FlightLimit(3.0), ceiling_m=ceiling_m)
    counts = check_all(surfaces, found)
    assert max(counts) > 1 or found.states()[ColumnState.CLOSED_AT_CEILING] > 0


def test_the_dilution_peaks_at_the_anchors_own_altitude_where_the_closed_form_says():
    """In the plane of anchors at one altitude all directions lie in it, and nothing fixes the height."""
    grid = ElevationGrid(np.zeros((9, 9), np.float32), 50.0, 50.0)
    corners = ((0.0, 0.0), (400.0, 0.0), (0.0, -400.0), (400.0, -400.0))
    anchors = tuple(Anchor(f"A{n}", east_m, north_m, 100.0) for n, (east_m, north_m) in enumerate(corners))
    surfaces = min_visible_altitude(grid, anchors)
    found = morphing_map(surfaces, FlightLimit(4.0), ceiling_m=220.0)
    middle = (4, 4)
    assert found.state[middle] == ColumnState.ABOVE
    assert found.no_flight_intervals[middle] == 1
    assert not found.several_intervals[middle]
    # four directions of elevation e, a quarter turn apart: DOP² = 1/cos² e + 1/(4·sin² e)
    away_m = 200.0 * math.sqrt(2.0)
    rise_m = found.altitude_m[middle] - 100.0
    cos2 = away_m**2 / (away_m**2 + rise_m**2)
    assert math.sqrt(1.0 / cos2 + 1.0 / (4.0 * (1.0 - cos2))) == pytest.approx(4.0, abs=1e-3)
    check_all(surfaces, found)


def test_a_narrow_peak_is_not_missed():
    """Anchors far apart at one altitude: the dilution is above a high limit only within centimetres of their plane."""
    grid = ElevationGrid(np.zeros((3, 3), np.float32), 10.0, 10.0)
    corners = ((-90.0, 80.0), (110.0, 90.0), (-80.0, -100.0), (100.0, -110.0))
    anchors = tuple(Anchor(f"A{n}", east_m, north_m, 60.0) for n, (east_m, north_m) in enumerate(corners))
    found = morphing_map(min_visible_altitude(grid, anchors), FlightLimit(1000.0), ceiling_m=400.0)
    assert (found.state == ColumnState.ABOVE).all()
    assert (found.no_flight_intervals == 1).all()
    np.testing.assert_allclose(found.altitude_m, 60.0, atol=TOLERANCE_M)


def test_flat_ground_under_four_high_anchors_is_flyable_everywhere():
    grid = ElevationGrid(np.zeros((7, 7), np.float32), 50.0, 50.0)
    corners = ((0.0, 0.0), (300.0, 0.0), (0.0, -300.0), (300.0, -300.0))
    anchors = tuple(Anchor(f"A{n}", east_m, north_m, 200.0) for n, (east_m, north_m) in enumerate(corners))
    found = morphing_map(min_visible_altitude(grid, anchors), FlightLimit(5.0), ceiling_m=50.0)
    assert found.states()[ColumnState.EVERYWHERE] == grid.heights_m.size
    np.testing.assert_array_equal(found.altitude_m, grid.heights_m)
    np.testing.assert_array_equal(found.above_ground_m, 0.0)
    assert not found.no_flight_intervals.any()


def test_where_nothing_is_flyable_the_map_is_nan_and_says_so():
    grid, anchors, ceiling_m = low_anchors(6)
    found = morphing_map(min_visible_altitude(grid, anchors), FlightLimit(0.5), ceiling_m=ceiling_m)
    assert found.states()[ColumnState.NOWHERE] == grid.heights_m.size
    assert np.isnan(found.altitude_m).all()
    assert np.isinf(found.safe_above_m).all()
    assert (found.no_flight_intervals == 1).all()


def test_a_looser_limit_or_one_more_anchor_never_raises_the_map():
    grid, anchors, ceiling_m = low_anchors(8, size=17)
    surfaces = min_visible_altitude(grid, anchors)

    def map_m(limit, some):
        part = surfaces if some == len(anchors) else min_visible_altitude(grid, anchors[:some])
        return np.nan_to_num(morphing_map(part, FlightLimit(limit), ceiling_m=ceiling_m).altitude_m, nan=np.inf)

    tolerance_m = 0.02
    assert (map_m(3.0, 8) <= map_m(2.0, 8) + tolerance_m).all()
    assert (map_m(3.0, 8) <= map_m(3.0, 7) + tolerance_m).all()


def test_unknown_ground_is_a_third_answer_between_open_and_blocked():
    grid, anchors, ceiling_m = low_anchors(7, size=17)
    heights_m = grid.heights_m.copy()
    heights_m[5:8, 6:12] = np.nan
    holed = ElevationGrid(heights_m, grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)
    maps = {
        unknown: morphing_map(
            min_visible_altitude(holed, anchors, unknown=unknown), FlightLimit(2.5), ceiling_m=ceiling_m
        )
        for unknown in ("unknown", "open", "blocked")
    }
    third, known = maps["unknown"], ~np.isnan(heights_m)
    assert (third.state[~known] == ColumnState.UNKNOWN).all()
    undecided = (third.state == ColumnState.UNKNOWN) & known
    assert undecided.any()
    assert np.isnan(third.altitude_m[undecided]).all()
    np.testing.assert_allclose(third.safe_above_m[known], maps["blocked"].safe_above_m[known], atol=0.05)
    decided = known & np.isin(third.state, (ColumnState.ABOVE, ColumnState.EVERYWHERE))
    assert decided.any()
    for decision in ("open", "blocked"):
        np.testing.assert_allclose(maps[decision].altitude_m[decided], third.altitude_m[decided], atol=0.05)
    assert (maps["open"].safe_above_m[undecided] <= third.safe_above_m[undecided] + 0.05).all()


def test_satellites_over_unknown_ground_are_a_third_answer_too():
    heights_m = hills(17).heights_m.copy()
    heights_m[6:9, 5:11] = np.nan
    holed = ElevationGrid(heights_m, 30.0, 30.0)
    limit, ceiling_m = FlightLimit(4.0, "pdop", "pseudorange"), float(np.nanmax(heights_m)) + 150.0
    third, opened, blocked = (
        morphing_map(min_visible_altitude(holed, satellites(7, seed=4), unknown=unknown), limit, ceiling_m=ceiling_m)
        for unknown in ("unknown", "open", "blocked")
    )
    known = ~np.isnan(heights_m)
    undecided = known & (third.state == ColumnState.UNKNOWN)
    decided = known & np.isin(third.state, (ColumnState.ABOVE, ColumnState.EVERYWHERE))
    assert undecided.any()
    assert decided.any()
    np.testing.assert_allclose(third.safe_above_m[known], blocked.safe_above_m[known], atol=0.02)
    np.testing.assert_allclose(third.altitude_m[decided], opened.altitude_m[decided], atol=0.02)
    assert (opened.safe_above_m[undecided] < third.safe_above_m[undecided]).all()


def test_posts_above_the_ceiling_are_outside_with_a_warning():
    grid, anchors, _ = low_anchors(6)
    ceiling_m = float(np.median(grid.heights_m))
    found = morphing_map(min_visible_altitude(grid, anchors), FlightLimit(3.0), ceiling_m=ceiling_m)
    outside = grid.heights_m >= ceiling_m
    np.testing.assert_array_equal(found.state == ColumnState.OUTSIDE, outside)
    assert f"{outside.sum()} posts stand above the ceiling" in found.warnings[-1]


def test_a_ceiling_above_ground_goes_with_the_ground():
    grid, anchors, _ = low_anchors(7)
    surfaces = min_visible_altitude(grid, anchors, "exact")
    found = morphing_map(surfaces, FlightLimit(2.5), ceiling_m=160.0, ceiling_above_ground=True)
    assert not (found.state == ColumnState.OUTSIDE).any()
    check_all(surfaces, found)


LINE = [Anchor(f"L{n}", 10.0 + 40.0 * n, -20.0 - 30.0 * n, 900.0 + 7.0 * n) for n in range(4)]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda surfaces: FlightLimit(0.0), "dop_limit must be a number > 0, not 0.0."),
        (lambda surfaces: FlightLimit(math.nan), "dop_limit must be a number > 0, not nan."),
        (
            lambda surfaces: FlightLimit(2.0, "edop"),
            "measure must be one of gdop, pdop, hdop, vdop, tdop, not 'edop'.",
        ),
        (
            lambda surfaces: FlightLimit(2.0, kind="sonar"),
            "kind must be one of ranging, pseudorange, tdoa, not 'sonar'.",
        ),
        (lambda surfaces: FlightLimit(2.0, "tdop"), "A limit on tdop needs kind 'pseudorange'; 'ranging' solves for"),
        (lambda surfaces: FlightLimit(2.0, anchors=0), "anchors must be >= 1, or None"),
        (
            lambda surfaces: morphing_map(surfaces(3), FlightLimit(2.0, "pdop", "pseudorange"), ceiling_m=900.0),
            "A map of pdop from pseudorange needs at least 4 anchors; 3 are given.",
        ),
        (
            lambda surfaces: morphing_map(surfaces(1), FlightLimit(2.0), ceiling_m=900.0),
            "A map of pdop from ranging needs at least 3 anchors; 1 is given.",
        ),
        (
            lambda surfaces: morphing_map(surfaces(6), FlightLimit(2.0), ceiling_m=-3.0),
            "The ceiling at -3 m is below the ground, which begins at",
        ),
        (
            lambda surfaces: morphing_map(surfaces(6), FlightLimit(2.0), ceiling_m=0.0, ceiling_above_ground=True),
            "A ceiling above ground must be higher than the ground, not 0 m.",
        ),
        (
            lambda surfaces: morphing_map(surfaces(6), FlightLimit(2.0), ceiling_m=math.inf),
            "ceiling_m must be a finite number of metres, not inf.",
        ),
        (
            lambda surfaces: morphing_map(min_visible_altitude(hills(9), LINE), FlightLimit(2.0), ceiling_m=900.0),
            "All 4 anchors stand on one line, from which no position can be fixed; move one off it.",
        ),
    ],
)
def test_a_question_without_an_answer_is_refused_in_one_sentence(make, sentence):
    def surfaces(count):
        grid, anchors, _ = low_anchors(count)
        return min_visible_altitude(grid, anchors)

    with pytest.raises(VisibilityInputError) as refused:
        make(surfaces)
    assert str(refused.value).startswith(sentence)


def test_distant_anchors_in_one_plane_are_refused():
    in_one_plane = [DistantAnchor(f"S{n}", 0.4, 0.2 + 0.2 * n) for n in range(4)]
    surfaces = min_visible_altitude(hills(9), in_one_plane)
    with pytest.raises(VisibilityInputError, match="All 4 distant anchors lie in one plane"):
        morphing_map(surfaces, FlightLimit(2.0), ceiling_m=900.0)


def test_unknown_ground_everywhere_leaves_no_air_to_map():
    grid = ElevationGrid(np.full((5, 5), np.nan, np.float32), 10.0, 10.0)
    anchors = [Anchor(f"A{n}", 10.0 * n, 5.0 * n * n, 100.0) for n in range(4)]
    with pytest.raises(VisibilityInputError, match="No ground is known"):
        morphing_map(min_visible_altitude(grid, anchors), FlightLimit(2.0), ceiling_m=900.0)
