"""Position error in metres, at points and as maps: dilution weighted by what each range and anchor is worth."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.dilution.dop import checked_sets, visible_sets_of
from visibility.dilution.dop_maps import antenna_points, check_receiver
from visibility.dilution.dop_questions import DopKind, Sources, kind_code, numbers, sources_of, unit_normals
from visibility.dilution.ground_normals import post_normals, rover_normals
from visibility.dilution.kernels import dop as kernel
from visibility.dilution.sets_in_sight import column_tables, sets_of
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor, DistantAnchor
from visibility.sight.minimum_altitude import MinimumVisibleAltitude
from visibility.sight.sight_points import check_points, checked_positions

__all__ = [
    "PositionError",
    "PositionErrorMap",
    "check_weights",
    "position_error",
    "position_error_along",
    "position_error_map",
    "variances_of",
]


@dataclass(frozen=True, eq=False)
class PositionError:
    """One-sigma position error of a weighted least-squares fix, at one place (scalars) or at n of them ((n,) arrays).

    covariance_m2: (3, 3) or (n, 3, 3), east, north, up, m²; +inf everywhere = no fix, NaN = unknown.
    east_sigma_m, north_sigma_m, up_sigma_m: metres. horizontal_sigma_m, position_sigma_m: root of the sum of the
        variances of two and of three coordinates; vertical_sigma_m is up_sigma_m.
    clock_sigma_m: of the receiver's clock in metres of range, 0 where none is solved for.
    reason: DopReason, uint8. count: visible anchors.
    """

    covariance_m2: npt.NDArray[np.float64]
    clock_sigma_m: npt.NDArray[np.float64]
    reason: npt.NDArray[np.uint8]
    count: npt.NDArray[np.int64]
    kind: DopKind

    def _sigma_m(self, *axes: int) -> npt.NDArray[np.float64]:
        variance = np.array([self.covariance_m2[..., axis, axis] for axis in axes]).sum(axis=0)
        sigma_m: npt.NDArray[np.float64] = np.sqrt(np.maximum(variance, 0.0))[()]
        return sigma_m

    @property
    def east_sigma_m(self) -> npt.NDArray[np.float64]:
        """One sigma east, metres."""
        return self._sigma_m(0)

    @property
    def north_sigma_m(self) -> npt.NDArray[np.float64]:
        """One sigma north, metres."""
        return self._sigma_m(1)

    @property
    def up_sigma_m(self) -> npt.NDArray[np.float64]:
        """One sigma up, metres."""
        return self._sigma_m(2)

    @property
    def horizontal_sigma_m(self) -> npt.NDArray[np.float64]:
        """Root of the sum of the variances east and north, metres (distance root mean square)."""
        return self._sigma_m(0, 1)

    @property
    def vertical_sigma_m(self) -> npt.NDArray[np.float64]:
        """One sigma up, metres."""
        return self._sigma_m(2)

    @property
    def position_sigma_m(self) -> npt.NDArray[np.float64]:
        """Root of the sum of the variances of all three coordinates, metres."""
        return self._sigma_m(0, 1, 2)


def position_error(
    anchor_positions_m: npt.ArrayLike,
    receiver_m: npt.ArrayLike,
    ranging_sigma_m: npt.ArrayLike,
    kind: DopKind = "ranging",
    *,
    pose_sigma_m: npt.ArrayLike = 0.0,
    pose_covariance_m2: npt.ArrayLike | None = None,
    visible: npt.ArrayLike | None = None,
    surface_normal: npt.ArrayLike | None = None,
    distant: npt.ArrayLike | None = None,
) -> PositionError:
    """Position error of ranges from k anchors to a receiver, each weighted by its variance.

    ranging_sigma_m: one-sigma of the ranges, metres, (k,) or one for all. An anchor's pose error, independent between
        anchors, lengthens its range by its part along the sight line: its variance there is added.
    pose_sigma_m: one-sigma of each coordinate of an anchor's position, (k,) or one for all; or
    pose_covariance_m2: (k, 3, 3) or (3, 3) for all, east, north, up, m², in its place.
    The rest as for ``dop``. Raises VisibilityInputError.
    """
    points_m = checked_positions(
        "receiver_m", np.atleast_2d(numbers("receiver_m", receiver_m, "east, north, altitude"))
    )
    anchors = len(checked_positions("anchor_positions_m", anchor_positions_m))
    variances_m2 = variances_of(anchors, ranging_sigma_m, pose_sigma_m, pose_covariance_m2)
    sources = sources_of(anchor_positions_m, distant, variances_m2)
    mask, unknown, count = checked_sets(visible_sets_of(visible, len(points_m), anchors), None, len(points_m), anchors)
    normals = unit_normals(surface_normal, len(points_m))
    found, reason = np.empty((len(points_m), 7)), np.empty(len(points_m), np.uint8)
    kernel.covariances_at_points(points_m, sources, mask, unknown, kind_code(kind), normals, found, reason)
    covariance_m2 = found[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    clock_sigma_m = np.sqrt(found[:, 6])
    if np.ndim(receiver_m) == 2:
        return PositionError(covariance_m2, clock_sigma_m, reason, count, kind)
    return PositionError(covariance_m2[0], clock_sigma_m[0], reason[0], count[0], kind)


def _sigmas(name: str, values_m: npt.ArrayLike, anchors: int) -> npt.NDArray[np.float64]:
    sigma_m = numbers(name, values_m, "one-sigma in metres")
    if sigma_m.shape not in ((), (anchors,)):
        raise VisibilityInputError(
            f"{name} must be one number of metres or one for each of the {anchors} anchors, not shape {sigma_m.shape}."
        )
    sigma_m = np.broadcast_to(sigma_m, (anchors,))
    broken = ~(np.isfinite(sigma_m) & (sigma_m >= 0.0))
    if broken.any():
        raise VisibilityInputError(f"{name} must be finite and >= 0 m, not {sigma_m[np.argmax(broken)]}.")
    return sigma_m


def variances_of(
    anchors: int, ranging_sigma_m: npt.ArrayLike, pose_sigma_m: npt.ArrayLike, pose_covariance_m2: npt.ArrayLike | None
) -> npt.NDArray[np.float64]:
    """(k, 7) variances as the kernels take them; raises VisibilityInputError."""
    ranging_m = _sigmas("ranging_sigma_m", ranging_sigma_m, anchors)
    pose_m = _sigmas("pose_sigma_m", pose_sigma_m, anchors)
    poses_m2 = pose_m[:, None, None] ** 2 * np.eye(3)
    if pose_covariance_m2 is not None:
        if (pose_m > 0.0).any():
            raise VisibilityInputError("Give pose_sigma_m or pose_covariance_m2, not both.")
        poses_m2 = _covariances(anchors, pose_covariance_m2)
    # a perfect range in any direction would weigh infinitely much
    perfect = (ranging_m == 0.0) & (np.linalg.eigvalsh(poses_m2)[:, 0] <= 0.0)
    if perfect.any():
        raise VisibilityInputError(
            f"ranging_sigma_m[{np.argmax(perfect)}] and the anchor's pose error are both zero; "
            "one of them must be positive in every direction."
        )
    upper = np.triu_indices(3)
    # stacked columns lie in an order of their own, which would be another type to the kernels
    return np.ascontiguousarray(np.column_stack([ranging_m**2, poses_m2[:, *upper]]))


def _covariances(anchors: int, pose_covariance_m2: npt.ArrayLike) -> npt.NDArray[np.float64]:
    poses_m2 = numbers("pose_covariance_m2", pose_covariance_m2, "a 3 × 3 covariance in m²")
    if poses_m2.shape not in ((3, 3), (anchors, 3, 3)):
        raise VisibilityInputError(
            f"pose_covariance_m2 must be (3, 3) or ({anchors}, 3, 3), one for each anchor, not shape {poses_m2.shape}."
        )
    poses_m2 = np.broadcast_to(poses_m2, (anchors, 3, 3))
    scale = np.abs(poses_m2).max(axis=(1, 2), initial=0.0)
    if (
        not np.isfinite(poses_m2).all()
        or (np.abs(poses_m2 - poses_m2.transpose(0, 2, 1)).max(axis=(1, 2), initial=0.0) > 1e-9 * scale).any()
    ):
        raise VisibilityInputError("pose_covariance_m2 must be finite and symmetric.")
    least = np.linalg.eigvalsh(poses_m2)[:, 0]
    if (least < -1e-9 * scale).any():
        raise VisibilityInputError(
            f"pose_covariance_m2 of anchor {np.argmin(least)} is no covariance: it has the negative variance "
            f"{least.min():.3g} m² in some direction."
        )
    return poses_m2


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
