"""How far one answer lies from the exact one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import FLAT, Anchor, lines_of_sight

__all__ = ["Deviation", "deviation", "pooled"]

# errors up to this need no explanation; of the larger ones the worst are looked into
PLAIN_M = 10.0
MOST_EXPLAINED = 50_000


@dataclass(frozen=True, eq=False)
class Deviation:
    """One anchor, or several pooled.

    misclassified: share of posts called otherwise than by exact, per receiver height above ground, per anchor.
    error_m: absolute altitude error of every post that exact calls hidden (to a receiver on the ground).
    at_obstacle_m: the largest error carried back along its sight line to the obstacle that decides it.
    wild: posts whose error at the obstacle exceeds the relief of the ground there, so that no choice of ray through the
        neighbouring posts explains it.
    unknown: share of posts called unknown that exact knows, per anchor; they are not among the misclassified.
    """

    misclassified: dict[float, tuple[float, ...]]
    error_m: npt.NDArray[np.float32]
    at_obstacle_m: float
    wild: int
    unknown: tuple[float, ...] = ()

    def percentile_m(self, percent: float) -> float:
        return float(np.percentile(self.error_m, percent)) if self.error_m.size else 0.0

    @property
    def largest_m(self) -> float:
        return float(self.error_m.max(initial=0.0))

    def mean(self, receiver_m: float) -> float:
        return float(np.mean(self.misclassified[receiver_m]))

    def worst(self, receiver_m: float) -> float:
        return max(self.misclassified[receiver_m])


def deviation(
    grid: ElevationGrid,
    anchor: Anchor,
    altitude_m: npt.NDArray[np.floating],
    exact_m: npt.NDArray[np.floating],
    receivers_m: tuple[float, ...],
) -> Deviation:
    """Of one anchor's altitude_m from exact_m, both (rows, cols) over flat ground; NaN = unknown, a third answer.

    Posts of unknown ground do not count, nor does the anchor's own, for which each engine has its own convention.
    """
    counted = np.isfinite(grid.heights_m)
    row, col = (round(index) for index in grid.post_at(anchor.east_m, anchor.north_m))
    if 0 <= row < grid.rows and 0 <= col < grid.cols:
        counted[row, col] = False
    answer_m = altitude_m.astype(np.float32)
    misclassified: dict[float, tuple[float, ...]] = {}
    for receiver_m in receivers_m:
        receiver_altitude_m = grid.heights_m + np.float32(receiver_m)
        differs = (receiver_altitude_m >= answer_m) != (receiver_altitude_m >= exact_m)
        differs |= np.isnan(exact_m)
        differs &= ~np.isnan(answer_m)
        misclassified[receiver_m] = (float(np.count_nonzero(differs & counted) / np.count_nonzero(counted)),)
    both = counted & np.isfinite(answer_m) & np.isfinite(exact_m)
    error_m = np.where(both, np.abs(answer_m - exact_m), 0.0).astype(np.float32)
    at_obstacle_m, relief_m = _carried_back(grid, anchor, error_m, exact_m)
    return Deviation(
        misclassified,
        error_m[both & (exact_m > grid.heights_m)],
        float(at_obstacle_m.max(initial=0.0)),
        int(np.count_nonzero(at_obstacle_m > relief_m)),
        (float(np.count_nonzero(np.isnan(answer_m) & ~np.isnan(exact_m) & counted) / np.count_nonzero(counted)),),
    )


def pooled(parts: list[Deviation]) -> Deviation:
    """Several anchors as one: shares side by side, errors together."""
    receivers_m = parts[0].misclassified
    return Deviation(
        {receiver_m: tuple(s for part in parts for s in part.misclassified[receiver_m]) for receiver_m in receivers_m},
        np.concatenate([part.error_m for part in parts]),
        max(part.at_obstacle_m for part in parts),
        sum(part.wild for part in parts),
        tuple(share for part in parts for share in part.unknown),
    )


def _carried_back(
    grid: ElevationGrid, anchor: Anchor, error_m: npt.NDArray[np.float32], exact_m: npt.NDArray[np.floating]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(error at the deciding obstacle, relief of the 3 x 3 posts around it) of the posts with the largest errors.

    An altitude over a far post follows from the slope over a near obstacle, so an error there grows with distance.
    """
    rows, cols = np.nonzero(error_m > PLAIN_M)
    order = np.argsort(-error_m[rows, cols])[:MOST_EXPLAINED]
    rows, cols = rows[order], cols[order]
    if rows.size == 0:
        return np.zeros(0), np.zeros(0)
    east_m = grid.origin_east_m + cols * grid.cell_east_m
    north_m = grid.origin_north_m - rows * grid.cell_north_m
    touching_m = np.column_stack([east_m, north_m, exact_m[rows, cols].astype(np.float64)])
    eyes_m = np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], touching_m.shape)
    lines = lines_of_sight(grid, eyes_m, touching_m, curvature=FLAT)
    share = lines.blocking_distance_m / np.hypot(east_m - anchor.east_m, north_m - anchor.north_m)
    at_row, at_col = (
        np.clip(np.rint(index), 0, most - 1).astype(int)
        for index, most in zip(grid.post_at(*lines.blocking_point_m[:, :2].T), grid.shape, strict=True)
    )
    return error_m[rows, cols] * share, _relief_m(grid.heights_m)[at_row, at_col]


def _relief_m(heights_m: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    """Highest less lowest known height of the 3 x 3 posts around each post."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(heights_m, 1, mode="edge"), (3, 3))
    highest, lowest = heights_m.astype(np.float64), heights_m.astype(np.float64)
    for down in range(3):
        for right in range(3):
            highest = np.fmax(highest, windows[:, :, down, right])
            lowest = np.fmin(lowest, windows[:, :, down, right])
    return highest - lowest
