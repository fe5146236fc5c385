"""An anchor's antenna as a pinhole camera: De Vivo et al. II-B, equations 2 to 11, and what it sees.

Frames, each reached from the one before by a homogeneous transform:
ned     north, east, down along the axes and from the origin of the grid's frame (the paper's inertial frame).
body    the platform; its attitude is the Euler sequence 313. Level and facing north: the same axes as ned.
gimbal  x along the principal axis, y to its right, z below it.
camera  x up in the image, y to the right, z along the principal axis.
The corrections to the printed formulas are told in docs/decisions/0008-camera-form.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor
from visibility.sight.curvature import Curvature
from visibility.sight.kernels.crossings import GRAZING_TOLERANCE_M
from visibility.sight.minimum_altitude import HIDDEN, UNKNOWN, VISIBLE
from visibility.sight.sight_points import horizontal_box

__all__ = [
    "OUTSIDE_DEM",
    "OUTSIDE_VIEW",
    "Camera",
    "OccludedPoints",
    "R_body_to_gimbal",
    "R_ned_to_body",
    "camera_for_anchor",
    "gimbal_angles",
    "homogeneous",
    "occluded_points",
]

Matrix = npt.NDArray[np.float64]

# Equation 7: the image's upward axis is the gimbal's upward one, the principal axis its x.
R_GIMBAL_TO_CAMERA: Matrix = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
R_GIMBAL_TO_CAMERA.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A pinhole camera over the grid.

    T_ned_to_camera: (4, 4) homogeneous transform. focal_length_m, pixel_size_m: metres; pixels: along each side.
    """

    T_ned_to_camera: Matrix
    focal_length_m: float
    pixels: int
    pixel_size_m: float

    @property
    def position_m(self) -> Matrix:
        """(3,) east, north, altitude of the pinhole."""
        R_ned_to_camera, shift_m = self.T_ned_to_camera[:3, :3], self.T_ned_to_camera[:3, 3]
        north_m, east_m, down_m = -R_ned_to_camera.T @ shift_m
        return np.array([east_m, north_m, -down_m])

    @property
    def half_width(self) -> float:
        """Tangent of half the field of view, along rows and columns."""
        return self.pixels * self.pixel_size_m / (2.0 * self.focal_length_m)

    def in_camera_frame(self, points_m: npt.ArrayLike) -> Matrix:
        """(..., 3) camera coordinates of points given as (..., 3) east, north, altitude: equation 2."""
        points = np.asarray(points_m, np.float64)
        ned = np.stack([points[..., 1], points[..., 0], -points[..., 2], np.ones(points.shape[:-1])], axis=-1)
        camera: Matrix = (ned @ self.T_ned_to_camera.T)[..., :3]
        return camera

    def image(self, points_m: npt.ArrayLike) -> Matrix:
        """(..., 2) place in the image, up and right, per unit of focal length.

        A point beside or behind the pinhole has no image; it answers +inf or -inf, above or below everything in view.
        """
        camera = self.in_camera_frame(points_m)
        depth = camera[..., 2]
        before = depth > 0.0
        out = np.copysign(np.inf, camera[..., :2])
        return np.divide(camera[..., :2], depth[..., None], out=out, where=before[..., None])

    def in_view(self, points_m: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """(...) whether points (..., 3), east, north, altitude, are in the field of view."""
        up, right = np.moveaxis(np.abs(self.image(points_m)), -1, 0)
        inside: npt.NDArray[np.bool_] = (up <= self.half_width) & (right <= self.half_width)
        return inside


def R_ned_to_body(phi_rad: float, theta_rad: float, psi_rad: float) -> Matrix:
    """Equation 4: Euler rotation 313, first psi about z, then theta about x, last phi about z."""
    cf, sf = math.cos(phi_rad), math.sin(phi_rad)
    ct, st = math.cos(theta_rad), math.sin(theta_rad)
    cp, sp = math.cos(psi_rad), math.sin(psi_rad)
    return np.array(
        [
            [cf * cp - sf * ct * sp, sf * ct * cp + cf * sp, sf * st],
            [-cf * ct * sp - sf * cp, cf * ct * cp - sf * sp, cf * st],
            [st * sp, -st * cp, ct],
        ]
    )


def R_body_to_gimbal(azimuth_rad: float, elevation_rad: float) -> Matrix:
    """Equation 5, its second row corrected: azimuth from body x towards y, elevation towards z (downwards)."""
    ca, sa = math.cos(azimuth_rad), math.sin(azimuth_rad)
    ce, se = math.cos(elevation_rad), math.sin(elevation_rad)
    return np.array([[ce * ca, ce * sa, se], [-sa, ca, 0.0], [-se * ca, -se * sa, ce]])


def gimbal_angles(towards_in_body_m: npt.ArrayLike) -> tuple[float, float]:
    """Equation 6, turned to look at the target instead of away from it: (azimuth, elevation) of a direction in body."""
    x, y, z = np.asarray(towards_in_body_m, np.float64)
    length_m = math.sqrt(x * x + y * y + z * z)
    if length_m == 0.0:
        raise VisibilityInputError("A camera cannot point at the place where it is.")
    return math.atan2(y, x), math.pi / 2.0 - math.acos(max(-1.0, min(1.0, z / length_m)))


def homogeneous(R: Matrix, origin_m: npt.ArrayLike) -> Matrix:  # noqa: N803 - a rotation
    """Equations 3 and 8: the (4, 4) transform [R, -R·origin; 0, 1] into a frame whose origin lies at origin_m."""
    T = np.eye(4)  # noqa: N806 - a transform
    T[:3, :3] = R
    T[:3, 3] = -R @ np.asarray(origin_m, np.float64)
    return T


def camera_for_anchor(
    anchor: Anchor,
    target_m: tuple[float, float, float],
    control_volume_width_m: float,
    pixels: int = 512,
    pixel_size_m: float = 1e-5,
    *,
    attitude_rad: tuple[float, float, float] = (0.0, 0.0, 0.0),
    gimbal_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    camera_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Camera:
    """The camera of an anchor whose gimbal centres a target, with a control volume of that width filling its view.

    target_m: (east, north, altitude). attitude_rad: Euler angles phi, theta, psi of the body.
    gimbal_offset_m in body, camera_offset_m in gimbal: lever arms; the gimbal is aimed from the anchor itself.
    Raises VisibilityInputError.
    """
    if not (math.isfinite(control_volume_width_m) and control_volume_width_m > 0.0):
        raise VisibilityInputError(f"control_volume_width_m must be a positive number, not {control_volume_width_m}.")
    if pixels < 1 or not (math.isfinite(pixel_size_m) and pixel_size_m > 0.0):
        raise VisibilityInputError(f"A camera needs pixels of a positive size, not {pixels} of {pixel_size_m} m.")
    if not np.isfinite([*target_m, *attitude_rad, *gimbal_offset_m, *camera_offset_m]).all():
        raise VisibilityInputError("Target, attitude and offsets of a camera must be finite numbers.")
    anchor_ned_m = np.array([anchor.north_m, anchor.east_m, -anchor.altitude_m])
    towards_m = np.array([target_m[1], target_m[0], -target_m[2]]) - anchor_ned_m
    R_to_body = R_ned_to_body(*attitude_rad)
    azimuth_rad, elevation_rad = gimbal_angles(R_to_body @ towards_m)
    T_ned_to_camera = (
        homogeneous(R_GIMBAL_TO_CAMERA, camera_offset_m)
        @ homogeneous(R_body_to_gimbal(azimuth_rad, elevation_rad), gimbal_offset_m)
        @ homogeneous(R_to_body, anchor_ned_m)
    )
    T_ned_to_camera.setflags(write=False)
    # equation 9
    focal_length_m = pixels * pixel_size_m * float(np.linalg.norm(towards_m)) / control_volume_width_m
    return Camera(T_ned_to_camera, focal_length_m, pixels, pixel_size_m)


OUTSIDE_VIEW, OUTSIDE_DEM = np.uint8(2), np.uint8(3)


@dataclass(frozen=True, eq=False)
class OccludedPoints:
    """What the image columns of a camera see of the ground; one row per column, one entry per sample going outward.

    azimuth_rad: (columns,) clockwise from grid north.
    distance_m: (samples,) horizontal from the point below the camera, beginning where the DEM begins.
    east_m, north_m, ground_m: (columns, samples); ground NaN = unknown or outside the DEM.
    state: (columns, samples) uint8: VISIBLE 1, HIDDEN 0, UNKNOWN 255, OUTSIDE_VIEW 2 (not in the field of view, so not
        visible), OUTSIDE_DEM 3.
    """

    azimuth_rad: npt.NDArray[np.float64]
    distance_m: npt.NDArray[np.float64]
    east_m: npt.NDArray[np.float64]
    north_m: npt.NDArray[np.float64]
    ground_m: npt.NDArray[np.float64]
    state: npt.NDArray[np.uint8]
    curvature: Curvature


def occluded_points(
    camera: Camera,
    grid: ElevationGrid,
    *,
    receiver_above_ground_m: float = 0.0,
    spacing_m: float | None = None,
    curvature: Curvature | None = None,
) -> OccludedPoints:
    """Resample the DEM along the ground traces of the image columns and tell the occluded points, in O(samples).

    A column's trace is in the vertical plane through the camera and that column's end on the image's lower edge (upper,
    if the camera looks up), so that the traces fan out over the whole footprint. Going outward, a point is visible
    where its place in the image is at least as high as that of everything before it.
    spacing_m: between samples; None takes the smaller cell. Ground between samples is not looked at.
    curvature: None takes what the grid's CRS implies (Curvature.of); FLAT switches it off.
    Raises VisibilityInputError, also for a camera that is rolled or has the point straight below or above it in view.
    """
    spacing_m = min(grid.cell_east_m, grid.cell_north_m) if spacing_m is None else spacing_m
    if not (math.isfinite(spacing_m) and spacing_m > 0.0):
        raise VisibilityInputError(f"spacing_m must be a positive number of metres, not {spacing_m}.")
    if not (math.isfinite(receiver_above_ground_m) and receiver_above_ground_m >= 0.0):
        raise VisibilityInputError(f"receiver_above_ground_m must be >= 0 m, not {receiver_above_ground_m}.")
    curvature = Curvature.over(grid, curvature)
    azimuth_rad = _column_azimuths(camera)
    foot_east_m, foot_north_m, _ = camera.position_m
    nearest_m, furthest_m = _reach_m(grid, foot_east_m, foot_north_m)
    distance_m = np.arange(max(1.0, nearest_m // spacing_m), furthest_m // spacing_m + 1.0) * spacing_m
    east_m = foot_east_m + np.sin(azimuth_rad)[:, None] * distance_m
    north_m = foot_north_m + np.cos(azimuth_rad)[:, None] * distance_m
    ground_m = height_at(grid, east_m, north_m)

    lowered_m = ground_m - curvature.drop_per_m2 * distance_m**2
    up = camera.image(np.stack([east_m, north_m, lowered_m], axis=-1))[..., 0]
    known = np.isfinite(ground_m)
    highest = np.maximum.accumulate(np.where(known, up, -np.inf), axis=1)
    receivers_m = np.stack([east_m, north_m, lowered_m + receiver_above_ground_m + GRAZING_TOLERANCE_M], axis=-1)
    state = np.where(camera.image(receivers_m)[..., 0] >= highest, VISIBLE, HIDDEN)

    row, col = (grid.origin_north_m - north_m) / grid.cell_north_m, (east_m - grid.origin_east_m) / grid.cell_east_m
    on_dem = (row >= 0.0) & (row <= grid.rows - 1) & (col >= 0.0) & (col <= grid.cols - 1)
    behind_unknown = np.logical_or.accumulate(on_dem & ~known, axis=1)
    state[behind_unknown & ((state == VISIBLE) | ~known)] = UNKNOWN
    state[known & ~camera.in_view(receivers_m)] = OUTSIDE_VIEW
    state[~on_dem] = OUTSIDE_DEM
    return OccludedPoints(azimuth_rad, distance_m, east_m, north_m, ground_m, state, curvature)


def _column_azimuths(camera: Camera) -> npt.NDArray[np.float64]:
    """(pixels,) azimuth of each image column's ground trace."""
    up, right, ahead = camera.T_ned_to_camera[:3, :3]  # the camera's axes as directions in ned
    if abs(right[2]) > 1e-9 or up[2] > 0.0:
        raise VisibilityInputError(
            "The camera is rolled, so its image columns do not stand upright; give it an attitude without roll."
        )
    nearest = math.hypot(ahead[0], ahead[1]) - camera.half_width * abs(ahead[2])
    if nearest <= 1e-6:
        raise VisibilityInputError(
            "The camera has the point straight below or above it in view, where image columns have no direction; "
            "narrow its view or use min_visible_altitude."
        )
    column = (np.arange(camera.pixels) - (camera.pixels - 1) / 2.0) * camera.pixel_size_m / camera.focal_length_m
    azimuth_rad: npt.NDArray[np.float64] = math.atan2(ahead[1], ahead[0]) + np.arctan2(column, nearest)
    return azimuth_rad


def _reach_m(grid: ElevationGrid, east_m: float, north_m: float) -> tuple[float, float]:
    """Distance from a position to the nearest and to the furthest point of the DEM."""
    low_m, high_m = horizontal_box(grid)
    here_m = np.array([east_m, north_m])
    before_m, beyond_m = low_m - here_m, here_m - high_m
    nearest_m = np.hypot(*np.maximum(np.maximum(before_m, beyond_m), 0.0))
    return float(nearest_m), float(np.hypot(*np.maximum(np.abs(before_m), np.abs(beyond_m))))
