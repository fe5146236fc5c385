"""What lies ahead of a rover: dark stretches where the map has them, the bubble, another speed, a drone to move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from detection import PositionFix, RangingAnchor
from planning import WatchError
from planning.placement import Flight
from planning.watching import Drive, Obstacle, advise, advise_move, advise_path
from planning.watching.advice import distance_along_m
from terrain import ElevationGrid
from tests.planning.watching.grounds import ANTENNA_M, on_ground
from visibility import Anchor, lines_of_sight
from visibility.cover import FootprintHeights, footprints_of, standing_footprints, with_standing
from visibility.cover.footprints import OneFootprint

CELL_M = 10.0
# all east of the wall, so that the ground west of it sees none of them
ANCHORS = [
    RangingAnchor(f"A{n + 1}", *map(float, at))
    for n, at in enumerate([(760, 200, 25), (780, 420, 32), (750, 640, 28), (700, 60, 30), (690, 760, 35)])
]


def wall() -> ElevationGrid:
    """Level ground with a wall of 40 m along east 400, from north 250 to 550."""
    heights_m = np.zeros((81, 81), np.float32)
    heights_m[25:56, 39:42] = 40.0
    return ElevationGrid(heights_m, CELL_M, CELL_M, 0.0, 800.0)


def fix(east_m: float, north_m: float, sigma_m: float = 0.3) -> PositionFix:
    return PositionFix(np.array([east_m, north_m, ANTENNA_M]), sigma_m**2 * np.eye(3), checked=True)


PATH = np.array([(300.0, 780.0), (300.0, 20.0)])


def test_stretches_are_where_lines_of_sight_say() -> None:
    grid, drive = wall(), Drive(PATH, min_anchors=4, horizon_m=1000.0)
    told = advise(grid, drive, fix(302.0, 740.0), ANCHORS)
    assert told.at_m == pytest.approx(40.0)
    assert told.off_path_m == pytest.approx(2.0)
    points_m = on_ground(grid, np.full(len(told.along_m), 300.0), 780.0 - told.along_m)
    anchors_m = np.array([(one.east_m, one.north_m, one.altitude_m) for one in ANCHORS])
    seen = np.column_stack([
        lines_of_sight(grid, points_m, np.tile(at_m, (len(points_m), 1))).clearance_m > 0.0 for at_m in anchors_m
    ])  # fmt: skip
    np.testing.assert_array_equal(told.usable, seen.sum(axis=1))
    dark = np.zeros(len(told.along_m), bool)
    for stretch in told.stretches:
        inside = (told.along_m >= stretch.from_m) & (told.along_m <= stretch.to_m)
        dark |= inside
        assert stretch.fewest == seen[inside].sum(axis=1).min()
        assert stretch.hidden == tuple(np.array([a.id for a in ANCHORS])[~seen[inside].all(axis=0)])
        assert stretch.bubble_m == told.bubble_m[inside].max()
        assert stretch.in_s == pytest.approx(stretch.from_m - told.at_m)
        assert stretch.for_s == pytest.approx(stretch.to_m - stretch.from_m)
    np.testing.assert_array_equal(dark, seen.sum(axis=1) < 4)
    assert 0.2 < dark.mean() < 0.8


def test_in_the_dark_the_bubble_grows_and_faster_it_grows_less() -> None:
    grid = wall()
    told = advise(grid, Drive(PATH, min_anchors=4, horizon_m=1000.0), fix(300.0, 780.0), ANCHORS)
    (stretch,) = told.stretches
    before = told.bubble_m[told.along_m < stretch.from_m - 50.0].max()
    assert stretch.bubble_m > 3.0 * before
    assert told.speed is not None
    assert told.speed.speed_m_per_s > 1.0
    assert told.speed.bubble_m < 0.8 * told.speed.bubble_before_m == pytest.approx(0.8 * told.bubble_m.max())
    again = advise(
        grid, Drive(PATH, speed_m_per_s=told.speed.speed_m_per_s, horizon_m=1000.0), fix(300.0, 780.0), ANCHORS
    )
    assert again.bubble_m.max() == pytest.approx(told.speed.bubble_m)


def test_where_all_is_seen_nothing_is_advised() -> None:
    east = np.array([(600.0, 780.0), (600.0, 20.0)])
    told = advise(wall(), Drive(east, min_anchors=4), fix(600.0, 780.0), ANCHORS)
    assert told.stretches == ()
    assert told.speed is None
    hidden = advise(wall(), Drive(east, min_anchors=4), fix(600.0, 780.0), ANCHORS, occluded={"A1", "A2"})
    (stretch,) = hidden.stretches
    assert (stretch.fewest, stretch.hidden) == (3, ("A1", "A2"))


def test_a_drone_is_moved_so_that_the_stretch_sees_enough() -> None:
    grid, drive = wall(), Drive(PATH, min_anchors=4, horizon_m=1000.0)
    drones = [Anchor(one.id, one.east_m, one.north_m, one.altitude_m) for one in ANCHORS]
    # one is missing in the dark: four of the five see the whole path from above the wall but A1, A2
    high = [Anchor(a.id, a.east_m, a.north_m, 2000.0) if n > 1 else a for n, a in enumerate(drones)]
    (stretch,) = advise(
        grid, drive, fix(300.0, 780.0), [RangingAnchor(a.id, a.east_m, a.north_m, a.altitude_m) for a in high]
    ).stretches
    assert stretch.fewest == 3
    told = advise_move(grid, drive, stretch, high, movable={"A1"}, flight=Flight(max_flight_m=3000.0))
    assert told.found.restored
    assert told.found.move is not None
    moved = [RangingAnchor(a.id, a.east_m, a.north_m, a.altitude_m) for a in told.found.anchors_after(high)]
    assert advise(grid, drive, fix(300.0, 780.0), moved).stretches == ()


def test_a_move_among_fewer_places_is_hardly_dearer_and_what_was_left_out_is_told() -> None:
    grid, drive = wall(), Drive(PATH, min_anchors=4, horizon_m=1000.0)
    high = [Anchor(a.id, a.east_m, a.north_m, 2000.0 if n > 1 else a.altitude_m) for n, a in enumerate(ANCHORS)]
    (stretch,) = advise(
        grid, drive, fix(300.0, 780.0), [RangingAnchor(a.id, a.east_m, a.north_m, a.altitude_m) for a in high]
    ).stretches
    everywhere, near, sparse, nearest = (
        advise_move(grid, drive, stretch, high, movable={"A1"}, most_places=places, most_posts=posts)
        for places, posts in ((100_000, 100_000), (100_000, 5000), (2000, 100_000), (100_000, 300))
    )
    least = everywhere.found.move
    assert least is not None
    assert everywhere.reach_m == np.inf
    assert least.flight_m < near.reach_m < 400.0
    assert near.found.move == least
    assert near.found.places < everywhere.found.places
    assert everywhere.sentence == everywhere.found.sentence
    assert near.sentence == near.found.sentence
    assert sparse.found.places <= 2000
    assert sparse.apart_m == 40.0
    assert sparse.found.restored
    assert sparse.found.move is not None
    assert least.flight_m <= sparse.found.move.flight_m <= least.flight_m + 2.0 * sparse.apart_m
    assert sparse.sentence.endswith(" Places 40 m apart were looked at.")
    assert nearest.reach_m < least.flight_m
    assert not nearest.found.restored
    assert nearest.sentence.endswith(f" Flights longer than {nearest.reach_m:.0f} m were not.")


def test_a_path_that_crosses_itself_is_followed() -> None:
    eight = Drive(np.array([(0.0, 0.0), (100.0, 100.0), (100.0, 0.0), (0.0, 100.0)]))
    first, last = np.hypot(50.0, 50.0), np.hypot(100.0, 100.0) + 100.0 + np.hypot(50.0, 50.0)
    assert distance_along_m(eight, (50.0, 50.0), 60.0)[0] == pytest.approx(first)
    assert distance_along_m(eight, (50.0, 50.0), 300.0)[0] == pytest.approx(last)


@pytest.mark.parametrize(
    ("change", "word"),
    [({"path_m": [(0.0, 0.0)]}, "two places"), ({"speed_m_per_s": 0.0}, "speed_m_per_s"),
     ({"min_anchors": 0}, "least 1"), ({"path_m": [(0.0, 0.0), (np.nan, 1.0)]}, "finite")],
)  # fmt: skip
def test_a_drive_that_makes_no_sense_is_refused(change: dict[str, object], word: str) -> None:
    with pytest.raises(WatchError, match=word):
        Drive(**{"path_m": PATH, **change})  # type: ignore[arg-type] # what is asked for wrongly


def test_a_way_round_keeps_enough_anchors_in_sight_and_comes_back_to_the_path() -> None:
    grid, drive = wall(), Drive(PATH, min_anchors=4, horizon_m=1000.0)
    ahead = advise(grid, drive, fix(300.0, 740.0), ANCHORS)
    anchors = [Anchor(one.id, one.east_m, one.north_m, one.altitude_m) for one in ANCHORS]
    whole = replace(ahead.stretches[0], to_m=ahead.stretches[-1].to_m)
    told = advise_path(grid, drive, whole, anchors, at_m=ahead.at_m, seconds=60.0)
    assert told.path_m is not None, told.sentence
    np.testing.assert_allclose(told.path_m[0], (300.0, 780.0 - told.from_m), atol=0.1)
    np.testing.assert_allclose(told.path_m[-1], (300.0, 780.0 - told.to_m), atol=0.1)
    assert ahead.at_m <= told.from_m < whole.from_m < whole.to_m < told.to_m
    points_m = on_ground(grid, *told.path_m.T)
    anchors_m = [(a.east_m, a.north_m, a.altitude_m) for a in anchors]
    seen = [lines_of_sight(grid, points_m, np.tile(at, (len(points_m), 1))).clearance_m > 0.0 for at in anchors_m]
    assert told.fewest == np.sum(seen, axis=0).min() >= 4
    length_m = np.hypot(*np.diff(told.path_m, axis=0).T).sum()
    assert told.longer_m == pytest.approx(length_m - (told.to_m - told.from_m))
    assert told.longer_m > 50.0


def test_where_no_way_is_left_the_reason_is_told() -> None:
    grid, drive = wall(), Drive(PATH, min_anchors=5, horizon_m=1000.0)
    ahead = advise(grid, drive, fix(300.0, 740.0), ANCHORS)
    anchors = [Anchor(one.id, one.east_m, one.north_m, one.altitude_m) for one in ANCHORS]
    told = advise_path(grid, drive, ahead.stretches[0], anchors, at_m=ahead.at_m, occluded=["A1"])
    assert told.path_m is None
    assert "5 anchors" in told.sentence


def test_a_plan_that_runs_out_of_time_does_not_say_that_there_is_no_way() -> None:
    grid, drive = wall(), Drive(PATH, min_anchors=4, horizon_m=1000.0)
    ahead = advise(grid, drive, fix(300.0, 740.0), ANCHORS)
    anchors = [Anchor(one.id, one.east_m, one.north_m, one.altitude_m) for one in ANCHORS]
    whole = replace(ahead.stretches[0], to_m=ahead.stretches[-1].to_m)
    told = advise_path(grid, drive, whole, anchors, at_m=ahead.at_m, seconds=1e-9)
    assert told.path_m is None
    assert told.sentence.startswith("No way round was found")


def test_a_path_through_a_building_over_unknown_ground_and_off_the_map_is_told() -> None:
    ground = wall()
    heights_m = ground.heights_m.copy()
    heights_m[40:44, 28:33] = np.nan  # north 370 to 400, and half a square beyond on either side
    ring = np.array([(280.0, 500.0), (320.0, 500.0), (320.0, 560.0), (280.0, 560.0), (280.0, 500.0)])
    house, _ = footprints_of([OneFootprint((ring,), {"height": "8"}, "house")], FootprintHeights(), "it")
    bare = replace(ground, heights_m=heights_m)
    grid = with_standing(bare, [standing_footprints(bare, house)])
    path_m = [(300.0, 780.0), (300.0, -60.0)]
    told = advise(grid, Drive(path_m, min_anchors=1, horizon_m=1000.0), fix(300.0, 780.0), ANCHORS)
    assert [one.what for one in told.obstructed] == [Obstacle.BUILDING, Obstacle.UNKNOWN_GROUND, Obstacle.OUTSIDE]
    house_m, hole_m, beyond_m = ((one.from_m, one.to_m) for one in told.obstructed)
    assert house_m == pytest.approx((220.0, 280.0), abs=CELL_M)
    assert hole_m == pytest.approx((370.0, 420.0), abs=CELL_M)
    assert beyond_m == pytest.approx((780.0, 840.0), abs=CELL_M)
    for one in told.obstructed:
        inside = (told.along_m > one.from_m) & (told.along_m < one.to_m)
        assert (told.usable[inside] == 0).all()
    assert advise(ground, Drive(PATH, min_anchors=4), fix(302.0, 740.0), ANCHORS).obstructed == ()
