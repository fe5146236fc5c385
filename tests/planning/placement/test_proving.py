"""What is said to be out of reach is: bounds against every set there is."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from planning.placement import Goal, PlacementRules, place_anchors
from planning.placement.judges import Problem, judge_of, sampled
from planning.placement.placing import Ready, prepare
from planning.placement.proving import Relaxation, prove, relaxation_of
from planning.placement.proving.subgradients import Node, bounds_of
from planning.placement.sight import SightTable, pack
from tests.planning.placement.grounds import exact_sight, small_question
from tests.reference import placement as oracle
from visibility import Anchor

GOALS = {
    "one in sight": Goal("coverage", min_anchors=1),
    "two in sight": Goal("coverage", min_anchors=2),
    "three in sight": Goal("coverage", min_anchors=3),
    "two in sight whichever is lost": Goal("coverage", min_anchors=2, spare=1),
    "a dilution": Goal("dop", min_anchors=3, dop_limit=6.0),
    "a dilution whichever is lost": Goal("dop", min_anchors=3, dop_limit=12.0, spare=1),
    "a dilution along the surface": Goal("dop", dop_limit=2.5, on_surface=True),
    "a horizontal dilution": Goal("dop", dop_limit=2.0, measure="hdop"),
    "a vertical dilution": Goal("dop", dop_limit=4.0, measure="vdop"),
    "a dilution with a clock": Goal("dop", dop_limit=12.0, kind="pseudorange"),
    "a mean error": Goal("mean_error"),
    "an error along the surface": Goal("mean_error", on_surface=True),
    "an error counted up to two metres": Goal("mean_error", worst_counted_m=2.0),
}
CANDIDATES, COUNT = 11, 4


def ready_for(goal: Goal, seed: int, *, rules: PlacementRules | None = None, fixed: bool = False) -> Ready:
    grid, candidates, targets = small_question(seed, CANDIDATES)
    east_m, north_m, altitude_m = candidates.position_m[3].tolist()
    standing = [Anchor("F", east_m + 70.0, north_m - 40.0, altitude_m + 30.0)] if fixed else []
    return prepare(grid, candidates, targets, goal, rules or PlacementRules(), standing, None, None, None, None)


def every_value(problem: Problem, count: int) -> dict[tuple[int, ...], float]:
    judge = judge_of(problem)
    return {some: judge.value(list(some)) for some in combinations(range(len(problem.anchor)), count)}


@pytest.mark.parametrize("fixed", [False, True], ids=["alone", "beside one that stands"])
@pytest.mark.parametrize("goal", GOALS.values(), ids=list(GOALS))
def test_no_set_exceeds_the_bound_and_the_proof_ends_at_the_best(goal: Goal, fixed: bool) -> None:
    ready = ready_for(goal, 7, fixed=fixed)
    problem = sampled(ready.problem, np.arange(0, len(ready.problem.targets), 19))
    values = every_value(problem, COUNT)
    best, worst = max(values.values()), min(values, key=lambda some: values[some])
    judge = judge_of(problem)
    around_best = max(values, key=lambda some: values[some])
    for around in ((), worst, around_best):
        rows = relaxation_of(problem, COUNT, around)
        for effort_s in (0.0, 0.01):
            early = prove(rows, judge, list(worst), ready.together, effort_s)
            assert early.bound >= best - 1e-9
            assert early.value <= best + 1e-12
            assert not early.proved or early.value == pytest.approx(best, abs=2e-6)
        whole = prove(rows, judge, list(worst), ready.together, 60.0)
        assert whole.proved
        assert whole.value == pytest.approx(best, abs=2e-6)


def test_the_bound_of_an_error_is_near_it_where_all_anchors_are_seen() -> None:
    ready = ready_for(Goal("mean_error"), 7)
    problem = sampled(ready.problem, np.arange(0, len(ready.problem.targets), 19))
    seen = replace(
        problem, sight=SightTable(pack(np.ones((CANDIDATES, len(problem.targets)), np.bool_)), len(problem.targets))
    )
    values = every_value(seen, COUNT)
    best = max(values, key=lambda some: values[some])
    root = prove(relaxation_of(seen, COUNT, best), judge_of(seen), list(best), ready.together, 0.0)
    # none brings more than all candidates together: until ramps rose to what is near, bounds were further than that
    everyone = judge_of(seen).value(list(range(CANDIDATES)))
    assert values[best] <= root.bound < values[best] + 0.7 * (everyone - values[best])


def test_the_bound_of_coverage_is_the_share_that_brute_force_finds() -> None:
    grid, candidates, targets = small_question(5, CANDIDATES)
    sight = exact_sight(grid, candidates.position_m, targets.point_m).tolist()
    best, _ = oracle.best_set(lambda chosen: oracle.share_covered(sight, chosen, 2), CANDIDATES, 3)
    ready = prepare(
        grid, candidates, targets, Goal("coverage", min_anchors=2), PlacementRules(), (), None, None, None, None
    )
    problem = replace(ready.problem, sight=SightTable(pack(np.array(sight)), len(targets)))
    proof = prove(relaxation_of(problem, 3), judge_of(problem), [0, 1, 2], ready.together, 60.0)
    assert proof.proved
    assert proof.bound == pytest.approx(best, abs=1e-12)


def test_weights_and_rules_between_anchors_are_kept() -> None:
    rules = PlacementRules(min_separation_m=600.0)
    ready = ready_for(Goal("coverage", min_anchors=2), 3, rules=rules)
    weight = np.random.default_rng(4).uniform(0.5, 2.0, len(ready.problem.targets))
    problem = replace(ready.problem, targets=replace(ready.problem.targets, weight=weight))
    values = {some: value for some, value in every_value(problem, 3).items() if ready.together.allows(list(some))}
    best = max(values.values())
    assert best < max(every_value(problem, 3).values())
    proof = prove(relaxation_of(problem, 3), judge_of(problem), list(min(values)), ready.together, 60.0)
    assert proof.proved
    assert ready.together.allows(proof.chosen)
    assert proof.value == pytest.approx(best, abs=2e-6)


def test_targets_that_no_set_tells_apart_are_one_row() -> None:
    problem = ready_for(Goal("coverage", min_anchors=2), 7).problem
    doubled = sampled(problem, np.repeat(np.arange(len(problem.targets)), 2))
    one, two = relaxation_of(problem, 3), relaxation_of(doubled, 3)
    assert len(one.weight) < len(problem.targets)
    assert len(two.weight) == len(one.weight)
    assert two.weight.sum() == pytest.approx(one.weight.sum())


def test_a_placement_among_eighty_candidates_is_proved() -> None:
    grid, candidates, targets = small_question(9, 80)
    found = place_anchors(grid, candidates, targets, 4, Goal("coverage", min_anchors=2))
    assert found.proved
    assert found.gap == 0.0
    assert found.method == "exact"


def test_prices_that_rounding_made_more_than_one_lower_no_bound() -> None:
    # of a thousand rows in alike need of two parts the one candidate left makes the first good
    part = np.zeros((2, 2, 1000), np.float32)
    part[0, :, 0] = part[1] = 1.0
    weight, need = np.full(1000, 1e-3), np.ones((2, 1000), np.float32)
    rows = Relaxation(part, need, weight, 0.0, 0.0, False)
    price = np.full((2, 1000), [[0.996], [0.00415]], np.float16)
    assert price.astype(np.float64).sum(axis=0).min() > 1.0
    node = Node((), np.array([0]), 1, price)
    found = bounds_of(rows, [np.zeros_like(need), np.ones_like(need)], [node], 0.0, 1)
    assert found.bound[0] >= 1e-3
