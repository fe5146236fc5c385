"""Gates between one and three rover widths in fences on level ground: the way through is there, which geometry proves.

A rover that is a disk passes a gate wider than itself wherever the fence stands among the posts: straight to the
middle of the gate, and straight on. So "there is no way" is false there unless it names more room than the gate has.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np
import shapely
from shapely import affinity

from benchmarks.report import Row, Table, duration
from planning.paths import PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from planning.paths.outcomes import PathOutcome
from terrain import ElevationGrid

__all__ = ["gate_problems", "gates", "is_false"]

CELL_M, POSTS = 10.0, 60
# of a rover's width: where a gate of another width is told apart
WIDTHS = ((1.0, 1.5), (1.5, 2.0), (2.0, 3.0))
# a gate as wide as the rover is passed by a disk that touches both posts: to be in the open there must be a little more
LEAST_SPARE_M = 0.01
THICK_M = 1.0
NOTE = """\
Level ground of 60 × 60 posts 10 m apart, rovers 0.5 to 12 m wide, a fence 1 m thick at any angle and place among the
posts, its gate 1 to 3 times as wide as the rover; without the sampling planner. False: "there is no way" without a
width, or with less room to spare than the gate leaves on either side."""


def gates(count: int = 1000) -> Table:
    """How plans through gates end, by the width of the gate; a proof that says more than is true is false."""
    rows, total = [], np.zeros(5, np.int64)
    worst_s = 0.0
    for number, (low, high) in enumerate(WIDTHS):
        counts, longest_s = np.zeros(5, np.int64), 0.0
        share = (count * (number + 1)) // len(WIDTHS) - (count * number) // len(WIDTHS)
        for problem, gate_m in gate_problems(share, low, high, seed=number):
            begin_s = time.process_time()
            outcome = plan_path(problem)
            longest_s = max(longest_s, time.process_time() - begin_s)
            shut = outcome.status is PathStatus.UNREACHABLE
            false = is_false(outcome, gate_m, problem.rover.footprint_radius_m)
            found, open_end = outcome.status is PathStatus.FOUND, outcome.status is PathStatus.UNDECIDED
            counts += np.array([1, found, shut, open_end, false], np.int64)
        total += counts
        worst_s = max(worst_s, longest_s)
        name = f"{low:g} to {high:g} rover widths"
        rows.append(Row((name, *(f"{v:,}" for v in counts), duration(longest_s)), "0 false", bool(counts[4] == 0)))
    rows.append(Row(("all", *(f"{v:,}" for v in total), duration(worst_s)), "0 false", bool(total[4] == 0)))
    columns = ("gate", "problems", "found", "unreachable", "undecided", "false", "longest plan, CPU")
    return Table("Gates hardly wider than the rover", columns, rows, NOTE)


def is_false(outcome: PathOutcome, gate_m: float, radius_m: float) -> bool:
    """Whether it says that there is no way with as much room as the gate leaves, or does not say with how much."""
    if outcome.status is not PathStatus.UNREACHABLE:
        return False
    grain = None if outcome.unreachable is None else outcome.unreachable.grain
    spare_m = 0.5 * gate_m - radius_m
    return grain is None or 0.5 * grain.width_m <= spare_m


def gate_problems(count: int, low: float, high: float, seed: int) -> Iterator[tuple[PathProblem, float]]:
    """(problem, width of its gate in metres), the gate between low and high rover widths."""
    random = np.random.default_rng([seed, 1812])
    grid = ElevationGrid(np.full((POSTS, POSTS), 100.0, np.float32), CELL_M, CELL_M, 500_000.0, 5_100_000.0)
    west_m, south_m, east_m, north_m = grid.bounds_m
    middle = np.array([0.5 * (west_m + east_m), 0.5 * (south_m + north_m)])
    far_m = 4.0 * POSTS * CELL_M
    for _ in range(count):
        width_m = float(np.exp(random.uniform(math.log(0.5), math.log(12.0))))
        gate_m = max(width_m * float(random.uniform(low, high)), width_m + 2.0 * LEAST_SPARE_M)
        turn = float(random.uniform(0.0, 360.0))
        along = np.array([math.cos(math.radians(turn)), math.sin(math.radians(turn))])
        at = middle + random.uniform(-8.0, 8.0, 2) * CELL_M
        fence = [
            shapely.box(-0.5 * THICK_M, 0.5 * gate_m, 0.5 * THICK_M, far_m),
            shapely.box(-0.5 * THICK_M, -far_m, 0.5 * THICK_M, -0.5 * gate_m),
        ]
        no_go = tuple(affinity.translate(affinity.rotate(part, turn, origin=(0.0, 0.0)), *at) for part in fence)
        # on either side of the fence, some cells aside from the gate
        aside = np.array([-along[1], along[0]])
        start, goal = (
            at + sign * 12.0 * CELL_M * along + float(random.uniform(-8.0, 8.0)) * CELL_M * aside for sign in (-1, 1)
        )
        yield (
            PathProblem(
                grid,
                (float(start[0]), float(start[1])),
                (float(goal[0]), float(goal[1])),
                rover=RoverModel(0.5 * width_m),
                no_go=no_go,
                budget=PlanBudget(sampling=False),
            ),
            gate_m,
        )
