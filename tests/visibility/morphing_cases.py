"""Anchors over small hills for the tests of morphing maps, and the comparison of a map with a scan of its columns."""

import math

import numpy as np

from tests.reference.column_scan import dilution_of, runs, seen_at
from tests.visibility.grounds import hills
from visibility import Anchor, DistantAnchor
from visibility.air.morphing_maps import ColumnState

STEP_M = 0.05
TOLERANCE_M = 0.1
THIN_M = 0.15  # of which a scan may see one sample or two


def low_anchors(count=6, seed=5, size=9, **more):
    """(grid, anchors, ceiling): hills with anchors among and just over them, so that columns pass their planes."""
    grid = hills(size)
    rng = np.random.default_rng(seed)
    west_m, south_m, east_m, north_m = grid.bounds_m
    top_m = float(np.nanmax(grid.heights_m))
    anchors = tuple(
        Anchor(
            f"A{n}", rng.uniform(west_m, east_m), rng.uniform(south_m, north_m), top_m + rng.uniform(5.0, 90.0), **more
        )
        for n in range(count)
    )
    return grid, anchors, top_m + 150.0


def satellites(count, seed, lowest_rad=0.15):
    """Distant anchors all over the sky."""
    rng = np.random.default_rng(seed)
    return tuple(
        DistantAnchor(f"S{n}", rng.uniform(0.0, 2.0 * math.pi), math.asin(rng.uniform(math.sin(lowest_rad), 1.0)))
        for n in range(count)
    )


def as_rows(anchors):
    """(rows, distant, limits) of anchors as the oracle takes them."""
    rows, distant, limits = [], [], []
    for anchor in anchors:
        distant.append(isinstance(anchor, DistantAnchor))
        if distant[-1]:
            across, azimuth = math.cos(anchor.elevation_rad), anchor.azimuth_rad
            rows.append((across * math.sin(azimuth), across * math.cos(azimuth), math.sin(anchor.elevation_rad)))
            limits.append(None)
        else:
            rows.append((anchor.east_m, anchor.north_m, anchor.altitude_m))
            steepest = anchor.limits.max_elevation_rad
            tangent = math.inf if steepest >= math.pi / 2 else math.tan(steepest)
            limits.append((anchor.limits.min_range_m, anchor.limits.max_range_m, tangent))
    return np.array(rows), np.array(distant), limits


class Column:
    """One column of a map, and what its definition says at any altitude."""

    def __init__(self, surfaces, found, row, col):
        self.lowest_m = surfaces.altitude_m[:, row, col].astype(float)
        self.rows, self.distant, self.limits = as_rows(surfaces.anchors)
        self.place = found.grid.position_of(row, col)
        self.limit = found.limit
        self.ground_m = float(found.grid.heights_m[row, col])
        self.ceiling_m = found.ceiling_m + (self.ground_m if found.ceiling_above_ground else 0.0)
        self.altitude_m = float(found.altitude_m[row, col])
        self.state = ColumnState(found.state[row, col])
        self.intervals = int(found.no_flight_intervals[row, col])

    def flyable(self, altitudes_m):
        altitudes_m = np.atleast_1d(np.asarray(altitudes_m, float))
        seen = seen_at(altitudes_m, self.lowest_m, self.rows, self.distant, self.place, self.limits)
        dop = dilution_of(altitudes_m, seen, self.rows, self.distant, self.place, self.limit.kind, self.limit.measure)
        return (dop < self.limit.dop_limit) & (seen.sum(axis=1) >= self.limit.needed_anchors)

    def check(self):
        """Compare with a scan; returns the number of no-flight intervals where all are thick enough to count."""
        altitudes_m = np.arange(self.ground_m + 1e-4, self.ceiling_m, STEP_M)
        flyable = self.flyable(altitudes_m)
        blocked = runs(~flyable)
        if self.state == ColumnState.NOWHERE:
            assert not flyable.any()
        elif self.state == ColumnState.CLOSED_AT_CEILING:
            assert flyable.any()
            assert not flyable[-1] or not self.flyable(np.linspace(altitudes_m[-1], self.ceiling_m, 50)).all()
        else:
            highest_m = altitudes_m[blocked[-1][1] - 1] if blocked else self.ground_m
            assert highest_m <= self.altitude_m + TOLERANCE_M
            if self.altitude_m > highest_m + TOLERANCE_M:
                # between two samples: look closer than the scan does
                just_below_m = self.altitude_m - np.linspace(0.0, STEP_M, 500)
                assert not self.flyable(just_below_m).all()
        thick = [altitudes_m[stop - 1] - altitudes_m[start] > THIN_M for start, stop in (*blocked, *runs(flyable))]
        if all(thick):
            assert self.intervals == len(blocked)
            return len(blocked)
        return None


def check_all(surfaces, found):
    """Compare every column; returns the interval counts that could be compared."""
    rows, cols = found.grid.shape
    counts = [Column(surfaces, found, row, col).check() for row in range(rows) for col in range(cols)]
    return [count for count in counts if count is not None]
