"""Anchors with radios: wherever sight decided, their signals do, and each line's margin is that of the slow oracle."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
import numpy.typing as npt
import pytest

from planning.bubbles import bubbles_along
from planning.paths import PathLimits, PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from planning.placement import (
    Candidates,
    Flight,
    Goal,
    Link,
    MoveQuestion,
    SightOptions,
    area_targets,
    candidate_grid,
    path_targets,
    place_anchors,
    placement_maps,
    plan_repositioning,
    reposition,
)
from planning.placement.cluster import anchors_table, sight_table
from planning.placement.rules import linked_pairs
from planning.validation import validate_path
from terrain import ElevationGrid, height_at
from tests.planning.placement.grounds import rough_grid
from tests.reference.signal import margin_db
from visibility import FLAT, HIDDEN, VISIBLE, Anchor, AntennaLimits, lines_of_sight
from visibility.cover import Canopy
from visibility.sight import AnchorTrack
from visibility.sight.in_reach import ReachOptions, in_reach, reach_of
from visibility.signal import RADIOS, Foliage, Radio, reception, signals, usable_probability, with_foliage

Floats = npt.NDArray[np.float64]
# hills decide by diffraction at the first, trees at the second
RADIO = replace(RADIOS["868MHz"], sensitivity_dbm=-93.0)
OTHER = Radio(2.44e9, 20.0, -79.0, transmit_gain_dbi=2.0, receive_gain_dbi=1.0, losses_db=3.0, spread_db=4.0)
CLOSE_DB = 0.03


@pytest.fixture(scope="module")
def ground() -> ElevationGrid:
    return rough_grid(24, seed=11, relief_m=130.0)


@pytest.fixture(scope="module")
def wood(ground: ElevationGrid) -> ElevationGrid:
    top_m = np.zeros(ground.shape, np.float32)
    top_m[4:16, 3:20] = 14.0
    return with_foliage(ground, Foliage(Canopy(ground, top_m, np.where(top_m > 0.0, 2.0, 0.0).astype(np.float32))))


def drones(grid: ElevationGrid, *radios: Radio | None) -> tuple[Anchor, ...]:
    places = ((1, 2, 25.0), (21, 18, 35.0), (10, 20, 15.0), (20, 3, 45.0))
    found = []
    for number, ((row, col, above_m), radio) in enumerate(zip(places, radios, strict=False)):
        east_m, north_m = grid.position_of(row + 0.3, col + 0.4)
        at_m = east_m, north_m, float(height_at(grid, east_m, north_m)) + above_m
        found.append(Anchor(f"D{number}", *at_m, radio=radio))
    return tuple(found)


def posts(grid: ElevationGrid, point_m: Floats) -> tuple[float, float, float]:
    row, col = grid.post_at(point_m[0], point_m[1])
    return row, col, float(point_m[2])


def margins(grid: ElevationGrid, anchor: Anchor, points_m: Floats) -> Floats:
    """(n,) by the oracle."""
    assert anchor.radio is not None
    trees = () if grid.trees is None else (grid.trees.top_m.astype(float), grid.trees.base_m.astype(float))
    start = posts(grid, np.array([anchor.east_m, anchor.north_m, anchor.altitude_m]))
    heights_m = grid.heights_m.astype(float)
    return np.array(
        [
            margin_db(heights_m, grid.cell_east_m, start, posts(grid, one), asdict(anchor.radio), *trees)
            for one in np.asarray(points_m, float)
        ]
    )


def got(grid: ElevationGrid, anchors: tuple[Anchor, ...], points_m: Floats) -> npt.NDArray[np.bool_]:
    """(n, k) by the oracle; no line may be so close that rounding decides."""
    found = np.stack([margins(grid, anchor, points_m) for anchor in anchors], axis=1)
    assert not (np.abs(found) < 1e-3).any(), "another seed, or another budget"
    return found >= 0.0


def antennas(grid: ElevationGrid, count: int, seed: int, above_m: float = 1.5) -> Floats:
    random = np.random.default_rng(seed)
    west, south, east, north = grid.bounds_m
    places = random.uniform((west, south), (east, north), (count, 2))
    return np.column_stack([places, np.asarray(height_at(grid, *places.T)) + above_m])


def test_a_line_has_the_margin_of_the_oracle(wood: ElevationGrid) -> None:
    points_m = antennas(wood, 25, seed=1)
    for anchor in drones(wood, RADIO, OTHER):
        from_m = np.broadcast_to((anchor.east_m, anchor.north_m, anchor.altitude_m), points_m.shape)
        found = reception(wood, from_m, points_m, anchor.radio, curvature=FLAT, clearance=True)
        wanted = margins(wood, anchor, points_m)
        # the oracle's way through trees is sampled
        np.testing.assert_allclose(found.margin_db, wanted, atol=0.15)
        np.testing.assert_array_equal(found.verdict == VISIBLE, wanted >= 0.0)
        assert {HIDDEN, VISIBLE} <= set(found.verdict.tolist())
        sight = lines_of_sight(wood, from_m, points_m, curvature=FLAT)
        np.testing.assert_array_equal(found.clearance_m, sight.clearance_m)
        assert anchor.radio is not None
        spread = [math.erfc(-one / anchor.radio.spread_db / math.sqrt(2.0)) / 2.0 for one in wanted]
        np.testing.assert_allclose(found.probability, spread, atol=0.02)


def test_the_probability_of_a_range_is_the_signal_s_or_that_of_sight_within_reach(wood: ElevationGrid) -> None:
    points_m = antennas(wood, 12, seed=2)
    heard, seen, near = drones(wood, RADIO, None, OTHER)
    near = replace(near, limits=AntennaLimits(max_range_m=250.0))
    found = usable_probability(wood, [heard, seen, near], points_m, curvature=FLAT, dem_sigma_m=2.0)
    ends = [np.broadcast_to((one.east_m, one.north_m, one.altitude_m), points_m.shape) for one in (heard, seen, near)]
    np.testing.assert_allclose(found[:, 0], signals(wood, ends[0], points_m, RADIO, curvature=FLAT).probability)
    sight = lines_of_sight(wood, ends[1], points_m, curvature=FLAT, dem_sigma_m=2.0)
    np.testing.assert_allclose(found[:, 1], sight.probability_clear)
    far = np.linalg.norm(points_m - ends[2], axis=1) > 250.0
    assert far.any()
    assert (found[far, 2] == 0.0).all()
    of_near = signals(wood, ends[2], points_m, OTHER, curvature=FLAT).probability
    np.testing.assert_allclose(found[~far, 2], of_near[~far])


def test_a_placement_is_the_best_by_the_oracle_s_margins(ground: ElevationGrid) -> None:
    west, south, east, north = ground.bounds_m
    targets = path_targets(ground, [(west + 40.0, south + 90.0), (east - 60.0, north - 40.0)])
    candidates: Candidates = candidate_grid(ground, 230.0, above_ground_m=[12.0])
    candidates = candidates.take(np.arange(min(len(candidates), 9)))
    (fixed,) = drones(ground, OTHER)
    options = SightOptions(radio=RADIO, curvature=FLAT)
    found = place_anchors(ground, candidates, targets, 2, Goal("coverage", min_anchors=2), fixed=[fixed], sight=options)
    assert [one.radio for one in found.anchors] == [RADIO, RADIO]
    several = tuple(Anchor(f"C{n}", *place, radio=RADIO) for n, place in enumerate(candidates.position_m.tolist()))
    seen, of_fixed = got(ground, several, targets.point_m), got(ground, (fixed,), targets.point_m)
    np.testing.assert_array_equal(sight_table(ground, targets, candidates.position_m, options).table.visible(), seen.T)
    np.testing.assert_array_equal(anchors_table(ground, targets, [fixed], options).visible(), of_fixed.T)
    share = targets.weight / targets.weight.sum()
    best = max(
        float(share[seen[:, [one, other]].sum(axis=1) + of_fixed[:, 0] >= 2].sum())
        for one in range(len(several))
        for other in range(one)
    )
    assert 0.0 < best < 1.0
    assert found.value == pytest.approx(best)
    blind = place_anchors(
        ground, candidates, targets, 2, Goal("coverage", min_anchors=2), fixed=[replace(fixed, radio=None)]
    )
    assert blind.value != found.value


def test_the_maps_of_a_placement_count_what_is_usable(ground: ElevationGrid) -> None:
    candidates = candidate_grid(ground, 300.0, above_ground_m=[20.0])
    options = SightOptions(radio=RADIO, curvature=FLAT)
    found = place_anchors(ground, candidates, area_targets(ground), 1, Goal("coverage", min_anchors=1), sight=options)
    maps = placement_maps(ground, found)
    rows, cols = np.divmod(np.arange(0, ground.heights_m.size, 7), ground.cols)
    east_m, north_m = ground.position_of(rows, cols)
    points_m = np.column_stack([east_m, north_m, ground.heights_m[rows, cols] + np.float32(1.5)])
    np.testing.assert_array_equal(maps.count_after[rows, cols], got(ground, found.anchors, points_m)[:, 0])
    assert not maps.count_before.any()


def test_links_to_bases_are_decided_by_their_radio(ground: ElevationGrid) -> None:
    one_m, base_m = antennas(ground, 14, seed=4, above_m=10.0), antennas(ground, 1, seed=5, above_m=3.0)
    base = Anchor("B", *base_m[0].tolist(), radio=RADIO)
    linked = linked_pairs(ground, Link((tuple(base_m[0].tolist()),), radio=RADIO), one_m, base_m)[:, 0]
    np.testing.assert_array_equal(linked, got(ground, (base,), one_m)[:, 0])
    assert 0 < linked.sum() < len(linked)


def test_a_move_restores_what_signals_say(ground: ElevationGrid) -> None:
    anchors = drones(ground, RADIO, OTHER)
    west, south, _, _ = ground.bounds_m
    path_m = np.array([(west + 250.0, south + 120.0), (west + 420.0, south + 200.0)])
    question = MoveQuestion(
        Goal("coverage", min_anchors=2), flight=Flight(max_flight_m=500.0), every=3, sight=SightOptions(curvature=FLAT)
    )
    found = reposition(ground, anchors, path_m, question)
    points_m = path_targets(ground, path_m, question.receiver_above_ground_m).point_m
    before = float((got(ground, anchors, points_m).sum(axis=1) >= 2).mean())
    assert found.before == pytest.approx(before)
    assert found.before < 1.0
    assert found.move is not None
    moved = tuple(found.move.to if one.id == found.move.anchor.id else one for one in anchors)
    assert found.move.to.radio == found.move.anchor.radio
    after = float((got(ground, moved, points_m).sum(axis=1) >= 2).mean())
    assert found.after == pytest.approx(after)
    assert after > before
    plan = plan_repositioning(ground, anchors, path_m, question)
    assert plan.good[:, 1].mean() == pytest.approx(after)


def test_a_path_is_driven_where_signals_arrive_and_its_validator_agrees(ground: ElevationGrid) -> None:
    (anchor,) = drones(ground, RADIO)
    rover = RoverModel(max_slope_rad=1.4)
    limits = PathLimits(min_anchors=1)
    margin = np.full(ground.shape, np.nan)
    rows, cols = (index.ravel() for index in np.indices(ground.shape))
    east_m, north_m = ground.position_of(rows, cols)
    points_m = np.column_stack([east_m, north_m, ground.heights_m[rows, cols] + 1.5])
    margin[rows, cols] = margins(ground, anchor, points_m)
    # from the best heard place that cannot be seen to the post beside the anchor
    eye_m = np.broadcast_to((anchor.east_m, anchor.north_m, anchor.altitude_m), points_m.shape)
    hidden = (lines_of_sight(ground, eye_m, points_m).clearance_m < -1.0).reshape(ground.shape)
    inner = np.zeros(ground.shape, np.bool_)
    inner[2:-2, 2:-2] = True
    start = np.unravel_index(np.argmax(np.where(hidden & inner, margin, -np.inf)), ground.shape)
    ends = [ground.position_of(*place) for place in (start, (2, 3))]
    problem = PathProblem(
        *(ground, ends[0], ends[1]), rover=rover, limits=limits, anchors=(anchor,), budget=PlanBudget(sampling=False)
    )
    found = plan_path(problem)
    assert found.status is PathStatus.FOUND
    assert found.path is not None
    vertices_m = np.column_stack([found.path.east_m, found.path.north_m])
    antennas_m = np.column_stack([vertices_m, np.asarray(height_at(ground, *vertices_m.T)) + 1.5])
    np.testing.assert_array_equal(found.path.visible[:, 0], got(ground, (anchor,), antennas_m)[:, 0])
    assert found.path.visible.all()
    assert found.validation is not None
    assert found.validation.passed
    # the same way is not one for a radio that is not heard there, nor for sight alone
    assert validate_path(problem, vertices_m).passed
    for other in (replace(anchor, radio=replace(RADIO, sensitivity_dbm=0.0)), replace(anchor, radio=None)):
        assert not validate_path(replace(problem, anchors=(other,)), vertices_m).passed


def test_an_anchor_that_moves_is_heard_from_where_it_is(ground: ElevationGrid) -> None:
    (anchor,) = drones(ground, RADIO)
    times_s = np.array([0.0, 2000.0])
    here_m = np.array([anchor.east_m, anchor.north_m, anchor.altitude_m])
    away_m = here_m + np.array([150.0, -60.0, 40.0])
    track = AnchorTrack("T", times_s, np.stack([here_m, away_m]), radio=RADIO)
    assert track.at(0.0).radio == RADIO
    start, goal = ground.position_of(8, 8), ground.position_of(16, 14)
    problem = PathProblem(
        ground, start, goal, rover=RoverModel(max_slope_rad=1.4), anchors=(track,), budget=PlanBudget(sampling=False)
    )
    found = plan_path(problem)
    assert found.path is not None
    wanted = []
    for east_m, north_m, time_s in zip(found.path.east_m, found.path.north_m, found.path.time_s, strict=True):
        there_m = here_m + min(round(time_s), 2000.0) / 2000.0 * (away_m - here_m)
        at_m = np.array([[east_m, north_m, float(height_at(ground, east_m, north_m)) + 1.5]])
        wanted.append(margins(ground, Anchor("T", *there_m.tolist(), radio=RADIO), at_m)[0] >= 0.0)
    assert set(wanted) == {False, True}
    np.testing.assert_array_equal(found.path.visible[:, 0], wanted)


@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_bubbles_count_the_anchors_whose_signals_arrive(wood: ElevationGrid, mode: str) -> None:
    anchors = drones(wood, RADIO, OTHER, RADIO, OTHER)
    points_m = antennas(wood, 15, seed=9, above_m=8.0)
    found = bubbles_along(
        *(wood, points_m, np.arange(15.0), anchors),
        mode="exact" if mode == "exact" else "fast",
        curvature=FLAT,
    )
    wanted = got(wood, anchors, points_m)
    np.testing.assert_array_equal(found.visible, wanted)
    assert 0 < wanted.sum() < wanted.size


def test_what_is_read_by_windows_is_usable_where_the_oracle_says(ground: ElevationGrid) -> None:
    anchor = replace(drones(ground, OTHER)[0], limits=AntennaLimits(max_range_m=400.0))
    reach = reach_of(ground, anchor)
    assert reach is not None
    found = in_reach(ground, anchor, reach, ReachOptions(above_ground_m=1.5, altitude_m=None, curvature=FLAT))
    rows, cols = (index.ravel()[::5] for index in np.indices(reach.shape))
    east_m, north_m = ground.position_of(rows + reach.first_row, cols + reach.first_col)
    heights_m = ground.heights_m[rows + reach.first_row, cols + reach.first_col]
    points_m = np.column_stack([east_m, north_m, heights_m + np.float32(1.5)])
    within = np.linalg.norm(points_m - (anchor.east_m, anchor.north_m, anchor.altitude_m), axis=1) <= 400.0
    margin = margins(ground, anchor, points_m)
    sure = np.abs(margin) > 0.1  # altitudes are found to 0.1 m
    np.testing.assert_array_equal((found.seen[rows, cols] == VISIBLE)[sure], (within & (margin >= 0.0))[sure])
    assert found.errors is None
    assert found.error_statement.startswith("signals over every edge")
