"""Which anchors a walk gets, by exact lines from where each anchor is when the rover is there: sight, or its signal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import shapely

from terrain import ElevationGrid
from visibility import (
    HIDDEN,
    VISIBLE,
    Anchor,
    AntennaLimits,
    Curvature,
    DistantAnchor,
    MovingAnchor,
    VisibilityInputError,
    dop,
)
from visibility.dilution import DopKind
from visibility.signal import reception

__all__ = ["AnyAnchor", "SightAlong", "dilution_along", "sight_along"]

Numbers = npt.NDArray[np.float64]
AnyAnchor = Anchor | DistantAnchor | MovingAnchor
UnknownGround = Literal["unknown", "open", "blocked"]

REACH_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class SightAlong:
    """What n antennas see of k anchors.

    antenna_m: (n, 3). seen: (n, k) bool, in sight for certain. margin_m: (n, k) clearance of the sight line, NaN where
    unknown ground decides and -inf where the anchor's antenna does not reach or it is not there.
    sources_m: (n, k, 3) position of each near anchor, unit direction to each distant one; distant: (k,) which.
    """

    antenna_m: Numbers
    seen: npt.NDArray[np.bool_]
    margin_m: Numbers
    sources_m: Numbers
    distant: npt.NDArray[np.bool_]

    @property
    def count(self) -> npt.NDArray[np.int64]:
        """(n,) anchors in sight for certain."""
        number: npt.NDArray[np.int64] = self.seen.sum(axis=1, dtype=np.int64)
        return number


def sight_along(
    grid: ElevationGrid,
    antenna_m: Numbers,
    time_s: Numbers,
    anchors: Sequence[AnyAnchor],
    curvature: Curvature,
    unknown: UnknownGround = "unknown",
) -> SightAlong:
    """Exact sight of antennas (n, 3) at times (n,); one over unknown ground (NaN altitude) sees nothing."""
    n, k = len(antenna_m), len(anchors)
    seen, margin_m = np.zeros((n, k), np.bool_), np.full((n, k), -np.inf)
    sources_m, distant = np.zeros((n, k, 3)), np.zeros(k, np.bool_)
    stands = np.isfinite(antenna_m).all(axis=1)
    for number, anchor in enumerate(anchors):
        one, is_there, places = _along(anchor, time_s)
        there = np.flatnonzero(stands & is_there)
        if len(there) == 0:
            continue
        distant[number] = isinstance(one, DistantAnchor)
        # where there is none, those of the next moment when there is
        known = np.minimum(np.searchsorted(there, np.arange(n)), len(there) - 1)
        ends_m = places[there]
        sources_m[:, number] = ends_m[known]
        if distant[number]:
            ends_m = _beyond_the_grid(grid, ends_m, antenna_m[there], curvature)
        radio = one.radio if isinstance(one, Anchor) else None
        lines = reception(
            *(grid, ends_m, antenna_m[there], radio), curvature=curvature, unknown=unknown, clearance=True
        )
        assert lines.clearance_m is not None, "it was asked for"
        reached = np.ones(len(there), np.bool_)
        if isinstance(one, Anchor):
            reached = _within_reach(one.limits, ends_m, antenna_m[there], curvature)
        seen[there, number] = reached & (lines.verdict == VISIBLE)
        decided = (lines.verdict == VISIBLE) | (lines.verdict == HIDDEN)
        if isinstance(one, Anchor) and one.doubts:
            trusted = ~_is_doubted(one, antenna_m[there])
            seen[there, number] &= trusted
            decided &= trusted | (lines.verdict == HIDDEN)
        margin_m[there, number] = np.where(reached, np.where(decided, lines.clearance_m, np.nan), -np.inf)
    return SightAlong(antenna_m, seen, margin_m, sources_m, distant)


def dilution_along(
    sight: SightAlong, kind: DopKind, measure: str, normals: Numbers | None = None
) -> npt.NDArray[np.float64]:
    """(n,) dilution of what is in sight for certain; +inf = no fix, NaN over unknown ground.

    normals: (n, 3) of the ground, where the rover is bound to it.
    """
    found = np.full(len(sight.antenna_m), np.nan)
    known = np.isfinite(sight.antenna_m).all(axis=1)
    if normals is not None:
        known &= np.isfinite(normals).all(axis=1)
    stands = np.flatnonzero(known)
    still = bool((sight.sources_m == sight.sources_m[:1]).all())
    for numbers in [stands] if still else stands[:, None]:
        answer = dop(
            sight.sources_m[numbers[0]] if len(numbers) else sight.sources_m[0],
            sight.antenna_m[numbers],
            kind,
            visible=sight.seen[numbers],
            surface_normal=None if normals is None else normals[numbers],
            distant=sight.distant,
        )
        found[numbers] = getattr(answer, measure)
    return found


def _along(anchor: AnyAnchor, time_s: Numbers) -> tuple[Anchor | DistantAnchor | None, npt.NDArray[np.bool_], Numbers]:
    """(the anchor while it is there, at which of n moments that is, its ``_source`` then (n, 3), else NaN)."""
    if isinstance(anchor, Anchor | DistantAnchor):
        return anchor, np.ones(len(time_s), np.bool_), np.tile(_source(anchor), (len(time_s), 1))
    states = [_state(anchor, moment_s) for moment_s in time_s.tolist()]
    one = next((state for state in states if state is not None), None)
    places = [(math.nan,) * 3 if state is None else _source(state) for state in states]
    return one, np.array([state is not None for state in states]), np.reshape(places, (-1, 3))


def _state(anchor: MovingAnchor, moment_s: float) -> Anchor | DistantAnchor | None:
    try:
        return anchor.at(moment_s)
    except VisibilityInputError:  # nothing is known of it beyond its track, so nobody may count on it
        return None


def _is_doubted(anchor: Anchor, antenna_m: Numbers) -> npt.NDArray[np.bool_]:
    """(n,) whether ranges have denied the anchor's sight near an antenna, more likely than not."""
    found = np.zeros(len(antenna_m), np.bool_)
    for doubt in anchor.doubts:
        if doubt.has_sight:
            stretch = shapely.LineString(doubt.places_m) if len(doubt.places_m) > 1 else shapely.Point(doubt.places_m)
            off_m = shapely.distance(stretch, shapely.points(antenna_m[:, :2]))
            found |= doubt.probability * np.exp(-((off_m / doubt.reach_m) ** 2) / 2.0) > 0.5
    return found


def _source(state: Anchor | DistantAnchor) -> tuple[float, float, float]:
    if isinstance(state, DistantAnchor):
        flat = math.cos(state.elevation_rad)
        return flat * math.sin(state.azimuth_rad), flat * math.cos(state.azimuth_rad), math.sin(state.elevation_rad)
    return state.east_m, state.north_m, state.altitude_m


def _beyond_the_grid(grid: ElevationGrid, direction: Numbers, antenna_m: Numbers, curvature: Curvature) -> Numbers:
    """(n, 3) where rays leave the ground's box. Distant anchors see the ground lowered from the grid's middle outward.

    There a ray is straight from an antenna lowered by c·d², d from the middle; raised again by its own c·d² its end
    makes a line over the unlowered ground with the same clearance everywhere, for lines bulge by c·t(1 - t)·D².
    """
    west_m, south_m, east_m, north_m = grid.bounds_m
    middle = np.array([(west_m + east_m) / 2.0, (south_m + north_m) / 2.0])
    across_m = math.hypot(east_m - west_m, north_m - south_m)
    flat = np.hypot(direction[:, 0], direction[:, 1])
    overhead = flat < 1e-9
    run = across_m / np.where(overhead, 1.0, flat)
    run[overhead] = across_m
    ends = antenna_m + run[:, None] * direction
    lowered = [((points[:, :2] - middle) ** 2).sum(axis=1) * curvature.drop_per_m2 for points in (antenna_m, ends)]
    ends[:, 2] += lowered[1] - lowered[0]
    return ends


def _within_reach(
    limits: AntennaLimits, source_m: Numbers, antenna_m: Numbers, curvature: Curvature
) -> npt.NDArray[np.bool_]:
    """(n,) whether antennas are within what an anchor's own antenna reaches, terrain apart."""
    east_m, north_m, up_m = (antenna_m - source_m).T
    flat_m = np.hypot(east_m, north_m)
    up_m = up_m - curvature.drop_per_m2 * flat_m**2
    range_m, elevation_rad = np.hypot(flat_m, up_m), np.arctan2(up_m, flat_m)
    slack_m = REACH_SLACK * range_m
    within = (range_m >= limits.min_range_m - slack_m) & (range_m <= limits.max_range_m + slack_m)
    within &= (elevation_rad >= limits.min_elevation_rad - REACH_SLACK) & (
        elevation_rad <= limits.max_elevation_rad + REACH_SLACK
    )
    if limits.azimuth_from_rad is not None and limits.azimuth_to_rad is not None:
        width = limits.azimuth_to_rad - limits.azimuth_from_rad
        if not 0.0 < width <= 2.0 * math.pi + REACH_SLACK:
            width %= 2.0 * math.pi
        turned = (np.arctan2(east_m, north_m) - limits.azimuth_from_rad) % (2.0 * math.pi)
        within &= (turned <= width + REACH_SLACK) | (turned >= 2.0 * math.pi - REACH_SLACK) | (flat_m == 0.0)
    result: npt.NDArray[np.bool_] = within
    return result
