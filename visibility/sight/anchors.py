"""Ranging anchors, near and distant: where they are and what their antennas can reach, over a grid too."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at
from visibility.errors import AnchorError
from visibility.sight.antenna_limits import ALL_ROUND, AntennaLimits, limits_of
from visibility.sight.curvature import Curvature
from visibility.sight.doubts import SightDoubt, sentence_of_doubts
from visibility.sight.kernels import reach as kernel
from visibility.sight.kernels.crossings import GridPoint
from visibility.sight.radios import Radio
from visibility.sight.roofs import refuse_under_roof

__all__ = [
    "Anchor",
    "Covariance",
    "DistantAnchor",
    "anchor_above_ground",
    "check_anchors",
    "hide_beyond_reach",
    "raise_to_reach",
]

PARALLEL_FROM_M = 1e8
# An anchor this little under the surface is a rounding of one that stands on it.
GROUND_TOLERANCE_M = 1e-3
FURTHEST_USEFUL_M = 1_000_000.0

Covariance = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


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


@dataclass(frozen=True, slots=True)
class Anchor:
    """A ranging anchor in the grid's frame.

    east_m, north_m, altitude_m: metres, in the grid's CRS and vertical datum; may lie outside the grid.
    ranging_sigma_m, pose_sigma_m: one-sigma of its ranges and of each coordinate of its own position, metres.
    pose_covariance_m2: covariance of its position in place of pose_sigma_m, rows of east, north, up, m².
    doubts: where a rover's ranges contradicted what a map has of it: maps have its sight for unknown there.
    radio: what it sends and how much of it must arrive. What asks ``visibility.signal`` whether an anchor is got
        (plans, placements, bubbles) takes that in place of sight; ``min_visible_altitude`` does not look at it.
    Raises AnchorError.
    """

    id: str
    east_m: float
    north_m: float
    altitude_m: float
    ranging_sigma_m: float = 0.1
    pose_sigma_m: float = 0.0
    limits: AntennaLimits = field(default=ALL_ROUND)
    pose_covariance_m2: Covariance | None = None
    doubts: tuple[SightDoubt, ...] = ()
    radio: Radio | None = None

    def __post_init__(self) -> None:
        if not self.id:
            raise AnchorError("An anchor needs a non-empty id.")
        for name in ("east_m", "north_m", "altitude_m"):
            if not math.isfinite(getattr(self, name)):
                raise AnchorError(f"Anchor {self.id}: {name} must be a finite number, not {getattr(self, name)}.")
        for name in ("ranging_sigma_m", "pose_sigma_m"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise AnchorError(f"Anchor {self.id}: {name} must be >= 0 m, not {getattr(self, name)}.")
        if self.pose_covariance_m2 is not None:
            _check_covariance(self.id, self.pose_sigma_m, self.pose_covariance_m2)


def _check_covariance(id: str, pose_sigma_m: float, covariance_m2: Covariance) -> None:
    if pose_sigma_m > 0.0:
        raise AnchorError(f"Anchor {id}: give pose_sigma_m or pose_covariance_m2, not both.")
    matrix = np.array(covariance_m2, np.float64)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or not np.allclose(matrix, matrix.T, rtol=1e-9):
        raise AnchorError(f"Anchor {id}: pose_covariance_m2 must be three rows of three numbers, and symmetric.")
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < -1e-9 * np.abs(matrix).max():
        raise AnchorError(
            f"Anchor {id}: pose_covariance_m2 is no covariance: it has the negative variance {least:.3g} m² in some "
            "direction."
        )


def anchor_above_ground(
    grid: ElevationGrid,
    id: str,
    east_m: float,
    north_m: float,
    above_ground_m: float,
    *,
    ranging_sigma_m: float = 0.1,
    pose_sigma_m: float = 0.0,
    limits: AntennaLimits = ALL_ROUND,
    pose_covariance_m2: Covariance | None = None,
    radio: Radio | None = None,
) -> Anchor:
    """An anchor at a height above the grid's surface; raises AnchorError where that ground is unknown or not there."""
    if not (math.isfinite(above_ground_m) and above_ground_m >= 0.0):
        raise AnchorError(f"Anchor {id}: above_ground_m must be a number of metres >= 0, not {above_ground_m}.")
    if not grid.contains(east_m, north_m):
        outside_m = _metres_outside(grid, id, east_m, north_m)
        raise AnchorError(
            f"Anchor {id} stands outside the DEM, {outside_m:.0f} m beyond its border, where no ground is known; "
            "give its altitude_m instead of above_ground_m."
        )
    ground_m = float(height_at(grid, east_m, north_m))
    if math.isnan(ground_m):
        raise AnchorError(
            f"Anchor {id} stands on unknown ground; give its altitude_m instead of above_ground_m, or move it."
        )
    altitude_m = ground_m + above_ground_m
    sigmas_m = ranging_sigma_m, pose_sigma_m
    return Anchor(id, east_m, north_m, altitude_m, *sigmas_m, limits, pose_covariance_m2, radio=radio)


def check_anchors(grid: ElevationGrid, anchors: Sequence[Anchor | DistantAnchor]) -> tuple[str, ...]:
    """Refuse anchors that make no question on this grid; return warnings about the others.

    Raises AnchorError for none at all, duplicate ids, an anchor below known ground, or one further than 1000 km away.
    """
    if not anchors:
        raise AnchorError("At least one anchor is needed.")
    ids = [anchor.id for anchor in anchors]
    if len(set(ids)) != len(ids):
        twice = sorted(id for id, times in Counter(ids).items() if times > 1)
        raise AnchorError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
    near = [anchor for anchor in anchors if isinstance(anchor, Anchor)]
    return tuple(
        warning
        for anchor in near
        for warning in (*_check_one(grid, anchor), *sentence_of_doubts(anchor.id, anchor.doubts))
    )


def _metres_outside(grid: ElevationGrid, id: str, at_east_m: float, at_north_m: float) -> float:
    """How far beyond the grid's border; raises AnchorError where that is no anchor's place but another CRS."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    outside_m = math.hypot(
        max(west_m - at_east_m, at_east_m - east_m, 0.0), max(south_m - at_north_m, at_north_m - north_m, 0.0)
    )
    if outside_m > FURTHEST_USEFUL_M:
        raise AnchorError(
            f"Anchor {id} is {outside_m / 1000.0:.0f} km outside the DEM (limit {FURTHEST_USEFUL_M / 1000.0:.0f} km); "
            "are its coordinates metres in the DEM's CRS, or degrees that were not said to be, or swapped?"
        )
    return outside_m


def _check_one(grid: ElevationGrid, anchor: Anchor) -> list[str]:
    outside_m = _metres_outside(grid, anchor.id, anchor.east_m, anchor.north_m)
    if not grid.contains(anchor.east_m, anchor.north_m):
        return [
            f"Anchor {anchor.id} is {outside_m:.0f} m outside the DEM; ground between it and the DEM is not known "
            "and taken as not blocking."
        ]
    ground_m = float(height_at(grid, anchor.east_m, anchor.north_m))
    if math.isnan(ground_m):
        return [f"Anchor {anchor.id} is over unknown ground, so its sight lines are unknown unless blocked."]
    if anchor.altitude_m < ground_m - GROUND_TOLERANCE_M:
        raise AnchorError(
            f"Anchor {anchor.id} is {ground_m - anchor.altitude_m:.1f} m below the ground "
            f"({ground_m:.1f} m there); raise it or give above_ground_m."
        )
    refuse_under_roof(grid, f"Anchor {anchor.id}", anchor.east_m, anchor.north_m, anchor.altitude_m)
    return []


def raise_to_reach(
    grid: ElevationGrid, anchor: Anchor, curvature: Curvature, altitude_m: npt.NDArray[np.float32]
) -> None:
    """Raise minimum altitudes (rows, cols) in place to the lowest that the anchor's antenna reaches; +inf = none."""
    if anchor.limits != ALL_ROUND:
        eye = GridPoint(*grid.post_at(anchor.east_m, anchor.north_m), anchor.altitude_m)
        cells_m = (grid.cell_east_m, grid.cell_north_m)
        kernel.raise_to_reach(altitude_m, eye, cells_m, limits_of(anchor.limits), curvature.drop_per_m2)


def hide_beyond_reach(
    grid: ElevationGrid,
    anchor: Anchor,
    curvature: Curvature,
    base_m: npt.NDArray[np.float32],
    above_m: np.float32,
    seen: npt.NDArray[np.uint8],
) -> None:
    """Mark receivers above_m over base_m (rows, cols) as hidden, in place, where the antenna does not reach."""
    if anchor.limits != ALL_ROUND:
        eye = GridPoint(*grid.post_at(anchor.east_m, anchor.north_m), anchor.altitude_m)
        cells_m = (grid.cell_east_m, grid.cell_north_m)
        limits = limits_of(anchor.limits)
        kernel.hide_beyond_reach(base_m, above_m, eye, cells_m, limits, curvature.drop_per_m2, seen)
