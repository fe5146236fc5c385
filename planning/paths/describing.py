"""The path as its reader wants it: metres, seconds, and what holds at each vertex by exact sight lines."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.kernels.path_fields import clearances
from terrain import height_at
from visibility import (
    ALL_ROUND,
    VISIBLE,
    DistantAnchor,
    MinimumVisibleAltitude,
    lines_of_sight,
    pack_sets,
    surface_normals,
    visible_sets,
)
from visibility.columns_of_air import column_tables
from visibility.dop import solve

from .fields import CostField, bit_of, metres_of, running_sums
from .outcomes import Path, PathTotals, Reason
from .problems import PathProblem

__all__ = ["Sightings", "described", "sampled", "sightings"]

Floats = npt.NDArray[np.float64]
# limits that are about the ground and its areas, not about positioning
OBSTACLES = (Reason.SLOPE, Reason.STEP, Reason.UNKNOWN_GROUND, Reason.NO_GO, Reason.KEEP_IN)


@dataclass(frozen=True, eq=False, slots=True)
class Sightings:
    """What the anchors give at n points: visible (n, k) bool, margin_m (n, k) sight clearance, dop (n,)."""

    visible: npt.NDArray[np.bool_]
    margin_m: Floats
    dop: Floats


def sampled(places: Floats, apart: float) -> tuple[Floats, npt.NDArray[np.int64]]:
    """(places at most so many cells apart, which of them are the ways' own)."""
    out, corners = [places[:1]], [0]
    for begin, end in itertools.pairwise(places):
        steps = max(math.ceil(float(np.hypot(*(end - begin))) / apart), 1)
        share = np.arange(1, steps + 1)[:, None] / steps
        piece = begin + share * (end - begin)
        piece[-1] = end
        out.append(piece)
        corners.append(corners[-1] + steps)
    return np.concatenate(out), np.array(corners, np.int64)


def antenna_points(problem: PathProblem, places: Floats) -> Floats:
    """(n, 3) of the antenna over fractional posts."""
    east_m, north_m = metres_of(problem.grid, places)
    ground_m = height_at(problem.grid, east_m, north_m)
    return np.column_stack([east_m, north_m, ground_m + problem.rover.antenna_height_m])


def sightings(problem: PathProblem, minimum: MinimumVisibleAltitude, places: Floats) -> Sightings:
    """What the anchors give over fractional posts, by exact sight lines and the antennas' limits."""
    points_m, grid, limits = antenna_points(problem, places), problem.grid, problem.limits
    within = visible_sets(minimum, points_m).visible()
    visible, margin_m = np.zeros(within.shape, np.bool_), np.full(within.shape, np.nan)
    for number, anchor in enumerate(minimum.anchors):
        if isinstance(anchor, DistantAnchor):
            visible[:, number] = within[:, number]
            continue
        eye_m = np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], points_m.shape)
        sight = lines_of_sight(grid, eye_m, points_m, curvature=minimum.curvature, unknown=minimum.unknown)
        visible[:, number] = sight.verdict == VISIBLE
        if anchor.limits != ALL_ROUND:
            visible[:, number] &= within[:, number]
        margin_m[:, number] = sight.clearance_m
    normals = surface_normals(grid, points_m[:, 0], points_m[:, 1]) if limits.on_surface else None
    unknown = np.isnan(points_m[:, 2])
    sources = column_tables(minimum).sources
    found = solve(points_m, sources, pack_sets(visible), unknown, limits.kind, normals)
    return Sightings(visible, margin_m, getattr(found, limits.dilution))


def described(problem: PathProblem, field: CostField, minimum: MinimumVisibleAltitude | None, places: Floats) -> Path:
    """The path over the corners of a way, as fractional posts (n, 2)."""
    grid, kernel_field = problem.grid, field.for_kernels()
    fine, corners = sampled(places, 1.0)
    east_m, north_m = metres_of(grid, fine)
    sums = running_sums(kernel_field, fine)
    ahead = np.diff(np.column_stack([east_m, north_m]), axis=0)
    heading_rad = np.arctan2(ahead[:, 0], ahead[:, 1]) % math.tau
    heading_rad = np.append(heading_rad, heading_rad[-1])
    normal = surface_normals(grid, east_m, north_m)
    rise = -normal[:, :2] / normal[:, 2:]
    along = rise[:, 0] * np.sin(heading_rad) + rise[:, 1] * np.cos(heading_rad)
    across = rise[:, 1] * np.sin(heading_rad) - rise[:, 0] * np.cos(heading_rad)
    seen = sightings(problem, minimum, fine) if minimum is not None else _nothing_seen(len(fine))
    clearance_m = np.empty(len(fine))
    obstacles = (field.reasons & np.bitwise_or.reduce([bit_of(reason) for reason in OBSTACLES])) != 0
    clearances(obstacles.astype(np.uint8), kernel_field[4], fine, clearance_m)
    slope_rad = np.arctan(np.hypot(*rise.T))
    return Path(
        east_m=east_m,
        north_m=north_m,
        altitude_m=height_at(grid, east_m, north_m),
        heading_rad=heading_rad,
        distance_m=sums[:, 4],
        time_s=sums[:, 2],
        slope_rad=slope_rad,
        pitch_rad=np.arctan(along),
        roll_rad=np.arctan(across),
        visible=seen.visible,
        anchor_count=seen.visible.sum(axis=1),
        dop=seen.dop,
        margin_m=_last_margin(seen.margin_m, problem.limits.needed_in_sight),
        clearance_m=clearance_m,
        bubble_radius_m=np.full(len(fine), np.nan),
        corners=corners,
        cost=float(sums[-1, 1]),
        cost_split=_split(problem, field, sums),
        totals=_totals(problem, sums, seen, slope_rad, east_m, north_m),
    )


def _nothing_seen(points: int) -> Sightings:
    return Sightings(np.zeros((points, 0), np.bool_), np.zeros((points, 0)), np.full(points, np.nan))


def _last_margin(margin_m: Floats, needed: int) -> Floats:
    """(n,) the needed-th best clearance of each point; NaN where there are fewer anchors."""
    if margin_m.shape[1] < needed:
        return np.full(len(margin_m), np.nan)
    best_last = np.sort(np.where(np.isnan(margin_m), -np.inf, margin_m), axis=1)
    return best_last[:, margin_m.shape[1] - needed]


def _split(problem: PathProblem, field: CostField, sums: Floats) -> dict[str, float]:
    """What each weight contributes to the cost."""
    weights, last = problem.weights, sums[-1]
    split = {
        "length": weights.length * last[4],
        "climb": weights.climb * last[5],
        "time": weights.time * last[2],
        "out_of_sight": weights.out_of_sight * last[3],
    }
    split["dop"] = max(last[1] - sum(split.values()), 0.0) if weights.dop > 0.0 else 0.0
    return {name: float(value) for name, value in split.items()}


def _totals(
    problem: PathProblem, sums: Floats, seen: Sightings, slope_rad: Floats, east_m: Floats, north_m: Floats
) -> PathTotals:
    count = seen.visible.sum(axis=1)
    with_anchors = seen.visible.shape[1] > 0
    # a piece is out of sight where either of its ends is
    dark = (count < problem.limits.needed_in_sight) if with_anchors else np.zeros(len(count), np.bool_)
    piece_s = np.diff(sums[:, 2])
    dark_s = np.where(dark[:-1] | dark[1:], piece_s, 0.0)
    rise_m = float(height_at(problem.grid, east_m[-1], north_m[-1]) - height_at(problem.grid, east_m[0], north_m[0]))
    return PathTotals(
        length_m=float(sums[-1, 4]),
        climb_m=float(sums[-1, 5]),
        descent_m=float(sums[-1, 5]) - rise_m,
        time_s=float(sums[-1, 2]),
        out_of_sight_s=float(dark_s.sum()),
        longest_out_of_sight_s=_longest_run(dark_s),
        worst_dop=float(seen.dop.max()) if with_anchors else math.nan,
        fewest_anchors=int(count.min()),
        steepest_rad=float(slope_rad.max()),
    )


def _longest_run(dark_s: Floats) -> float:
    longest = run = 0.0
    for seconds in dark_s.tolist():
        run = run + seconds if seconds > 0.0 else 0.0
        longest = max(longest, run)
    return longest
