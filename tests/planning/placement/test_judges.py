"""What judges say: a set's value is the oracle's, and "with each candidate added" is the value of the set with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planning.placement import (
    Goal,
    SightOptions,
    area_targets,
    candidate_points,
    join_candidates,
    place_anchors,
    placement_geometry,
)
from planning.placement.cluster import sight_table
from planning.placement.judges import CountJudge, GeometryJudge, Problem, judge_of, shown_value
from planning.placement.placing import anchor_rows
from planning.placement.sight import sampled_targets
from terrain import ElevationGrid
from tests.planning.placement.grounds import small_question
from tests.reference import placement as oracle
from visibility import Anchor

GOALS = [
    Goal("coverage", min_anchors=2),
    Goal("coverage", min_anchors=2, spare=1),
    Goal("dop", min_anchors=3, dop_limit=6.0),
    Goal("dop", min_anchors=4, dop_limit=8.0, spare=1),
    Goal("dop", min_anchors=3, dop_limit=6.0, on_surface=True),
    Goal("dop", min_anchors=4, dop_limit=9.0, kind="pseudorange", measure="hdop"),
    Goal("mean_error"),
    Goal("mean_error", spare=1, measure="vdop"),
    Goal("worst_error", worst_counted_m=3.0),
]
# unknowns of a fix: east, north, up; along the ground one less; with a clock one more
NEEDED_UNASKED = [
    (Goal("dop"), 3),
    (Goal("dop", on_surface=True), 2),
    (Goal("dop", kind="pseudorange"), 4),
    (Goal("dop", kind="pseudorange", on_surface=True), 3),
    (Goal("dop", on_surface=True, spare=1), 2),
    (Goal("mean_error", on_surface=True), 2),
    (Goal("coverage"), 4),
    (Goal("dop", min_anchors=4, on_surface=True), 4),
]
SETS: list[list[int]] = [[], [0], [1, 5], [2, 4, 7], [0, 3, 6, 8], [0, 1, 2, 3, 4, 5]]


def problem_of(goal: Goal, *, weighted: bool = False, fixed: tuple[Anchor, ...] = ()) -> Problem:
    grid, candidates, whole = small_question(4, 9)
    if weighted:
        whole = area_targets(grid, weight=np.linspace(0.0, 3.0, grid.heights_m.size).reshape(grid.shape))
    targets = sampled_targets(whole, np.arange(0, len(whole), 29))
    weight = np.full((9, 1), 1.0 if goal.is_share else goal.ranging_sigma_m**-2)
    fixed_rows = anchor_rows(fixed, goal)
    options = SightOptions(mode="exact")
    table = sight_table(grid, targets, candidates.position_m, options).table
    fixed_table = sight_table(grid, targets, fixed_rows[:, :3], options).table
    return Problem(targets, goal, np.hstack([candidates.position_m, weight]), table, fixed_rows, fixed_table)


@pytest.mark.parametrize(
    ("goal", "needed"), NEEDED_UNASKED, ids=lambda one: one.sentence() if isinstance(one, Goal) else ""
)
def test_a_dilution_asks_for_as_many_anchors_as_a_fix_needs(goal: Goal, needed: int) -> None:
    assert goal.needed == needed
    assert goal.needed_with_spare == needed + goal.spare


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: goal.sentence())
@pytest.mark.parametrize("weighted", [False, True], ids=["equal", "weighted"])
def test_with_each_candidate_added_is_the_value_of_the_larger_set(goal: Goal, weighted: bool) -> None:
    fixed = (Anchor("F", 500.0, -600.0, 500.0),)
    for problem in (problem_of(goal, weighted=weighted), problem_of(goal, weighted=weighted, fixed=fixed)):
        for judge in (judge_of(problem), CountJudge(problem, goal.needed_with_spare, partial=True)):
            for chosen in SETS:
                which = np.array([c for c in range(9) if c not in chosen])
                expected = [judge.value([*chosen, int(c)]) for c in which]
                assert judge.with_each(chosen, which) == pytest.approx(expected, abs=1e-9)


def test_information_gained_is_that_of_the_larger_set_and_shrinks_as_sets_grow() -> None:
    judge = GeometryJudge(problem_of(Goal("dop")), information=True)
    everyone = np.arange(9)
    for small, large in (([], [1]), ([1], [1, 5]), ([2, 4], [2, 4, 7, 8])):
        gains = [judge.with_each(chosen, everyone) - judge.value(chosen) for chosen in (small, large)]
        outside = [c for c in range(9) if c not in large]
        assert judge.value([*small, 6]) == pytest.approx(judge.value(small) + gains[0][6])
        assert (gains[0][outside] >= gains[1][outside] - 1e-9).all()


@pytest.mark.parametrize("chosen", SETS[1:])
def test_values_are_those_of_the_oracle(chosen: list[int]) -> None:
    problem = problem_of(Goal("coverage", min_anchors=2), weighted=True)
    sight = problem.sight.visible().tolist()
    share = oracle.share_covered(sight, chosen, 2, problem.targets.weight.tolist())
    assert shown_value(problem, chosen) == pytest.approx(share)
    problem = problem_of(GOALS[2])
    sight = problem.sight.visible().tolist()
    share = oracle.share_with_dilution(sight, problem.anchor[:, :3], problem.targets.point_m, chosen, 3, 6.0)
    assert shown_value(problem, chosen) == pytest.approx(share)
    problem = problem_of(GOALS[6])
    error_m = oracle.mean_error(sight, problem.anchor[:, :3], problem.targets.point_m, chosen, 0.1, 10.0)
    assert shown_value(problem, chosen) == pytest.approx(error_m, rel=1e-6)


@pytest.mark.parametrize("objective", ["coverage", "dop"])
def test_a_spare_counts_what_is_left_after_the_worst_loss(objective: str) -> None:
    goal = Goal(objective, min_anchors=3, dop_limit=7.0)
    robust, plain = problem_of(replace(goal, spare=1)), problem_of(goal)
    chosen = [0, 2, 3, 5, 7, 8]
    # a target counts once every loss leaves it enough; the share after a loss of one anchor everywhere is no less
    left = [shown_value(plain, [m for m in chosen if m != lost]) for lost in chosen]
    assert shown_value(robust, chosen) <= min(left) + 1e-12
    seen = plain.sight.visible()
    per_target = np.ones(len(plain.targets), np.bool_)
    for lost in chosen:
        rest = [m for m in chosen if m != lost]
        if objective == "coverage":
            per_target &= seen[rest].sum(axis=0) >= 3
        else:
            per_target &= GeometryJudge(plain).of_targets(rest) > 0.5
    assert shown_value(robust, chosen) == pytest.approx(per_target.mean())


@pytest.mark.parametrize(("dop_limit", "share"), [(1.0, 0.0), (1.0 + 1e-9, 1.0)])
def test_a_dilution_that_is_the_limit_is_not_good_enough(dop_limit: float, share: float) -> None:
    # along the three axes from the only target: a vertical dilution of exactly 1
    grid = ElevationGrid(np.zeros((9, 9), np.float32), 10.0, 10.0)
    weight = np.zeros(grid.shape)
    weight[4, 4] = 1.0
    axes = join_candidates(
        [
            candidate_points(grid, [at], above_ground_m=[height_m])
            for at, height_m in (((80.0, -40.0), 1.5), ((40.0, 0.0), 1.5), ((40.0, -40.0), 61.5))
        ]
    )
    goal = Goal("dop", min_anchors=3, dop_limit=dop_limit, measure="vdop")
    found = place_anchors(grid, axes, area_targets(grid, weight=weight), 3, goal)
    assert found.value == placement_geometry(grid, found).within_limit == share
