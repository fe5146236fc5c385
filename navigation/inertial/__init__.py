"""Inertial navigation: strapdown, an error-state filter that anything corrects, alignment, standstill, a smoother."""

from .alignment import align_moving, align_still, angles_of, matrices_of, quaternion_of_angles
from .bodies import EARTH, MARS, MOON, Body, TangentFrame
from .filtering import ClockNoise, InertialStart, InertialTrack, navigate
from .imu import IMU_PRESETS, ImuNoise, deg_per_h, deg_per_sqrt_h, milli_g
from .measurements import (
    Measurements,
    coordinates,
    ground_heights,
    join,
    position_fixes,
    ranges_to_anchors,
    rates_along,
    standstill,
    vehicle_speeds,
    velocity_fixes,
)
from .samples import ImuLog, from_forward_right_down, imu_log
from .satellites import phase_changes, pseudoranges
from .smoothing import SmoothedTrack
from .standing import StandstillRule, standing_still

__all__ = [
    "EARTH",
    "IMU_PRESETS",
    "MARS",
    "MOON",
    "Body",
    "ClockNoise",
    "ImuLog",
    "ImuNoise",
    "InertialStart",
    "InertialTrack",
    "Measurements",
    "SmoothedTrack",
    "StandstillRule",
    "TangentFrame",
    "align_moving",
    "align_still",
    "angles_of",
    "coordinates",
    "deg_per_h",
    "deg_per_sqrt_h",
    "from_forward_right_down",
    "ground_heights",
    "imu_log",
    "join",
    "matrices_of",
    "milli_g",
    "navigate",
    "phase_changes",
    "position_fixes",
    "pseudoranges",
    "quaternion_of_angles",
    "ranges_to_anchors",
    "rates_along",
    "standing_still",
    "standstill",
    "vehicle_speeds",
    "velocity_fixes",
]
