"""Anchors far beyond the map, satellites above all: a direction in place of a position."""

from __future__ import annotations

import math
from dataclasses import dataclass

from terrain import ElevationGrid
from visibility.errors import AnchorError

__all__ = ["DistantAnchor"]

PARALLEL_FROM_M = 1e8


@dataclass(frozen=True, slots=True)
class DistantAnchor:
    """An anchor in a direction, seen from the middle of the grid.

    azimuth_rad: clockwise from grid north; elevation_rad: above the horizontal in the middle of the grid, 0 to pi/2.
    range_m: distance from there; the default is so far that its rays are parallel.
    ranging_sigma_m: one-sigma of its ranges, metres.
    For such anchors the ground is lowered by curvature from the middle of the grid outward, not from the anchor.
    Raises AnchorError.
    """

    id: str
    azimuth_rad: float
    elevation_rad: float
    range_m: float = PARALLEL_FROM_M
    ranging_sigma_m: float = 1.0

    def __post_init__(self) -> None:
        if not self.id:
            raise AnchorError("An anchor needs a non-empty id.")
        if not math.isfinite(self.azimuth_rad):
            raise AnchorError(f"Anchor {self.id}: azimuth_rad must be a finite angle, not {self.azimuth_rad}.")
        if not 0.0 < self.elevation_rad <= math.pi / 2:
            raise AnchorError(
                f"Anchor {self.id}: a distant anchor must stand above the horizon, up to the zenith; "
                f"{math.degrees(self.elevation_rad):.1f} deg does not."
            )
        if not (math.isfinite(self.range_m) and self.range_m > 0.0):
            raise AnchorError(f"Anchor {self.id}: range_m must be a positive number of metres, not {self.range_m}.")
        if not (math.isfinite(self.ranging_sigma_m) and self.ranging_sigma_m >= 0.0):
            raise AnchorError(f"Anchor {self.id}: ranging_sigma_m must be >= 0 m, not {self.ranging_sigma_m}.")

    def position_m(self, grid: ElevationGrid) -> tuple[float, float, float]:
        """(east_m, north_m, altitude_m) in the plane that touches the grid's middle at altitude 0."""
        east_m, north_m = middle_m(grid)
        across_m = self.range_m * math.cos(self.elevation_rad)
        return (
            east_m + across_m * math.sin(self.azimuth_rad),
            north_m + across_m * math.cos(self.azimuth_rad),
            self.range_m * math.sin(self.elevation_rad),
        )


def middle_m(grid: ElevationGrid) -> tuple[float, float]:
    """(east_m, north_m) of the middle of a grid."""
    return grid.position_of((grid.rows - 1) / 2.0, (grid.cols - 1) / 2.0)
