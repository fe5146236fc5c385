"""Plans, bubbles, sessions and advice take back what ranges said against the map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from detection import DetectorSettings, PositionFix, RangeEpoch, RangeMeasurement, RangingAnchor
from planning.bubbles import bubbles_along
from planning.paths import PathLimits, PathProblem, PlanBudget, plan_path
from planning.placement import (
    Flight,
    Goal,
    MoveQuestion,
    candidate_points,
    check_placement,
    path_targets,
    place_anchors,
    reposition,
)
from planning.validation import PathLimit, validate_path
from planning.watching import Drive, Expected, GroundErrors, MapDetector, MapDoubt, advise
from tests.planning.validation.courses import grid_of
from tests.planning.watching.grounds import anchors, on_ground, ridge
from visibility import Anchor
from visibility.sight import SightDoubt

LEVEL = grid_of(np.zeros((41, 41)))  # 10 m cells, (0, 0) to (400, 400)
MASTS = (Anchor("A", 20.0, 200.0, 30.0), Anchor("B", 200.0, 20.0, 30.0))
# across the way from south to north, but for the east
DOUBT = SightDoubt(((0.0, 200.0), (250.0, 200.0)), 0.98, reach_m=20.0)
FURTHEST_M = 20.0 * math.sqrt(2.0 * math.log(2.0 * 0.98))
START, GOAL = (100.0, 60.0), (100.0, 340.0)


def question(doubts: tuple[SightDoubt, ...]) -> PathProblem:
    doubted = (replace(MASTS[0], doubts=doubts), MASTS[1])
    budget = PlanBudget(sampling=False)
    return PathProblem(LEVEL, START, (GOAL,), anchors=doubted, limits=PathLimits(min_anchors=2), budget=budget)


def test_a_path_goes_round_where_ranges_denied_an_anchor_that_it_needs() -> None:
    plain, doubted = plan_path(question(())).path, plan_path(question((DOUBT,))).path
    assert plain is not None
    assert doubted is not None
    off_m = [
        shapely.LineString(np.column_stack([path.east_m, path.north_m])).distance(shapely.LineString(DOUBT.places_m))
        for path in (plain, doubted)
    ]
    assert off_m[0] == 0.0
    assert off_m[1] > FURTHEST_M


def test_the_validator_knows_the_doubt_by_itself() -> None:
    straight = [START, GOAL]
    kept = {
        len(doubts): one
        for doubts in ((), (DOUBT,))
        for one in validate_path(question(doubts), straight).checks
        if one.limit is PathLimit.ANCHORS
    }
    assert kept[0].kept
    assert not kept[1].kept
    share = kept[1].broken / kept[1].samples
    assert share == pytest.approx(2.0 * FURTHEST_M / 280.0, abs=0.02)


@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_a_bubble_grows_where_an_anchor_is_not_counted_on(mode) -> None:
    points_m = np.column_stack([np.full(29, 100.0), np.linspace(60.0, 340.0, 29), np.full(29, 1.5)])
    more = (Anchor("C", 380.0, 200.0, 60.0), Anchor("D", 200.0, 380.0, 45.0))
    times_s = np.arange(29.0)
    found = [
        bubbles_along(LEVEL, points_m, times_s, (replace(MASTS[0], doubts=doubts), MASTS[1], *more), mode=mode)
        for doubts in ((), (DOUBT,))
    ]
    near = np.abs(points_m[:, 1] - 200.0) < FURTHEST_M - 10.0
    assert found[0].visible is not None
    assert found[1].visible is not None
    assert found[0].visible.all()
    assert not found[1].visible[near, 0].any()
    assert found[1].visible[:, 1:].all()
    assert (found[1].radius_m[near] > found[0].radius_m[near]).all()


SETTINGS = DetectorSettings(max_speed_m_per_s=4.0, harmful_m=0.5)
ERRORS = GroundErrors(dem_sigma_m=1.0)
EAST_M = 430.0


def driven(detector: MapDetector) -> list[float]:
    """p_sight of A5 along a straight drive on which its ranges are 6 m too long, though the map has it in sight."""
    told = []
    for second in range(40):
        rover_m = on_ground(detector.grid, np.array([EAST_M]), np.array([300.0 + second]))[0]
        ranges = tuple(
            RangeMeasurement(
                one.id,
                math.dist((one.east_m, one.north_m, one.altitude_m), rover_m.tolist()) + 6.0 * (one.id == "A5"),
            )
            for one in anchors()
        )
        told.append(detector.process(RangeEpoch(float(second), ranges)).p_sight["A5"])
    return told


def test_the_next_session_begins_with_what_the_last_one_found() -> None:
    first = MapDetector(ridge(ridge_m=0.0), anchors(), SETTINGS, errors=ERRORS)
    before = driven(first)
    (doubt,) = first.map_doubts()
    assert doubt.expected is Expected.IN_SIGHT
    assert min(before) > 0.9
    taken = {"A5": (doubt.weight(20.0),)}
    second = MapDetector(ridge(ridge_m=0.0), anchors(), SETTINGS, errors=ERRORS, doubts=taken)
    after = driven(second)
    assert max(after[5:35]) < 0.1
    assert second.map_doubts() == ()


def test_an_anchor_that_moves_is_doubted_no_more() -> None:
    doubt = SightDoubt(((EAST_M, 300.0), (EAST_M, 340.0)), 0.99, reach_m=20.0)
    detector = MapDetector(ridge(ridge_m=0.0), anchors(), SETTINGS, errors=ERRORS, doubts={"A5": (doubt,)})
    assert driven(detector)[10] < 0.1
    rover_m = on_ground(detector.grid, np.array([EAST_M]), np.array([340.0]))[0].tolist()
    moved = replace(anchors()[4], east_m=60.0)
    ranges = [
        RangeMeasurement(one.id, math.dist((one.east_m, one.north_m, one.altitude_m), rover_m))
        for one in (*anchors()[:4], moved, *anchors()[5:])
    ]
    told = detector.process(RangeEpoch(40.0, tuple(ranges), moved=(moved,)))
    assert told.p_sight["A5"] > 0.9


def test_a_doubt_about_a_shadow_is_hope() -> None:
    where = tuple((EAST_M, 300.0 + step) for step in range(0, 50, 10))
    heard = MapDoubt("A2", Expected.HIDDEN, 0.0, 40.0, 40, where, 0.5, 300.0, 0.1, 0.95).weight(20.0)
    grid = ridge(ridge_m=45.0)
    hidden = MapDetector(grid, anchors(), SETTINGS, errors=ERRORS)
    hoped = MapDetector(grid, anchors(), SETTINGS, errors=ERRORS, doubts={"A2": (heard,)})
    rover_m = on_ground(grid, np.array([EAST_M]), np.array([320.0]))[0].tolist()
    too_long_m = {"A1": 4.0, "A3": 4.0}
    ranges = tuple(
        RangeMeasurement(
            one.id, math.dist((one.east_m, one.north_m, one.altitude_m), rover_m) + too_long_m.get(one.id, 0.0)
        )
        for one in anchors()
    )
    told = [
        [one.process(RangeEpoch(float(second), ranges)).p_sight["A2"] for second in range(5)][-1]
        for one in (hidden, hoped)
    ]
    assert told[0] < 0.05
    assert told[1] == pytest.approx(0.95, abs=0.03)


def test_advice_does_not_count_on_a_doubted_anchor() -> None:
    drive = Drive(np.array([(100.0, 60.0), (100.0, 340.0)]), min_anchors=2, horizon_m=400.0)
    near = [RangingAnchor(one.id, one.east_m, one.north_m, one.altitude_m) for one in MASTS]
    place = PositionFix(np.array([100.0, 60.0, 1.5]), 0.1 * np.eye(3), checked=True)
    assert advise(LEVEL, drive, place, near).stretches == ()
    told = advise(LEVEL, drive, place, near, doubts={"A": (DOUBT,)})
    (stretch,) = told.stretches
    assert stretch.hidden == ("A",)
    assert stretch.from_m == pytest.approx(140.0 - FURTHEST_M, abs=5.0)
    assert stretch.to_m == pytest.approx(140.0 + FURTHEST_M, abs=5.0)


def test_a_drone_whose_sight_ranges_denied_moves_further_than_the_doubt_reaches() -> None:
    path_m = np.array([START, GOAL])
    doubted = (replace(MASTS[0], doubts=(DOUBT,)), MASTS[1])
    asked = MoveQuestion(Goal("coverage", min_anchors=2), flight=Flight(max_flight_m=200.0))
    assert reposition(LEVEL, MASTS, path_m, asked).before == 1.0
    found = reposition(LEVEL, doubted, path_m, asked)
    assert found.before == pytest.approx(1.0 - 2.0 * FURTHEST_M / 280.0, abs=0.03)
    assert found.restored
    assert found.move is not None
    assert found.move.anchor.id == "A"
    assert found.move.to.doubts == ()
    away_m = math.hypot(found.move.to.east_m - MASTS[0].east_m, found.move.to.north_m - MASTS[0].north_m)
    assert DOUBT.reach_m < away_m < DOUBT.reach_m + 2.0 * 10.0
    # a doubt that reaches further than any flight leaves nothing to gain from this drone
    far = replace(DOUBT, probability=0.6, reach_m=400.0)
    stays = reposition(LEVEL, (replace(MASTS[0], doubts=(far,)), MASTS[1]), path_m, replace(asked, movable=["A"]))
    assert (stays.move, stays.restored) == (None, False)


def test_a_placement_does_not_count_on_what_ranges_denied_of_an_anchor_that_stands() -> None:
    targets = path_targets(LEVEL, np.array([START, GOAL]), 1.5)
    candidates = candidate_points(LEVEL, [(380.0, 200.0)], above_ground_m=[30.0])
    values = []
    for doubts in ((), (DOUBT,)):
        fixed = (replace(MASTS[0], doubts=doubts),)
        found = place_anchors(LEVEL, candidates, targets, 1, Goal("coverage", min_anchors=1), fixed=fixed)
        values.append((found.before, found.value, check_placement(LEVEL, found).after_loss["P1"]))
    assert values[0] == (1.0, 1.0, 1.0)
    left = 1.0 - 2.0 * FURTHEST_M / 280.0
    assert values[1] == (pytest.approx(left, abs=0.03), 1.0, pytest.approx(left, abs=0.03))
