"""Whether "there is no way" is true: what was proved, against a search on squares four times as fine.

The finer search is the grid planner's on the same surface with posts four times as close. What it finds is handed to
the validator with the problem as it was asked; a path that passes refutes the proof.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import affinity

from benchmarks.report import Row, Table, duration
from benchmarks.terrains import DATA, real_grid
from dem_samples import load_sample
from planning import PathError
from planning.kernels.searches import least_worst_way
from planning.paths import PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from planning.paths.corridors import SIXTEEN, grid_way
from planning.paths.ends import ends_of
from planning.paths.fields import cost_field
from planning.validation import validate_path
from terrain import ElevationGrid, TerrainError, height_at

__all__ = ["close_problems", "finer", "refuted", "unreachables"]

FINER = 4
# drawn so often for each problem: ground is unknown, or start and goal are in an area
TRIES = 40
NOTE = """\
Slope limits a little under or over the steepest place of the least steep way, fences with a gate of 0.02 to 2.5 cells,
and areas, over windows of 80 posts; without the sampling planner. Refuted: the grid planner on squares four times as
fine finds a path that the validator passes."""


def unreachables(count: int = 300, posts: int = 80, files: Sequence[str] | None = None) -> Table:
    """How problems near their limits end, and what finer squares say of those said to be unreachable."""
    grids = _grids(files)
    rows, totals, worst_s = [], np.zeros(5, np.int64), 0.0
    for number, (name, grid) in enumerate(grids):
        counts, taken_s = np.zeros(5, np.int64), []
        # a ground that hardly anything of is known has none: the others make up for it
        share = math.ceil((count - int(totals[0])) / (len(grids) - number))
        for problem in close_problems(grid, share, posts, seed=number):
            begin_s = time.process_time()
            outcome = plan_path(problem)
            taken_s.append(time.process_time() - begin_s)
            shut = outcome.status is PathStatus.UNREACHABLE
            kinds = (shut, outcome.status is PathStatus.UNDECIDED, shut and refuted(problem))
            counts += np.array([1, outcome.status is PathStatus.FOUND, *kinds], np.int64)
        totals += counts
        worst_s = max(worst_s, *taken_s, 0.0)
        cells = (name, *(f"{value:,}" for value in counts), duration(max(taken_s, default=0.0)))
        rows.append(Row(cells, "0 refuted", counts[4] == 0))
    rows.append(Row(("all", *(f"{v:,}" for v in totals), duration(worst_s)), "0 refuted", totals[4] == 0))
    columns = ("ground", "problems", "found", "unreachable", "undecided", "refuted", "longest plan, CPU")
    return Table("There is no way, looked at four times as finely", columns, rows, NOTE)


def finer(grid: ElevationGrid, times: int = FINER) -> ElevationGrid:
    """The same surface with posts so many times as close, its heights from the middle of what there is."""
    row, col = (np.arange(times * (posts - 1) + 1) / times for posts in grid.shape)
    east_m, north_m = grid.position_of(*np.meshgrid(row, col, indexing="ij"))
    # floats of 32 bits are kept small, so that slopes of short sides stay what they are
    heights_m = height_at(grid, east_m, north_m) - float(np.nanmean(grid.heights_m))
    return replace(
        grid,
        heights_m=heights_m.astype(np.float32),
        cell_east_m=grid.cell_east_m / times,
        cell_north_m=grid.cell_north_m / times,
    )


def refuted(problem: PathProblem) -> bool:
    """Whether the grid planner on finer squares finds a path that the validator passes."""
    close = replace(problem, grid=finer(problem.grid))
    try:
        field = cost_field(close, None)
        way, _ = grid_way(field.for_kernels(), ends_of(close, field), SIXTEEN)
    except PathError:
        return False
    if way is None:
        return False
    return validate_path(problem, np.column_stack(close.grid.position_of(*way.places.T))).passed


def close_problems(grid: ElevationGrid, count: int, posts: int, seed: int) -> Iterator[PathProblem]:
    """So many problems that a little decides, by turns of slope, of a fence with a gate and of both with areas."""
    random = np.random.default_rng([seed, 1407])
    made = 0
    for _ in range(TRIES * count):
        if made == count:
            return
        window = _window(grid, posts, random)
        problem = _problem(window, made % 3, random)
        if problem is None:
            continue
        made += 1
        yield problem


def _grids(files: Sequence[str] | None) -> list[tuple[str, ElevationGrid]]:
    """Every DEM in the folder beside the checkout; without it, one that comes with Sightline."""
    names = sorted(path.name for path in DATA.glob("*") if path.suffix != ".json") if files is None else files
    found = []
    for name in names:
        try:
            grid = real_grid(name)
        except TerrainError:
            continue
        if grid is not None:
            found.append((name, grid))
    return found or [("Jacksboro", load_sample("jacksboro"))]


def _window(grid: ElevationGrid, posts: int, random: np.random.Generator) -> ElevationGrid:
    rows, cols = min(posts, grid.rows), min(posts, grid.cols)
    top, left = int(random.integers(grid.rows - rows + 1)), int(random.integers(grid.cols - cols + 1))
    east_m, north_m = grid.position_of(top, left)
    part = np.ascontiguousarray(grid.heights_m[top : top + rows, left : left + cols])
    return replace(grid, heights_m=part, origin_east_m=east_m, origin_north_m=north_m)


def _problem(grid: ElevationGrid, kind: int, random: np.random.Generator) -> PathProblem | None:
    """kind: 0 = slope, 1 = a fence with a gate over ground that may be driven, 2 = slope, fence and areas."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    known = np.argwhere(~np.isnan(grid.heights_m))
    if len(known) == 0:
        return None
    # from the west of what is known to the east of it, off the lines between squares
    known = known[np.argsort(known[:, 1])]
    at = known[[int(random.integers(0, len(known) // 3 + 1)), -1 - int(random.integers(0, len(known) // 3 + 1))]]
    start, goal = (grid.position_of(*(place + random.uniform(-0.3, 0.3, 2))) for place in at)
    cell_m = min(grid.cell_east_m, grid.cell_north_m)
    radius_m = float(random.choice([0.0, 0.5, 0.2 * cell_m]))
    steep = PathProblem(
        grid, start, goal, rover=RoverModel(radius_m, max_slope_rad=math.pi / 2), budget=PlanBudget(sampling=False)
    )
    if kind > 0:
        steep = replace(steep, no_go=_fence(grid, start, goal, cell_m * float(random.uniform(0.02, 2.5)), random))
    if kind == 2:
        places = random.uniform((west_m, south_m), (east_m, north_m), (4, 2))
        areas = [
            affinity.rotate(shapely.box(e, n, e + 6.0 * cell_m, n + 3.0 * cell_m), float(random.uniform(0, 180)))
            for e, n in places.tolist()
        ]
        steep = replace(steep, no_go=(*steep.no_go, *areas))
    needed_rad = _needed_rad(steep)
    if needed_rad is None:
        return None
    share = float(random.uniform(0.93, 1.03)) if kind != 1 else float(random.uniform(1.0, 1.3))
    slope_rad = min(max(needed_rad * share, math.radians(0.5)), math.radians(85.0))
    problem = replace(steep, rover=replace(steep.rover, max_slope_rad=slope_rad))
    try:
        ends_of(problem, cost_field(problem, None))
    except PathError:
        return None
    return problem


def _fence(
    grid: ElevationGrid,
    start: tuple[float, float],
    goal: tuple[float, float],
    gate_m: float,
    random: np.random.Generator,
) -> tuple[shapely.Polygon, ...]:
    """Two long thin areas across the way, and a gate between them, at any angle."""
    far_m, thick_m = (
        2.0 * math.hypot(grid.rows * grid.cell_north_m, grid.cols * grid.cell_east_m),
        0.3 * grid.cell_east_m,
    )
    share = float(random.uniform(0.4, 0.6))
    at = [a + share * (b - a) for a, b in zip(start, goal, strict=True)]
    # where the way crosses it, or up to some cells aside
    aside_m = float(random.uniform(-8.0, 8.0)) * grid.cell_north_m
    parts = [
        shapely.box(0.0, aside_m + 0.5 * gate_m, thick_m, far_m),
        shapely.box(0.0, -far_m, thick_m, aside_m - 0.5 * gate_m),
    ]
    turn = float(random.uniform(-20.0, 20.0))
    return tuple(affinity.translate(affinity.rotate(part, turn, origin=(0.0, 0.0)), *at) for part in parts)


def _needed_rad(problem: PathProblem) -> float | None:
    """The steepest square of the least steep way over squares, areas left out where they leave no way."""
    try:
        for one in (problem, replace(problem, no_go=())):
            field = cost_field(one, None)
            begin, end = (stop.nodes for stop in ends_of(one, field))
            value = np.where(field.reasons == 0, np.arctan(field.slope.astype(np.float64)), np.inf)
            worst, _ = least_worst_way(value, begin, end)
            if math.isfinite(worst):
                return float(worst)
    except PathError:
        return None
    return None
