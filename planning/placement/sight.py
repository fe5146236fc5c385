"""Which candidate sees which target: one packed bit each, worked out once, in parcels that can go anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import VISIBLE, Anchor, AntennaLimits, Curvature, lines_of_sight, min_visible_altitude, visible_sets

from .targets import Targets

__all__ = ["Parcel", "SightOptions", "SightTable", "parcel_bits", "parcels", "sampled_table"]

Bits = npt.NDArray[np.uint64]
Floats = npt.NDArray[np.float64]

# anchors whose surfaces are in memory at once
ANCHORS_AT_ONCE = 16
BYTES_AT_ONCE = 400_000_000
BYTES_PER_POST = 9
LINES_PER_POST = 1 / 250  # a sight line costs about as much as a sweep over 250 posts


@dataclass(frozen=True, slots=True)
class SightOptions:
    """How sight is worked out; sight over unknown ground never counts as sight.

    max_range_m: longest slant range that is measured. curvature: None = as the grid's CRS implies.
    """

    mode: Literal["fast", "exact"] = "fast"
    curvature: Curvature | None = None
    max_range_m: float = math.inf
    unknown: Literal["unknown", "open"] = "unknown"


@dataclass(frozen=True, slots=True, eq=False)
class SightTable:
    """Sight of n anchors and m targets. bits: (n, words) uint64, bit i % 64 of word i // 64 = sees target i."""

    bits: Bits
    targets: int

    def visible(self, which: npt.ArrayLike | slice = slice(None)) -> npt.NDArray[np.bool_]:
        """(rows, m) bool of some rows."""
        rows = np.ascontiguousarray(self.bits[which]).astype("<u8").view(np.uint8)  # type: ignore[index]
        return np.unpackbits(rows, axis=-1, bitorder="little")[..., : self.targets].astype(np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class Parcel:
    """A piece of the work: anchors (n, 3) and their rows in the whole table."""

    rows: npt.NDArray[np.intp]
    position_m: Floats


def parcels(grid: ElevationGrid, position_m: Floats) -> Iterator[Parcel]:
    """Anchors in parcels small enough for memory; the same ones wherever they are worked out."""
    fit = max(int(BYTES_AT_ONCE / (BYTES_PER_POST * grid.heights_m.size)), 1)
    size = min(ANCHORS_AT_ONCE, fit)
    for start in range(0, len(position_m), size):
        rows = np.arange(start, min(start + size, len(position_m)))
        yield Parcel(rows, position_m[rows])


def parcel_bits(grid: ElevationGrid, targets: Targets, options: SightOptions, parcel: Parcel) -> Bits:
    """(n, words) sight of the anchors of a parcel. Raises AnchorError.

    A few points are asked line by line, which is exact; many by the surfaces of minimum visible altitude.
    """
    if targets.post is None and (options.mode == "exact" or len(targets) < grid.heights_m.size * LINES_PER_POST):
        return pack(_lines(grid, targets, options, parcel))
    limits = AntennaLimits(max_range_m=options.max_range_m)
    anchors = [
        Anchor(f"{row}", east_m, north_m, altitude_m, limits=limits)
        for row, (east_m, north_m, altitude_m) in zip(parcel.rows.tolist(), parcel.position_m.tolist(), strict=True)
    ]
    surfaces = min_visible_altitude(grid, anchors, options.mode, options.curvature, unknown=options.unknown)
    if targets.post is None:
        return pack(visible_sets(surfaces, targets.point_m).visible().T)
    seen = surfaces.visible(above_ground_m=targets.above_ground_m).reshape(len(anchors), -1)
    if len(targets.post) < seen.shape[1]:
        seen = seen[:, targets.post]
    return pack(seen == 1)


def _lines(grid: ElevationGrid, targets: Targets, options: SightOptions, parcel: Parcel) -> npt.NDArray[np.bool_]:
    """(n, m) bool: sight of each target from each anchor, along exact lines."""
    seen = np.zeros((len(parcel.rows), len(targets)), np.bool_)
    for number, place_m in enumerate(parcel.position_m):
        near = np.flatnonzero(((targets.point_m - place_m) ** 2).sum(axis=1) <= options.max_range_m**2)
        if len(near):
            from_m = np.broadcast_to(place_m, (len(near), 3))
            sight = lines_of_sight(
                grid, from_m, targets.point_m[near], curvature=options.curvature, unknown=options.unknown
            )
            seen[number, near] = sight.verdict == VISIBLE
    return seen


def pack(seen: npt.NDArray[np.bool_]) -> Bits:
    """(n, m) bool as (n, words) bits."""
    packed = np.packbits(seen, axis=1, bitorder="little")
    words = max((seen.shape[1] + 63) // 64, 1)
    padded = np.zeros((len(seen), words * 8), np.uint8)
    padded[:, : packed.shape[1]] = packed
    return padded.view("<u8").astype(np.uint64)


def sight_table(
    grid: ElevationGrid,
    targets: Targets,
    position_m: Floats,
    options: SightOptions,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> tuple[SightTable, int]:
    """(table of all anchors (n, 3), how many rows were worked out before ``stop`` said so)."""
    bits = np.zeros((len(position_m), max((len(targets) + 63) // 64, 1)), np.uint64)
    done = 0
    for parcel in parcels(grid, position_m):
        if stop is not None and stop():
            break
        bits[parcel.rows] = parcel_bits(grid, targets, options, parcel)
        done += len(parcel.rows)
        if progress is not None:
            progress(done / len(position_m))
    return SightTable(bits[:done], len(targets)), done


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
