"""What a move of a drone costs: climb, fly level clear of the ground, descend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid

__all__ = ["Flight", "flight_costs", "flight_level_m"]

Floats = npt.NDArray[np.float64]
SAMPLES = 96  # of the ground below each flight, at most
AT_ONCE = 16_384  # flights, so that their samples stay in the cache


@dataclass(frozen=True, slots=True)
class Flight:
    """How a drone flies from place to place.

    speeds in m/s. clearance_m: kept above the ground on the way. max_flight_m: longest flight path of one move.
    Raises PlacementError.
    """

    speed_m_per_s: float = 12.0
    climb_m_per_s: float = 3.0
    descent_m_per_s: float = 2.0
    clearance_m: float = 20.0
    max_flight_m: float = math.inf

    def __post_init__(self) -> None:
        for name in ("speed_m_per_s", "climb_m_per_s", "descent_m_per_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise PlacementError(f"{name} must be a speed > 0 m/s, not {getattr(self, name)}.")
        if not (math.isfinite(self.clearance_m) and self.clearance_m >= 0.0) or not self.max_flight_m > 0.0:
            raise PlacementError("A flight needs clearance_m >= 0 and max_flight_m > 0.")


def flight_costs(grid: ElevationGrid, flight: Flight, from_m: Floats, to_m: Floats) -> tuple[Floats, Floats]:
    """(metres of flight path, seconds), both (n,), from one place (3,) to others (n, 3).

    Straight up to a level that clears the ground below the whole way, level, straight down. Ground outside the DEM or
    unknown is not cleared.
    """
    parts = [to_m[start : start + AT_ONCE] for start in range(0, max(len(to_m), 1), AT_ONCE)]
    below_m = np.concatenate([_highest_below(grid, from_m, part) for part in parts])
    level_m = np.maximum(np.maximum(from_m[2], to_m[:, 2]), below_m + flight.clearance_m)
    across_m = np.hypot(to_m[:, 0] - from_m[0], to_m[:, 1] - from_m[1])
    still = across_m == 0.0
    level_m[still] = np.maximum(from_m[2], to_m[still, 2])
    climb_m, descent_m = level_m - from_m[2], level_m - to_m[:, 2]
    seconds = climb_m / flight.climb_m_per_s + across_m / flight.speed_m_per_s + descent_m / flight.descent_m_per_s
    return climb_m + across_m + descent_m, seconds


def flight_level_m(from_m: Sequence[float], to_m: Sequence[float], flight_m: float) -> float:
    """Altitude at which a flight of that length between two places (east, north, altitude) goes level."""
    return (flight_m - math.dist(from_m[:2], to_m[:2]) + from_m[2] + to_m[2]) / 2.0


def _highest_below(grid: ElevationGrid, from_m: Floats, to_m: Floats) -> Floats:
    """(n,) highest post beside each straight way; -inf where none is known."""
    row_0, col_0 = grid.post_at(from_m[0], from_m[1])
    row_1 = (grid.origin_north_m - to_m[:, 1]) / grid.cell_north_m
    col_1 = (to_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    posts = np.maximum(np.abs(row_1 - row_0), np.abs(col_1 - col_0)).max(initial=0.0)
    share = np.linspace(0.0, 1.0, int(min(SAMPLES, 2 * math.ceil(posts) + 1)))[:, None]
    row = np.rint(row_0 + share * (row_1 - row_0)).astype(np.intp)
    col = np.rint(col_0 + share * (col_1 - col_0)).astype(np.intp)
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    height_m = grid.heights_m[np.where(inside, row, 0), np.where(inside, col, 0)]
    highest: Floats = np.where(inside & ~np.isnan(height_m), height_m, -np.inf).max(axis=0).astype(np.float64)
    return highest
