"""smartLoc's drive through Berlin as arrays, and the filter that it is usually given: extended, with a gate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pyproj import Transformer

from navigation.inertial import TangentFrame
from navigation.pseudoranges import StreetRanges, StreetStart, WheelReadings

__all__ = ["PLACE", "SMARTLOC", "StreetLog", "gated_filter", "street_log", "turned_while_sent"]

Array = npt.NDArray[np.float64]
SMARTLOC = Path(__file__).resolve().parents[4] / "shared" / "data" / "monitor" / "smartloc"
PLACE = "Berlin_Potsdamer_Platz_first_140_s"
LIGHT_M_PER_S = 299_792_458.0


@dataclass(frozen=True, eq=False)
class StreetLog:
    """What was heard and felt, the frame at the first true place, and where the car was at each epoch, (k, 3)."""

    ranges: StreetRanges
    wheels: WheelReadings
    frame: TangentFrame
    place_m: Array
    heading_rad: float


def street_log(folder: Path = SMARTLOC, name: str = PLACE) -> StreetLog:
    """One of smartLoc's drives, NAME_Input.txt and NAME_GT.txt; the heading is the course of the first five seconds."""
    lines = [line.split() for line in (folder / f"{name}_Input.txt").read_text(encoding="utf-8").splitlines()]
    heard = np.array([line[1:11] for line in lines if line and line[0] == "pseudorange3"], float)
    felt = np.array([line[1:8] for line in lines if line and line[0] == "odom3"], float)
    lines = [line.split() for line in (folder / f"{name}_GT.txt").read_text(encoding="utf-8").splitlines()]
    truth = np.array([line[1:5] for line in lines if line], float)
    longitude, latitude, altitude_m = Transformer.from_crs(4978, 4979, always_xy=True).transform(*truth[0, 1:])
    frame = TangentFrame(math.radians(latitude), math.radians(longitude), altitude_m)
    heard = heard[np.argsort(heard[:, 0], kind="stable")]
    ranges = StreetRanges(
        heard[:, 0], heard[:, 1], heard[:, 3:6], heard[:, 6].astype(int), heard[:, 7].astype(int), np.sqrt(heard[:, 2])
    )
    at = frame.from_centred_m(truth[:, 1:])
    place_m = np.stack([np.interp(np.unique(heard[:, 0]), truth[:, 0], axis) for axis in at.T], axis=1)
    gone_m = at[int(np.searchsorted(truth[:, 0], truth[0, 0] + 5.0))] - at[0]
    wheels = WheelReadings(felt[:, 0], felt[:, 1], felt[:, 6])
    return StreetLog(ranges, wheels, frame, place_m, math.atan2(gone_m[0], gone_m[1]))


def turned_while_sent(log: StreetLog) -> Array:
    """(m, 3) satellites in the body-fixed frame of the instant when the signal comes in."""
    sent_m = np.array(log.ranges.satellites_ecef_m)
    turned = log.frame.body.rate_rad_per_s * log.ranges.measured_m / LIGHT_M_PER_S
    cosine, sine = np.cos(turned), np.sin(turned)
    east, north = cosine * sent_m[:, 0] + sine * sent_m[:, 1], cosine * sent_m[:, 1] - sine * sent_m[:, 0]
    return np.stack([east, north, sent_m[:, 2]], axis=1)


def gated_filter(log: StreetLog, start: StreetStart, *, gate_sigma: float, earth_turns: bool) -> tuple[Array, Array]:
    """(places (k, 3), covariances (k, 3, 3)) of place, heading, clock, drift and GLONASS' clock, wheels carrying them.

    Noise as the log states it: 5 cm/s and 2 mrad/s of each reading, pseudoranges with their own sigma, all white.
    """
    ranges, wheels = log.ranges, log.wheels
    seen_m = log.frame.from_centred_m(turned_while_sent(log) if earth_turns else ranges.satellites_ecef_m)
    other = ranges.system != ranges.system.min()
    epochs_s = np.unique(ranges.times_s)
    mean = np.array([*start.position_m, 0.5 * math.pi - start.heading_rad, 0.0, 0.0, 0.0])
    first = ranges.times_s == epochs_s[0]
    mean[4] = np.median(ranges.measured_m[first] - np.linalg.norm(seen_m[first] - mean[:3], axis=1))
    level_m, up_m = start.position_sigma_m, start.height_sigma_m
    covariance = np.diag(np.square([level_m, level_m, up_m, start.heading_sigma_rad, 100.0, 10.0, 30.0]))
    places, covariances = np.zeros((len(epochs_s), 3)), np.zeros((len(epochs_s), 3, 3))
    for number, now_s in enumerate(epochs_s):
        if number:
            step_s = now_s - epochs_s[number - 1]
            speed, turn = (
                np.interp(now_s, wheels.times_s, one) for one in (wheels.forward_m_per_s, wheels.turns_rad_per_s)
            )
            mean, covariance = _carried(mean, covariance, float(speed), float(turn), float(step_s))
        for one in np.flatnonzero(ranges.times_s == now_s):
            away = mean[:3] - seen_m[one]
            row = np.array([*(away / np.linalg.norm(away)), 0.0, 1.0, 0.0, float(other[one])])
            innovation = ranges.measured_m[one] - np.linalg.norm(away) - mean[4] - other[one] * mean[6]
            noise = ranges.sigmas_m[one] ** 2
            variance = row @ covariance @ row + noise
            if innovation**2 > gate_sigma**2 * variance:
                continue
            gain = covariance @ row / variance
            mean = mean + gain * innovation
            kept = np.eye(7) - np.outer(gain, row)
            covariance = kept @ covariance @ kept.T + noise * np.outer(gain, gain)
        places[number], covariances[number] = mean[:3], covariance[:3, :3]
    return places, covariances


def _carried(mean: Array, covariance: Array, speed: float, turn: float, step_s: float) -> tuple[Array, Array]:
    halfway = mean[3] + 0.5 * turn * step_s
    east, north = speed * step_s * math.cos(halfway), speed * step_s * math.sin(halfway)
    transition = np.eye(7)
    transition[0, 3], transition[1, 3], transition[4, 5] = -north, east, step_s
    way_m2 = (0.05 * step_s) ** 2
    noise = np.diag([way_m2, way_m2, (0.03 * step_s) ** 2, (0.002 * step_s) ** 2, 0.01 * step_s, 0.09 * step_s, 0.0])
    moved = mean + np.array([east, north, 0.0, turn * step_s, mean[5] * step_s, 0.0, 0.0])
    return moved, transition @ covariance @ transition.T + noise
