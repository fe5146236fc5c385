"""The morphing map in time: frames as anchors move, and from when to when each place is available."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.air.morphing_maps import ColumnState, MorphingMap, check_ceiling, closed_map, morphing_map
from visibility.dilution.dop_questions import FlightLimit, geometry_fault
from visibility.dilution.sets_in_sight import sources_of_anchors
from visibility.errors import AnchorError, VisibilityInputError
from visibility.sight.anchor_tracks import MovingAnchor, anchors_at
from visibility.sight.anchors import Anchor, DistantAnchor, check_anchors
from visibility.sight.minimum_altitude import SurfaceCache

__all__ = ["Availability", "MorphingFrame", "anchors_over", "availability", "morphing_frames"]


@dataclass(frozen=True, eq=False)
class MorphingFrame:
    """The morphing map at one time, with the anchors that there were."""

    time_s: float
    anchors: tuple[Anchor | DistantAnchor, ...]
    map: MorphingMap


def morphing_frames(
    grid: ElevationGrid,
    anchors: Sequence[Anchor | DistantAnchor | MovingAnchor],
    times_s: Sequence[float],
    limit: FlightLimit,
    *,
    ceiling_m: float,
    ceiling_above_ground: bool = False,
    cache: SurfaceCache | None = None,
) -> Iterator[MorphingFrame]:
    """One morphing map after another; only anchors that moved since the frame before are recomputed.

    times_s: ascending. cache: None makes one for the grid with the fast mode; give one to choose mode, curvature and
    the posts that are answered, and to read how many surfaces were computed. All anchors are looked up at all times
    before the first frame.
    While satellites are too few or anchors pass through one line nobody can fly: such a frame is closed and warns.
    Raises VisibilityInputError (a time outside a track, times that do not ascend, anchors that fix no position at any
    time, and as morphing_map), AnchorError.
    """
    times = [float(time_s) for time_s in times_s]
    if cache is not None and cache.grid is not grid:
        raise VisibilityInputError("The surface cache belongs to another grid; make one for this grid.")
    cache = SurfaceCache(grid) if cache is None else cache
    moments = anchors_over(grid, anchors, times, limit)
    box = cache.box
    check_ceiling(box, ceiling_m, ceiling_above_ground)

    def frames() -> Iterator[MorphingFrame]:
        for time_s, here in zip(times, moments, strict=True):
            fault = geometry_fault(limit, sources_of_anchors(here))
            if fault is not None:
                why = f"At {time_s:g} s there is no fix anywhere: {fault}"
                yield MorphingFrame(time_s, here, closed_map(box, limit, ceiling_m, ceiling_above_ground, why))
                continue
            found = morphing_map(
                cache.surfaces(here), limit, ceiling_m=ceiling_m, ceiling_above_ground=ceiling_above_ground
            )
            yield MorphingFrame(time_s, here, found)

    return frames()


def anchors_over(
    grid: ElevationGrid,
    anchors: Sequence[Anchor | DistantAnchor | MovingAnchor],
    times_s: Sequence[float],
    limit: FlightLimit,
) -> list[tuple[Anchor | DistantAnchor, ...]]:
    """Who is there at each time; refuses what ``morphing_frames`` refuses of anchors, before anything is calculated.

    Raises VisibilityInputError, AnchorError.
    """
    _check_times(list(times_s))
    moments = [anchors_at(tuple(anchors), time_s) for time_s in times_s]
    for time_s, here in zip(times_s, moments, strict=True):
        try:
            if here:
                check_anchors(grid, here)
        except AnchorError as error:
            raise AnchorError(f"At {time_s:g} s: {error}") from error
    faults = [geometry_fault(limit, sources_of_anchors(here)) for here in moments]
    if all(fault is not None for fault in faults):
        raise VisibilityInputError(faults[0])
    return moments


@dataclass(frozen=True, eq=False)
class Availability:
    """From when to when each place is available; arrays (rows, cols).

    first_s, last_s: the first and last frame at which it is; longest_from_s, longest_to_s: ends of the longest run of
        frames without a break; all float64, NaN = never.
    share: float32, frames at which it is available for certain. unknown_share: frames at which that is not known.
    """

    first_s: npt.NDArray[np.float64]
    last_s: npt.NDArray[np.float64]
    longest_from_s: npt.NDArray[np.float64]
    longest_to_s: npt.NDArray[np.float64]
    share: npt.NDArray[np.float32]
    unknown_share: npt.NDArray[np.float32]


def availability(
    frames: Iterable[MorphingFrame], *, altitude_m: float | None = None, above_ground_m: float | None = None
) -> Availability:
    """From when to when each place, at one altitude or height above ground, is in flyable air up to the ceiling.

    Reads the frames once and keeps none of them. Raises VisibilityInputError unless exactly one height is given, that
    lies below the ceiling, and there is a frame.
    """
    if (altitude_m is None) == (above_ground_m is None):
        raise VisibilityInputError("Give exactly one of altitude_m and above_ground_m for availability.")
    height_m = altitude_m if altitude_m is not None else above_ground_m
    if height_m is None or not math.isfinite(height_m) or (above_ground_m is not None and height_m < 0.0):
        raise VisibilityInputError(f"Availability needs a finite height, above ground >= 0 m, not {height_m}.")
    times, run = [], None
    for frame in frames:
        available, unknown = _available(frame.map, height_m, above_ground_m is not None)
        if run is None:
            run = _Run(available.shape)
        run.add(frame.time_s, available, unknown)
        times.append(frame.time_s)
    if run is None:
        raise VisibilityInputError("Availability needs at least one frame.")
    _check_times(times)
    return run.summary(len(times))


def _available(
    found: MorphingMap, height_m: float, above_ground: bool
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """(flyable for certain, not known) of each post at a height."""
    ground_m = found.grid.heights_m
    here_m = ground_m + height_m if above_ground else np.full(ground_m.shape, height_m)
    ceiling_m = ground_m + found.ceiling_m if found.ceiling_above_ground else np.full(ground_m.shape, found.ceiling_m)
    # float32 altitudes, so a height above ground meets the ground that it was added to
    inside = (here_m >= ground_m) & (here_m <= ceiling_m)
    available = inside & (here_m >= found.safe_above_m)
    unknown = (found.state == ColumnState.UNKNOWN) & ~available & (inside | np.isnan(ground_m))
    return available, unknown


class _Run:
    """Runs of frames at which each post is available, as frames come in."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.first_s, self.last_s = np.full(shape, np.nan), np.full(shape, np.nan)
        self.from_s = np.full(shape, np.nan)  # of the run that goes on
        self.longest_from_s, self.longest_to_s = np.full(shape, np.nan), np.full(shape, np.nan)
        self.available, self.unknown = np.zeros(shape, np.int32), np.zeros(shape, np.int32)

    def add(self, time_s: float, available: npt.NDArray[np.bool_], unknown: npt.NDArray[np.bool_]) -> None:
        self.available += available
        self.unknown += unknown
        self.first_s[available & np.isnan(self.first_s)] = time_s
        self.last_s[available] = time_s
        self.from_s[~available] = np.nan
        self.from_s[available & np.isnan(self.from_s)] = time_s
        longest_s = np.where(np.isnan(self.longest_from_s), -1.0, self.longest_to_s - self.longest_from_s)
        longer = available & (time_s - self.from_s > longest_s)
        self.longest_from_s[longer] = self.from_s[longer]
        self.longest_to_s[longer] = time_s

    def summary(self, frames: int) -> Availability:
        return Availability(
            first_s=self.first_s,
            last_s=self.last_s,
            longest_from_s=self.longest_from_s,
            longest_to_s=self.longest_to_s,
            share=(self.available / frames).astype(np.float32),
            unknown_share=(self.unknown / frames).astype(np.float32),
        )


def _check_times(times_s: list[float]) -> None:
    if not times_s:
        raise VisibilityInputError("At least one time is needed.")
    if not np.isfinite(times_s).all() or (np.diff(times_s) <= 0.0).any():
        raise VisibilityInputError("Times must be finite and ascend.")
