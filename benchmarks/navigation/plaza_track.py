"""Plaza 1: ranges and odometry through the linear filter of Table III, linearised at each step, against the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.io

import navigation
from benchmarks.detection.measured_ranges import RANGING, plaza

__all__ = ["PlazaTrack", "plaza_track"]

Array = npt.NDArray[np.float64]

# said before any run: half a metre of range error is what calibrated ranges are known for; a wheel slips by some
# percent of the way, and its heading wanders by a degree in some tens of metres
RANGE_SIGMA_M, SLIP, WANDER_RAD2_PER_M = 0.5, 0.05, math.radians(0.3) ** 2
STANDING_M2_PER_S = 1e-4
START_SIGMAS = (1.0, 1.0, math.radians(10.0))
GATE_SIGMA = 4.0


@dataclass(frozen=True, eq=False)
class PlazaTrack:
    """m ranges: error (m, 2) after each, its covariance (m, 2, 2), dead reckoning's distance from the truth (m,)."""

    error_m: Array
    covariance_m2: Array
    reckoned_m: Array
    used_share: float

    @property
    def distance_m(self) -> Array:
        return np.asarray(np.linalg.norm(self.error_m, axis=1))

    def space_covariance_m2(self) -> Array:
        """(m, 3, 3) of a mower whose height is known."""
        whole = np.zeros((len(self.error_m), 3, 3))
        whole[:, :2, :2] = self.covariance_m2
        return whole


def plaza_track() -> PlazaTrack:
    """State east, north, and how far dead reckoning's heading is off; every range at its own time, in order of time."""
    log = plaza()
    turns = scipy.io.loadmat(RANGING / "plaza" / "Plaza1.mat")["DR"]
    time_s = np.array([epoch.time_s for epoch in log.epochs])
    order = np.argsort(time_s, kind="stable")
    heading = np.cumsum(turns[:, 2])
    # the truth's first heading only turns the picture: the filter is told that it is 10 degrees unsure of it
    heading += float(scipy.io.loadmat(RANGING / "plaza" / "Plaza1.mat")["GT"][0, 3])
    halfway = heading - turns[:, 2] / 2.0
    way_m = np.cumsum(turns[:, [1]] * np.column_stack([np.cos(halfway), np.sin(halfway)]), axis=0)
    gone_m = np.cumsum(np.abs(turns[:, 1]))
    at_m = np.column_stack([np.interp(time_s[order], turns[:, 0], way_m[:, axis]) for axis in range(2)])
    length_m = np.interp(time_s[order], turns[:, 0], gone_m)
    anchors = {anchor.id: (anchor.east_m, anchor.north_m) for anchor in log.anchors}
    places_m = log.places_m[order]
    mean, covariance = np.array([*places_m[0], 0.0]), np.diag(np.square(START_SIGMAS))
    errors, covariances, used = [], [], 0
    for number, epoch in enumerate(order):
        before = max(number - 1, 0)
        step_m = at_m[number] - at_m[before]
        step_s = float(time_s[order[number]] - time_s[order[before]])
        mean, covariance = _advance(mean, covariance, step_m, float(length_m[number] - length_m[before]), step_s)
        measured = log.epochs[epoch].ranges[0]
        mean, covariance, taken = _range(mean, covariance, np.array(anchors[measured.anchor_id]), measured.range_m)
        used += taken
        errors.append(mean[:2] - places_m[number])
        covariances.append(covariance[:2, :2])
    reckoned_m = np.linalg.norm(at_m - at_m[0] - (places_m - places_m[0]), axis=1)
    return PlazaTrack(np.array(errors), np.array(covariances), reckoned_m, used / len(order))


def _advance(mean: Array, covariance: Array, step_m: Array, way_m: float, step_s: float) -> tuple[Array, Array]:
    cosine, sine = math.cos(mean[2]), math.sin(mean[2])
    turned_m = np.array([cosine * step_m[0] - sine * step_m[1], sine * step_m[0] + cosine * step_m[1]])
    transition = np.eye(3)
    transition[:2, 2] = -turned_m[1], turned_m[0]
    slip_m2 = (SLIP * way_m) ** 2 + STANDING_M2_PER_S * step_s
    noise = np.diag([slip_m2, slip_m2, WANDER_RAD2_PER_M * way_m])
    control = np.array([*(mean[:2] + turned_m), mean[2]]) - transition @ mean
    return navigation.linear_predict(mean, covariance, transition, noise, control)


def _range(mean: Array, covariance: Array, anchor_m: Array, range_m: float) -> tuple[Array, Array, bool]:
    line_m = mean[:2] - anchor_m
    expected_m = float(np.linalg.norm(line_m))
    row = np.array([[*(line_m / expected_m), 0.0]])
    linear = range_m - expected_m + row @ mean
    found = navigation.linear_update(mean, covariance, linear, row, [[RANGE_SIGMA_M**2]])
    if found.nis > GATE_SIGMA**2:
        return mean, covariance, False
    return found.mean, found.covariance, True
