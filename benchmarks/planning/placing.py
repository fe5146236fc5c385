"""Placing anchors: speed, small instances against brute force, and what holds after a loss."""

from __future__ import annotations

import math
import time
from itertools import combinations

import numpy as np

from benchmarks.report import Row, Table, duration
from benchmarks.terrains import fractal_grid, real_grid
from planning.placement import (
    Candidates,
    Goal,
    Placement,
    SearchOptions,
    SightOptions,
    Targets,
    area_targets,
    candidate_grid,
    check_placement,
    place_anchors,
)
from planning.placement.judges import judge_of, shown_value
from planning.placement.placing import prepare
from planning.placement.rules import PlacementRules
from planning.placement.sight import sampled_targets
from terrain import ElevationGrid, LargeDem
from terrain.synthetic import fractal

__all__ = ["after_a_loss", "cost_of_sight", "lattice_of", "placing_speed", "small_instances"]

GOALS = {
    "coverage, 4 in sight": Goal("coverage", min_anchors=4),
    "PDOP < 5, 4 in sight": Goal("dop", min_anchors=4, dop_limit=5.0),
}
SPEED_NOTE = """\
One placement from a grid and a lattice of candidates to anchors, bound and what each adds, kernels warm; sight is all
candidates × all posts, the rest is search. Rough fractal, 30 m cells, and a real one."""
AS_SHIPPED = "with the exact step"
SMALL_NOTE = """\
All sets gone through by one line of numpy each; the search without its own exact step, and with it. The worst over
all instances is judged: for coverage against equality, for dilutions and errors against 1 %."""
LOSS_NOTE = """\
Placed with one anchor to spare; sight recomputed edge by edge, then each anchor taken away in turn. What is stated must
be no more than what is left after the worst loss."""
COST_NOTE = "Sight alone, mode fast, one bit per candidate and post; the least of three runs."


def lattice_of(grid: ElevationGrid | LargeDem, count: int) -> float:
    """Spacing of a lattice with about so many places."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    return math.sqrt((east_m - west_m) * (north_m - south_m) / count)


def placing_speed(posts: int = 512, candidates: int = 400, real_candidates: int = 2000) -> Table:
    """The two sizes of the target."""
    rows = []
    grounds: list[tuple[str, ElevationGrid, tuple[float, ...], int, float]] = [
        (f"fractal, {posts}²", fractal_grid(posts), (80.0,), candidates, 10.0)
    ]
    real = real_grid("bigtujunga.tif")
    if real is not None:
        grounds.append(("bigtujunga.tif", real, (80.0, 120.0), real_candidates, 120.0))
    small = fractal(48, 0, relief_m=300.0, cell_m=30.0)
    for goal in GOALS.values():  # warm
        place_anchors(small, candidate_grid(small, 200.0, above_ground_m=[80.0]), area_targets(small), 6, goal)
    for name, grid, heights_m, asked, limit_s in grounds:
        places = candidate_grid(grid, lattice_of(grid, asked // len(heights_m)), above_ground_m=heights_m)
        targets = area_targets(grid)
        for words, goal in GOALS.items():
            begin_s = time.perf_counter()
            found = place_anchors(grid, places, targets, 6, goal)
            taken_s = time.perf_counter() - begin_s
            cells = (
                f"{name}, {len(places):,} candidates, k = 6, {words}",
                duration(taken_s),
                duration(found.timing_s["sight_s"]),
                f"{found.value:.1%}",
                f"{found.bound:.1%}",
            )
            rows.append(Row(cells, f"≤ {limit_s:g} s", taken_s <= limit_s))
    return Table("Placing anchors", ("what", "time", "of it sight", "share", "bound"), rows, SPEED_NOTE)


def cost_of_sight(sizes: tuple[int, ...] = (256, 512, 1024, 2048), candidates: int = 64) -> Table:
    """What one candidate and one post cost."""
    rows = []
    for posts in sizes:
        grid = fractal_grid(posts)
        places = candidate_grid(grid, lattice_of(grid, candidates), above_ground_m=[80.0])
        targets = area_targets(grid)
        best_s = math.inf
        for _ in range(3):
            begin_s = time.perf_counter()
            prepare(grid, places, targets, Goal("coverage"), PlacementRules(), (), None, None, None, None)
            best_s = min(best_s, time.perf_counter() - begin_s)
        each_ns = best_s / (len(places) * grid.heights_m.size) * 1e9
        rows.append(Row((f"{len(places)} candidates × {posts}² posts", duration(best_s), f"{each_ns:.1f} ns")))
    return Table("Sight of candidates", ("what", "time", "per candidate and post"), rows, COST_NOTE)


def small_instances(instances: int = 6, candidates: int = 14) -> Table:
    """Against every set of up to 4 candidates."""
    rows = []
    for words, goal, per_cent in (
        ("coverage, 1 in sight", Goal("coverage", min_anchors=1), 0.0),
        ("coverage, 2 in sight", Goal("coverage", min_anchors=2), 0.0),
        ("coverage, 2 in sight whichever is lost", Goal("coverage", min_anchors=2, spare=1), 0.0),
        ("PDOP < 6, 3 in sight", Goal("dop", min_anchors=3, dop_limit=6.0), 1.0),
        ("mean error", Goal("mean_error"), 1.0),
        ("worst error", Goal("worst_error"), 1.0),
    ):
        worst = {"search alone": 0.0, AS_SHIPPED: 0.0}
        for seed in range(instances):
            grid = fractal(40, seed, relief_m=300.0, cell_m=30.0)
            places = candidate_grid(grid, lattice_of(grid, candidates), above_ground_m=[60.0])
            places = places.take(np.arange(min(candidates, len(places))))
            targets = sampled_targets(area_targets(grid), np.arange(0, grid.heights_m.size, 7))
            for count in (3, 4):
                best = _best_of_all(grid, places, targets, count, goal)
                for how, exact in (("search alone", False), (AS_SHIPPED, True)):
                    found = place_anchors(
                        grid, places, targets, count, goal, options=SearchOptions(exact=exact),
                        sight=SightOptions("exact"),
                    )  # fmt: skip
                    worst[how] = max(worst[how], _short_of(found, best))
        for how, short in worst.items():
            told = "equal" if per_cent == 0.0 else f"within {per_cent:g} %"
            met = short <= 1e-9 if per_cent == 0.0 else short <= per_cent / 100.0
            verdict = (told, met) if how == AS_SHIPPED else ("", None)
            rows.append(Row((words, how, str(2 * instances), f"{short:.2%}"), *verdict))
    return Table("Small placements against brute force", ("goal", "how", "instances", "worst loss"), rows, SMALL_NOTE)


def after_a_loss(instances: int = 6) -> Table:
    """N−1: whether what is stated holds, edge by edge, with any one anchor gone."""
    rows = []
    for words, goal in (
        ("coverage, 3 in sight", Goal("coverage", min_anchors=3, spare=1)),
        ("PDOP < 8, 3 in sight", Goal("dop", min_anchors=3, dop_limit=8.0, spare=1)),
    ):
        held, stated, left = 0, [], []
        for seed in range(instances):
            grid = fractal(96, seed, relief_m=250.0, cell_m=30.0)
            places = candidate_grid(grid, lattice_of(grid, 60), above_ground_m=[80.0])
            found = place_anchors(grid, places, area_targets(grid), 6, goal, sight=SightOptions("exact"))
            check = check_placement(grid, found)
            held += check.least_after_loss >= found.value - 1e-12 and check.value >= found.value - 1e-12
            stated.append(found.value)
            left.append(check.least_after_loss)
        cells = (words, str(instances), f"{np.mean(stated):.1%}", f"{np.mean(left):.1%}", f"{held} of {instances}")
        rows.append(Row(cells, "all", held == instances))
    columns = ("goal", "placements", "stated, mean", "left after the worst loss, mean", "holds")
    return Table("With any one anchor lost", columns, rows, LOSS_NOTE)


def _best_of_all(grid: ElevationGrid, places: Candidates, targets: Targets, count: int, goal: Goal) -> float:
    ready = prepare(grid, places, targets, goal, PlacementRules(), (), SightOptions("exact"), None, None, None)
    judge = judge_of(ready.problem)
    best = max(combinations(range(len(places)), count), key=lambda some: judge.value(list(some)))
    return shown_value(ready.problem, list(best))


def _short_of(found: Placement, best: float) -> float:
    """Relative loss against the best, >= 0."""
    if best == found.value:
        return 0.0
    loss = best - found.value if found.goal.is_share else found.value - best
    return max(0.0, loss / abs(best)) if best else 0.0
