"""De Vivo's camera form, equations 2 to 9: rotations, transforms, and what is where in the image."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from visibility import Anchor
from visibility.sight import camera_for_anchor
from visibility.sight.camera import R_GIMBAL_TO_CAMERA, R_body_to_gimbal, R_ned_to_body, gimbal_angles, homogeneous


def assert_rotation(matrix):
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


# -- equations 2 to 9


@pytest.mark.parametrize("angles_rad", [(0, 0, 0), (0.3, -0.8, 2.1), (-3.0, 1.4, 0.2)])
def test_equation_4_is_the_euler_sequence_313(angles_rad):
    R_to_body = R_ned_to_body(*angles_rad)
    assert_rotation(R_to_body)
    phi, theta, psi = angles_rad
    # frames turn, so the transpose of turning vectors about z, x, z
    turned = Rotation.from_euler("ZXZ", [psi, theta, phi]).as_matrix().T
    np.testing.assert_allclose(R_to_body, turned, atol=1e-12)


def test_equation_5_as_printed_is_no_rotation_and_as_corrected_is_one():
    azimuth, elevation = 0.7, -0.4
    corrected = R_body_to_gimbal(azimuth, elevation)
    assert_rotation(corrected)
    printed = corrected.copy()
    printed[1, 0] = -math.sin(elevation)
    assert np.abs(printed @ printed.T - np.eye(3)).max() > 0.1
    assert_rotation(R_GIMBAL_TO_CAMERA)


@pytest.mark.parametrize("towards_m", [(3.0, 4.0, 2.0), (-3.0, 4.0, -2.0), (0.0, -5.0, 0.0), (0.0, 0.0, 7.0)])
def test_equation_6_as_corrected_turns_the_principal_axis_to_the_target(towards_m):
    R_to_gimbal = R_body_to_gimbal(*gimbal_angles(towards_m))
    np.testing.assert_allclose(R_to_gimbal @ towards_m, [np.linalg.norm(towards_m), 0.0, 0.0], atol=1e-12)


def test_equation_6_as_printed_looks_away_from_the_target():
    towards_m = np.array([3.0, 4.0, 2.0])
    printed_azimuth = math.atan2(-towards_m[1], -towards_m[0])
    printed_elevation = math.acos(towards_m[2] / np.linalg.norm(towards_m)) - math.pi / 2.0
    away_m = R_body_to_gimbal(printed_azimuth, printed_elevation) @ towards_m
    np.testing.assert_allclose(away_m, [-np.linalg.norm(towards_m), 0.0, 0.0], atol=1e-12)


def test_a_homogeneous_transform_takes_its_origin_to_zero_and_chains():
    R_to_body, origin_m = R_ned_to_body(0.1, 0.2, 0.3), np.array([5.0, -2.0, 9.0])
    np.testing.assert_allclose(homogeneous(R_to_body, origin_m) @ [*origin_m, 1.0], [0, 0, 0, 1], atol=1e-12)
    there_and_back = homogeneous(R_to_body.T, -R_to_body @ origin_m) @ homogeneous(R_to_body, origin_m)
    np.testing.assert_allclose(there_and_back, np.eye(4), atol=1e-12)


@pytest.mark.parametrize("attitude_rad", [(0.0, 0.0, 0.0), (0.4, -0.2, 1.9)])
def test_the_target_is_in_the_middle_and_the_control_volume_fills_the_view(attitude_rad):
    anchor, target_m = Anchor("A", 500_100.0, 4_100_200.0, 900.0), (500_700.0, 4_099_400.0, 350.0)
    camera = camera_for_anchor(anchor, target_m, 400.0, attitude_rad=attitude_rad)
    reach_m = math.dist(target_m, (anchor.east_m, anchor.north_m, anchor.altitude_m))
    np.testing.assert_allclose(camera.in_camera_frame(target_m), [0.0, 0.0, reach_m], atol=1e-6)
    np.testing.assert_allclose(camera.position_m, [anchor.east_m, anchor.north_m, anchor.altitude_m], atol=1e-6)
    assert camera.half_width == pytest.approx(200.0 / reach_m)
    assert camera.focal_length_m == pytest.approx(512 * 1e-5 * reach_m / 400.0)
    # 199 m aside, level and across the line of sight: still in view; 201 m: not
    across_m = np.array([800.0, 600.0, 0.0]) / 1000.0
    if attitude_rad == (0.0, 0.0, 0.0):
        assert camera.in_view(target_m + 199.0 * across_m)
        assert not camera.in_view(target_m + 201.0 * across_m)


def test_up_in_the_image_is_up_in_the_world_and_right_is_right():
    camera = camera_for_anchor(Anchor("A", 0.0, 0.0, 100.0), (0.0, 1000.0, 0.0), 500.0)  # looking north
    up, right = np.moveaxis(camera.image([(0, 1000, 0), (0, 1000, 50), (0, 1500, 0), (80, 1000, 0)]), -1, 0)
    assert up[1] > up[0]
    assert up[2] > up[0]
    assert right[3] > right[0] == pytest.approx(0.0, abs=1e-12)
    assert not camera.in_view((0.0, -1000.0, 200.0))  # its mirror image behind the camera


def test_lever_arms_move_the_pinhole_not_the_aim():
    anchor, target_m = Anchor("A", 0.0, 0.0, 100.0), (0.0, 1000.0, 0.0)
    arm = camera_for_anchor(anchor, target_m, 500.0, gimbal_offset_m=(2.0, 0.5, 1.0), camera_offset_m=(0.1, 0.0, 0.0))
    plain = camera_for_anchor(anchor, target_m, 500.0)
    np.testing.assert_allclose(arm.T_ned_to_camera[:3, :3], plain.T_ned_to_camera[:3, :3])
    tilt = math.atan2(100.0, 1000.0)
    np.testing.assert_allclose(arm.position_m, [0.5, 2.0 + 0.1 * math.cos(tilt), 99.0 - 0.1 * math.sin(tilt)])
