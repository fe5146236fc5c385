"""The flight of De Vivo et al., figure 10: along the floor of a valley, while the satellites go on."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from skimage.graph import route_through_array

import gnss
from benchmarks.visibility.paper_case import LIMIT, cut_out, paper_window
from terrain import ElevationGrid, height_at
from visibility import DistantAnchor, dop, dop_along, min_visible_altitude, satellites, visible_sets

__all__ = ["TAKE_OFF", "Flight", "fly", "valley_path"]

Array = npt.NDArray[np.float64]

# (row, col) of the window: up the main canyon from the west, past the bend, into the branch to the north-east
WAY = ((311, 4), (388, 222), (300, 328))
TAKE_OFF = datetime(2007, 12, 1, 22, 12, tzinfo=UTC)
ABOVE_GROUND_M = 50.0
SPEED_M_S = 20.0
RATE_HZ = 10.0
# how long satellites stand still: they move by 0.25 degrees meanwhile
UPDATE_S = 30.0
# a cell of the valley's slopes costs as much as a detour of so many cells for each 100 m that it stands higher
DETOUR_PER_100_M = 40.0
SMOOTH_M = 60.0


@dataclass(frozen=True, eq=False)
class Flight:
    """What a flight sees; arrays (points,).

    total, pdop_total: of all satellites in the cone, as if there were no mountains. calculated_s: for all of it,
    surfaces included.
    """

    start: datetime
    points_m: Array
    ground_m: Array
    time_s: Array
    visible: npt.NDArray[np.int64]
    total: npt.NDArray[np.int64]
    pdop: Array
    pdop_total: Array
    calculated_s: float


def valley_path(grid: ElevationGrid) -> Array:
    """(n, 3) flight along the floor of the valley, at least ABOVE_GROUND_M above it, evenly in time."""
    above_floor_m = grid.heights_m.astype(np.float64) - float(np.nanmin(grid.heights_m))
    cost = 1.0 + DETOUR_PER_100_M * above_floor_m / 100.0
    posts: list[tuple[int, int]] = []
    for start, end in itertools.pairwise(WAY):
        posts += route_through_array(cost, start, end, geometric=True)[0]
    row, col = np.array(posts, np.float64).T
    smooth = SMOOTH_M / min(grid.cell_east_m, grid.cell_north_m)
    east_m = grid.origin_east_m + gaussian_filter1d(col, smooth, mode="nearest") * grid.cell_east_m
    north_m = grid.origin_north_m - gaussian_filter1d(row, smooth, mode="nearest") * grid.cell_north_m
    along_m = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(east_m), np.diff(north_m)))])
    even_m = np.arange(0.0, along_m[-1], SPEED_M_S / RATE_HZ)
    east_m, north_m = np.interp(even_m, along_m, east_m), np.interp(even_m, along_m, north_m)
    # the highest ground within a reach of three sigmas, smoothed, is nowhere below the ground itself
    reach = int(3.0 * SMOOTH_M * RATE_HZ / SPEED_M_S)
    roof_m = maximum_filter1d(height_at(grid, east_m, north_m), 2 * reach + 1, mode="nearest")
    altitude_m = gaussian_filter1d(roof_m, reach / 3.0, mode="nearest", truncate=3.0) + ABOVE_GROUND_M
    return np.column_stack([east_m, north_m, altitude_m])


def fly(whole: ElevationGrid, almanac: gnss.Almanac, start: datetime) -> Flight:
    """Who is in sight along the valley, and the dilution; satellites are brought up to date every UPDATE_S."""
    grid = paper_window(whole)
    points_m = valley_path(grid)
    time_s = np.arange(len(points_m)) / RATE_HZ
    leg = (time_s // UPDATE_S).astype(int)
    visible, total = np.empty(len(points_m), np.int64), np.empty(len(points_m), np.int64)
    pdop, pdop_total = np.empty(len(points_m)), np.empty(len(points_m))
    started_s = time.perf_counter()
    moments = [start + timedelta(seconds=(number + 0.5) * UPDATE_S) for number in range(int(leg[-1]) + 1)]
    eyes = satellites.satellite_eyes(whole, almanac, moments)
    for number in range(len(moments)):
        here = leg == number
        surfaces = cut_out(min_visible_altitude(whole, eyes.distant_anchors(number)))
        visible[here] = visible_sets(surfaces, points_m[here]).count
        total[here] = len(surfaces.anchors)
        pdop[here] = dop_along(surfaces, points_m[here], LIMIT.kind).pdop
        stand_m = [anchor.position_m(grid) for anchor in surfaces.anchors if isinstance(anchor, DistantAnchor)]
        pdop_total[here] = dop(stand_m, points_m[here], kind=LIMIT.kind).pdop
    calculated_s = time.perf_counter() - started_s
    ground_m = height_at(grid, points_m[:, 0], points_m[:, 1])
    return Flight(start, points_m, ground_m, time_s, visible, total, pdop, pdop_total, calculated_s)
