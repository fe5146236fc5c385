"""The safety bubble in the loop, beliefs as a cost, and anchors that move while the rover drives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planning import PlaceError
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
from visibility import Anchor, lines_of_sight
from visibility.sight import AnchorTrack

GRID_ALONE = PlanBudget(sampling=False)


def level(rows: int = 40, cols: int = 60, cell_m: float = 5.0) -> np.ndarray:
    return np.zeros((rows, cols), np.float32)


def overhead(count: int = 4) -> tuple[Anchor, ...]:
    places = ((20.0, -20.0), (280.0, -30.0), (30.0, -180.0), (270.0, -170.0))[:count]
    return tuple(Anchor(f"A{n}", *place, 120.0 + 10.0 * n, ranging_sigma_m=0.5) for n, place in enumerate(places))


def two_gaps() -> np.ndarray:
    """A ridge across level ground with a gap of 3 cells near the straight way, and one of 13 further off."""
    heights_m = level()
    heights_m[:, 30] = 60.0
    heights_m[18:22, 30] = 0.0
    heights_m[24:38, 30] = 0.0
    return heights_m


def test_with_a_bubble_the_path_takes_the_wide_gap() -> None:
    grid = ElevationGrid(two_gaps(), 5.0, 5.0)
    ends = (52.0, -98.0), (251.0, -97.0)
    common = {"anchors": overhead(), "budget": GRID_ALONE, "rover": RoverModel(max_slope_rad=math.radians(30.0))}
    free = plan_path(PathProblem(grid, *ends, **common))
    kept = plan_path(PathProblem(grid, *ends, limits=PathLimits(bubble_epsilon=3.0, dem_sigma_m=5.0), **common))
    assert free.path is not None
    assert kept.path is not None
    assert (kept.path.clearance_m >= kept.path.bubble_radius_m).all()
    narrow = free.path.clearance_m < 3.0 * free.path.position_sigma_m + 5.0
    assert narrow.any()
    assert kept.path.totals.length_m > free.path.totals.length_m


def test_the_predicted_sigma_falls_to_what_the_ranges_allow_and_grows_out_of_sight() -> None:
    grid = ElevationGrid(level(), 5.0, 5.0)
    rover = RoverModel()
    seen = plan_path(
        PathProblem(grid, (22.0, -98.0), (281.0, -97.0), anchors=overhead(), rover=rover, budget=GRID_ALONE)
    )
    alone = plan_path(
        PathProblem(grid, (22.0, -98.0), (281.0, -97.0), anchors=overhead(1), rover=rover, budget=GRID_ALONE)
    )
    assert seen.path is not None
    assert alone.path is not None
    assert seen.path.position_sigma_m[-1] < 1.0
    assert alone.path.position_sigma_m[-1] > 3.0 * seen.path.position_sigma_m[-1]
    assert seen.path.totals.mean_position_sigma_m < alone.path.totals.mean_position_sigma_m
    surer = NavigationModel(initial_velocity_sigma_m_per_s=0.01)
    slow = plan_path(
        PathProblem(grid, (22.0, -98.0), (281.0, -97.0), anchors=overhead(), navigation=surer, budget=GRID_ALONE)
    )
    assert slow.path is not None
    assert slow.path.position_sigma_m[1] < seen.path.position_sigma_m[1]


def test_a_start_with_less_room_than_its_bubble_is_refused_with_the_reason() -> None:
    grid = ElevationGrid(two_gaps(), 5.0, 5.0)
    limits = PathLimits(bubble_epsilon=3.0)
    problem = PathProblem(
        grid,
        (142.5, -12.0),
        (251.0, -97.0),
        anchors=overhead(),
        limits=limits,
        rover=RoverModel(max_slope_rad=0.5),
        navigation=NavigationModel(initial_sigma_m=4.0),
        budget=GRID_ALONE,
    )
    with pytest.raises(PlaceError, match="safety bubble") as refused:
        plan_path(problem)
    assert refused.value.place == "start"


def shadowed() -> ElevationGrid:
    """Level ground with a wall in the south, behind which low anchors in the north are hidden on the straight way."""
    heights_m = level(rows=50)
    heights_m[22:25, 15:45] = 40.0
    return ElevationGrid(heights_m, 5.0, 5.0)


def test_the_belief_aware_mode_goes_where_the_error_is_less() -> None:
    places = ((0.0, 60.0, 60.0), (100.0, -10.0, 20.0), (200.0, 60.0, 70.0), (300.0, -10.0, 20.0))
    anchors = tuple(Anchor(f"N{n}", *place, ranging_sigma_m=0.5) for n, place in enumerate(places))
    ends = (32.0, -128.0), (271.0, -127.0)
    common = {"anchors": anchors, "budget": GRID_ALONE, "rover": RoverModel(max_slope_rad=0.5)}
    short = plan_path(PathProblem(shadowed(), *ends, weights=CostWeights(out_of_sight=0.0), **common))
    sure = plan_path(
        PathProblem(shadowed(), *ends, weights=CostWeights(out_of_sight=0.0, position_error=2.0), **common)
    )
    assert short.path is not None
    assert sure.path is not None
    assert sure.path.totals.mean_position_sigma_m < 0.8 * short.path.totals.mean_position_sigma_m
    assert sure.path.totals.length_m > short.path.totals.length_m
    assert sure.path.cost == pytest.approx(sum(sure.path.cost_split.values()), rel=1e-6)
    assert sure.path.cost_split["position_error"] > 0.0


def test_the_path_meets_the_map_of_the_time_at_which_it_gets_there() -> None:
    """The anchor flies with the rover behind a wall: where it was at the start it would be hidden later on."""
    grid = shadowed()
    track = AnchorTrack("T", np.array([0.0, 600.0]), np.array([[20.0, -200.0, 30.0], [520.0, -200.0, 30.0]]))
    still = Anchor("S", 20.0, -200.0, 30.0)
    limits = PathLimits(min_anchors=1)
    rover = RoverModel(max_slope_rad=0.5)
    common = {"limits": limits, "rover": rover, "budget": GRID_ALONE, "frame_s": 20.0}
    outcome = plan_path(PathProblem(grid, (32.0, -88.0), (271.0, -127.0), anchors=(track,), **common))
    assert outcome.status is PathStatus.FOUND, outcome.sentence
    path = outcome.path
    assert path is not None
    eyes_m = np.array(
        [(a.east_m, a.north_m, a.altitude_m) for a in (track.at(s) for s in np.round(path.time_s).tolist())]
    )
    antenna_m = np.column_stack([path.east_m, path.north_m, path.altitude_m + rover.receiver_above_ground_m])
    assert (lines_of_sight(grid, eyes_m, antenna_m).verdict == 1).all()
    from_start = lines_of_sight(grid, np.broadcast_to(eyes_m[0], eyes_m.shape), antenna_m)
    standing = plan_path(PathProblem(grid, (32.0, -88.0), (271.0, -127.0), anchors=(still,), **common))
    assert (from_start.verdict == 0).any() or standing.path is None or standing.path.totals != path.totals


def test_beyond_its_track_an_anchor_is_not_counted_on() -> None:
    grid = ElevationGrid(level(), 5.0, 5.0)
    track = AnchorTrack("T", np.array([0.0, 60.0]), np.array([[20.0, -20.0, 90.0], [120.0, -20.0, 90.0]]))
    problem = PathProblem(
        grid, (22.0, -98.0), (281.0, -97.0), anchors=(track,), limits=PathLimits(min_anchors=1), budget=GRID_ALONE
    )
    with pytest.raises(PlaceError, match="no anchor is in sight there") as refused:
        plan_path(problem)
    assert refused.value.place == "goal"
    assert refused.value.reasons == (Reason.ANCHORS,)
