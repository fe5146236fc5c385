"""Paths: random problems against proof and validator, time to a first path, cost against a finer reference."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from scipy import ndimage

from benchmarks.planning.path_problems import Ground, grounds, random_problems
from benchmarks.report import Row, Table, duration
from benchmarks.terrains import fractal_grid, spread_anchors
from planning import PlaceError
from planning.paths import PathProblem, PathStatus, PlanBudget, plan_path
from planning.paths.corridors import EIGHT, SIXTEEN, grid_way, straightened
from planning.paths.ends import Ends, ends_of
from planning.paths.fields import CostField, KernelField, cost_field
from planning.paths.sight_maps import sight_maps
from planning.validation import validate_path
from visibility import min_visible_altitude

__all__ = ["cost_in_three_seconds", "first_path", "random_paths", "rolling", "same_twice"]

# steps to the 32 nearest squares in different directions: headings at most 7 degrees apart
FINE_MOVES = np.array(
    [(r, c) for r in range(-3, 4) for c in range(-3, 4) if math.gcd(r, c) == 1 and max(abs(r), abs(c)) <= 3], np.int64
)
RELIEF_SHARE = 0.35
RANDOM_NOTE = """\
Start, goal, slope and roll limits, anchors in sight (0 to 3) and dilution (none, 4, 8) drawn at random; without the
sampling planner. Invalid: the validator, at an eighth of a cell, finds a limit broken. Contradicting: found over
squares between areas that no allowed square joins, or called unreachable by the ground alone although one area joins
them."""
FIRST_PATH_S, MEDIAN_RATIO, HIGH_RATIO = 0.5, 1.02, 1.05
# one way costed by its pieces and by shorter ones
ROUNDING = 1e-6


def random_paths(count: int = 1000, posts: int = 120) -> Table:
    """How random problems end, judged by the validator at an eighth of a cell and by labelled areas."""
    chosen = grounds(posts)
    rows, totals = [], np.zeros(6, np.int64)
    for number, ground in enumerate(chosen):
        share = count // len(chosen) + (number < count % len(chosen))
        tally = np.zeros(6, np.int64)
        for problem in random_problems(ground, share, seed=100 + number):
            tally += _ending(problem)
        totals += tally
        rows.append(Row((ground.name, *(f"{n:,}" for n in tally))))
    found, refused = totals[1], totals[4] + totals[5]
    target = "every found path valid, nothing falsely found or unreachable"
    rows.append(Row(("all", *(f"{n:,}" for n in totals)), target, bool(found > 0 and refused == 0)))
    columns = ("ground", "problems", "found", "unreachable", "undecided or other", "invalid", "contradicting")
    return Table("Random path problems", columns, rows, RANDOM_NOTE)


def _ending(problem: PathProblem) -> np.ndarray:
    """(problems, found, unreachable, other, invalid, contradicting) of one problem."""
    try:
        outcome = plan_path(problem)
    except PlaceError:  # an end that the maps allow and exact sight lines do not
        return np.array([1, 0, 0, 1, 0, 0])
    field = cost_field(problem, sight_maps(problem))
    joined = _joined(problem, field)
    if outcome.path is not None:
        corners = outcome.path.corners
        vertices = np.column_stack([outcome.path.east_m, outcome.path.north_m])[corners]
        step_m = min(problem.grid.cell_east_m, problem.grid.cell_north_m) / 8.0
        valid = validate_path(problem, vertices, step_m=step_m).passed
        # between the squares there is a way where they hold none
        closer = outcome.planner == "triangles of the ground"
        return np.array([1, 1, 0, 0, int(not valid), int(not joined and not closer)])
    if outcome.status is PathStatus.UNREACHABLE:
        # exact sight lines may have closed what the field joins, and so may headings; both say so
        assert outcome.unreachable is not None
        reasons = {outcome.unreachable.reason, *(one.reason for one in outcome.unreachable.relaxations)}
        same_field = np.array_equal(outcome.reasons, field.reasons)
        excused = bool(reasons & {"exact sight lines", "pitch or roll"}) or problem.rover.max_roll_rad < math.pi / 2
        return np.array([1, 0, 1, 0, 0, int(joined and not excused and same_field)])
    return np.array([1, 0, 0, 1, 0, 0])


def _joined(problem: PathProblem, field: CostField) -> bool:
    """Whether start and goal lie in one area of allowed squares, by labelling."""
    area, _ = ndimage.label(field.reasons == 0)
    ends = ends_of(problem, field)
    first, last = (set(area.ravel()[end.nodes].tolist()) for end in (ends[0], ends[-1]))
    return bool(first & last)


def first_path(posts: int = 1024, count: int = 15) -> Table:
    """How soon a first valid path is known once maps and field are ready."""
    ground = rolling(posts)
    seconds, whole = [], []
    for problem in random_problems(ground, 3 * count, seed=5):
        field = cost_field(problem, sight_maps(problem))
        ends, kernel_field = ends_of(problem, field), field.for_kernels()
        begin_s = time.perf_counter()
        way, _ = grid_way(kernel_field, ends, EIGHT, 3.0)
        if way is not None:
            seconds.append(time.perf_counter() - begin_s)
            begin_s = time.perf_counter()
            grid_way(kernel_field, ends, SIXTEEN)
            whole.append(time.perf_counter() - begin_s)
        if len(seconds) == count:
            break
    median_s = float(np.median(seconds))
    rows = [
        Row(
            ("first path", duration(median_s), duration(float(np.max(seconds)))),
            f"median ≤ {FIRST_PATH_S} s",
            median_s <= FIRST_PATH_S,
        ),
        Row(("cheapest on 16 neighbours", duration(float(np.median(whole))), duration(float(np.max(whole))))),
    ]
    return Table(f"First valid path, {posts}²", ("what", "median", "longest"), rows)


def rolling(posts: int) -> Ground:
    """Gentle fractal ground with six anchors."""
    grid = fractal_grid(posts)
    gentle = replace(grid, heights_m=grid.heights_m * np.float32(RELIEF_SHARE))
    anchors = [anchor for anchor, *_ in spread_anchors(gentle, 6)]
    return Ground("fractal", min_visible_altitude(gentle, anchors, "exact"), (25.0, 35.0))


def cost_in_three_seconds(posts: int = 400, count: int = 24) -> Table:
    """What a path costs that is planned in three seconds, against a finer any-angle reference."""
    ratios, grids, late, sampled = [], [], 0, 0
    for number, ground in enumerate(grounds(posts)):
        budget = PlanBudget(seconds=3.0)
        for problem in random_problems(ground, 4 * count, seed=900 + number, budget=budget):
            outcome = plan_path(problem)
            if outcome.path is None:
                continue
            field = cost_field(problem, sight_maps(problem))
            reference = _reference(field.for_kernels(), ends_of(problem, field))
            ratios.append(outcome.path.cost / reference)
            grids.append(outcome.ratio)
            late += outcome.stopped_by == "time"
            sampled += outcome.planner.startswith("BIT*")
            if len(ratios) % (count // 5 or 1) == 0:
                break
    median, high = float(np.median(ratios)), float(np.percentile(ratios, 90.0))
    rows = [
        Row(("median of cost / reference", f"{median:.4f}"), f"≤ {MEDIAN_RATIO}", median <= MEDIAN_RATIO),
        Row(("90th percentile", f"{high:.4f}"), f"≤ {HIGH_RATIO}", high <= HIGH_RATIO),
        Row(("worst of cost / the grid's own way", f"{max(grids):.6f}"), "≤ 1", max(grids) <= 1.0 + ROUNDING),
        Row(("paths; BIT*'s; ended by the clock", f"{len(ratios)}; {sampled}; {late}")),
    ]
    note = "The reference: the cheapest way over 32 neighbours, pulled straight and its corners moved in ten rounds."
    return Table("Cost within three seconds", ("what", "measured"), rows, note)


def _reference(field: KernelField, ends: tuple[Ends, ...]) -> float:
    way, _ = grid_way(field, ends, FINE_MOVES)
    assert way is not None, "a path was found there"
    return straightened(field, way, rounds=10).cost


def same_twice(count: int = 6) -> Table:
    """Whether one seed gives one path in fresh processes of the sampling planner."""
    problems = [
        problem
        for number, ground in enumerate(grounds(120))
        for problem in random_problems(ground, 3, seed=40 + number, budget=PlanBudget(iterations=10_000))
    ]
    same = different = 0
    for problem in problems:
        if same + different == count:
            break
        first, second = plan_path(problem), plan_path(problem)
        if first.path is None or second.path is None:
            continue
        equal = np.array_equal(first.path.east_m, second.path.east_m)
        same, different = same + equal, different + (not equal)
    rows = [Row((str(same + different), str(same)), "all the same", different == 0 and same > 0)]
    return Table("One seed, one path", ("problems planned twice", "identical"), rows)
