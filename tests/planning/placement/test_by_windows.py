"""Placements by windows against those in memory: the same anchors, value and bound, whoever works them out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio
import shapely
from distributed import LocalCluster

from planning import NoCandidateError, PlacementError
from planning.placement import (
    Goal,
    PlacementRules,
    SightOptions,
    WindowPlacement,
    WindowQuestion,
    area_targets,
    candidate_grid,
    check_placement,
    place_anchors,
    place_by_windows,
)
from planning.placement.greedy import bound_of, exchange, fill_up, greedy
from planning.placement.judges import CountJudge, Problem, judge_of, shown_value
from planning.placement.placing import prepare
from terrain import ElevationGrid, LargeDem, open_dem, read_dem
from terrain.synthetic import fractal
from visibility import Anchor, anchor_above_ground

ROWS, COLS, CELL_M = 150, 190, 30.0
RULES = PlacementRules(max_range_m=1100.0)
GOALS = [
    Goal("coverage", min_anchors=1),
    Goal("coverage", min_anchors=2),
    Goal("coverage", min_anchors=2, spare=1),
]


@pytest.fixture(scope="module")
def dem_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fractal ground with a hole, as a tiled file."""
    heights_m = fractal(192, 5, relief_m=400.0, cell_m=CELL_M).heights_m[:ROWS, :COLS].copy()
    heights_m[40:60, 100:130] = np.nan
    path = tmp_path_factory.mktemp("dem") / "large.tif"
    at = rasterio.Affine(CELL_M, 0.0, 600_000.0, 0.0, -CELL_M, 5_000_000.0)
    size = {"height": ROWS, "width": COLS, "count": 1, "dtype": "float32", "nodata": math.nan}
    tiles = {"tiled": True, "blockxsize": 64, "blockysize": 64}
    with rasterio.open(path, "w", driver="GTiff", crs="EPSG:32632", transform=at, **size, **tiles) as file:
        file.write(heights_m, 1)
    return path


@pytest.fixture(scope="module")
def dem(dem_file: Path) -> LargeDem:
    return open_dem(dem_file)


@pytest.fixture(scope="module")
def grid(dem_file: Path) -> ElevationGrid:
    return read_dem(dem_file)


def standing(grid: ElevationGrid) -> tuple[Anchor, ...]:
    west_m, _, _, north_m = grid.bounds_m
    return (
        anchor_above_ground(grid, "F1", west_m + 1500.0, north_m - 2400.0, 60.0),
        anchor_above_ground(grid, "F2", west_m + 4200.0, north_m - 3300.0, 60.0),
    )


def in_memory(problem: Problem, together, count: int) -> tuple[list[int], list[int]]:
    """(greedy's set, the set that no exchange betters) by the judges that hold all bits in memory."""
    judge, many = judge_of(problem), len(problem.anchor)
    guide = CountJudge(problem, problem.goal.needed_with_spare, partial=True)
    first = fill_up(judge, greedy(guide, many, count, together), count, together)
    return first, exchange(judge, first, together)


@pytest.mark.parametrize("goal", GOALS, ids=["1", "2", "2 and a spare"])
# rays of the fast mode end at the border of the window, which anchors that stand share in memory and not here
@pytest.mark.parametrize(("mode", "stand"), [("exact", False), ("exact", True), ("fast", False)])
def test_the_answer_is_that_of_the_search_in_memory(dem, grid, goal: Goal, mode, stand: bool) -> None:
    fixed = standing(grid) if stand else ()
    rules = replace(RULES, min_separation_m=350.0)
    candidates, targets = candidate_grid(grid, 450.0, above_ground_m=[40.0, 70.0]), area_targets(grid)
    sight = SightOptions(mode)
    ready = prepare(grid, candidates, targets, goal, rules, fixed, sight, None, None, None)
    first, chosen = in_memory(ready.problem, ready.together, 6)
    found = place_by_windows(
        dem,
        candidate_grid(dem, 450.0, above_ground_m=[40.0, 70.0]),
        6,
        WindowQuestion(goal, rules, 1.5, None, fixed, sight),
    )
    assert found.feasible.removed == ready.feasible.removed
    assert sorted(found.candidate.tolist()) == sorted(ready.feasible.number[chosen].tolist())
    assert found.targets == len(targets)
    assert found.value == pytest.approx(shown_value(ready.problem, chosen), abs=1e-12)
    assert found.greedy_value == pytest.approx(shown_value(ready.problem, first), abs=1e-12)
    assert found.before == pytest.approx(shown_value(ready.problem, []), abs=1e-12)
    assert found.bound == pytest.approx(bound_of(ready.problem, 6), abs=1e-12)
    assert found.before + found.marginal.sum() == pytest.approx(found.value, abs=1e-12)
    assert 0.0 < found.value < 1.0
    whole = place_anchors(grid, candidates, targets, 6, goal, rules, fixed=fixed, sight=sight)
    assert found.before <= found.value <= whole.bound + 1e-12


def test_the_value_over_every_edge_is_that_of_a_check_in_memory(dem, grid) -> None:
    goal, candidates = GOALS[1], candidate_grid(dem, 400.0, above_ground_m=[60.0])
    found = place_by_windows(dem, candidates, 5, WindowQuestion(goal, RULES))
    here = place_anchors(grid, candidates, area_targets(grid), 5, goal, RULES)
    here = replace(here, anchors=found.anchors)
    assert found.exact == pytest.approx(check_placement(grid, here).value, abs=1e-12)


def test_an_area_is_served_alone(dem, grid) -> None:
    west_m, south_m, east_m, north_m = grid.bounds_m
    area = shapely.Polygon(
        [(west_m + 900, south_m + 700), (east_m - 1300, south_m + 1200), (west_m + 2500, north_m - 400)]
    )
    candidates, goal = candidate_grid(dem, 330.0, above_ground_m=[50.0], area=area), GOALS[1]
    targets = area_targets(grid, area=area)
    ready = prepare(grid, candidates, targets, goal, RULES, (), SightOptions("exact"), None, None, None)
    _, chosen = in_memory(ready.problem, ready.together, 4)
    found = place_by_windows(dem, candidates, 4, WindowQuestion(goal, RULES, area=area, sight=SightOptions("exact")))
    assert found.targets == len(targets)
    assert sorted(found.candidate.tolist()) == sorted(ready.feasible.number[chosen].tolist())
    assert found.value == pytest.approx(shown_value(ready.problem, chosen), abs=1e-12)
    assert found.bound == pytest.approx(bound_of(ready.problem, 4), abs=1e-12)


def test_heights_of_candidates_are_those_of_the_whole(dem, grid) -> None:
    one, other = (candidate_grid(some, 87.0, above_ground_m=[50.0], altitude_m=[900.0]) for some in (dem, grid))
    np.testing.assert_allclose(one.position_m, other.position_m, atol=1e-6)
    np.testing.assert_allclose(one.ground_m, other.ground_m, atol=1e-6)
    assert np.isnan(one.ground_m).any()


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as running:
        yield running


# sockets and loops that distributed closes only as the interpreter ends
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_workers_that_read_their_own_windows_answer_the_same(dem, cluster: LocalCluster, tmp_path: Path) -> None:
    candidates, question = candidate_grid(dem, 330.0, above_ground_m=[50.0]), WindowQuestion(GOALS[1], RULES)
    shares: list[float] = []
    here = place_by_windows(dem, candidates, 5, question)
    there = place_by_windows(
        dem, candidates, 5, question, cluster=cluster.scheduler_address, folder=tmp_path, progress=shares.append
    )
    same(here, there)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert not list(tmp_path.iterdir())


def same(one: WindowPlacement, other: WindowPlacement) -> None:
    assert one.anchors == other.anchors
    assert (one.value, one.bound, one.exact) == (other.value, other.bound, other.exact)


def test_a_stop_answers_with_the_best_of_what_was_looked_at(dem, tmp_path: Path) -> None:
    shares: list[float] = []
    candidates = candidate_grid(dem, 330.0, above_ground_m=[50.0])
    found = place_by_windows(
        dem, candidates, 3, WindowQuestion(GOALS[0], RULES), folder=tmp_path, progress=shares.append,
        stop=lambda: bool(shares) and shares[-1] > 0.2,
    )  # fmt: skip
    assert found.stopped
    assert len(found.anchors) == 3
    assert len(found.feasible.candidates) < len(candidates)
    assert not list(tmp_path.iterdir())


def test_a_candidate_far_from_all_targets_is_told(dem, grid) -> None:
    west_m, _, _, north_m = grid.bounds_m
    corner = shapely.box(west_m, north_m - 600.0, west_m + 600.0, north_m)
    found = place_by_windows(
        dem, candidate_grid(dem, 700.0, above_ground_m=[50.0]), 1, WindowQuestion(GOALS[0], RULES, area=corner)
    )
    assert found.feasible.removed["no target within range"] > 10
    far = candidate_grid(
        dem,
        300.0,
        above_ground_m=[50.0],
        area=shapely.box(west_m + 4000, north_m - 4000, west_m + 5000, north_m - 3000),
    )
    with pytest.raises(NoCandidateError, match="no target within range"):
        place_by_windows(dem, far, 1, WindowQuestion(GOALS[0], RULES, area=corner))


@pytest.mark.parametrize(
    ("goal", "rules", "sentence"),
    [
        (Goal(), RULES, 'not for "mean_error"'),
        (GOALS[0], PlacementRules(), "by windows it needs one"),
    ],
)
def test_what_windows_cannot_hold_is_refused(goal: Goal, rules: PlacementRules, sentence: str) -> None:
    with pytest.raises(PlacementError, match=sentence):
        WindowQuestion(goal, rules)
