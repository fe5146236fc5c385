"""Kepler's orbit and the turning Earth: what almanacs and broadcast ephemerides have in common."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gnss.errors import AlmanacError

__all__ = ["EARTH_MU_M3_PER_S2", "EARTH_RATE_RAD_PER_S", "eccentric_anomaly_rad", "ecef_of_orbit_m", "true_anomaly_rad"]

Array = npt.NDArray[np.float64]

# IS-GPS-200, table 20-IV: the values that the control segment fits with, so not today's best ones
EARTH_MU_M3_PER_S2 = 3.986005e14
EARTH_RATE_RAD_PER_S = 7.2921151467e-5

TOLERANCE_RAD = 1e-13
MOST_STEPS = 50


def eccentric_anomaly_rad(mean_anomaly_rad: npt.ArrayLike, eccentricity: npt.ArrayLike) -> Array:
    """E in M = E − e·sin E, by Newton's method to 1e-13 rad; in −π…π, broadcast, NaN where M is NaN.

    Raises AlmanacError for an eccentricity outside 0 <= e < 1, and should 50 steps not suffice.
    """
    e = np.asarray(eccentricity, np.float64)
    if not ((e >= 0.0) & (e < 1.0)).all():
        raise AlmanacError("An orbit's eccentricity must satisfy 0 <= e < 1.")
    mean = np.asarray(mean_anomaly_rad, np.float64)
    mean = mean - 2.0 * np.pi * np.round(mean / (2.0 * np.pi))
    # from here on the far side of the root Newton's steps run one way, whatever the eccentricity
    anomaly = np.where(e < 0.8, mean + e * np.sin(mean), np.copysign(np.pi, mean))
    for _ in range(MOST_STEPS):
        step = (anomaly - e * np.sin(anomaly) - mean) / (1.0 - e * np.cos(anomaly))
        anomaly = anomaly - step
        if not (np.abs(step) > TOLERANCE_RAD).any():
            return anomaly
    raise AlmanacError(f"Kepler's equation was not solved in {MOST_STEPS} steps.")


def true_anomaly_rad(anomaly_rad: Array, eccentricity: npt.ArrayLike) -> Array:
    """ν of an eccentric anomaly, in −π…π (De Vivo et al., table II)."""
    e = np.asarray(eccentricity, np.float64)
    angle: Array = np.arctan2(np.sqrt(1.0 - e * e) * np.sin(anomaly_rad), np.cos(anomaly_rad) - e)
    return angle


def ecef_of_orbit_m(
    radius_m: Array, argument_of_latitude_rad: Array, inclination_rad: npt.ArrayLike, node_rad: npt.ArrayLike
) -> Array:
    """(..., 3) ECEF of a place in an orbit plane whose ascending node has an Earth-fixed longitude (table II)."""
    in_plane_x_m = radius_m * np.cos(argument_of_latitude_rad)
    in_plane_y_m = radius_m * np.sin(argument_of_latitude_rad)
    cos_i, sin_i = np.cos(inclination_rad), np.sin(inclination_rad)
    cos_node, sin_node = np.cos(node_rad), np.sin(node_rad)
    return np.stack(
        [
            in_plane_x_m * cos_node - in_plane_y_m * cos_i * sin_node,
            in_plane_x_m * sin_node + in_plane_y_m * cos_i * cos_node,
            in_plane_y_m * sin_i,
        ],
        axis=-1,
    )
