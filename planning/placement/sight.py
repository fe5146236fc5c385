"""Which candidate sees which target: one packed bit each, worked out once, in parcels that can go anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from planning.kernels.placement_bits import keep_in_range
from terrain import ElevationGrid
from visibility import VISIBLE, Anchor, Curvature, min_visible_altitude, visible_sets
from visibility.sight import SightDoubt, doubted
from visibility.sight.in_reach import Raster
from visibility.signal import Radio, reception

from .targets import Targets

__all__ = [
    "Parcel",
    "SightOptions",
    "SightTable",
    "enter",
    "forget_doubted",
    "neighbours",
    "parcel_bits",
    "parcels",
    "positions_of",
    "sampled_table",
    "window_within",
]

Bits = npt.NDArray[np.uint64]
Floats = npt.NDArray[np.float64]

# anchors whose surfaces are in memory at once
ANCHORS_AT_ONCE = 16
BYTES_AT_ONCE = 400_000_000
BYTES_PER_POST = 9
MOST_OF_GRID = 0.7  # a window larger than this saves nothing
LINES_PER_POST = 1 / 250  # a sight line costs about as much as a sweep over 250 posts


@dataclass(frozen=True, slots=True)
class SightOptions:
    """How sight is worked out; sight over unknown ground never counts as sight.

    max_range_m: longest slant range that is measured. curvature: None = as the grid's CRS implies.
    radio: of anchors that are placed: their signals decide then, in place of sight.
    """

    mode: Literal["fast", "exact"] = "fast"
    curvature: Curvature | None = None
    max_range_m: float = math.inf
    unknown: Literal["unknown", "open"] = "unknown"
    radio: Radio | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SightTable:
    """Sight of n anchors and m targets. bits: (n, words) uint64, bit i % 64 of word i // 64 = sees target i."""

    bits: Bits
    targets: int

    def visible(self, which: slice | list[int] | npt.NDArray[np.intp] = slice(None)) -> npt.NDArray[np.bool_]:
        """(rows, m) bool of some rows."""
        rows = np.ascontiguousarray(self.bits[which]).astype("<u8").view(np.uint8)
        return np.unpackbits(rows, axis=-1, bitorder="little")[..., : self.targets].astype(np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class Parcel:
    """A piece of the work, whole in itself: it can be done anywhere.

    rows: of its anchors in the whole table. position_m: (n, 3). grid: as much ground as the anchors reach over.
    targets: those in reach; which: their numbers among all, None = all of them.
    """

    rows: npt.NDArray[np.intp]
    position_m: Floats
    grid: ElevationGrid
    targets: Targets
    which: npt.NDArray[np.intp] | None
    options: SightOptions


def positions_of(anchors: Sequence[Anchor]) -> Floats:
    """(n, 3) east, north, altitude, metres."""
    return np.array([(a.east_m, a.north_m, a.altitude_m) for a in anchors], np.float64).reshape(-1, 3)


def parcels(
    grid: ElevationGrid, targets: Targets, position_m: Floats, options: SightOptions
) -> list[Callable[[], Parcel]]:
    """The work in parcels that are small enough for memory, each made when it is called for.

    Neighbours share a parcel, so that with a range limit each needs only a window of the ground; the parcels come in an
    order that soon touches all of the ground, for when the work is stopped early.
    """
    pieces = neighbours(position_m, grid.heights_m.size)
    return [partial(_parcel, grid, targets, position_m, options, piece) for piece in pieces]


def neighbours(position_m: Floats, posts: int) -> list[npt.NDArray[np.intp]]:
    """Numbers of anchors in pieces of neighbours, as many as may have surfaces of so many posts in memory at once."""
    size = min(ANCHORS_AT_ONCE, max(int(BYTES_AT_ONCE / (BYTES_PER_POST * posts)), 1))
    order = _near_each_other(position_m, size)
    pieces = [order[start : start + size] for start in range(0, len(order), size)]
    return [pieces[number] for number in np.random.default_rng(20_260_502).permutation(len(pieces))]


def _near_each_other(position_m: Floats, size: int) -> npt.NDArray[np.intp]:
    """Anchors strip by strip, to and fro, so that any ``size`` in a row are neighbours."""
    if len(position_m) == 0:
        return np.zeros(0, np.intp)
    low_m, high_m = position_m[:, :2].min(axis=0), position_m[:, :2].max(axis=0)
    width_m = math.sqrt(max(float(np.prod(high_m - low_m)), 1.0) * size / len(position_m))
    strip = ((position_m[:, 1] - low_m[1]) / width_m).astype(np.intp)
    along_m = np.where(strip % 2 == 0, position_m[:, 0], -position_m[:, 0])
    return np.lexsort((position_m[:, 2], along_m, strip))


def _parcel(
    grid: ElevationGrid, targets: Targets, position_m: Floats, options: SightOptions, rows: npt.NDArray[np.intp]
) -> Parcel:
    place_m = position_m[rows]
    window = window_within(grid, place_m, options.max_range_m)
    if window is None:
        return Parcel(rows, place_m, grid, targets, None, options)
    top, bottom, left, right = window
    part = grid.window(top, bottom - 1, left, right - 1)
    row = (grid.origin_north_m - targets.point_m[:, 1]) / grid.cell_north_m
    col = (targets.point_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    which = np.flatnonzero((row >= top) & (row <= bottom - 1) & (col >= left) & (col <= right - 1))
    inside = sampled_targets(targets, which)
    if inside.post is not None:
        whole_row, whole_col = np.divmod(inside.post, grid.cols)
        inside = replace(inside, post=(whole_row - top) * part.cols + whole_col - left)
    return Parcel(rows, place_m, part, inside, which, options)


def window_within(grid: Raster, place_m: Floats, reach_m: float) -> tuple[int, int, int, int] | None:
    """(top, bottom, left, right) of the posts within reach, ends excluded; None where that is most of the grid."""
    if not math.isfinite(reach_m):
        return None
    row, col = (
        (grid.origin_north_m - place_m[:, 1]) / grid.cell_north_m,
        (place_m[:, 0] - grid.origin_east_m) / grid.cell_east_m,
    )
    rows, cols = reach_m / grid.cell_north_m + 1.0, reach_m / grid.cell_east_m + 1.0
    top = int(np.clip(math.floor(row.min() - rows), 0, max(grid.rows - 2, 0)))
    left = int(np.clip(math.floor(col.min() - cols), 0, max(grid.cols - 2, 0)))
    bottom = int(np.clip(math.ceil(row.max() + rows) + 1, min(top + 2, grid.rows), grid.rows))
    right = int(np.clip(math.ceil(col.max() + cols) + 1, min(left + 2, grid.cols), grid.cols))
    if (bottom - top) * (right - left) > MOST_OF_GRID * grid.rows * grid.cols:
        return None
    return top, bottom, left, right


def parcel_bits(parcel: Parcel) -> Bits:
    """(n, words) sight of a parcel's anchors and targets. Raises AnchorError.

    A few points are asked line by line, which is exact, and all where signals decide; many by the surfaces of minimum
    visible altitude.
    """
    grid, targets, options = parcel.grid, parcel.targets, parcel.options
    if len(targets) == 0:
        return np.zeros((len(parcel.rows), 1), np.uint64)
    few = options.mode == "exact" or len(targets) < grid.heights_m.size * LINES_PER_POST
    if options.radio is not None or (targets.post is None and few):
        return pack(_lines(parcel))
    anchors = [
        Anchor(f"{row}", east_m, north_m, altitude_m)
        for row, (east_m, north_m, altitude_m) in zip(parcel.rows.tolist(), parcel.position_m.tolist(), strict=True)
    ]
    surfaces = min_visible_altitude(grid, anchors, options.mode, options.curvature, unknown=options.unknown)
    if targets.post is None:
        seen = visible_sets(surfaces, targets.point_m).visible().T.copy()
    else:
        seen = surfaces.visible(above_ground_m=targets.above_ground_m).reshape(len(anchors), -1)[:, targets.post] == 1
    if math.isfinite(options.max_range_m):
        # picked columns lie in an order of their own, which would be another type to the kernel
        seen = np.ascontiguousarray(seen)
        # all anchors at once: limits of their antennas would be a kernel call each
        keep_in_range(seen, parcel.position_m, targets.point_m, options.max_range_m, surfaces.curvature.drop_per_m2)
    return pack(seen)


def _lines(parcel: Parcel) -> npt.NDArray[np.bool_]:
    """(n, m) bool: whether each target gets each anchor, along exact lines."""
    grid, targets, options = parcel.grid, parcel.targets, parcel.options
    seen = np.zeros((len(parcel.rows), len(targets)), np.bool_)
    for number, place_m in enumerate(parcel.position_m):
        near = np.flatnonzero(((targets.point_m - place_m) ** 2).sum(axis=1) <= options.max_range_m**2)
        if len(near):
            from_m = np.broadcast_to(place_m, (len(near), 3))
            got = reception(
                *(grid, from_m, targets.point_m[near], options.radio),
                curvature=options.curvature,
                unknown=options.unknown,
            )
            seen[number, near] = got.verdict == VISIBLE
    return seen


def pack(seen: npt.NDArray[np.bool_]) -> Bits:
    """(n, m) bool as (n, words) bits."""
    packed = np.packbits(seen, axis=1, bitorder="little")
    words = max((seen.shape[1] + 63) // 64, 1)
    padded = np.zeros((len(seen), words * 8), np.uint8)
    padded[:, : packed.shape[1]] = packed
    return padded.view("<u8").astype(np.uint64)


def forget_doubted(bits: Bits, doubts: Sequence[SightDoubt], targets: Targets) -> None:
    """Take from rows (n, words) of one anchor, in place, the targets where ranges denied its sight."""
    if doubts:
        bits &= pack(~doubted(doubts, targets.point_m)[None, :])


def enter(table: SightTable, parcel: Parcel, bits: Bits) -> None:
    """Write what came of a parcel into the table, in place."""
    if parcel.which is None:
        table.bits[parcel.rows] = bits
        return
    for row, part in zip(parcel.rows, bits, strict=True):
        seen = np.zeros((1, table.targets), np.bool_)
        seen[0, parcel.which] = SightTable(part[None, :], len(parcel.which)).visible()[0]
        table.bits[row] = pack(seen)[0]


def sampled_table(table: SightTable, which: npt.NDArray[np.intp]) -> SightTable:
    """The same for some of the targets."""
    bits = np.zeros((len(table.bits), max((len(which) + 63) // 64, 1)), np.uint64)
    for row in range(len(bits)):  # one by one: unpacked, all of them would not fit
        bits[row] = pack(table.visible([row])[:, which])[0]
    return SightTable(bits, len(which))


def sampled_targets(targets: Targets, which: npt.NDArray[np.intp]) -> Targets:
    """Some of the targets."""
    return replace(
        targets,
        point_m=np.ascontiguousarray(targets.point_m[which]),
        weight=np.ascontiguousarray(targets.weight[which]),
        post=None if targets.post is None else targets.post[which],
        normal=np.ascontiguousarray(targets.normal[which]),
    )
