"""Placements against what people do without a search, and moves against every move there is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from benchmarks.planning.mixed_integers import best_by_highs
from benchmarks.planning.placing import lattice_of
from benchmarks.report import Row, Table, duration
from benchmarks.terrains import fractal_grid, real_grid
from benchmarks.timing import Timed
from planning.placement import (
    Candidates,
    Flight,
    Goal,
    MoveQuestion,
    PlacementRules,
    SearchOptions,
    area_targets,
    candidate_grid,
    path_targets,
    place_anchors,
    reposition,
    straight_ahead,
)
from planning.placement.greedy import bound_of
from planning.placement.judges import Problem, shown_value
from planning.placement.placing import prepare
from planning.placement.searching import search
from planning.placement.stretches import flight_costs
from terrain import ElevationGrid
from terrain.synthetic import fractal
from visibility import VISIBLE, Anchor, anchor_above_ground, lines_of_sight

__all__ = ["PROBLEMS", "against_baselines", "any_move_can", "moves_against_all", "proofs", "told", "window"]

DEMS = ("bigtujunga.tif", "N44W072.hgt", "mmgis_gale_missionDEM.tif")
NOTE = """\
Windows of real DEMs, candidates on a lattice at two heights, every post a target. Values are shares (%) or metres.
Random: the best of {sets:,} sets. Grid: the candidates nearest to a regular layout. High: the highest places. Greedy:
greedy alone."""
PROOFS_NOTE = """\
The same problems. Simple bound: of submodular counting, or of what all candidates together give. Bound: branch and
bound over Lagrangian bounds after the search; time is that of both: the lesser of the clock's and of all threads'
processor time. HiGHS (SciPy's), asked for at most {seconds:g} s: what it placed and its bound, where the goal is a
mixed-integer program."""
MOVES_NOTE = """\
Fractal ground of {posts}² posts, 30 m cells; four drones at random, one of them occluded for good, a stretch of 150 m
ahead, three to be in sight, flights up to {reach_m:g} m. Brute force sends every drone to every post within the flight
range at every height, and traces all lines."""
PROBLEMS: tuple[tuple[Goal, int], ...] = (
    (Goal("coverage", min_anchors=1), 4),
    (Goal("coverage", min_anchors=3), 6),
    (Goal("coverage", min_anchors=4), 6),
    (Goal("dop", min_anchors=4, dop_limit=5.0), 6),
    (Goal("dop", min_anchors=3, dop_limit=4.0, on_surface=True), 5),
    (Goal("mean_error"), 6),
    (Goal("coverage", min_anchors=3, spare=1), 6),
)


def against_baselines(problems: int = 20, posts: int = 110, sets: int = 1000) -> Table:
    """Never worse than the four that need no search."""
    rows = []
    for number in range(problems):
        name, grid = window(number, posts)
        goal, count = PROBLEMS[number % len(PROBLEMS)]
        relief_m = float(np.nanmax(grid.heights_m) - np.nanmin(grid.heights_m))
        heights_m = (0.1 * relief_m, 0.2 * relief_m)
        places = candidate_grid(grid, lattice_of(grid, 90), above_ground_m=heights_m)
        targets = area_targets(grid)
        found = place_anchors(grid, places, targets, count, goal)
        ready = prepare(grid, places, targets, goal, PlacementRules(), (), None, None, None, None)
        kept = ready.feasible.candidates
        rivals = {
            "random": _best_of_random(ready.problem, count, sets, number),
            "grid": shown_value(ready.problem, _regular(kept, count)),
            "high": shown_value(ready.problem, np.argsort(-kept.position_m[:, 2])[:count].tolist()),
            "greedy": found.greedy_value,
        }
        sign = 1.0 if goal.is_share else -1.0
        never_worse = all(sign * found.value >= sign * value - 1e-9 for value in rivals.values())
        values = [told(goal, value) for value in (found.value, *rivals.values(), found.bound)]
        rows.append(Row((f"{name}: {goal.sentence()}, k = {count}", *values), "never worse", never_worse))
    columns = ("problem", "placed", "random", "grid", "high", "greedy", "bound")
    return Table("Placements against baselines", columns, rows, NOTE.format(sets=sets))


def proofs(problems: int = 20, posts: int = 110, effort_s: float = 40.0, peer_s: float = 60.0) -> Table:
    """What no choice exceeds, before and after branch and bound."""
    rows = []
    for number in range(problems):
        name, grid = window(number, posts)
        goal, count = PROBLEMS[number % len(PROBLEMS)]
        relief_m = float(np.nanmax(grid.heights_m) - np.nanmin(grid.heights_m))
        places = candidate_grid(grid, lattice_of(grid, 90), above_ground_m=(0.1 * relief_m, 0.2 * relief_m))
        ready = prepare(grid, places, area_targets(grid), goal, PlacementRules(), (), None, None, None, None)
        timed = Timed()
        found = search(ready.problem, count, ready.together, SearchOptions(proof_s=effort_s))
        taken_s = timed.s()
        simple = bound_of(ready.problem, count)
        gap, before = found.bound - found.value, simple - found.value
        share = gap / before if before > 1e-9 else 0.0
        sign = 1.0 if goal.is_share else -1.0
        cells = (
            f"{name}, {len(ready.problem.anchor)} candidates: {goal.sentence()}, k = {count}",
            *(told(goal, sign * value) for value in (found.value, simple, found.bound)),
            "proved" if found.proved else f"{share:.0%}",
            duration(taken_s),
            _by_highs(ready.problem, count, peer_s),
        )
        # of coverage, k up to 5 is to be proved
        easy = goal.objective == "coverage" and count <= 5
        rows.append(
            Row(
                cells,
                "proved" if easy else "≤ half, ≤ 60 s",
                (found.proved or not easy) and share <= 0.5 and taken_s <= 60.0,
            )
        )
    columns = ("problem", "placed", "simple bound", "bound", "gap, of the simple one", "time", "HiGHS: placed, bound")
    return Table("What no placement exceeds", columns, rows, PROOFS_NOTE.format(seconds=peer_s))


def _by_highs(problem: Problem, count: int, seconds: float) -> str:
    goal = problem.goal
    if goal.objective != "coverage" or goal.spare:
        return "–"
    peer = best_by_highs(problem, count, seconds)
    placed = "nothing" if math.isnan(peer.value) else told(goal, peer.value)
    return f"{placed}, {told(goal, peer.bound)} in {duration(peer.taken_s)}"


def window(number: int, posts: int) -> tuple[str, ElevationGrid]:
    """A part of a real DEM that has known ground, thinned so that it has relief; of a fractal where there is none."""
    name = DEMS[number % len(DEMS)]
    whole = real_grid(name)
    if whole is None:
        return f"fractal {number}", fractal_grid(posts, number + 1)
    step = max(1, min(whole.shape) // (3 * posts))
    random = np.random.default_rng(number)
    top, left = (int(random.integers(0, max(1, size - step * posts))) for size in whole.shape)
    heights_m = np.ascontiguousarray(
        whole.heights_m[top : top + step * posts : step, left : left + step * posts : step]
    )
    east_m, north_m = whole.position_of(top, left)
    part = replace(
        whole, heights_m=heights_m, cell_east_m=whole.cell_east_m * step, cell_north_m=whole.cell_north_m * step,
        origin_east_m=east_m, origin_north_m=north_m,
    )  # fmt: skip
    return name.split(".")[0], part


def _best_of_random(problem: Problem, count: int, sets: int, seed: int) -> float:
    random = np.random.default_rng(seed)
    candidates = len(problem.anchor)
    values = [shown_value(problem, random.choice(candidates, size=count, replace=False).tolist()) for _ in range(sets)]
    return max(values) if problem.goal.is_share else min(values)


def _regular(places: Candidates, count: int) -> list[int]:
    """The candidates nearest to the middles of a regular layout, each once."""
    across = math.ceil(math.sqrt(count))
    down = math.ceil(count / across)
    low_m, high_m = places.position_m[:, :2].min(axis=0), places.position_m[:, :2].max(axis=0)
    chosen: list[int] = []
    for place in range(count):
        share = np.array([(place % across + 0.5) / across, (place // across + 0.5) / down])
        away_m = np.hypot(*(places.position_m[:, :2] - (low_m + share * (high_m - low_m))).T)
        away_m[chosen] = np.inf
        chosen.append(int(np.argmin(away_m)))
    return chosen


def told(goal: Goal, value: float) -> str:
    """A value in its unit."""
    return f"{100.0 * value:.2f} %" if goal.is_share else f"{value:.3f} m"


def moves_against_all(cases: int = 60, posts: int = 32, reach_m: float = 500.0) -> Table:
    """How many of the occlusions that any move can mend are mended."""
    goal, can, does, wrong, needless = Goal("coverage", min_anchors=3), 0, 0, 0, 0
    for seed in range(cases):
        grid = fractal(posts, seed, relief_m=120.0, cell_m=30.0)
        anchors, path_m = _crew(grid, seed), _ahead(grid, seed, 150.0)
        question = MoveQuestion(goal, occluded=["D0"], flight=Flight(max_flight_m=reach_m))
        found = reposition(grid, anchors, path_m, question)
        if found.move is None and found.restored:
            needless += 1
            continue
        possible = any_move_can(grid, anchors, "D0", path_m, goal, reach_m)
        can += possible
        does += found.restored and possible
        wrong += found.restored and not possible
    share = does / can if can else 0.0
    cells = (str(cases - needless), str(can), str(does), f"{share:.1%}")
    rows = [Row(cells, "≥ 95 %", share >= 0.95 and wrong == 0)]
    columns = ("occlusions", "a move can restore", "restored", "share")
    return Table("Repositioning", columns, rows, MOVES_NOTE.format(posts=posts, reach_m=reach_m))


def any_move_can(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    hidden: str,
    path_m: npt.NDArray[np.float64],
    goal: Goal,
    reach_m: float,
    heights_m: Sequence[float] = (60.0, 120.0),
) -> bool:
    """Every drone to every post within reach at every height, all lines traced; coverage only."""
    point_m = path_targets(grid, path_m).point_m
    counted = [a for a in anchors if a.id != hidden]
    row, col = np.divmod(np.arange(grid.heights_m.size), grid.cols)
    east_m, north_m = grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m
    for anchor in anchors:
        others = np.array([(a.east_m, a.north_m, a.altitude_m) for a in counted if a.id != anchor.id])
        count = np.sum([_sees(grid, place, point_m) for place in others], axis=0)
        if (count < goal.needed - 1).any():
            continue
        near = np.flatnonzero(np.hypot(east_m - anchor.east_m, north_m - anchor.north_m) <= reach_m)
        ground_m = grid.heights_m.reshape(-1)[near]
        here_m = np.array([anchor.east_m, anchor.north_m, anchor.altitude_m])
        for altitude_m in (*(ground_m + height for height in heights_m), np.full(len(near), anchor.altitude_m)):
            place_m = np.column_stack([east_m[near], north_m[near], altitude_m])[altitude_m >= ground_m]
            moved = np.linalg.norm(place_m - here_m, axis=1) >= min(grid.cell_east_m, grid.cell_north_m)
            flight_m, _ = flight_costs(grid, Flight(max_flight_m=reach_m), here_m, place_m)
            place_m = place_m[moved & (flight_m <= reach_m)]
            for point in point_m[count < goal.needed]:
                place_m = place_m[_sees(grid, point, place_m)]
            if len(place_m):
                return True
    return False


def _sees(
    grid: ElevationGrid, one_m: npt.NDArray[np.float64], many_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    if not len(many_m):
        return np.zeros(0, np.bool_)
    return np.asarray(lines_of_sight(grid, np.broadcast_to(one_m, many_m.shape), many_m).verdict == VISIBLE)


def _crew(grid: ElevationGrid, seed: int) -> list[Anchor]:
    random = np.random.default_rng(seed)
    west, south, east, north = grid.bounds_m
    return [
        anchor_above_ground(grid, f"D{n}", random.uniform(west, east), random.uniform(south, north), 80.0)
        for n in range(4)
    ]


def _ahead(grid: ElevationGrid, seed: int, length_m: float) -> npt.NDArray[np.float64]:
    random = np.random.default_rng(seed + 100)
    west, south, east, north = grid.bounds_m
    place = random.uniform((west, south), (east, north))
    toward = math.atan2((west + east) / 2 - place[0], (south + north) / 2 - place[1])
    return straight_ahead(float(place[0]), float(place[1]), toward, length_m)
