"""Small grounds and path problems for tests of the validator."""

from __future__ import annotations

from typing import Any

import numpy as np

from planning.questions.models import PathLimits, RoverModel
from planning.questions.problems import PathProblem
from planning.validation import LimitCheck, PathLimit, validate_path
from terrain import ElevationGrid
from visibility import Anchor

CELL_M = 10.0
SIDE = 41
# north-west post at (0, 400): the grid spans 0..400 m both ways
NORTH_M = 400.0
ROVER = RoverModel(footprint_radius_m=1.0)


def grid_of(heights_m: np.ndarray) -> ElevationGrid:
    return ElevationGrid(heights_m.astype(np.float32), CELL_M, CELL_M, 0.0, NORTH_M)


def level() -> ElevationGrid:
    return grid_of(np.zeros((SIDE, SIDE)))


def tilted(rise_east: float = 0.0, rise_north: float = 0.0) -> ElevationGrid:
    east, north = np.meshgrid(np.arange(SIDE) * CELL_M, NORTH_M - np.arange(SIDE) * CELL_M)
    return grid_of(rise_east * east + rise_north * north)


def walled(at_col: int = 20, height_m: float = 50.0) -> ElevationGrid:
    """Level ground with a wall a post thick from north to south."""
    heights_m = np.zeros((SIDE, SIDE))
    heights_m[:, at_col] = height_m
    return grid_of(heights_m)


def problem_of(
    grid: ElevationGrid,
    vertices_m: Any,
    *,
    rover: RoverModel = ROVER,
    limits: PathLimits | None = None,
    **rest: Any,
) -> PathProblem:
    """The problem whose start and goal are the ends of a path."""
    start, goal = tuple(vertices_m[0]), tuple(vertices_m[-1])
    rest.setdefault("goals", (goal,))
    return PathProblem(grid, start, rover=rover, limits=limits or PathLimits(), **rest)


def judged(grid: ElevationGrid, vertices_m: Any, limit: PathLimit, **question: Any) -> LimitCheck:
    """What the validator says of one limit; every other one that was checked is kept."""
    answer = validate_path(problem_of(grid, vertices_m, **question), vertices_m)
    others = [check for check in answer.checks if check.limit is not limit and not check.kept]
    assert others == [], others
    (check,) = [check for check in answer.checks if check.limit is limit]
    return check


def mast(id: str, east_m: float, north_m: float, altitude_m: float = 30.0, **rest: Any) -> Anchor:
    return Anchor(id, east_m, north_m, altitude_m, **rest)
