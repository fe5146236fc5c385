"""What the ground under a walk must be like: known, not too steep, not too tilted, without steps."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at

from .reports import LimitCheck, PathLimit, check_of
from .walking import Walk

__all__ = ["ground_checks"]

Numbers = npt.NDArray[np.float64]

ANGLE_SLACK_RAD = 1e-6
STEP_SLACK_M = 1e-4
# places on the rim of the footprint that are looked at
RIM = 24
PLACES_AT_ONCE = 2_000_000


def ground_checks(
    walk: Walk,
    *,
    footprint_radius_m: float,
    max_slope_rad: float,
    max_pitch_rad: float,
    max_roll_rad: float,
    max_step_m: float,
) -> list[LimitCheck]:
    """Known ground under the whole footprint; slope, pitch and roll of the triangle under its middle; steps under it.

    A step is how far ground under the footprint departs from the plane of the triangle under its middle.
    """
    unknown, step_m = _under_footprint(walk, footprint_radius_m, wants_steps=math.isfinite(max_step_m))
    checks = [check_of(walk, PathLimit.KNOWN_GROUND, unknown, 0.0)]
    for limit, tangents, allowed in (
        (PathLimit.SLOPE, walk.slope, max_slope_rad),
        (PathLimit.PITCH, walk.along, max_pitch_rad),
        (PathLimit.ROLL, walk.across, max_roll_rad),
    ):
        angle = np.arctan(np.abs(tangents).max(axis=1))
        checks.append(check_of(walk, limit, angle, allowed, slack=ANGLE_SLACK_RAD, ignore_nan=True))
    if step_m is not None:
        checks.append(check_of(walk, PathLimit.STEP, step_m, max_step_m, slack=STEP_SLACK_M, ignore_nan=True))
    return checks


def _under_footprint(walk: Walk, radius_m: float, wants_steps: bool) -> tuple[Numbers, Numbers | None]:
    """(1 where some ground under the footprint is unknown, metres of the largest step; NaN over unknown ground)."""
    offsets = _offsets(radius_m)
    unknown, step_m = np.empty(len(walk)), np.full(len(walk), np.nan)
    batch = max(PLACES_AT_ONCE // len(offsets), 1)
    for first in range(0, len(walk), batch):
        part = slice(first, first + batch)
        places = walk.place_m[part, None, :] + offsets
        posts = _posts_within(walk.grid, walk.place_m[part], radius_m)
        if posts is not None:
            places = np.concatenate([places, posts], axis=1)
        ground_m = height_at(walk.grid, places[..., 0], places[..., 1])
        missing = np.isnan(ground_m) & ~np.isnan(places[..., 0])
        unknown[part] = missing.any(axis=1) | np.isnan(walk.gradients[part]).any(axis=(1, 2))
        if wants_steps:
            away = places - walk.place_m[part, None, :]
            for side in range(walk.gradients.shape[1]):
                plane_m = walk.ground_m[part, None] + (away * walk.gradients[part, None, side, :]).sum(axis=-1)
                apart_m = np.abs(ground_m - plane_m)
                step_m[part] = np.fmax(step_m[part], np.where(np.isnan(apart_m), 0.0, apart_m).max(axis=1))
    step_m[unknown > 0.0] = np.nan
    return unknown, step_m if wants_steps else None


def _offsets(radius_m: float) -> Numbers:
    """(k, 2) places of the footprint relative to its middle, besides the posts in it: middle and rim."""
    turn = np.linspace(0.0, 2.0 * math.pi, RIM, endpoint=False)
    rim = radius_m * np.column_stack([np.sin(turn), np.cos(turn)])
    return np.concatenate([np.zeros((1, 2)), rim]) if radius_m > 0.0 else np.zeros((1, 2))


def _posts_within(grid: ElevationGrid, place_m: Numbers, radius_m: float) -> Numbers | None:
    """(n, k, 2) the posts under each footprint, NaN where a post of the window is not; ground bends at posts."""
    if radius_m == 0.0:
        return None
    down, across = int(radius_m / grid.cell_north_m) + 1, int(radius_m / grid.cell_east_m) + 1
    row = np.rint((grid.origin_north_m - place_m[:, 1]) / grid.cell_north_m)
    col = np.rint((place_m[:, 0] - grid.origin_east_m) / grid.cell_east_m)
    rows, cols = np.mgrid[-down : down + 1, -across : across + 1].reshape(2, -1)
    east_m = grid.origin_east_m + (col[:, None] + cols) * grid.cell_east_m
    north_m = grid.origin_north_m - (row[:, None] + rows) * grid.cell_north_m
    posts = np.stack([east_m, north_m], axis=-1)
    posts[np.hypot(*(posts - place_m[:, None, :]).transpose(2, 0, 1)) > radius_m] = np.nan
    return posts
