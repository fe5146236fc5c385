"""Rovers that cannot turn on the spot, and flights above the morphing map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planning import PathProblemError, PlaceError
from planning.paths import (
    FlightProblem,
    PathProblem,
    PathStatus,
    PlanBudget,
    RoverModel,
    plan_flight,
    plan_path,
)
from terrain import ElevationGrid, nearest_surface
from visibility import Anchor, FlightLimit, min_visible_altitude, morphing_map


def walled() -> ElevationGrid:
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[:, 30] = 60.0
    heights_m[24:38, 30] = 0.0
    return ElevationGrid(heights_m, 5.0, 5.0)


@pytest.mark.parametrize("can_reverse", [False, True])
def test_a_rover_that_cannot_turn_on_the_spot_drives_curves_that_its_radius_allows(can_reverse: bool) -> None:
    rover = RoverModel(max_slope_rad=0.5, min_turning_radius_m=4.0, can_reverse=can_reverse)
    outcome = plan_path(
        PathProblem(
            walled(),
            (52.0, -58.0),
            (251.0, -57.0),
            rover=rover,
            start_heading_rad=math.radians(200.0),
            budget=PlanBudget(iterations=20_000),
        )
    )
    assert outcome.status is PathStatus.FOUND, outcome.sentence
    assert outcome.validation is not None
    assert outcome.validation.passed
    path = outcome.path
    assert path is not None
    assert path.heading_rad[0] == pytest.approx(math.radians(200.0), abs=0.2)
    assert outcome.ratio > 1.0


def test_where_no_curve_fits_the_plan_says_that_only_the_turning_radius_is_in_the_way() -> None:
    heights_m = np.full((40, 60), 60.0, np.float32)
    heights_m[18:22, 5:55] = 0.0
    heights_m[5:22, 51:55] = 0.0
    rover = RoverModel(max_slope_rad=0.5, min_turning_radius_m=60.0)
    grid = ElevationGrid(heights_m, 5.0, 5.0)
    outcome = plan_path(
        PathProblem(grid, (60.0, -97.0), (262.0, -40.0), rover=rover, budget=PlanBudget(iterations=5_000))
    )
    assert outcome.status is PathStatus.OUT_OF_BUDGET
    assert "turning radius of 60 m" in outcome.sentence


def test_a_flight_keeps_its_bubble_from_the_ground_by_the_exact_distance() -> None:
    grid = walled()
    problem = FlightProblem(
        grid, (52.0, -30.0, 30.0), (251.0, -32.0, 25.0), bubble_m=12.0, budget=PlanBudget(iterations=6_000)
    )
    outcome = plan_flight(problem)
    assert outcome.status is PathStatus.FOUND, outcome.sentence
    assert outcome.clearance_m >= 12.0 - 2e-3
    share = np.linspace(0.0, 1.0, 200)[:, None]
    for begin, end in zip(outcome.corners_m[:-1], outcome.corners_m[1:], strict=True):
        assert (nearest_surface(grid, begin + share * (end - begin)).distance_m >= 12.0 - 2e-3).all()
    np.testing.assert_allclose(outcome.corners_m[[0, -1]], [problem.start, problem.goal], atol=1e-9)
    again = plan_flight(problem)
    np.testing.assert_array_equal(again.corners_m, outcome.corners_m)


def test_a_flight_under_a_ceiling_below_the_ridge_goes_through_the_gap_or_is_proved_impossible() -> None:
    ends = (52.0, -30.0, 20.0), (251.0, -32.0, 20.0)
    low = plan_flight(FlightProblem(walled(), *ends, ceiling_m=50.0, bubble_m=8.0, budget=PlanBudget(iterations=4_000)))
    assert low.status is PathStatus.FOUND, low.sentence
    at_ridge = low.corners_m[np.abs(low.corners_m[:, 0] - 150.0) < 60.0]
    assert (at_ridge[:, 1] < -110.0).any()
    shut = walled().heights_m.copy()
    shut[:, 30] = 60.0
    none = plan_flight(FlightProblem(ElevationGrid(shut, 5.0, 5.0), *ends, ceiling_m=50.0, bubble_m=8.0))
    assert none.status is PathStatus.UNREACHABLE
    assert len(none.corners_m) == 0


def test_a_flight_stays_above_the_morphing_map() -> None:
    grid = walled()
    places = ((20.0, -20.0, 90.0), (280.0, -30.0, 120.0), (30.0, -180.0, 100.0), (270.0, -170.0, 140.0))
    surfaces = min_visible_altitude(grid, [Anchor(f"A{n}", *place) for n, place in enumerate(places)], "exact")
    above = morphing_map(surfaces, FlightLimit(6.0), ceiling_m=200.0)
    problem = FlightProblem(
        grid,
        (52.0, -100.0, 180.0),
        (251.0, -102.0, 180.0),
        above=above,
        bubble_m=5.0,
        budget=PlanBudget(iterations=4_000),
    )
    outcome = plan_flight(problem)
    assert outcome.status is PathStatus.FOUND, outcome.sentence
    for begin, end in zip(outcome.corners_m[:-1], outcome.corners_m[1:], strict=True):
        fine = begin + np.linspace(0.0, 1.0, 400)[:, None] * (end - begin)
        rows, cols = np.rint(-fine[:, 1] / 5.0).astype(int), np.rint(fine[:, 0] / 5.0).astype(int)
        assert (fine[:, 2] >= above.safe_above_m[rows, cols] - 1e-3).all()
    assert (outcome.margin_m >= -1e-6).all()


def test_flights_that_make_no_question_are_refused() -> None:
    grid = walled()
    with pytest.raises(PlaceError, match="outside the DEM"):
        plan_flight(FlightProblem(grid, (-50.0, -30.0, 30.0), (251.0, -32.0, 25.0)))
    with pytest.raises(PlaceError, match="below the floor"):
        plan_flight(FlightProblem(grid, (52.0, -30.0, 3.0), (251.0, -32.0, 25.0), bubble_m=10.0))
    with pytest.raises(PathProblemError, match="same place"):
        FlightProblem(grid, (52.0, -30.0, 30.0), (52.0, -30.0, 30.0))
    with pytest.raises(PathProblemError, match="bubble_m"):
        FlightProblem(grid, (52.0, -30.0, 30.0), (251.0, -32.0, 25.0), bubble_m=-1.0)


def test_a_start_over_shut_air_is_told_the_nearest_that_is_open() -> None:
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[8:20, 6:20] = 90.0
    grid = ElevationGrid(heights_m, 5.0, 5.0)
    ends = (52.0, -70.0, 95.0), (251.0, -70.0, 50.0)
    with pytest.raises(PlaceError, match="start is over air that may not be flown, at no altitude") as refused:
        plan_flight(FlightProblem(grid, *ends, ceiling_m=80.0, ceiling_above_ground=False))
    assert refused.value.nearest_m is not None
    moved = (*refused.value.nearest_m, 50.0)
    assert plan_flight(FlightProblem(grid, moved, ends[1], ceiling_m=80.0)).status is PathStatus.FOUND
    with pytest.raises(PlaceError, match="No air on the map may be flown"):
        plan_flight(
            FlightProblem(
                ElevationGrid(np.full((9, 9), 90.0), 5.0, 5.0), (9.0, -9.0, 95.0), (30.0, -9.0, 95.0), ceiling_m=80.0
            )
        )


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1)])
def test_a_dem_without_ground_between_its_posts_is_no_ground_to_plan_over(shape: tuple[int, int]) -> None:
    grid = ElevationGrid(np.zeros(shape, np.float32), 5.0, 5.0)
    with pytest.raises(PathProblemError, match=f"{shape[0]} × {shape[1]} posts has no ground between them"):
        FlightProblem(grid, (0.0, 0.0, 30.0), (0.0, 0.0, 60.0))
    with pytest.raises(PathProblemError, match="has no ground between them"):
        PathProblem(grid, (0.0, 0.0), (1.0, 0.0), rover=RoverModel(footprint_radius_m=0.0))
