"""Planes and balls in depth images, with the sensor's own error model, as landmarks for a relative position."""

from .depth_sensor import KINECT, DepthSensor, TargetPixels
from .planes import PlaneFit, fit_plane, quantisation_sigma_m
from .registration import TargetPose, pose_measurements, register_targets
from .spheres import Limb, SphereFit, fit_sphere, fit_sphere_algebraic, fit_sphere_in_image

__all__ = [
    "KINECT",
    "DepthSensor",
    "Limb",
    "PlaneFit",
    "SphereFit",
    "TargetPixels",
    "TargetPose",
    "fit_plane",
    "fit_sphere",
    "fit_sphere_algebraic",
    "fit_sphere_in_image",
    "pose_measurements",
    "quantisation_sigma_m",
    "register_targets",
]
