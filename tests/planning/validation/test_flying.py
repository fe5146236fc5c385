"""Flights walked at fine steps: the exact distance to the ground, the morphing map below, the ceiling above."""

from __future__ import annotations

import numpy as np
import pytest

from planning import PathError
from planning.paths import FlightProblem
from planning.validation import PathLimit, PathValidation, fly_along, validate_flight
from terrain import ElevationGrid
from visibility import Anchor, FlightLimit, min_visible_altitude, morphing_map

START, GOAL = (10.0, -50.0, 40.0), (190.0, -50.0, 40.0)


def ridge(height_m: float = 30.0) -> ElevationGrid:
    heights_m = np.zeros((21, 41), np.float32)
    heights_m[:, 20] = height_m
    return ElevationGrid(heights_m, 5.0, 5.0)


def check(report: PathValidation, limit: PathLimit):
    return next(one for one in report.checks if one.limit is limit)


def test_a_flight_over_a_ridge_is_as_near_to_it_as_geometry_says() -> None:
    problem = FlightProblem(ridge(), START, GOAL, bubble_m=9.0)
    report = validate_flight(problem, [START, GOAL], step_m=0.05)
    assert report.passed
    clearance = check(report, PathLimit.CLEARANCE)
    assert clearance.worst == pytest.approx(10.0, abs=1e-6)  # straight over the crest, which is 30 m high
    assert clearance.where_m[0] == pytest.approx(100.0, abs=0.1)


def test_a_flight_that_comes_too_near_to_the_ground_or_through_it_is_told_where() -> None:
    problem = FlightProblem(ridge(), START, GOAL, bubble_m=12.0)
    report = validate_flight(problem, [START, GOAL])
    assert [one.limit for one in report.failures] == [PathLimit.CLEARANCE]
    assert "distance to the ground" in report.sentence
    through = validate_flight(FlightProblem(ridge(60.0), START, GOAL, bubble_m=0.0), [START, GOAL])
    clearance = check(through, PathLimit.CLEARANCE)
    assert clearance.worst < 0.0
    assert abs(clearance.where_m[0] - 100.0) < 5.0


def test_over_unknown_ground_no_distance_is_known() -> None:
    heights_m = ridge().heights_m.copy()
    heights_m[9:12, 4:7] = np.nan
    grid = ElevationGrid(heights_m, 5.0, 5.0)
    assert not check(validate_flight(FlightProblem(grid, START, GOAL), [START, GOAL]), PathLimit.CLEARANCE).kept


@pytest.mark.parametrize(
    ("ceiling_m", "above_ground", "kept"), [(41.0, False, True), (39.0, False, False), (39.0, True, False)]
)
def test_the_ceiling_is_an_altitude_or_goes_with_the_ground(ceiling_m: float, above_ground: bool, kept: bool) -> None:
    problem = FlightProblem(ridge(), START, GOAL, ceiling_m=ceiling_m, ceiling_above_ground=above_ground, bubble_m=5.0)
    assert check(validate_flight(problem, [START, GOAL]), PathLimit.CEILING).kept is kept


def test_ends_that_are_not_those_of_the_question_are_told() -> None:
    problem = FlightProblem(ridge(), START, GOAL, bubble_m=5.0)
    report = validate_flight(problem, [(10.0, -50.0, 41.0), (190.0, -52.0, 40.0)])
    assert [one.limit for one in report.failures] == [PathLimit.START, PathLimit.GOAL]
    assert [one.worst for one in report.failures] == pytest.approx([1.0, 2.0])


def test_below_the_morphing_map_a_flight_fails_by_as_much_as_it_is_below() -> None:
    grid = ridge()
    places = ((5.0, -5.0, 90.0), (195.0, -10.0, 120.0), (10.0, -95.0, 100.0), (190.0, -90.0, 140.0))
    lines = min_visible_altitude(grid, [Anchor(f"A{n}", *place) for n, place in enumerate(places)], "exact")
    above = morphing_map(lines, FlightLimit(6.0), ceiling_m=300.0)
    highest_m = float(above.safe_above_m[10, 2:39].max())
    ends = [(east_m, north_m, highest_m + 1.0) for east_m, north_m, _ in (START, GOAL)]
    over = validate_flight(FlightProblem(grid, *ends, above=above, bubble_m=2.0), ends)
    assert check(over, PathLimit.MORPHING_MAP).worst == pytest.approx(1.0, abs=1e-3)
    low = [(east_m, north_m, highest_m - 3.0) for east_m, north_m, _ in (START, GOAL)]
    under = validate_flight(FlightProblem(grid, *low, above=above, bubble_m=2.0), low)
    assert check(under, PathLimit.MORPHING_MAP).worst == pytest.approx(-3.0, abs=1e-3)
    assert not check(under, PathLimit.MORPHING_MAP).kept


@pytest.mark.parametrize("corners", [[START], [START[:2], GOAL[:2]], [START, (np.nan, 0.0, 0.0)]])
def test_what_is_no_flight_is_refused(corners: list[tuple[float, ...]]) -> None:
    with pytest.raises(PathError, match="two corners or more"):
        fly_along(FlightProblem(ridge(), START, GOAL), corners)
