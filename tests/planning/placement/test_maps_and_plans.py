"""What a placement and a repositioning bring, as maps and along the path, in a line or two of Python."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planning.placement import (
    Flight,
    Goal,
    MoveQuestion,
    area_targets,
    candidate_grid,
    flight_level_m,
    leapfrog,
    path_length_m,
    path_targets,
    place_anchors,
    placement_maps,
    plan_repositioning,
    reposition,
)
from planning.placement.stretches import flight_costs
from terrain import ElevationGrid
from tests.planning.placement.grounds import exact_sight, rough_grid
from visibility import Anchor, Curvature, anchor_above_ground

GRID = rough_grid(32, seed=4, relief_m=120.0)
WEST, SOUTH, EAST, NORTH = GRID.bounds_m
CREW = [
    anchor_above_ground(GRID, f"D{n}", WEST + east * (EAST - WEST), SOUTH + north * (NORTH - SOUTH), 80.0)
    for n, (east, north) in enumerate([(0.1, 0.2), (0.9, 0.3), (0.4, 0.9), (0.6, 0.1)])
]
PATH_M = np.array([(WEST + 60.0, SOUTH + 90.0), (EAST - 90.0, NORTH - 60.0)])


def test_the_maps_of_a_placement_say_what_its_value_says() -> None:
    goal = Goal("coverage", min_anchors=2)
    candidates = candidate_grid(GRID, 240.0, above_ground_m=[60.0])
    found = place_anchors(GRID, candidates, area_targets(GRID), 3, goal, fixed=CREW[:1])
    maps = placement_maps(GRID, found)
    assert np.mean(maps.count_after >= 2) == pytest.approx(found.value)
    assert np.mean(maps.count_before >= 2) == found.before == 0.0
    assert maps.count_before.max() == 1
    assert (maps.count_after >= maps.count_before).all()
    assert np.isinf(maps.dop_before).all()
    assert (np.isfinite(maps.dop_after) <= (maps.count_after >= 3)).all()
    assert maps.is_target.all()
    assert maps.curvature == Curvature.of(GRID)


def test_the_maps_tell_unknown_ground_and_where_a_path_goes() -> None:
    heights_m = np.array(GRID.heights_m)
    heights_m[3, 5] = np.nan
    holed = ElevationGrid(heights_m, GRID.cell_east_m, GRID.cell_north_m, GRID.origin_east_m, GRID.origin_north_m)
    targets = path_targets(holed, PATH_M)
    found = place_anchors(
        holed, candidate_grid(holed, 240.0, above_ground_m=[60.0]), targets, 2, Goal("coverage", min_anchors=1)
    )
    assert found.within_limits_m == pytest.approx(found.value * targets.total)
    assert found.what == ("drone", "drone")
    maps = placement_maps(holed, found)
    assert np.argwhere(np.isnan(maps.dop_before)).tolist() == [[3, 5]]
    rows, cols = np.nonzero(maps.is_target)
    east_m, north_m = holed.position_of(rows, cols)
    along = (PATH_M[1] - PATH_M[0]) / np.linalg.norm(PATH_M[1] - PATH_M[0])
    aside_m = np.abs(along[0] * (north_m - PATH_M[0, 1]) - along[1] * (east_m - PATH_M[0, 0]))
    assert aside_m.max() <= math.hypot(holed.cell_east_m, holed.cell_north_m) / 2.0
    # what is open over unknown ground is in sight, or not, and never unknown
    assert (placement_maps(holed, found, "open").count_after >= maps.count_after).all()


def test_a_plan_of_one_move_is_the_advice_and_tells_where_it_holds() -> None:
    question = MoveQuestion(Goal("coverage", min_anchors=3), occluded=["D1"], flight=Flight(max_flight_m=900.0))
    advice = reposition(GRID, CREW, PATH_M, question)
    plan = plan_repositioning(GRID, CREW, PATH_M, question, rover_m_per_s=2.0)
    assert advice.move is not None
    assert [timed.move for timed in plan.schedule.moves] == [advice.move]
    assert (plan.schedule.share_unmoved, plan.schedule.share) == (advice.before, advice.after)
    assert plan.restored is advice.restored
    assert plan.schedule.arrive_s == pytest.approx(path_length_m(PATH_M) / 2.0)
    assert plan.sentence.startswith(f"{advice.move.anchor.id} flies")
    for column, hidden in enumerate(({"D1"}, {"D1"} - {advice.move.anchor.id})):
        who = [a for a in (CREW, advice.anchors_after(CREW))[column] if a.id not in hidden]
        places = np.array([(a.east_m, a.north_m, a.altitude_m) for a in who])
        assert (plan.good[:, column] == (exact_sight(GRID, places, plan.point_m).sum(axis=0) >= 3)).all()


def test_a_plan_by_stretches_is_the_leapfrog() -> None:
    question = MoveQuestion(Goal("coverage", min_anchors=3), occluded=["D0"])
    expected = leapfrog(GRID, CREW, PATH_M, question, stretch_m=400.0)
    plan = plan_repositioning(GRID, CREW, PATH_M, question, stretch_m=400.0)
    assert plan.schedule == expected
    assert len(plan.schedule.stretches) > 1
    assert len(plan.good) == len(plan.point_m)
    assert plan.restored == all(stretch.value >= 1.0 - 1e-9 for stretch in expected.stretches)


def test_nobody_moves_where_nothing_has_to() -> None:
    plan = plan_repositioning(GRID, CREW, PATH_M, MoveQuestion(Goal("coverage", min_anchors=1), share=0.01))
    assert plan.schedule.moves == ()
    assert plan.restored
    assert plan.sentence.startswith("Nobody moves")


def test_the_level_of_a_flight_comes_out_of_its_length() -> None:
    start: Anchor = replace(CREW[0], altitude_m=CREW[0].altitude_m + 10.0)
    from_m, to_m = ([getattr(a, name) for name in ("east_m", "north_m", "altitude_m")] for a in (start, CREW[2]))
    flight_m, _ = flight_costs(GRID, Flight(clearance_m=200.0), np.array(from_m), np.array([to_m]))
    level_m = flight_level_m(from_m, to_m, float(flight_m[0]))
    across_m = math.dist(from_m[:2], to_m[:2])
    assert level_m > max(from_m[2], to_m[2])
    assert (level_m - from_m[2]) + across_m + (level_m - to_m[2]) == pytest.approx(flight_m[0])
