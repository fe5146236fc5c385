"""The path as its reader wants it: metres, seconds, and what holds at each vertex by exact sight lines."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from planning.kernels.path_fields import clearances
from planning.questions.problems import PathProblem
from terrain import height_at
from visibility.dilution import surface_normals

from .beliefs import predicted_sigma_m
from .fields import CostField, running_sums
from .outcomes import Path, PathTotals
from .places import metres_of, sampled
from .sight_maps import Sightings, SightMaps
from .triangles import middles, steepest_rad

__all__ = ["described"]

Floats = npt.NDArray[np.float64]


def described(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Floats, *, everywhere: bool = False
) -> Path:
    """The path over the corners of a way, as fractional posts (n, 2); everywhere: also over forbidden squares."""
    grid, kernel_field = problem.grid, field.for_kernels(everywhere=everywhere)
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
    seen = maps.sightings(fine, sums[:, 2]) if maps is not None else _nothing_seen(len(fine))
    clearance_m = np.empty(len(fine))
    clearances(field.obstacles(), kernel_field[4], fine, clearance_m)
    slope_rad = np.arctan(np.hypot(*rise.T))
    altitude_m = height_at(grid, east_m, north_m)
    sigma_m = np.full(len(fine), np.nan)
    if maps is not None:
        points_m = np.column_stack([east_m, north_m, altitude_m + problem.rover.receiver_above_ground_m])
        sigma_m = predicted_sigma_m(problem, points_m, sums[:, 2], rise, seen.visible)
    limits = problem.limits
    asked = limits.bubble_epsilon > 0.0
    return Path(
        east_m=east_m,
        north_m=north_m,
        altitude_m=altitude_m,
        heading_rad=heading_rad,
        distance_m=sums[:, 4],
        time_s=sums[:, 2],
        slope_rad=slope_rad,
        pitch_rad=np.arctan(along),
        roll_rad=np.arctan(across),
        visible=seen.visible,
        anchor_count=seen.visible.sum(axis=1),
        dop=seen.dop,
        margin_m=_last_margin(seen.margin_m, limits.needed_in_sight),
        clearance_m=clearance_m,
        position_sigma_m=sigma_m,
        bubble_radius_m=limits.bubble_epsilon * sigma_m + limits.dem_sigma_m if asked else np.full(len(fine), np.nan),
        corners=corners,
        cost=float(sums[-1, 1]),
        cost_split=_split(problem, field, fine, sums),
        totals=_totals(problem, sums, seen, _between(maps, fine, sums), sigma_m, steepest_rad(grid, fine), altitude_m),
    )


def _between(maps: SightMaps | None, places: Floats, sums: Floats) -> Sightings:
    """What the anchors give between the vertices: in the middle of what the path crosses of each triangle."""
    middle, at = middles(places)
    if maps is None:
        return _nothing_seen(len(middle))
    return maps.sightings(middle, np.interp(at, np.arange(len(sums)), sums[:, 2]))


def _nothing_seen(points: int) -> Sightings:
    return Sightings(np.zeros((points, 0), np.bool_), np.zeros((points, 0)), np.full(points, np.nan))


def _last_margin(margin_m: Floats, needed: int) -> Floats:
    """(n,) the needed-th best clearance of each point; NaN where there are fewer anchors."""
    if margin_m.shape[1] < needed:
        return np.full(len(margin_m), np.nan)
    best_last = np.sort(np.where(np.isnan(margin_m), -np.inf, margin_m), axis=1)
    return best_last[:, margin_m.shape[1] - needed]


def _split(problem: PathProblem, field: CostField, places: Floats, sums: Floats) -> dict[str, float]:
    """What each weight contributes to the cost."""
    weights, last = problem.weights, sums[-1]
    split = {
        "length": weights.length * last[4],
        "climb": weights.climb * last[5],
        "time": weights.time * last[2],
        "out_of_sight": weights.out_of_sight * last[3],
    }
    # what a metre costs besides is told apart in each square, at the middle of each piece
    middle = 0.5 * (places[:-1] + places[1:])
    square = (
        np.minimum(middle[:, 0].astype(np.intp), field.dop_cost.shape[0] - 1),
        np.minimum(middle[:, 1].astype(np.intp), field.dop_cost.shape[1] - 1),
    )
    beside = last[1] - sum(split.values())
    by_dop = float((field.dop_cost[square] * np.diff(sums[:, 4])).sum())
    by_error = float(((field.added - field.dop_cost)[square] * np.diff(sums[:, 4])).sum())
    share = by_dop / (by_dop + by_error) if by_dop + by_error > 0.0 else 0.0
    split["dop"], split["position_error"] = max(beside, 0.0) * share, max(beside, 0.0) * (1.0 - share)
    return {name: float(value) for name, value in split.items()}


def _totals(
    problem: PathProblem,
    sums: Floats,
    seen: Sightings,
    between: Sightings,
    sigma_m: Floats,
    steepest_rad: float,
    altitude_m: Floats,
) -> PathTotals:
    count = seen.visible.sum(axis=1)
    with_anchors = seen.visible.shape[1] > 0
    # a piece is out of sight where either of its ends is
    dark = (count < problem.limits.needed_in_sight) if with_anchors else np.zeros(len(count), np.bool_)
    piece_s = np.diff(sums[:, 2])
    dark_s = np.where(dark[:-1] | dark[1:], piece_s, 0.0)
    rise_m = float(altitude_m[-1] - altitude_m[0])
    return PathTotals(
        length_m=float(sums[-1, 4]),
        climb_m=float(sums[-1, 5]),
        descent_m=float(sums[-1, 5]) - rise_m,
        time_s=float(sums[-1, 2]),
        out_of_sight_s=float(dark_s.sum()),
        longest_out_of_sight_s=_longest_run(dark_s),
        worst_dop=float(np.concatenate([seen.dop, between.dop]).max()) if with_anchors else math.nan,
        fewest_anchors=int(min(count.min(), between.visible.sum(axis=1).min())),
        mean_position_sigma_m=float((0.5 * (sigma_m[:-1] + sigma_m[1:]) * piece_s).sum() / piece_s.sum()),
        steepest_rad=steepest_rad,
    )


def _longest_run(dark_s: Floats) -> float:
    longest = run = 0.0
    for seconds in dark_s.tolist():
        run = run + seconds if seconds > 0.0 else 0.0
        longest = max(longest, run)
    return longest
