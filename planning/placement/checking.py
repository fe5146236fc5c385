"""How good a placement is: checked by exact sight lines, its geometry, and maps before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid, height_at
from visibility import Anchor, Curvature, dop, dop_map
from visibility.dilution import least_anchors
from visibility.signal import min_usable_altitude

from .cluster import anchors_table, sight_table
from .goals import Goal
from .judges import Problem, shown_value
from .placing import Placement, anchor_rows
from .sight import SightOptions, positions_of
from .targets import Targets

__all__ = [
    "Check",
    "HoverSensitivity",
    "PlacementGeometry",
    "PlacementMaps",
    "check_placement",
    "hover_sensitivity",
    "placement_geometry",
    "placement_maps",
    "value_of_anchors",
]

Floats = npt.NDArray[np.float64]
# a dilution beyond which one metre of error in the ranges is twenty in the position: as good as none
USELESS_DOP = 20.0


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
    fixed, number = placement.fixed, len(placement.anchors)
    moved = [one for move_m in moves_m for one in _moved(grid, placement.anchors, move_m)]
    # what stands still is looked at once, not for every draw
    problem = _problem_of(grid, (*fixed, *moved), placement.targets, placement.goal, placement.sight)
    still, first = list(range(len(fixed))), len(fixed)
    sets = [[*still, *range(first + at * number, first + (at + 1) * number)] for at in range(len(moves_m))]
    values = _values(problem, sets)
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
    table = anchors_table(grid, targets, anchors, sight)
    none = sight_table(grid, targets, np.zeros((0, 3)), sight).table
    return Problem(targets, goal, anchor_rows(anchors, goal), table, np.zeros((0, 4)), none)


def _values(problem: Problem, sets: Sequence[list[int]]) -> list[float]:
    return [shown_value(problem, members) for members in sets]


@dataclass(frozen=True, slots=True)
class PlacementGeometry:
    """Dilution of precision over the targets, each counted by its weight.

    median: +inf where half of them or more have no fix. within_limit, no_fix: shares 0..1, of a dilution below the
        goal's dop_limit, and of none at all. useless: of the targets that see enough anchors for a fix, the share whose
        dilution is above 20 or undefined; None where there are none.
    warning: a sentence where that is most of them, else None.
    """

    median: float
    within_limit: float
    no_fix: float
    useless: float | None
    warning: str | None


def placement_geometry(grid: ElevationGrid, placement: Placement) -> PlacementGeometry:
    """The geometry of all anchors of a placement, those that stood before included."""
    anchors, targets, goal = (*placement.fixed, *placement.anchors), placement.targets, placement.goal
    positions_m = positions_of(anchors)
    bits = anchors_table(grid, targets, anchors, placement.sight).bits
    visible = np.unpackbits(bits.view(np.uint8), axis=1, bitorder="little")[:, : len(targets)].T.astype(np.bool_)
    normal = targets.normal if goal.on_surface else None
    found = dop(positions_m, targets.point_m, goal.kind, visible=visible, surface_normal=normal)
    value: npt.NDArray[np.float64] = np.asarray(getattr(found, goal.measure), np.float64)

    share = targets.weight / targets.total

    def share_of(which: npt.NDArray[np.bool_]) -> float:
        return float(targets.weight[which].sum() / targets.weight.sum())

    order = np.argsort(value, kind="stable")
    # shares that should sum to a half may fall short of it by rounding
    middle = order[int(np.searchsorted(np.cumsum(share[order]), 0.5 - 1e-9))]
    least = least_anchors(goal.kind, on_surface=goal.on_surface)
    enough = visible.sum(axis=1) >= least
    bad = enough & ~(value <= USELESS_DOP)
    useless = share_of(bad) / share_of(enough) if enough.any() else None
    asked_for_fixes = goal.needed >= least
    return PlacementGeometry(
        float(value[middle]),
        share_of(value < goal.dop_limit),
        share_of(~np.isfinite(value)),
        useless,
        _warning(placement, useless) if asked_for_fixes and useless is not None and useless > 0.5 else None,
    )


def _warning(placement: Placement, useless: float) -> str:
    goal, positions_m = placement.goal, positions_of((*placement.fixed, *placement.anchors))
    in_a_row = len(positions_m) > 2 and np.linalg.matrix_rank(positions_m[1:] - positions_m[0], tol=1.0) < 2
    where = "stand in a row" if in_a_row else "are badly spread"
    cure = "" if goal.objective != "coverage" else ' The objective "dop" (--objective dop) looks for a good spread.'
    return (
        f"The anchors {where}: of the places that see enough of them for a position, {useless:.0%} have a "
        f"{goal.measure.upper()} above {USELESS_DOP:g} or none.{cure}"
    )


@dataclass(frozen=True, slots=True, eq=False)
class PlacementMaps:
    """Maps (rows, cols) of a placement.

    count_before, count_after: uint8, anchors surely in sight. dop_before, dop_after: float32, the goal's measure of
    dilution; +inf = no fix, NaN = unknown. is_target: uint8, 1 where a post counts. error_statement: of their lines.
    """

    count_before: npt.NDArray[np.uint8]
    count_after: npt.NDArray[np.uint8]
    dop_before: npt.NDArray[np.float32]
    dop_after: npt.NDArray[np.float32]
    is_target: npt.NDArray[np.uint8]
    error_statement: str
    curvature: Curvature


def placement_maps(
    grid: ElevationGrid, placement: Placement, unknown: Literal["unknown", "open", "blocked"] | None = None
) -> PlacementMaps:
    """The maps with the fixed anchors alone, and with those that were placed.

    unknown: what a line over unknown ground is; as the placement took it by default. Raises AnchorError.
    """
    sight, goal = placement.sight, placement.goal
    curvature, told = Curvature.over(grid, sight.curvature), ""
    maps: list[tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]] = []
    for anchors in (placement.fixed, (*placement.fixed, *placement.anchors)):
        count = np.zeros(grid.shape, np.uint8)
        dop = np.where(np.isnan(grid.heights_m), np.float32(np.nan), np.float32(np.inf))
        if anchors:
            height_m = placement.targets.above_ground_m
            lines = min_usable_altitude(
                *(grid, anchors, sight.mode, curvature),
                unknown=unknown or sight.unknown,
                only_above_ground_m=height_m,
            )
            found = dop_map(lines, height_m, goal.kind, measure=goal.measure, on_surface=goal.on_surface)
            count, dop, told = found.count.astype(np.uint8), found.dop, lines.error_statement
        maps.append((count, dop))
    (count_before, dop_before), (count_after, dop_after) = maps
    is_target = np.zeros(grid.shape, np.uint8)
    is_target.reshape(-1)[_posts_of(grid, placement.targets)] = 1
    return PlacementMaps(count_before, count_after, dop_before, dop_after, is_target, told, curvature)


def _posts_of(grid: ElevationGrid, targets: Targets) -> npt.NDArray[np.intp]:
    """Flat indices of the posts nearest to the targets."""
    if targets.post is not None:
        return targets.post
    row = np.rint((grid.origin_north_m - targets.point_m[:, 1]) / grid.cell_north_m).astype(np.intp)
    col = np.rint((targets.point_m[:, 0] - grid.origin_east_m) / grid.cell_east_m).astype(np.intp)
    return row * grid.cols + col
