"""Candidates and rules: what each takes away is counted, and what makes no question is refused in a sentence."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planning import NoCandidateError, PlacementError
from planning.placement import (
    Candidates,
    Goal,
    Link,
    PlacementRules,
    SearchOptions,
    SightOptions,
    area_targets,
    candidate_grid,
    candidate_points,
    check_placement,
    corridor_targets,
    feasible_candidates,
    hover_sensitivity,
    join_candidates,
    path_targets,
    place_anchors,
    value_of_anchors,
)
from terrain import ElevationGrid, height_at
from tests.planning.placement.grounds import anchor_positions, exact_sight, rough_grid
from visibility import Anchor

GRID = rough_grid(32, seed=8, relief_m=250.0)
TARGETS = area_targets(GRID)
WEST_M, SOUTH_M, EAST_M, NORTH_M = GRID.bounds_m
MIDDLE_M = ((WEST_M + EAST_M) / 2.0, (SOUTH_M + NORTH_M) / 2.0)
LATTICE = candidate_grid(GRID, 150.0, above_ground_m=[40.0, 90.0])


def kept(rules: PlacementRules, candidates: Candidates = LATTICE) -> Candidates:
    return feasible_candidates(GRID, candidates, rules, TARGETS).candidates


def test_every_rule_takes_what_breaks_it_and_nothing_else() -> None:
    zone = shapely.box(WEST_M, SOUTH_M, *MIDDLE_M)
    post = shapely.Point(MIDDLE_M)
    position_m, above_m = LATTICE.position_m, LATTICE.above_ground_m
    inside = shapely.intersects_xy(zone, *position_m[:, :2].T)
    away_m = np.hypot(*(position_m[:, :2] - MIDDLE_M).T)
    ceiling_m = float(np.median(position_m[:, 2]))
    for rules, keeps, name in (
        (PlacementRules(no_fly=(zone,)), ~inside, "in a no-fly zone"),
        (PlacementRules(stand_off=((post, 300.0),)), away_m >= 300.0, "within a stand-off distance"),
        (PlacementRules(min_above_ground_m=60.0), above_m >= 60.0, "too low above ground"),
        (PlacementRules(max_above_ground_m=60.0), above_m <= 60.0, "too high above ground"),
        (PlacementRules(max_altitude_m=ceiling_m), position_m[:, 2] <= ceiling_m, "above the ceiling"),
    ):
        found = feasible_candidates(GRID, LATTICE, rules, TARGETS)
        assert found.number.tolist() == np.flatnonzero(keeps).tolist(), name
        assert found.removed == {name: int(np.count_nonzero(~keeps))}
        assert name in found.sentence()


def test_a_rule_does_not_count_what_another_took() -> None:
    rules = PlacementRules(max_above_ground_m=60.0, no_fly=(shapely.box(WEST_M, SOUTH_M, EAST_M, NORTH_M + 1.0),))
    with pytest.raises(NoCandidateError, match=r"too high above ground: .*in a no-fly zone: ") as error:
        kept(rules)
    assert sum(error.value.removed.values()) == len(LATTICE)


def test_places_over_unknown_ground_or_below_it_are_no_candidates() -> None:
    heights_m = np.array(GRID.heights_m)
    heights_m[:10, :10] = np.nan
    holed = replace(GRID, heights_m=heights_m)
    places = candidate_grid(holed, 100.0, above_ground_m=[50.0], altitude_m=[-500.0])
    found = feasible_candidates(holed, places, PlacementRules(), area_targets(holed))
    assert found.removed["no known ground below"] > 0
    assert found.removed["below the ground"] > 0
    assert np.isfinite(found.candidates.above_ground_m).all()


def test_a_candidate_out_of_range_of_every_target_is_none() -> None:
    corner = area_targets(GRID, area=shapely.box(WEST_M, SOUTH_M, WEST_M + 100.0, SOUTH_M + 100.0))
    found = feasible_candidates(GRID, LATTICE, PlacementRules(max_range_m=300.0), corner)
    reach_m = np.linalg.norm(LATTICE.position_m[:, None] - corner.point_m[None], axis=2).min(axis=1)
    assert found.number.tolist() == np.flatnonzero(reach_m <= 300.0).tolist()


def test_every_anchor_sees_the_base_or_one_that_does() -> None:
    base_m = (WEST_M + 60.0, SOUTH_M + 60.0, float(GRID.heights_m[-3, 2]) + 3.0)
    alone = Link((base_m,), max_range_m=700.0)
    direct = exact_sight(GRID, np.array([base_m]), LATTICE.position_m)[0]
    near = np.linalg.norm(LATTICE.position_m - base_m, axis=1) <= 700.0
    assert len(kept(PlacementRules(link=alone))) == np.count_nonzero(direct & near)
    relayed = PlacementRules(link=replace(alone, relays=1))
    placed = place_anchors(GRID, LATTICE, TARGETS, 4, Goal("coverage", min_anchors=1), relayed)
    position_m = anchor_positions(placed.anchors)
    first = exact_sight(GRID, np.array([base_m]), position_m)[0]
    first &= np.linalg.norm(position_m - base_m, axis=1) <= 700.0
    over = exact_sight(GRID, position_m[first], position_m)
    over &= np.linalg.norm(position_m[first][:, None] - position_m[None], axis=2) <= 700.0
    assert first.any()
    assert (first | over.any(axis=0)).all()


def test_anchors_keep_apart_from_each_other_and_from_fixed_ones() -> None:
    fixed = Anchor("F", *MIDDLE_M, 400.0)
    placed = place_anchors(
        GRID,
        LATTICE,
        TARGETS,
        4,
        Goal("coverage", min_anchors=2),
        PlacementRules(min_separation_m=350.0),
        fixed=[fixed],
    )
    all_m = anchor_positions((fixed, *placed.anchors))
    apart_m = np.linalg.norm(all_m[:, None] - all_m[None], axis=2)[np.triu_indices(5, 1)]
    assert (apart_m >= 350.0).all()


def test_where_separation_leaves_no_place_for_all_fewer_are_placed_and_it_is_said() -> None:
    placed = place_anchors(
        GRID, LATTICE, TARGETS, 6, Goal("coverage", min_anchors=1), PlacementRules(min_separation_m=900.0)
    )
    assert len(placed.anchors) < 6
    assert f"Only {len(placed.anchors)} of 6 anchors are placed: no set of more was found" in placed.warnings[0]


@pytest.mark.parametrize("seed", range(3))
def test_under_a_large_separation_as_many_are_placed_as_can_stand(seed: int) -> None:
    places_m = np.random.default_rng(seed).uniform((WEST_M, SOUTH_M), (EAST_M, NORTH_M), (16, 2))
    candidates = candidate_points(GRID, places_m, above_ground_m=[60.0])
    apart_m = np.linalg.norm(candidates.position_m[:, None] - candidates.position_m[None], axis=2)
    separation_m = 0.45 * (EAST_M - WEST_M)

    def stands(chosen: tuple[int, ...]) -> bool:
        return all(apart_m[a, b] >= separation_m for a, b in itertools.combinations(chosen, 2))

    most = max(k for k in range(1, 9) if any(stands(some) for some in itertools.combinations(range(16), k)))
    rules = PlacementRules(min_separation_m=separation_m)
    searched = SearchOptions(exact=False)
    placed = place_anchors(GRID, candidates, TARGETS, most, Goal("coverage", min_anchors=1), rules, options=searched)
    assert len(placed.anchors) == most


def test_the_fewest_that_reach_a_share_are_no_more_than_needed() -> None:
    few = place_anchors(GRID, LATTICE, TARGETS, goal=Goal("coverage", min_anchors=1), reach=0.9)
    assert few.value >= 0.9
    assert few.needed is not None
    assert few.needed <= len(few.anchors)
    fewer = place_anchors(GRID, LATTICE, TARGETS, len(few.anchors) - 1, Goal("coverage", min_anchors=1))
    assert fewer.value < 0.9


def test_with_a_spare_any_one_may_be_lost_as_recomputed_edge_by_edge() -> None:
    for goal in (Goal("coverage", min_anchors=2, spare=1), Goal("dop", min_anchors=3, dop_limit=9.0, spare=1)):
        placed = place_anchors(GRID, LATTICE, TARGETS, 5, goal, sight=SightOptions("exact"))
        check = check_placement(GRID, placed)
        assert check.value == pytest.approx(placed.value)
        assert set(check.after_loss) == {anchor.id for anchor in placed.anchors}
        assert min(check.after_loss.values()) == check.least_after_loss >= placed.value > 0.0


def test_hovering_off_costs_nothing_where_nobody_moves_and_never_goes_underground() -> None:
    placed = place_anchors(GRID, LATTICE, TARGETS, 3, Goal("coverage", min_anchors=2), sight=SightOptions("exact"))
    still = hover_sensitivity(GRID, placed, 0.0, draws=2)
    assert (still.mean, still.worst, still.vertical_low) == (placed.value,) * 3
    where_m = anchor_positions(placed.anchors)
    ground_m = height_at(GRID, where_m[:, 0], where_m[:, 1])

    def seen_by_two(altitude_m: np.ndarray) -> float:
        seen = exact_sight(GRID, np.column_stack([where_m[:, :2], altitude_m]), TARGETS.point_m)
        return float(np.average(seen.sum(axis=0) >= 2, weights=TARGETS.weight))

    for hover_m in (10.0, 500.0):
        off = hover_sensitivity(GRID, placed, hover_m, draws=2)
        assert off.vertical_low == pytest.approx(seen_by_two(np.maximum(where_m[:, 2] - hover_m, ground_m)))
        assert off.vertical_high == pytest.approx(seen_by_two(where_m[:, 2] + hover_m))
    with pytest.raises(PlacementError, match="hover_m must be"):
        hover_sensitivity(GRID, placed, math.nan)


def test_anchors_that_stand_stay_where_they_are_while_the_placed_hover() -> None:
    stands = Anchor("F", *(float(metres) for metres in LATTICE.position_m[0]))
    placed = place_anchors(GRID, LATTICE, TARGETS, 2, Goal("coverage", min_anchors=2), fixed=[stands])
    off = hover_sensitivity(GRID, placed, 20.0, draws=1)
    ground_m = [height_at(GRID, one.east_m, one.north_m) for one in placed.anchors]
    for up_m, told in ((-20.0, off.vertical_low), (20.0, off.vertical_high)):
        moved = [
            replace(one, altitude_m=max(one.altitude_m + up_m, float(floor_m)))
            for one, floor_m in zip(placed.anchors, ground_m, strict=True)
        ]
        assert told == value_of_anchors(GRID, [stands, *moved], TARGETS, placed.goal, placed.sight)


def test_ground_that_weighs_more_draws_the_anchor_to_it() -> None:
    weight = np.ones(GRID.shape)
    weight[:, :8] = 1000.0
    targets = area_targets(GRID, weight=weight)
    placed = place_anchors(GRID, LATTICE, targets, 1, Goal("coverage", min_anchors=1))
    seen = exact_sight(GRID, anchor_positions(placed.anchors), targets.point_m)[0]
    every = exact_sight(GRID, LATTICE.position_m, targets.point_m)
    shares = every @ targets.weight / targets.weight.sum()
    assert float(seen @ targets.weight / targets.weight.sum()) >= shares.max() - 0.02


def test_a_path_counts_metres_and_a_corridor_posts() -> None:
    path_m = [(WEST_M + 50.0, MIDDLE_M[1]), (EAST_M - 50.0, MIDDLE_M[1])]
    along = path_targets(GRID, path_m)
    assert along.total == pytest.approx(EAST_M - WEST_M - 100.0)
    beside = corridor_targets(GRID, path_m, 200.0)
    assert (np.abs(beside.point_m[:, 1] - MIDDLE_M[1]) <= 100.0 + 1e-6).all()
    assert len(beside) > 100


def test_a_place_given_twice_counts_once_and_a_lattice_is_centred() -> None:
    assert len(join_candidates([LATTICE, LATTICE])) == len(LATTICE)
    east_m = LATTICE.position_m[:, 0]
    assert east_m.min() - WEST_M == pytest.approx(EAST_M - east_m.max())


FAR = shapely.box(-9e6, -9e6, -8e6, -8e6)
FLAT = ElevationGrid(np.full((4, 4), np.nan, np.float32), 10.0, 10.0)
BAD = {
    "no anchors": (lambda: place_anchors(GRID, LATTICE, TARGETS, 0), "At least one anchor"),
    "neither number nor share": (lambda: place_anchors(GRID, LATTICE, TARGETS), "exactly one of count and reach"),
    "a share of 2": (lambda: place_anchors(GRID, LATTICE, TARGETS, reach=2.0), "reach must be a share"),
    "more than there are": (lambda: place_anchors(GRID, LATTICE.take(np.arange(3)), TARGETS, 4), "on 3 candidates"),
    "more in sight than there are": (
        lambda: place_anchors(GRID, LATTICE, TARGETS, 2, Goal("coverage", min_anchors=5)),
        "5 anchors in sight are asked for, and there are only 2.",
    ),
    "more in sight than fixed and placed": (
        lambda: place_anchors(
            GRID, LATTICE, TARGETS, 1, Goal("coverage", min_anchors=3), fixed=[Anchor("F", *MIDDLE_M, 9e3)]
        ),
        "3 anchors in sight are asked for, and there are only 2.",
    ),
    "none to spare": (
        lambda: place_anchors(GRID, LATTICE, TARGETS, 1, Goal("coverage", min_anchors=1, spare=1)),
        "1 anchor in sight is asked for besides one that may be lost, and there is only 1.",
    ),
    "too few for a dilution": (
        lambda: place_anchors(GRID, LATTICE, TARGETS, 2, Goal("dop", min_anchors=1)),
        "A fix needs 3 anchors in sight, and there are only 2; the objective coverage counts places that see fewer.",
    ),
    "too few for an error": (
        lambda: place_anchors(GRID, LATTICE, TARGETS, 1, Goal("mean_error")),
        "A fix needs 3 anchors in sight, and there is only 1; the objective coverage counts places that see fewer.",
    ),
    "a share out of reach": (
        lambda: place_anchors(
            GRID, LATTICE.take(np.arange(2)), TARGETS, goal=Goal("coverage", min_anchors=2), reach=1.0
        ),
        "cannot be reached: all 2 candidates together",
    ),
    "no spacing": (lambda: candidate_grid(GRID, 0.0, above_ground_m=[1.0]), "spacing of candidates"),
    "too many": (lambda: candidate_grid(GRID, 1e-3, above_ground_m=[1.0]), "take a wider one"),
    "no height": (lambda: candidate_grid(GRID, 100.0), "at least one height"),
    "a height below ground": (lambda: candidate_grid(GRID, 100.0, above_ground_m=[-1.0]), "above_ground_m >= 0"),
    "an area elsewhere": (lambda: candidate_grid(GRID, 99.0, above_ground_m=[1.0], area=FAR), "lies outside the DEM"),
    "places of one number": (lambda: candidate_points(GRID, [1.0], above_ground_m=[1.0]), "places_m must be"),
    "targets elsewhere": (lambda: area_targets(GRID, area=FAR), "no post of the DEM"),
    "targets on nothing": (lambda: area_targets(FLAT), "no known ground"),
    "weights of another shape": (lambda: area_targets(GRID, weight=np.ones((2, 2))), "the grid's shape"),
    "weights of nothing": (lambda: area_targets(GRID, weight=np.zeros(GRID.shape)), "not all 0"),
    "weights below nothing": (lambda: area_targets(GRID, weight=np.full(GRID.shape, -1.0)), "finite numbers >= 0"),
    "a rover under ground": (lambda: area_targets(GRID, -1.0), "height above ground must be"),
    "a path of one place": (lambda: path_targets(GRID, [MIDDLE_M]), "n >= 2"),
    "a path of no length": (lambda: path_targets(GRID, [MIDDLE_M, MIDDLE_M]), "longer than 0 m"),
    "a path without end": (lambda: path_targets(GRID, [(0.0, 0.0), (1e300, 0.0)]), "more than 2,000,000 points"),
    "a corridor of no width": (lambda: corridor_targets(GRID, [(0.0, 0.0), (9.0, 9.0)], 0.0), "width of a corridor"),
    "floor above ceiling": (lambda: PlacementRules(min_above_ground_m=9.0, max_above_ground_m=8.0), "contradict"),
    "a floor of nothing": (lambda: PlacementRules(min_above_ground_m=math.nan), "min_above_ground_m must be"),
    "a range of nothing": (lambda: PlacementRules(max_range_m=0.0), "max_range_m must be > 0"),
    "a ceiling of nothing": (lambda: PlacementRules(max_altitude_m=math.nan), "max_altitude_m must be a number"),
    "a stand-off below 0": (lambda: PlacementRules(stand_off=((FAR, -1.0),)), "stand-off distance must be"),
    "a link without base": (lambda: Link(()), "at least one base"),
    "a link of no length": (lambda: Link(((0.0, 0.0, 0.0),), 0.0), "max_range_m > 0"),
    "an objective of its own": (lambda: Goal("best"), "objective must be one of"),
    "a height's error of nothing named": (lambda: Goal(measure="vdop"), "vdop goes with an objective"),
    "two spares": (lambda: Goal(spare=2), "spare 0 or 1"),
    "no limit": (lambda: Goal(dop_limit=0.0), "dop_limit must be a number > 0"),
    "a vertical error along the ground": (lambda: Goal("dop", on_surface=True, measure="vdop"), "is not defined"),
    "a clock's dilution": (lambda: Goal(kind="pseudorange", measure="gdop"), "cannot be placed for"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_makes_no_question_is_refused_in_one_sentence(what: str) -> None:
    question, sentence = BAD[what]
    with pytest.raises(PlacementError, match=re.escape(sentence)) as error:
        question()
    assert "\n" not in str(error.value)
