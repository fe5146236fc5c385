"""Usable in place of visible: the lowest altitude over every post at which enough of an anchor's signal arrives."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.sight.anchors import Anchor, DistantAnchor, raise_to_reach
from visibility.sight.curvature import Curvature
from visibility.sight.doubts import forget_where_doubted
from visibility.sight.minimum_altitude import MinimumVisibleAltitude, Mode, UnknownGround, min_visible_altitude
from visibility.sight.radios import Radio, free_space_loss_db
from visibility.sight.roofs import roof_heights
from visibility.signal.foliage import foliage_of
from visibility.signal.links import signals

__all__ = ["ALTITUDE_STEP_M", "margin_map", "min_usable_altitude"]

Reals = npt.NDArray[np.float64]
Heights = npt.NDArray[np.float32]

ALTITUDE_STEP_M = 0.1
# above what is in sight and above the crowns a signal is looked for at so many times the height
STEPS_UP = (1.0, 4.0, 16.0)
POSTS_AT_ONCE = 1_000_000
SHARE_OF_SIGHT = 0.1
TRUNCATION = 0.2


def min_usable_altitude(
    grid: ElevationGrid,
    anchors: Sequence[Anchor | DistantAnchor],
    mode: Mode = "fast",
    curvature: Curvature | None = None,
    *,
    unknown: UnknownGround = "unknown",
    progress: Callable[[float], None] | None = None,
    only_above_ground_m: float | None = None,
) -> MinimumVisibleAltitude:
    """The same as ``min_visible_altitude``, but where an anchor has a radio its signal decides, not sight.

    Over each post that is the lowest altitude from the ground or roof up at which ``signals`` has a margin of 0 dB, to
    0.1 m between an altitude with too little and one above it with enough (``first_enough``). Signals grow with
    altitude but for free space, so that above it an anchor is taken as usable up to its antenna's limits. +inf: at no
    altitude that was looked at.
    only_above_ground_m: receivers are at this height and no other, which takes a fraction of the time: of an anchor
    with a radio the altitude is that of the ground where it is usable from there, +inf where not.
    Raises AnchorError, VisibilityInputError, SignalError.
    """
    started_s = time.perf_counter()
    share = None if progress is None else lambda done: progress(SHARE_OF_SIGHT * done)
    heard = [
        (number, one, one.radio)
        for number, one in enumerate(anchors)
        if isinstance(one, Anchor) and one.radio is not None
    ]
    found = min_visible_altitude(grid, anchors, mode, curvature, unknown=unknown, progress=share if heard else progress)
    if not heard:
        return found
    altitude_m, hidden_below_m = found.altitude_m.copy(), found.hidden_below_m.copy()
    for done, (number, anchor, radio) in enumerate(heard):
        if only_above_ground_m is None:
            lowest_m = _lowest(grid, anchor, radio, found.altitude_m[number], found.curvature, unknown)
        else:
            receiver_m = grid.heights_m + np.float32(only_above_ground_m)
            margin_db, _ = margin_map(grid, anchor, radio, receiver_m, found.curvature, unknown=unknown)
            usable_m = np.where(margin_db >= 0.0, grid.heights_m, np.float32(np.inf))
            lowest_m = np.where(np.isnan(margin_db), np.float32(np.nan), usable_m)
        raise_to_reach(grid, anchor, found.curvature, lowest_m)
        forget_where_doubted(grid, anchor.doubts, lowest_m)
        altitude_m[number] = lowest_m
        hidden_below_m[number] = np.where(np.isnan(lowest_m), -np.inf, lowest_m)
        if progress is not None:
            progress(SHARE_OF_SIGHT + (1.0 - SHARE_OF_SIGHT) * (done + 1) / len(heard))
    elapsed_s = time.perf_counter() - started_s
    return replace(
        found,
        altitude_m=altitude_m,
        hidden_below_m=hidden_below_m,
        elapsed_s=elapsed_s,
        of_signals=len(heard) == len(anchors),
    )


def margin_map(
    grid: ElevationGrid,
    anchor: Anchor,
    radio: Radio,
    receiver_m: Heights,
    curvature: Curvature | None = None,
    *,
    unknown: UnknownGround = "unknown",
) -> tuple[Heights, tuple[str, ...]]:
    """((rows, cols) margin in dB of links from an anchor to receivers at altitudes (rows, cols), what to know of them).

    NaN where the altitude or the signal is not known. The antenna's limits are not looked at. Raises SignalError.
    """
    posts = np.flatnonzero(np.isfinite(receiver_m.ravel()))
    margin_db = np.full(receiver_m.size, np.nan, np.float32)
    at_m = receiver_m.ravel()[posts].astype(np.float64)
    margin_db[posts], notes = _margins(grid, anchor, radio, posts, at_m, curvature, unknown)
    return margin_db.reshape(receiver_m.shape), notes


def _lowest(
    grid: ElevationGrid, anchor: Anchor, radio: Radio, clear_m: Heights, curvature: Curvature, unknown: UnknownGround
) -> Heights:
    """(rows, cols) the lowest usable altitude; NaN where it is not known, +inf where there is none."""
    ground_m = np.maximum(grid.heights_m, roof_heights(grid)).ravel().astype(np.float64)
    posts = np.flatnonzero(~np.isnan(ground_m))
    rows, cols = np.divmod(posts, grid.cols)
    east_m, north_m = grid.position_of(rows.astype(np.float64), cols.astype(np.float64))
    flat_m = np.hypot(east_m - anchor.east_m, north_m - anchor.north_m)
    near = free_space_loss_db(flat_m, radio.frequency_hz) <= radio.allowed_loss_db
    lowest_m = np.full(ground_m.shape, np.inf)
    lowest_m[np.isnan(ground_m)] = np.nan
    posts, flat_m = posts[near], flat_m[near]
    low_m = ground_m[posts]
    margin_db, _ = _margins(grid, anchor, radio, posts, low_m, curvature, unknown)
    lowest_m[posts] = np.where(np.isnan(margin_db), np.nan, np.where(margin_db >= 0.0, low_m, np.inf))
    less = margin_db < 0.0
    posts, low_m, flat_m = posts[less], low_m[less], flat_m[less]
    foliage = foliage_of(grid)
    crowns_m = 0.0 if foliage is None else float(np.nanmax(foliage.canopy.top_m, initial=0.0))
    sight_m = clear_m.ravel()[posts].astype(np.float64)
    over_m = np.where(np.isfinite(sight_m), np.maximum(sight_m - low_m, 0.0), 0.0)
    over_m += crowns_m + np.sqrt(radio.wavelength_m * flat_m) / 2.0 + 1.0
    high_m, enough = low_m + over_m, np.zeros(len(posts), np.bool_)
    low_db, high_db = margin_db[less], np.full(len(posts), np.nan)
    for step in STEPS_UP:
        open_ = np.flatnonzero(~enough)
        high_m[open_] = low_m[open_] + step * over_m[open_]
        margin_db, _ = _margins(grid, anchor, radio, posts[open_], high_m[open_], curvature, unknown)
        enough[open_], high_db[open_] = margin_db >= 0.0, margin_db
        too_low = open_[margin_db < 0.0]
        low_m[too_low], low_db[too_low] = high_m[too_low], high_db[too_low]
    posts = posts[enough]

    def margins(which: npt.NDArray[np.intp], at_m: Reals) -> Reals:
        return _margins(grid, anchor, radio, posts[which], at_m, curvature, unknown)[0]

    lowest_m[posts] = first_enough((low_m[enough], high_m[enough]), (low_db[enough], high_db[enough]), margins)
    return lowest_m.reshape(grid.shape).astype(np.float32)


def first_enough(
    between_m: tuple[Reals, Reals],
    margins_db: tuple[Reals, Reals],
    margins: Callable[[npt.NDArray[np.intp], Reals], Reals],
) -> Reals:
    """(n,) altitudes with a margin >= 0, no more than 0.1 m above one with less.

    between_m, margins_db: (n,) altitudes with too little and with enough, and their margins. margins: asked for the
    margins (m,) of some of them at altitudes (m,). Interpolates, truncates and projects, so that it never takes more
    than a step beyond what halving would (Oliveira and Takahashi, ACM TOMS 47, 2020: ITP).
    """
    (low_m, high_m), (low_db, high_db) = ((first.copy(), second.copy()) for first, second in (between_m, margins_db))
    wide_m = np.maximum(high_m - low_m, ALTITUDE_STEP_M)
    halvings = np.ceil(np.log2(wide_m / ALTITUDE_STEP_M))
    for step in range(int(halvings.max(initial=0.0)) + 2):
        left = np.flatnonzero(high_m - low_m > ALTITUDE_STEP_M)
        if not len(left):
            break
        a, b, f_a, f_b = low_m[left], high_m[left], low_db[left], high_db[left]
        middle = (a + b) / 2.0
        straight = np.isfinite(f_a) & np.isfinite(f_b)
        root = np.where(straight, b - (b - a) * f_b / np.where(straight, f_b - f_a, 1.0), middle)
        toward = np.sign(middle - root)
        truncated = root + toward * np.minimum(TRUNCATION * (b - a) ** 2 / wide_m[left], np.abs(middle - root))
        spare = ALTITUDE_STEP_M / 2.0 * 2.0 ** (halvings[left] + 1.0 - step) - (b - a) / 2.0
        tried_m = np.where(np.abs(truncated - middle) <= spare, truncated, middle - toward * np.maximum(spare, 0.0))
        found_db = margins(left, tried_m)
        enough = found_db >= 0.0
        high_m[left[enough]], high_db[left[enough]] = tried_m[enough], found_db[enough]
        low_m[left[~enough]], low_db[left[~enough]] = tried_m[~enough], found_db[~enough]
    return high_m


def _margins(
    grid: ElevationGrid,
    anchor: Anchor,
    radio: Radio,
    posts: npt.NDArray[np.intp],
    at_m: Reals,
    curvature: Curvature | None,
    unknown: UnknownGround,
) -> tuple[Reals, tuple[str, ...]]:
    """((n,) margins at altitudes over posts, by their numbers, what to know of them)."""
    margin_db, notes = np.empty(len(posts)), dict[str, None]()
    for start in range(0, len(posts), POSTS_AT_ONCE):
        some = slice(start, start + POSTS_AT_ONCE)
        rows, cols = np.divmod(posts[some], grid.cols)
        east_m, north_m = grid.position_of(rows.astype(np.float64), cols.astype(np.float64))
        ends_m = np.column_stack([east_m, north_m, at_m[some]])
        anchor_m = np.broadcast_to((anchor.east_m, anchor.north_m, anchor.altitude_m), ends_m.shape)
        found = signals(grid, anchor_m, ends_m, radio, curvature=curvature, unknown=unknown)
        margin_db[some] = found.margin_db
        notes |= dict.fromkeys(found.warnings)
    return margin_db, tuple(notes)
