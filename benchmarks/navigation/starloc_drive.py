"""STAR-loc's rig of two tags and an inertial unit: five seconds without ranges, against constant velocity."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from benchmarks.detection.measured_ranges import RangeLog, starloc, starloc_sequences
from benchmarks.navigation.starloc_track import RANGE_SIGMA_M, START_SIGMA_M, detector_weights, starloc_track
from benchmarks.report import Row, Table
from navigation.drives import DriveLog, DriveSettings, DriveTrack, Foreseen, Ranges, Readings, navigate_drive
from navigation.inertial import ImuNoise, TangentFrame, matrices_of

__all__ = ["ranges_dropped", "rig_drive"]

Array = npt.NDArray[np.float64]
DROPPED_S, BEGINNINGS_S = 5.0, (10.0, 14.0, 18.0, 22.0, 26.0)
# the tags on the rig, forward, left, up, as the set's own poses have them; the unit is a hand from the rig's origin
TAGS_M = np.array([(-0.085, -0.207, 0.069), (-0.085, 0.0, 0.069)])
# the unit's axes point forward, right, down, and it leans 9 degrees on the rig
MOUNTED = Rotation.from_euler("y", -9.0, degrees=True) * Rotation.from_euler("x", 180.0, degrees=True)
# said before any run: a camera's unit, whose readings are taken every 5 to 35 ms from a rig that is swung
UNIT = ImuNoise(0.05, 0.005, 0.3, 0.01, 0.01, 0.0005, 300.0)
SETTINGS = DriveSettings(
    imu=UNIT,
    imu_late_s=0.04,
    align_s=1.0,
    position_sigma_m=START_SIGMA_M,
    range_sigma_m=RANGE_SIGMA_M,
    lever_arm_sigma_m=0.1,
    gate_sigma=4.0,
    hidden_excess_m=0.0,  # the detector's verdicts are weights here
    smoother=False,
)
# the room is somewhere in Quebec; nothing here feels the Earth turn
FRAME = TangentFrame(math.radians(45.5))


def ranges_dropped(beginnings_s: tuple[float, ...] = BEGINNINGS_S) -> Table:
    """Errors of both tags while no ranges come, where the truth is possible."""
    title, columns = (
        "Five seconds without ranges: STAR-loc",
        ("sequence", "constant velocity", "tightly coupled", "ratio"),
    )
    sequences = starloc_sequences()
    if not sequences:
        return Table(title, columns, (Row(("the data are not here", "", "", "")),))
    rows = []
    for sequence in sequences:
        logs = starloc(sequence)
        weights = [detector_weights(log) for log in logs]
        plain, tight = [], []
        for begin_s in beginnings_s:
            dropped = (begin_s, begin_s + DROPPED_S)
            track = rig_drive(sequence, logs, weights, dropped)
            for tag, (log, weight) in enumerate(zip(logs, weights, strict=True)):
                kept = np.where(_within(_times(log), dropped), 0.0, weight)
                alone = starloc_track(log, kept)
                away = _within(alone.time_s, dropped)
                plain.append(alone.distance_m[away])
                at = _tag_places(track, tag, alone.time_s)
                tight.append(np.linalg.norm(at - alone.place_m, axis=1)[away])
        found = [float(np.sqrt(np.mean(np.concatenate(one) ** 2))) for one in (plain, tight)]
        ratio = found[1] / found[0]
        cells = (sequence.name, f"{found[0]:.2f} m", f"{found[1]:.2f} m", f"{ratio:.2f}")
        rows.append(Row(cells, "≤ 0.5 × constant velocity", ratio <= 0.5))
    note = (
        f"{len(beginnings_s)} gaps of {DROPPED_S:.0f} s in 35 s; position error, rms, within them. Both believe the "
        "first true place to 1 m and weigh ranges by the detector; the inertial filter has both tags on their arms, "
        "tries twelve headings, and estimates where the unit sits on the rig. Noise as said beforehand, not fitted."
    )
    return Table(title, columns, rows, note)


def rig_drive(
    sequence: Path, logs: list[RangeLog], weights: list[Array], dropped_s: tuple[float, float] = (0.0, 0.0)
) -> DriveTrack:
    """The rig's track by its readings and the ranges of both tags, but for those of an interval."""
    with (sequence / "imu.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = ["time_s", *(f"{what}_{axis}" for what in ("linear_acceleration", "angular_velocity") for axis in "xyz")]
    read = np.array([[float(row[name]) for name in names] for row in rows])
    turned = [MOUNTED.apply(read[:, 1:4]), MOUNTED.apply(read[:, 4:7])]
    # readings are of instants: the mean since the one before is that of both
    forces, rates = (np.concatenate([one[:1], 0.5 * (one[1:] + one[:-1])]) for one in turned)
    number = {anchor.id: place for place, anchor in enumerate(logs[0].anchors)}
    told = np.array(
        [
            (one.time_s, number[one.anchor_id], one.range_m, tag, weight)
            for tag, (log, sure) in enumerate(zip(logs, weights, strict=True))
            for one, weight in zip((one for epoch in log.epochs for one in epoch.ranges), sure, strict=True)
        ]
    )
    told = told[np.argsort(told[:, 0], kind="stable")]
    told = told[~_within(told[:, 0], dropped_s)]
    ranges = Ranges(
        told[:, 0], told[:, 1].astype(np.int64), told[:, 2], np.full(len(told), np.nan), TAGS_M[told[:, 3].astype(int)]
    )
    anchors_m = np.array([(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in logs[0].anchors])
    place = tuple(logs[1].places_m[0].tolist())
    log = DriveLog(Readings(read[:, 0], forces, rates), ranges=ranges, anchors_m=anchors_m)
    return navigate_drive(log, replace(SETTINGS, position_m=place), FRAME, Foreseen(sight=told[:, 4]))


def _tag_places(track: DriveTrack, tag: int, times_s: Array) -> Array:
    """(n, 3) places of a tag; the arm from the unit is the one that was estimated."""
    arms_m = matrices_of(track.filtered.quaternion) @ (track.filtered.lever_arm_m + TAGS_M[tag])
    at = track.position_m + arms_m
    return np.stack([np.interp(times_s, track.times_s, axis) for axis in at.T], axis=1)


def _times(log: RangeLog) -> Array:
    return np.array([one.time_s for epoch in log.epochs for one in epoch.ranges], float)


def _within(times_s: Array, interval_s: tuple[float, float]) -> npt.NDArray[np.bool_]:
    inside: npt.NDArray[np.bool_] = (times_s >= interval_s[0]) & (times_s < interval_s[1])
    return inside
