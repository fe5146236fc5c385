"""Questions that make no sense are refused in one sentence; where there is no way, the proof says what blocks."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import shapely

from planning import AreaError, NoCoverageError, PathProblemError, PlaceError
from planning.paths import (
    CostWeights,
    NavigationModel,
    PathLimits,
    PathProblem,
    PathStatus,
    PlanBudget,
    Reason,
    RoverModel,
    plan_path,
)
from terrain import ElevationGrid
from visibility import Anchor, dop_map, min_visible_altitude

GRID_ALONE = PlanBudget(sampling=False)
START, GOAL = (22.0, -98.0), (281.0, -97.0)
ROVER = RoverModel(max_slope_rad=math.radians(30.0))


def level() -> np.ndarray:
    return np.zeros((40, 60), np.float32)


def grid_of(heights_m: np.ndarray) -> ElevationGrid:
    return ElevationGrid(heights_m, 5.0, 5.0)


def asked(grid: ElevationGrid | None = None, **changes: object) -> PathProblem:
    given = {"start": START, "goals": GOAL, "rover": ROVER, "budget": GRID_ALONE} | changes
    return PathProblem(grid or grid_of(level()), **given)


def overhead(count: int) -> tuple[Anchor, ...]:
    places = ((20.0, -20.0), (280.0, -30.0), (30.0, -180.0), (270.0, -170.0))[:count]
    return tuple(Anchor(f"A{n}", *place, 120.0 + 10.0 * n) for n, place in enumerate(places))


def box(west: float, south: float, east: float, north: float) -> shapely.Polygon:
    return shapely.box(west, south, east, north)


def test_a_ridge_across_is_named_with_the_slope_that_would_do() -> None:
    heights_m = level()
    heights_m[:, 30] = 10.0
    heights_m[25, 30] = heights_m[26, 30] = heights_m[27, 30] = 4.0
    outcome = plan_path(asked(grid_of(heights_m)))
    assert outcome.status is PathStatus.UNREACHABLE
    assert outcome.unreachable is not None
    assert outcome.unreachable.reason is Reason.SLOPE
    (slope,) = outcome.unreachable.relaxations
    assert slope.needed == pytest.approx(math.atan(0.8), abs=math.radians(0.2))
    assert 140.0 < outcome.unreachable.where_m[0] < 160.0
    eased = RoverModel(max_slope_rad=slope.needed)
    assert plan_path(asked(grid_of(heights_m), rover=eased)).status is PathStatus.FOUND


@pytest.mark.parametrize(("limits", "reason"), [(PathLimits(min_anchors=4), Reason.ANCHORS)])
def test_too_many_anchors_asked_for_are_named_with_the_number_that_would_do(limits: PathLimits, reason: Reason) -> None:
    heights_m = level()
    heights_m[:, 27] = 1.0
    rover = RoverModel(max_slope_rad=1.4, receiver_above_ground_m=0.5)
    low = Anchor("low", -300.0, -100.0, 6.0)
    outcome = plan_path(asked(grid_of(heights_m), rover=rover, anchors=(*overhead(3), low), limits=limits))
    assert outcome.status is PathStatus.UNREACHABLE
    assert outcome.unreachable is not None
    assert outcome.unreachable.reason is reason
    assert outcome.unreachable.relaxations[0].needed == 3.0
    assert "3 anchors in sight instead of 4" in outcome.sentence
    fewer = PathLimits(min_anchors=3)
    assert (
        plan_path(asked(grid_of(heights_m), rover=rover, anchors=(*overhead(3), low), limits=fewer)).status
        is PathStatus.FOUND
    )


def test_a_no_go_area_across_is_named_and_where_the_way_meets_it() -> None:
    outcome = plan_path(asked(no_go=(box(100.0, -400.0, 120.0, 100.0),)))
    assert outcome.status is PathStatus.UNREACHABLE
    assert outcome.unreachable is not None
    assert outcome.unreachable.reason is Reason.NO_GO
    assert 95.0 < outcome.unreachable.where_m[0] < 125.0


def test_pitch_too_little_for_every_heading_is_named_with_the_angle_that_would_do() -> None:
    slope = np.tile(np.clip(np.arange(60, dtype=np.float32) - 25.0, 0.0, 10.0) * 1.5, (40, 1))
    rover = RoverModel(max_slope_rad=0.6, max_pitch_rad=math.radians(10.0), max_roll_rad=math.radians(5.0))
    outcome = plan_path(asked(grid_of(slope), rover=rover))
    assert outcome.status is PathStatus.UNREACHABLE
    assert outcome.unreachable is not None
    assert outcome.unreachable.reason is Reason.PITCH_OR_ROLL
    assert outcome.unreachable.relaxations[0].needed > math.radians(5.0)


def test_where_two_limits_block_no_single_one_is_said_to_help() -> None:
    heights_m = level()
    heights_m[:, 30] = 10.0
    outcome = plan_path(asked(grid_of(heights_m), no_go=(box(200.0, -400.0, 220.0, 100.0),)))
    assert outcome.unreachable is not None
    assert outcome.unreachable.relaxations == ()
    assert "No single limit" in outcome.sentence


def test_way_points_are_passed_and_any_of_several_goals_will_do() -> None:
    stop = (151.0, -31.0)
    goals = ((281.0, -97.0), box(250.0, -40.0, 270.0, -20.0))
    outcome = plan_path(asked(goals=goals, way_points=(stop,)))
    assert outcome.path is not None
    away_m = np.hypot(outcome.path.east_m - stop[0], outcome.path.north_m - stop[1])
    assert away_m.min() < 1e-6
    assert shapely.intersects_xy(goals[1], outcome.path.east_m[-1], outcome.path.north_m[-1])


def test_dilution_limits_hold_along_the_whole_path() -> None:
    grid = grid_of(level())
    maps = dop_map(min_visible_altitude(grid, overhead(4), "exact"), 1.5)
    outcome = plan_path(asked(grid, maps=maps, limits=PathLimits(dop_limit=3.0)))
    if outcome.path is None:
        assert outcome.unreachable is not None
        assert outcome.unreachable.reason is Reason.DOP
    else:
        assert outcome.path.dop.max() < 3.0


def test_places_that_cannot_be_stood_on_are_refused_with_the_reason_and_the_nearest_place() -> None:
    hole_m = level()
    hole_m[18:22, 2:7] = np.nan
    with pytest.raises(PlaceError, match="unknown ground") as refused:
        plan_path(asked(grid_of(hole_m)))
    assert refused.value.place == "start"
    assert refused.value.nearest_m is not None
    moved = plan_path(asked(grid_of(hole_m), start=refused.value.nearest_m))
    assert moved.status is PathStatus.FOUND
    with pytest.raises(PlaceError, match="outside the DEM"):
        plan_path(asked(goals=(900.0, -97.0)))
    with pytest.raises(PlaceError, match="no-go area"):
        plan_path(asked(no_go=(box(270.0, -110.0, 290.0, -90.0),)))
    with pytest.raises(PlaceError, match="goal area"):
        plan_path(asked(goals=box(270.0, -110.0, 290.0, -90.0), no_go=(box(260.0, -120.0, 300.0, -80.0),)))


def test_the_nearest_place_as_it_is_written_can_be_typed_back() -> None:
    hole_m = level()
    hole_m[18:22, 2:7] = np.nan
    with pytest.raises(PlaceError) as refused:
        plan_path(asked(grid_of(hole_m)))
    east, north = re.findall(r"(-?[\d.]+) m (?:east|north)", str(refused.value))
    assert plan_path(asked(grid_of(hole_m), start=(float(east), float(north)))).status is PathStatus.FOUND


@pytest.mark.parametrize(
    ("changes", "reasons"),
    [
        (
            {"start": (15.0, -9.8), "grid": grid_of(np.zeros((3, 100), np.float32))},
            ("too near the border of the map",),
        ),
        ({"goals": (294.8, -97.0)}, ("too near the border of the map",)),
    ],
    ids=["a strip of two squares", "a goal on the border"],
)
def test_the_border_of_a_map_of_known_ground_is_not_called_unknown(
    changes: dict[str, object], reasons: tuple[str, ...]
) -> None:
    with pytest.raises(PlaceError, match="cannot be stood on: too near the border of the map; ") as refused:
        plan_path(asked(**changes))
    assert refused.value.reasons == reasons


def test_unknown_ground_at_the_border_is_named_beside_it() -> None:
    hole_m = level()
    hole_m[18:22, 57:] = np.nan
    with pytest.raises(PlaceError) as refused:
        plan_path(asked(grid_of(hole_m), goals=(294.8, -97.0)))
    assert refused.value.reasons == ("unknown ground", "too near the border of the map")


def test_a_wall_up_to_the_border_is_opened_by_the_border() -> None:
    ridge_m = level()
    ridge_m[2:, 30] = 30.0
    wide = RoverModel(6.0, max_slope_rad=math.radians(30.0))
    outcome = plan_path(asked(grid_of(ridge_m), rover=wide))
    assert outcome.unreachable is not None
    assert [(one.reason, one.shown) for one in outcome.unreachable.relaxations] == [
        (Reason.SLOPE, True),
        (Reason.BORDER, False),
    ]


@pytest.mark.parametrize("gate_m", [1.2, 2.0, 6.0])
def test_a_gap_that_the_rover_fits_through_is_found_however_the_squares_lie(gate_m: float) -> None:
    walls = (
        box(140.0, -190.0, 150.0, -100.0 - gate_m),
        box(140.0, -100.0, 150.0, 10.0),
        box(140.0, -300.0, 150.0, -190.0),
    )
    outcome = plan_path(asked(no_go=walls))
    assert outcome.status is PathStatus.FOUND
    assert outcome.validation is not None
    assert outcome.validation.passed


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"goals": START}, PathProblemError, "same place"),
        ({"goals": box(10.0, -110.0, 40.0, -80.0)}, PathProblemError, "already"),
        ({"goals": ()}, PathProblemError, "at least one goal"),
        ({"way_points": (START,)}, PathProblemError, "place before it"),
        ({"start": (math.nan, 0.0)}, PathProblemError, "finite"),
        ({"limits": PathLimits(min_anchors=1)}, PathProblemError, "need anchors"),
        ({"limits": PathLimits(min_anchors=3), "anchors": overhead(2)}, PathProblemError, "only 2"),
        ({"limits": PathLimits(min_anchors=2, dop_limit=0.01), "anchors": overhead(4)}, NoCoverageError, "Nowhere"),
        ({"no_go": (shapely.Polygon([(0, 0), (9, 9), (9, 0), (0, 9)]),)}, AreaError, "no proper polygon"),
        ({"no_go": (shapely.Polygon(),)}, AreaError, "empty"),
        ({"no_go": (shapely.Point(1.0, 1.0),)}, AreaError, "must be a polygon"),
        ({"no_go": (box(0, 0, 1, 1),), "areas_crs": "EPSG:4326"}, AreaError, "transform them first"),
        ({"seed": -1}, PathProblemError, "seed"),
        ({"start_heading_rad": math.inf}, PathProblemError, "finite angle"),
        ({"frame_s": 0.0}, PathProblemError, "frame_s"),
    ],
)
def test_a_question_that_makes_no_sense_is_refused(changes: dict, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        plan_path(asked(**changes))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PlanBudget(iterations=0), "at least one iteration"),
        (lambda: PlanBudget(seconds=0.0), "more than 0 s"),
        (lambda: PathLimits(dop_limit=0.0), "dop_limit"),
        (lambda: PathLimits(bubble_epsilon=-1.0), "bubble_epsilon"),
        (lambda: CostWeights(climb=-1.0), "climb"),
        (lambda: CostWeights(length=0.0), "cost something"),
        (lambda: RoverModel(max_slope_rad=0.0), "max_slope_rad"),
        (lambda: RoverModel(min_turning_radius_m=1e-6), "turns on the spot, or from 0.01 to"),
        (lambda: RoverModel(min_turning_radius_m=1e12), "turns on the spot, or from 0.01 to"),
        (lambda: RoverModel(speed_m_per_s=0.0), "speed_m_per_s"),
        (lambda: RoverModel(speed_over_slope=((0.1, 1.0), (0.0, 1.0))), "ascending"),
        (lambda: RoverModel(max_step_m=0.0), "max_step_m"),
        (lambda: NavigationModel(interval_s=0.0), "interval_s"),
    ],
)
def test_numbers_that_cannot_be_are_refused(make: object, words: str) -> None:
    with pytest.raises(PathProblemError, match=words):
        make()


def test_speed_over_slope_makes_uphill_take_longer_than_downhill() -> None:
    slope = np.tile(np.arange(60, dtype=np.float32) * 1.0, (40, 1))
    rover = RoverModel(max_slope_rad=0.5, speed_over_slope=((-0.3, 1.2), (0.0, 1.0), (0.3, 0.4)))
    weights = CostWeights(length=0.0, climb=0.0, time=1.0, out_of_sight=0.0)
    up = plan_path(asked(grid_of(slope), rover=rover, weights=weights))
    down = plan_path(asked(grid_of(slope), rover=rover, weights=weights, start=GOAL, goals=START))
    assert up.path is not None
    assert down.path is not None
    assert up.path.totals.time_s > 1.8 * down.path.totals.time_s
    assert up.path.cost == pytest.approx(up.path.totals.time_s, rel=1e-6)
