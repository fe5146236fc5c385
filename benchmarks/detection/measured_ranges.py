"""Real range logs as epochs for the detector, with the truth that came with them: starloc, plaza, labyrinth."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import scipy.io
import scipy.optimize

from detection import OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor

__all__ = ["RANGING", "RangeLog", "labyrinth", "plaza", "starloc", "starloc_sequences"]

RANGING = Path(__file__).resolve().parents[3] / "shared" / "data" / "ranging"

Floats = npt.NDArray[np.float64]

# Faster than this no rig that a person carries speeds up; truth that does is wrong.
LARGEST_TRUE_ACCELERATION_M_PER_S2 = 10.0
AROUND_WRONG_TRUTH_S = 0.35


@dataclass(frozen=True, slots=True, eq=False)
class RangeLog:
    """Epochs of one antenna, and the truth: per epoch the range error of each range (m), the place, whether the truth
    contradicts itself there (it moves as nothing can)."""

    name: str
    anchors: tuple[RangingAnchor, ...]
    epochs: tuple[RangeEpoch, ...]
    errors_m: tuple[Floats, ...]
    places_m: Floats
    truth_is_wrong: npt.NDArray[np.bool_]
    dimension: int

    def first(self, epochs: int) -> RangeLog:
        """The beginning of the log."""
        return RangeLog(
            self.name, self.anchors, self.epochs[:epochs], self.errors_m[:epochs], self.places_m[:epochs],
            self.truth_is_wrong[:epochs], self.dimension,
        )  # fmt: skip


def starloc_sequences(folder: Path = RANGING / "starloc") -> list[Path]:
    """The sequences there are."""
    return sorted(path.parent for path in folder.glob("*/uwb.csv"))


def starloc(sequence: Path) -> list[RangeLog]:
    """A sequence of STAR-loc as one log per tag; an epoch is a round in which no anchor comes twice.

    Anchors stand where the true ranges and tag poses of the sequence put them.
    """
    with (sequence / "uwb.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["range_calib"] and row["gt_range"]]
    tag, anchor = (np.array([int(float(row[name])) for row in rows]) for name in ("from_id", "to_id"))
    time_s, range_m, true_m = _columns(rows, ("time_s", "range_calib", "gt_range")).T
    place_m = _columns(rows, ("tag_pos_x", "tag_pos_y", "tag_pos_z"))
    anchors = {
        number: RangingAnchor(str(number), *_trilaterated(place_m[anchor == number], true_m[anchor == number]))
        for number in np.unique(anchor).tolist()
    }
    logs = []
    for number in np.unique(tag).tolist():
        mine = np.flatnonzero(tag == number)
        rounds = _rounds(anchor[mine].tolist())
        wrong = _moves_as_nothing_can(time_s[mine], place_m[mine])
        epochs, errors_m, last = [], [], []
        for members in rounds:
            at = mine[members]
            heard = [RangeMeasurement(str(anchor[i]), float(range_m[i]), time_s=float(time_s[i])) for i in at.tolist()]
            epochs.append(RangeEpoch(float(time_s[at[-1]]), tuple(heard)))
            errors_m.append(range_m[at] - true_m[at])
            last.append(members[-1])
        name = f"{sequence.name} tag {number}"
        logs.append(
            RangeLog(name, tuple(anchors.values()), tuple(epochs), tuple(errors_m), place_m[mine][last], wrong[last], 3)
        )
    return logs


def plaza(path: Path = RANGING / "plaza" / "Plaza1.mat") -> RangeLog:
    """The mower of plaza 1: one range an epoch, odometry since the range before, ranges calibrated by their truth.

    The raw ranges' scale and offset per beacon are fitted to the true distances first.
    """
    log = scipy.io.loadmat(path)
    truth, ranges, turns, beacons = log["GT"], log["TD"], log["DR"], log["TL"]
    place_m = np.column_stack([np.interp(ranges[:, 0], truth[:, 0], truth[:, axis]) for axis in (1, 2)])
    anchors = {int(b): RangingAnchor(str(int(b)), float(east), float(north)) for b, east, north in beacons}
    beacon = ranges[:, 2].astype(int)
    true_m = np.array(
        [math.dist(place, (anchors[b].east_m, anchors[b].north_m)) for b, place in zip(beacon, place_m, strict=True)]
    )
    calibrated_m = ranges[:, 3].copy()
    for number in anchors:
        mine = beacon == number
        fit = scipy.optimize.least_squares(
            lambda line, mine=mine: line[0] * ranges[mine, 3] + line[1] - true_m[mine], (1.0, 0.0), loss="soft_l1"
        ).x
        calibrated_m[mine] = fit[0] * ranges[mine, 3] + fit[1]
    # dead reckoning: DR is (time, metres since, radians since); the heading starts where truth has it
    way_m = _dead_reckoned(turns, float(truth[0, 3]))
    at_m = np.column_stack([np.interp(ranges[:, 0], turns[:, 0], way_m[:, axis]) for axis in (0, 1)])
    gone_m = np.interp(ranges[:, 0], turns[:, 0], np.cumsum(np.abs(turns[:, 1])))
    epochs = []
    for k in range(len(ranges)):
        odometry = None
        if k and ranges[k, 0] > ranges[k - 1, 0]:
            step_m = at_m[k] - at_m[k - 1]
            odometry = OdometryIncrement(
                float(ranges[k, 0] - ranges[k - 1, 0]),
                (float(gone_m[k] - gone_m[k - 1]), 0.0),
                heading_rad=math.atan2(step_m[0], step_m[1]),
            )
        measured = RangeMeasurement(str(beacon[k]), float(calibrated_m[k]))
        epochs.append(RangeEpoch(float(ranges[k, 0]), (measured,), odometry))
    errors_m = tuple(np.array([error]) for error in calibrated_m - true_m)
    right = np.zeros(len(epochs), bool)
    return RangeLog("plaza 1", tuple(anchors.values()), tuple(epochs), errors_m, place_m, right, 2)


def labyrinth(folder: Path = RANGING / "labyrinth") -> RangeLog:
    """The indoor rover: one range an epoch with wheel odometry since the one before; heading is not known at first."""
    lines = [line.split() for line in (folder / "Indoor_UWB_Input.txt").read_text(encoding="utf-8").splitlines()]
    truth = {
        float(words[1]): (float(words[2]), float(words[3]))
        for words in (line.split() for line in (folder / "Indoor_UWB_GT.txt").read_text(encoding="utf-8").splitlines())
        if words
    }
    ranges = [[float(word) for word in words[1:7]] for words in lines if words and words[0] == "range2"]
    wheels = {
        float(words[1]): [float(word) for word in words[2:6]] for words in lines if words and words[0] == "odom2diff"
    }
    anchors: dict[str, RangingAnchor] = {}
    epochs, errors_m, places_m = [], [], []
    before_s = None
    for time_s, range_m, variance, east_m, north_m, number in ranges:
        name = str(int(number))
        anchors.setdefault(name, RangingAnchor(name, east_m, north_m))
        odometry = None
        if before_s is not None and time_s in wheels:
            right, left, sideways, _ = wheels[time_s]
            duration_s = time_s - before_s
            odometry = OdometryIncrement(duration_s, ((right + left) / 2.0 * duration_s, sideways * duration_s))
        epochs.append(RangeEpoch(time_s, (RangeMeasurement(name, range_m, math.sqrt(variance)),), odometry))
        places_m.append(truth[time_s])
        errors_m.append(np.array([range_m - math.dist(truth[time_s], (east_m, north_m))]))
        before_s = time_s
    return RangeLog(
        "labyrinth", tuple(anchors.values()), tuple(epochs), tuple(errors_m), np.array(places_m),
        np.zeros(len(epochs), bool), 2,
    )  # fmt: skip


def _columns(rows: Sequence[dict[str, str]], names: Iterable[str]) -> Floats:
    return np.array([[float(row[name]) for name in names] for row in rows])


def _trilaterated(places_m: Floats, ranges_m: Floats) -> list[float]:
    found = scipy.optimize.least_squares(
        lambda place: np.linalg.norm(places_m - place, axis=1) - ranges_m, places_m.mean(axis=0) + 0.1
    )
    return [float(metres) for metres in found.x]


def _rounds(anchors: Sequence[int]) -> list[list[int]]:
    """Consecutive positions in which no anchor comes twice."""
    rounds: list[list[int]] = []
    heard: set[int] = set()
    for position, anchor in enumerate(anchors):
        if not rounds or anchor in heard:
            rounds.append([])
            heard = set()
        rounds[-1].append(position)
        heard.add(anchor)
    return rounds


def _moves_as_nothing_can(time_s: Floats, place_m: Floats) -> npt.NDArray[np.bool_]:
    """Where the truth speeds up faster than a person can carry it, and a little around."""
    evenly_s = np.arange(time_s[0], time_s[-1], 0.05)
    place = np.column_stack([np.interp(evenly_s, time_s, place_m[:, axis]) for axis in range(3)])
    place = np.column_stack([np.convolve(place[:, axis], np.ones(3) / 3.0, "same") for axis in range(3)])
    speed = np.gradient(place, evenly_s, axis=0)
    acceleration = np.linalg.norm(np.gradient(speed, evenly_s, axis=0), axis=1)
    acceleration[:4] = acceleration[-4:] = 0.0  # the mean over three samples has no neighbours there
    wrong_s = evenly_s[acceleration > LARGEST_TRUE_ACCELERATION_M_PER_S2]
    if not len(wrong_s):
        return np.zeros(len(time_s), bool)
    near: npt.NDArray[np.bool_] = np.abs(time_s[:, None] - wrong_s[None, :]).min(axis=1) <= AROUND_WRONG_TRUTH_S
    return near


def _dead_reckoned(turns: Floats, heading_rad: float) -> Floats:
    """Places (heading counter-clockwise from east) of odometry that says how far and how much it turned."""
    headings = heading_rad + np.cumsum(turns[:, 2])
    halfway = headings - turns[:, 2] / 2.0
    steps = turns[:, 1, None] * np.column_stack([np.cos(halfway), np.sin(halfway)])
    places_m: Floats = np.cumsum(steps, axis=0)
    return places_m
