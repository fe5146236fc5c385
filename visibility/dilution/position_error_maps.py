"""Maps of position error in metres: the dilution of a rover over every post, weighted by what each range is worth."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.dilution.columns_of_air import column_tables
from visibility.dilution.dop_maps import antenna_points, check_receiver
from visibility.dilution.dop_questions import DopKind, Sources, kind_code
from visibility.dilution.ground_normals import post_normals, rover_normals
from visibility.dilution.kernels import dop as kernel
from visibility.dilution.position_errors import PositionError, variances_of
from visibility.dilution.sets_in_sight import sets_of
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor
from visibility.sight.distant import DistantAnchor
from visibility.sight.minimum_altitude import MinimumVisibleAltitude
from visibility.sight.sight_points import check_points

__all__ = ["PositionErrorMap", "check_weights", "position_error_along", "position_error_map"]

POSTS_AT_ONCE = 65_536


@dataclass(frozen=True, eq=False)
class PositionErrorMap:
    """The answer to ``position_error_map``; arrays (rows, cols) float32, metres, +inf = no fix, NaN = unknown.

    horizontal_sigma_m, position_sigma_m: root of the sum of the variances of two and of three coordinates, one sigma.
    vertical_sigma_m: one sigma up. reasons: uint8, DopReason.
    """

    horizontal_sigma_m: npt.NDArray[np.float32]
    vertical_sigma_m: npt.NDArray[np.float32]
    position_sigma_m: npt.NDArray[np.float32]
    reasons: npt.NDArray[np.uint8]
    elapsed_s: float


def position_error_map(
    minimum: MinimumVisibleAltitude, above_ground_m: float, kind: DopKind = "ranging", *, on_surface: bool = False
) -> PositionErrorMap:
    """Position error of a rover's antenna over every post, from the anchors in sight and what their ranges are worth.

    Each range has the variance of its anchor's ranging_sigma_m, and of the anchor's own pose error along the line of
    sight; otherwise as ``dop_map``. Raises VisibilityInputError, also for an anchor without any error: its range would
    weigh infinitely much.
    """
    started_s = time.perf_counter()
    grid = minimum.grid
    check_receiver(above_ground_m)
    tables = column_tables(minimum)
    sources = _weighted(tables.sources, minimum.anchors)
    sigmas_m = np.empty((3, *grid.shape), np.float32)
    reasons = np.empty(grid.shape, np.uint8)
    step = max(POSTS_AT_ONCE // grid.cols, 1)
    for first in range(0, grid.rows, step):
        rows = first, min(first + step, grid.rows)
        points = antenna_points(grid, rows, above_ground_m)
        sets = sets_of(minimum, tables, points)
        normals = post_normals(grid, *rows) if on_surface else np.empty((0, 3))
        found = np.empty((len(points), 7))
        reason = reasons[slice(*rows)].reshape(-1)
        kernel.covariances_at_points(points, sources, sets.mask, sets.unknown, kind_code(kind), normals, found, reason)
        horizontal_m2, vertical_m2 = found[:, kernel.EE] + found[:, kernel.NN], found[:, kernel.UU]
        for number, variance_m2 in enumerate((horizontal_m2, vertical_m2, horizontal_m2 + vertical_m2)):
            sigmas_m[number, slice(*rows)] = np.sqrt(np.maximum(variance_m2, 0.0)).reshape(-1, grid.cols)
    horizontal_m, vertical_m, position_m = sigmas_m
    return PositionErrorMap(horizontal_m, vertical_m, position_m, reasons, time.perf_counter() - started_s)


def position_error_along(
    minimum: MinimumVisibleAltitude, points_m: npt.ArrayLike, kind: DopKind = "ranging", *, on_surface: bool = False
) -> PositionError:
    """Position error at each point (n, 3) of a trajectory, weighted as in ``position_error_map``; else as dop_along.

    Raises VisibilityInputError.
    """
    points = check_points(minimum.grid, "points_m", points_m)
    tables = column_tables(minimum)
    sources = _weighted(tables.sources, minimum.anchors)
    sets = sets_of(minimum, tables, points)
    normals = rover_normals(minimum.grid, points[:, 0], points[:, 1]) if on_surface else np.empty((0, 3))
    found, reason = np.empty((len(points), 7)), np.empty(len(points), np.uint8)
    kernel.covariances_at_points(points, sources, sets.mask, sets.unknown, kind_code(kind), normals, found, reason)
    covariance_m2 = found[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    return PositionError(covariance_m2, np.sqrt(found[:, kernel.CLOCK]), reason, sets.count, kind)


def check_weights(anchors: Sequence[Anchor | DistantAnchor]) -> None:
    """Refuse anchors whose ranges and poses are both without error; raises VisibilityInputError."""
    for anchor in anchors:
        if anchor.ranging_sigma_m > 0.0:
            continue
        covariance_m2 = _pose_covariance_m2(anchor)
        if np.linalg.eigvalsh(covariance_m2)[0] <= 0.0:
            raise VisibilityInputError(
                f"Anchor {anchor.id}: its ranging_sigma_m is 0 and its pose is without error in some direction, so its "
                "ranges would weigh infinitely much; give one of them a positive sigma."
            )


def _weighted(sources: Sources, anchors: Sequence[Anchor | DistantAnchor]) -> Sources:
    check_weights(anchors)
    ranging_sigma_m = [anchor.ranging_sigma_m for anchor in anchors]
    poses_m2 = np.array([_pose_covariance_m2(anchor) for anchor in anchors])
    return sources._replace(variances=variances_of(len(anchors), ranging_sigma_m, 0.0, poses_m2))


def _pose_covariance_m2(anchor: Anchor | DistantAnchor) -> npt.NDArray[np.float64]:
    if isinstance(anchor, DistantAnchor):
        return np.zeros((3, 3))
    if anchor.pose_covariance_m2 is not None:
        return np.array(anchor.pose_covariance_m2, np.float64)
    return anchor.pose_sigma_m**2 * np.eye(3)
