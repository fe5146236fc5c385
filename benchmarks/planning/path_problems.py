"""Random path problems over real ground and mazes of ridges, for benchmarks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.terrains import real_grid
from dem_samples import load_sample
from planning import NoCoverageError, PlaceError
from planning.paths import CostWeights, PathLimits, PathProblem, PlanBudget, RoverModel
from planning.paths.ends import ends_of
from planning.paths.fields import cost_field
from planning.paths.sight_maps import sight_maps
from terrain import ElevationGrid
from visibility import MinimumVisibleAltitude, anchor_above_ground, min_visible_altitude

__all__ = ["Ground", "grounds", "maze", "random_problems"]

GRID_ALONE = PlanBudget(sampling=False)
TRIES = 60


@dataclass(frozen=True, eq=False)
class Ground:
    """A named ground with anchors over it, and how steep and how high its rovers go."""

    name: str
    minimum: MinimumVisibleAltitude
    slopes_deg: tuple[float, float]

    @property
    def grid(self) -> ElevationGrid:
        return self.minimum.grid


def grounds(posts: int = 200) -> list[Ground]:
    """Mountains, Mars, a small DEM that comes with Sightline, and two mazes; windows of so many posts."""
    found = []
    for name, file, above_m, slopes_deg in (
        ("bigtujunga", "bigtujunga.tif", (300.0, 900.0), (28.0, 40.0)),
        ("Gale", "mmgis_gale_missionDEM.tif", (5.0, 40.0), (12.0, 25.0)),
    ):
        grid = real_grid(file)
        if grid is not None:
            found.append(_ground(name, _window(grid, posts), above_m, slopes_deg))
    found.append(_ground("Jacksboro", _window(load_sample("jacksboro"), posts), (60.0, 300.0), (8.0, 20.0)))
    for seed in (1, 2):
        found.append(_ground(f"maze {seed}", maze(posts, seed), (20.0, 80.0), (20.0, 30.0)))
    return found


def _window(grid: ElevationGrid, posts: int) -> ElevationGrid:
    """The middle of a grid."""
    top, left = max((grid.rows - posts) // 2, 0), max((grid.cols - posts) // 2, 0)
    east_m, north_m = grid.position_of(top, left)
    part = grid.heights_m[top : top + posts, left : left + posts]
    return replace(grid, heights_m=np.ascontiguousarray(part), origin_east_m=east_m, origin_north_m=north_m)


def maze(posts: int, seed: int, cell_m: float = 10.0) -> ElevationGrid:
    """Level ground with ridges across, each with one or two gaps, and a ripple."""
    random = np.random.default_rng(seed)
    heights_m = 0.3 * random.standard_normal((posts, posts)).astype(np.float32)
    for number, at in enumerate(range(12, posts - 8, 16)):
        ridge = np.full(posts, 25.0, np.float32)
        for _ in range(int(random.integers(1, 3))):
            gap = int(random.integers(2, posts - 10))
            ridge[gap : gap + int(random.integers(4, 9))] = 0.0
        if number % 2:
            heights_m[at] += ridge
        else:
            heights_m[:, at] += ridge
    return ElevationGrid(heights_m, cell_m, cell_m)


def _ground(
    name: str, grid: ElevationGrid, above_m: tuple[float, float], slopes_deg: tuple[float, float], count: int = 6
) -> Ground:
    random = np.random.default_rng(11)
    known = np.argwhere(np.isfinite(grid.heights_m))
    anchors = []
    for number in range(count):
        row, col = known[int(random.integers(len(known)))]
        east_m, north_m = grid.position_of(int(row), int(col))
        anchors.append(anchor_above_ground(grid, f"A{number + 1}", east_m, north_m, float(random.uniform(*above_m))))
    return Ground(name, min_visible_altitude(grid, anchors, "exact"), slopes_deg)


def random_problems(
    ground: Ground, count: int, seed: int, budget: PlanBudget = GRID_ALONE, weights: CostWeights | None = None
) -> Iterator[PathProblem]:
    """So many problems whose start and goal can be stood on, with limits drawn at random."""
    random = np.random.default_rng(seed)
    west_m, south_m, east_m, north_m = ground.grid.bounds_m
    made = 0
    while made < count:
        limits = PathLimits(
            min_anchors=int(random.choice([0, 0, 1, 2, 3])),
            dop_limit=float(random.choice([math.inf, math.inf, 4.0, 8.0])),
        )
        rover = RoverModel(
            max_slope_rad=math.radians(float(random.uniform(*ground.slopes_deg))),
            max_roll_rad=math.radians(float(random.choice([90.0, 90.0, 20.0]))),
            footprint_radius_m=0.5,
        )
        places = random.uniform((west_m, south_m), (east_m, north_m), (2, 2))
        start, goal = tuple(places[0].tolist()), tuple(places[1].tolist())
        for _ in range(TRIES):
            if start == goal:
                break
            problem = PathProblem(
                ground.grid,
                start,
                goal,
                rover=rover,
                limits=limits,
                maps=ground.minimum,
                weights=weights or CostWeights(),
                budget=budget,
                seed=made,
            )
            try:
                maps = sight_maps(problem)
                ends_of(problem, cost_field(problem, maps), maps)
            except PlaceError as refused:
                if refused.nearest_m is None:
                    break
                start, goal = (refused.nearest_m, goal) if refused.place == "start" else (start, refused.nearest_m)
                continue
            except NoCoverageError:
                break
            made += 1
            yield problem
            break
