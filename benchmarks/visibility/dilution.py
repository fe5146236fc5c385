"""Dilution of precision: how fast it comes, and what one value per visible set costs in accuracy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table, duration
from benchmarks.terrains import CELL_M, fractal_grid, spread_anchors
from benchmarks.timing import best_of_s
from terrain import ElevationGrid, height_at
from visibility import (
    FLAT,
    Anchor,
    DistantAnchor,
    MinimumVisibleAltitude,
    dop_along,
    dop_map,
    min_visible_altitude,
    visible_sets,
)
from visibility.dilution import DopKind, dop_at_points, dop_per_visible_set

__all__ = ["SetError", "dilution_speed", "error_of_one_per_set", "one_per_set"]

GPS_DISTANCE_M = 2.02e7
CEILING_M = 1000.0
DOP_LIMIT = 2.5

SET_NOTE = """\
Rough fractal, 30 m cells, flat; points evenly through a box in its middle, from the ground to 1 km above it. Each
point's PDOP against that in the middle of all points of the box with the same visible set, where there is a fix."""


@dataclass(frozen=True, slots=True)
class SetError:
    """What one PDOP per visible set costs over a volume.

    median, p95, largest: of |PDOP of the set / PDOP of the point − 1|, over points with a fix. differing: share of all
    points that a limit of 2.5 judges otherwise. sets: distinct visible sets.
    """

    median: float
    p95: float
    largest: float
    differing: float
    sets: int


def satellites(count: int = 12, seed: int = 5) -> list[DistantAnchor]:
    """GPS-like: all round the sky from 5 degrees up, at their distance."""
    random = np.random.default_rng(seed)
    azimuth_rad = random.uniform(0.0, 2.0 * math.pi, count)
    elevation_rad = np.radians(random.uniform(5.0, 85.0, count))
    return [
        DistantAnchor(f"G{number}", float(azimuth), float(elevation), range_m=GPS_DISTANCE_M)
        for number, (azimuth, elevation) in enumerate(zip(azimuth_rad, elevation_rad, strict=True))
    ]


def drones(grid: ElevationGrid, count: int) -> list[Anchor]:
    """Anchors 10 to 300 m above ground, over known posts drawn at random."""
    return [drawn[0] for drawn in spread_anchors(grid, count)]


def error_of_one_per_set(minimum: MinimumVisibleAltitude, edge_m: float, kind: DopKind, across: int = 40) -> SetError:
    """Error over a box of so wide an edge in the middle of the ground, ``across``² · ``across`` / 2 points."""
    grid = minimum.grid
    middle_m = np.array(grid.position_of((grid.rows - 1) / 2.0, (grid.cols - 1) / 2.0))
    steps_m = (np.arange(across) + 0.5) / across * edge_m - edge_m / 2.0
    above_m = (np.arange(across // 2) + 0.5) / (across // 2) * CEILING_M
    east_m, north_m, height_m = (axis.ravel() for axis in np.meshgrid(steps_m, steps_m, above_m))
    east_m, north_m = east_m + middle_m[0], north_m + middle_m[1]
    points_m = np.column_stack([east_m, north_m, height_at(grid, east_m, north_m) + height_m])
    sets = visible_sets(minimum, points_m)
    anchors_m = [_position_m(grid, anchor) for anchor in minimum.anchors]
    each = dop_at_points(points_m, anchors_m, sets.mask, kind, unknown=sets.unknown).pdop
    shared = dop_per_visible_set(points_m, anchors_m, sets.mask, kind, unknown=sets.unknown).pdop
    both = np.isfinite(each) & np.isfinite(shared)
    error = np.abs(shared[both] / each[both] - 1.0)
    differing = float(np.mean((shared >= DOP_LIMIT) != (each >= DOP_LIMIT)))
    median, p95, largest = (float(np.quantile(error, share)) for share in (0.5, 0.95, 1.0))
    return SetError(median, p95, largest, differing, len(np.unique(sets.mask, axis=0)))


def one_per_set(posts: int = 341, across: int = 40) -> Table:
    """The shortcut of one dilution per visible set, on a 1 km and a 10 km volume."""
    grid = fractal_grid(posts)
    rows = []
    cases: tuple[tuple[str, list[Anchor | DistantAnchor], DopKind], ...] = (
        ("12 satellites, pseudorange", [*satellites()], "pseudorange"),
        ("16 drones, pseudorange", [*drones(grid, 16)], "pseudorange"),
        ("16 drones, ranging", [*drones(grid, 16)], "ranging"),
    )
    for name, anchors, kind in cases:
        minimum = min_visible_altitude(grid, anchors, "fast", FLAT)
        for edge_km in (1.0, 10.0):
            edge_m = min(edge_km * 1000.0, (posts - 1) * CELL_M)
            found = error_of_one_per_set(minimum, edge_m, kind, across)
            errors = (f"{found.median:.2%}", f"{found.p95:.2%}", f"{found.largest:.2%}", f"{found.differing:.2%}")
            rows.append(Row((name, f"{edge_km:g} km", str(found.sets), *errors)))
    columns = ("anchors", "volume", "visible sets", "median error", "p95", "largest", "judged otherwise at 2.5")
    return Table("One DOP per visible set", columns, rows, SET_NOTE)


def dilution_speed(posts: int = 1024, points: int = 200_000) -> Table:
    """Visible set and DOP along a trajectory, and the map of a rover, with the surfaces at hand."""
    grid = fractal_grid(posts)
    rows = []
    trajectory_m = _trajectory(grid, points)
    kinds: tuple[tuple[str, list[Anchor | DistantAnchor], DopKind], ...] = (
        ("12 satellites", [*satellites()], "pseudorange"),
        ("16 anchors", [*drones(grid, 16)], "ranging"),
    )
    for name, anchors, kind in kinds:
        minimum = min_visible_altitude(grid, anchors, "fast", FLAT)
        time_s = best_of_s(partial(dop_along, minimum, trajectory_m, kind))
        rate = points / time_s
        cells = (f"visible set and DOP along a trajectory, {name}", duration(time_s), f"{rate:,.0f} points/s")
        rows.append(Row(cells, "≥ 200,000 points/s", rate >= 200_000))
    minimum = min_visible_altitude(grid, drones(grid, 32), "fast", FLAT)
    time_s = best_of_s(partial(dop_map, minimum, 1.5))
    cells = (f"DOP map at rover height, 32 anchors, {posts}²", duration(time_s), f"{posts**2 / time_s:,.0f} posts/s")
    rows.append(Row(cells, "≤ 1 s", time_s <= 1.0))
    return Table("Dilution of precision, surfaces at hand", ("what", "time", "rate"), rows)


def _position_m(grid: ElevationGrid, anchor: Anchor | DistantAnchor) -> tuple[float, float, float]:
    if isinstance(anchor, DistantAnchor):
        return anchor.position_m(grid)
    return anchor.east_m, anchor.north_m, anchor.altitude_m


def _trajectory(grid: ElevationGrid, points: int) -> npt.NDArray[np.float64]:
    """(points, 3) along a flight that weaves across the ground, 50 to 150 m above it."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    along = np.linspace(0.0, 1.0, points)
    east = west_m + (east_m - west_m) * (0.5 + 0.45 * np.sin(2.0 * np.pi * 7.0 * along))
    north = south_m + (north_m - south_m) * (0.5 + 0.45 * np.cos(2.0 * np.pi * 5.0 * along))
    above_m = 100.0 + 50.0 * np.sin(2.0 * np.pi * 40.0 * along)
    return np.column_stack([east, north, height_at(grid, east, north) + above_m])
