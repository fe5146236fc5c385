"""A placement checked: recomputed edge by edge, with any one anchor lost, and with all hovering off their places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid, height_at
from visibility import Anchor

from .goals import Goal
from .judges import Problem, shown_value
from .placing import Placement, anchor_rows, positions_of
from .sight import SightOptions
from .targets import Targets
from .working_out import sight_table

__all__ = ["Check", "HoverSensitivity", "check_placement", "hover_sensitivity", "value_of_anchors"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Check:
    """A placement recomputed over every edge of the triangulated surface.

    value: what the goal asks for, exact. after_loss: the goal's value without spare once that anchor alone is lost, by
        the anchor's id, fixed ones included. least_after_loss: the worst of them; with a goal that allows for a loss it
        is at least ``value`` (at most, for errors).
    """

    value: float
    after_loss: dict[str, float]
    least_after_loss: float


@dataclass(frozen=True, slots=True)
class HoverSensitivity:
    """What hovering off the planned places does to the value: planned, and mean and worst over draws.

    hover_m: every anchor is off by up to so much east, north and up. vertical_low, vertical_high: the value with all
        anchors that much lower and higher.
    """

    hover_m: float
    planned: float
    mean: float
    worst: float
    vertical_low: float
    vertical_high: float
    draws: int


def value_of_anchors(
    grid: ElevationGrid, anchors: Sequence[Anchor], targets: Targets, goal: Goal, sight: SightOptions
) -> float:
    """The goal's value of any anchors: a share 0..1, or metres. Raises AnchorError."""
    return _values(_problem_of(grid, anchors, targets, goal, sight), [list(range(len(anchors)))])[0]


def check_placement(grid: ElevationGrid, placement: Placement) -> Check:
    """The placement recomputed in mode "exact", whole and with each of its anchors lost."""
    anchors = (*placement.fixed, *placement.anchors)
    sight = replace(placement.sight, mode="exact")
    problem = _problem_of(grid, anchors, placement.targets, placement.goal, sight)
    everyone = list(range(len(anchors)))
    value = _values(problem, [everyone])[0]
    without = replace(problem, goal=replace(problem.goal, spare=0))
    lost = _values(without, [everyone[:at] + everyone[at + 1 :] for at in everyone])
    worst = min(lost) if placement.goal.is_share else max(lost)
    return Check(value, {anchor.id: one for anchor, one in zip(anchors, lost, strict=True)}, worst)


def hover_sensitivity(
    grid: ElevationGrid, placement: Placement, hover_m: float = 10.0, *, draws: int = 8, seed: int = 0
) -> HoverSensitivity:
    """The placement's value when its anchors hover off their places; the ground is never gone below.

    Each draw moves every placed anchor independently and evenly within ± hover_m in each axis. Raises PlacementError.
    """
    if not (np.isfinite(hover_m) and hover_m >= 0.0 and draws >= 1):
        raise PlacementError(f"hover_m must be >= 0 m and draws >= 1, not {hover_m} and {draws}.")
    random = np.random.default_rng(seed)
    shape = (len(placement.anchors), 3)
    moves_m = [random.uniform(-hover_m, hover_m, shape) for _ in range(draws)]
    moves_m += [np.full(shape, (0.0, 0.0, up_m)) for up_m in (-hover_m, hover_m)]
    values = [
        value_of_anchors(
            grid, (*placement.fixed, *_moved(grid, placement.anchors, move_m)), placement.targets, placement.goal,
            placement.sight,
        )
        for move_m in moves_m
    ]  # fmt: skip
    drawn = values[:draws]
    worst = min(drawn) if placement.goal.is_share else max(drawn)
    low, high = values[draws:]
    return HoverSensitivity(hover_m, placement.value, float(np.mean(drawn)), worst, low, high, draws)


def _moved(grid: ElevationGrid, anchors: Sequence[Anchor], move_m: Floats) -> list[Anchor]:
    place_m = positions_of(anchors) + move_m
    ground_m = np.nan_to_num(np.asarray(height_at(grid, place_m[:, 0], place_m[:, 1]), np.float64), nan=-np.inf)
    place_m[:, 2] = np.maximum(place_m[:, 2], ground_m)
    return [
        replace(anchor, east_m=float(e), north_m=float(n), altitude_m=float(u))
        for anchor, (e, n, u) in zip(anchors, place_m, strict=True)
    ]


def _problem_of(
    grid: ElevationGrid, anchors: Sequence[Anchor], targets: Targets, goal: Goal, sight: SightOptions
) -> Problem:
    """The anchors as candidates."""
    table = sight_table(grid, targets, positions_of(anchors), sight).table
    none = sight_table(grid, targets, np.zeros((0, 3)), sight).table
    return Problem(targets, goal, anchor_rows(anchors, goal), table, np.zeros((0, 4)), none)


def _values(problem: Problem, sets: Sequence[list[int]]) -> list[float]:
    return [shown_value(problem, members) for members in sets]
