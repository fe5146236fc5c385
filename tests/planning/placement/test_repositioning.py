"""A drone that stays hidden: the cheapest move that restores what is asked ahead, checked by brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from benchmarks.planning.placing_baselines import any_move_can
from planning import PlacementError
from planning.placement import (
    Flight,
    Goal,
    MoveQuestion,
    PlacementRules,
    leapfrog,
    path_between,
    path_targets,
    plan_repositioning,
    reposition,
    straight_ahead,
)
from planning.placement.stretches import flight_costs
from terrain import ElevationGrid, height_at
from tests.planning.placement.grounds import exact_sight, rough_grid
from visibility import Anchor, anchor_above_ground

GOAL = Goal("coverage", min_anchors=3)


def crew(grid: ElevationGrid, count: int = 4, seed: int = 0, height_m: float = 80.0) -> list[Anchor]:
    random = np.random.default_rng(seed)
    west, south, east, north = grid.bounds_m
    return [
        anchor_above_ground(grid, f"D{n}", random.uniform(west, east), random.uniform(south, north), height_m)
        for n in range(count)
    ]


def ahead(grid: ElevationGrid, seed: int = 0, length_m: float = 300.0) -> np.ndarray:
    random = np.random.default_rng(seed + 100)
    west, south, east, north = grid.bounds_m
    place = random.uniform((west, south), (east, north))
    toward = math.atan2((west + east) / 2 - place[0], (south + north) / 2 - place[1])
    return straight_ahead(*place, toward, length_m)


def test_most_that_any_move_can_restore_is_restored() -> None:
    reach_m, can, does = 500.0, 0, 0
    for seed in range(16):
        grid = rough_grid(32, seed=seed, relief_m=120.0)
        anchors, path_m = crew(grid, 4, seed), ahead(grid, seed, 150.0)
        question = MoveQuestion(GOAL, occluded=["D0"], flight=Flight(max_flight_m=reach_m))
        found = reposition(grid, anchors, path_m, question)
        if found.move is None and found.restored:
            continue
        possible = any_move_can(grid, anchors, "D0", path_m, GOAL, reach_m)
        can += possible
        does += found.restored
        assert possible or not found.restored
    assert can >= 3
    assert does >= 0.95 * can


def test_after_the_move_the_lines_of_sight_are_there() -> None:
    for seed in range(12):
        grid = rough_grid(40, seed=seed, relief_m=250.0)
        anchors, path_m = crew(grid, 4, seed), ahead(grid, seed)
        found = reposition(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D1"]))
        if found.move is None or not found.restored:
            continue
        counted = [a for a in found.anchors_after(anchors) if a.id != "D1" or found.move.anchor.id == "D1"]
        seen = exact_sight(
            grid,
            np.array([(a.east_m, a.north_m, a.altitude_m) for a in counted]),
            path_targets(grid, path_m).point_m,
        )
        assert (seen.sum(axis=0) >= GOAL.min_anchors).all()
        assert found.after == 1.0 > found.before
        return
    pytest.fail("no seed needed a move")


def test_heights_asked_for_are_the_only_ones() -> None:
    # over a plane at 0 m an altitude is a height above ground, and every place sees everything
    grid = ElevationGrid(np.zeros((30, 30)), 20.0, 30.0)
    anchors = [anchor_above_ground(grid, f"D{n}", 60.0 + 140.0 * n, -300.0, 445.0) for n in range(3)]
    path_m = straight_ahead(100.0, -500.0, 0.3, 150.0)

    def to_m(heights_m: list[float] | None) -> float:
        found = reposition(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D1"], above_ground_m=heights_m))
        assert found.move is not None
        return found.move.to.altitude_m

    assert to_m([60.0]) == 60.0
    assert to_m([60.0, 400.0]) == 400.0
    assert to_m(None) == 445.0  # level flight is the shortest, and its own altitude is looked at by default
    for schedule in (
        leapfrog(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D1"], above_ground_m=[60.0]), stretch_m=80.0),
        plan_repositioning(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D1"], above_ground_m=[60.0])).schedule,
    ):
        assert [timed.move.to.altitude_m for timed in schedule.moves] == [60.0]
    with pytest.raises(PlacementError, match="names no height"):
        to_m([])


def test_an_occluded_drone_has_to_go_a_cell_away_before_it_counts() -> None:
    grid = ElevationGrid(np.zeros((30, 30)), 20.0, 30.0)
    anchors = [anchor_above_ground(grid, f"D{n}", 60.0 + 140.0 * n, -300.0, 60.0) for n in range(3)]
    found = reposition(grid, anchors, straight_ahead(100.0, -500.0, 0.3, 150.0), MoveQuestion(GOAL, occluded=["D1"]))
    # on a plane every place sees everything: the nearest will do, but for the one where something unknown hides it
    assert found.restored
    assert found.move is not None
    assert found.move.anchor.id == "D1"
    to = found.move.to
    away_m = math.dist((to.east_m, to.north_m, to.altitude_m), (200.0, -300.0, 60.0))
    assert 20.0 <= away_m <= 37.0


def test_nothing_moves_where_nothing_has_to() -> None:
    grid = ElevationGrid(np.zeros((20, 20), np.float32), 30.0, 30.0)
    found = reposition(grid, crew(grid), [(100.0, -100.0), (200.0, -200.0)], MoveQuestion(GOAL, occluded=["D0"]))
    assert found.move is None
    assert found.restored
    assert "Nothing has to move" in found.sentence


def test_the_cheapest_move_in_time_is_not_slower_than_the_shortest() -> None:
    grid = rough_grid(40, seed=2, relief_m=250.0)
    anchors, path_m = crew(grid, 4, 2), ahead(grid, 2)
    by_distance = reposition(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D0", "D1"]))
    by_time = reposition(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D0", "D1"], cheapest="time"))
    if by_distance.restored and by_distance.move is not None:
        assert by_time.move is not None
        assert by_time.move.flight_s <= by_distance.move.flight_s
        assert by_distance.move.flight_m <= by_time.move.flight_m


def test_a_flight_climbs_over_the_ridge_between() -> None:
    heights_m = np.zeros((11, 11), np.float32)
    heights_m[:, 5] = 100.0
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    metres, seconds = flight_costs(
        grid, Flight(10.0, 2.0, 1.0, clearance_m=20.0), np.array([0.0, -50.0, 50.0]), np.array([[100.0, -50.0, 60.0]])
    )
    assert metres[0] == pytest.approx(70.0 + 100.0 + 60.0)
    assert seconds[0] == pytest.approx(35.0 + 10.0 + 60.0)


def test_a_stretch_is_the_path_between_two_distances() -> None:
    path = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0)]
    assert path_between(path, 50.0, 150.0) == pytest.approx(np.array([(50.0, 0.0), (100.0, 0.0), (100.0, 50.0)]))
    assert straight_ahead(10.0, 20.0, math.pi / 2, 5.0)[1] == pytest.approx((15.0, 20.0))


def test_drones_that_follow_serve_more_of_a_long_path_and_the_times_add_up() -> None:
    grid = rough_grid(40, seed=4, relief_m=200.0)
    west, south, east, north = grid.bounds_m
    path = [(west + 60.0, south + 60.0), (east - 60.0, north - 60.0)]
    near = [anchor_above_ground(grid, f"D{n}", west + 100.0 + 120.0 * n, south + 150.0, 60.0) for n in range(4)]
    plan = leapfrog(grid, near, path, MoveQuestion(GOAL), stretch_m=400.0, rover_m_per_s=2.0)
    assert plan.share > plan.share_unmoved
    assert plan.stretches[0].from_m == 0.0
    assert plan.stretches[-1].to_m == pytest.approx(math.hypot(east - west - 120.0, north - south - 120.0))
    driven_s = plan.stretches[-1].to_m / 2.0
    assert plan.arrive_s == pytest.approx(driven_s + plan.waited_s)
    for timed in plan.moves:
        assert timed.end_s - timed.start_s == pytest.approx(timed.move.flight_s)
        assert timed.end_s <= plan.stretches[timed.stretch].depart_s + 1e-9
    assert plan.flight_m == pytest.approx(sum(timed.move.flight_m for timed in plan.moves))


def test_a_move_keeps_the_rules_for_places_and_ways() -> None:
    grid = rough_grid(40, seed=3, relief_m=250.0)
    anchors, path_m = crew(grid, 4, 3), ahead(grid, 3)
    west, south, east, north = grid.bounds_m
    zone = shapely.box(west, south, (west + east) / 2, north)
    rules = PlacementRules(no_fly=(zone,), max_altitude_m=400.0)
    found = reposition(grid, anchors, path_m, MoveQuestion(GOAL, occluded=["D0", "D2"], rules=rules))
    if found.move is not None:
        way = shapely.LineString(
            [(found.move.anchor.east_m, found.move.anchor.north_m), (found.move.to.east_m, found.move.to.north_m)]
        )
        assert not way.intersects(zone)
        assert found.move.to.altitude_m <= 400.0
        assert found.move.to.altitude_m >= float(height_at(grid, found.move.to.east_m, found.move.to.north_m))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"occluded": ["X"]}, "no anchor X"),
        ({"share": 0.0}, "share must be"),
        ({"goal": Goal("mean_error")}, "objective coverage or dop"),
        ({"path_m": [(0.0, 0.0)]}, "path must be"),
    ],
)
def test_a_question_that_makes_no_sense_is_refused(change: dict, sentence: str) -> None:
    grid = rough_grid(24)
    asked = {"goal": GOAL, **change}
    path_m = asked.pop("path_m", [(100.0, -100.0), (200.0, -200.0)])
    with pytest.raises(PlacementError, match=sentence):
        reposition(grid, crew(grid), path_m, MoveQuestion(**asked))


def test_a_flight_that_cannot_be_flown_is_refused() -> None:
    with pytest.raises(PlacementError, match="speed"):
        Flight(speed_m_per_s=0.0)
    with pytest.raises(PlacementError, match="clearance_m"):
        replace(Flight(), max_flight_m=0.0)


@pytest.mark.parametrize("stretch_m", [None, 1250.0])
def test_no_range_is_measured_beyond_its_limit_in_one_move_or_many(stretch_m: float | None) -> None:
    level = ElevationGrid(np.zeros((60, 60), np.float32), 50.0, 50.0)
    anchors = [Anchor(f"D{n}", 100.0 + 700.0 * n, -1500.0, 80.0) for n in range(4)]
    path_m, rules = [(200.0, -1500.0), (2700.0, -1500.0)], PlacementRules(max_range_m=600.0)
    question = MoveQuestion(Goal("coverage", min_anchors=2), rules=rules, movable=[])
    plan = plan_repositioning(level, anchors, path_m, question, stretch_m=stretch_m)
    assert plan.schedule.share_unmoved == pytest.approx(0.6, abs=0.05)
    assert plan.good[:, 0].mean() == pytest.approx(plan.schedule.share_unmoved, abs=0.05)
