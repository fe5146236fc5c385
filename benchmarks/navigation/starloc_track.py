"""STAR-loc through the filter of ranges, with what the detector says of each range and without."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import navigation
from benchmarks.detection.measured_ranges import RangeLog
from detection import Detector, DetectorSettings

__all__ = ["StarlocTrack", "detector_weights", "starloc_track"]

Array = npt.NDArray[np.float64]

# said before any run: the detector's own default, and a rig that a person carries and swings at about 1 m/s²
RANGE_SIGMA_M = DetectorSettings().range_sigma_m
MOTION = navigation.MotionNoise(1.0, 1.0, 1.0)
START_SIGMA_M = 1.0


@dataclass(frozen=True, eq=False)
class StarlocTrack:
    """n epochs where the truth holds: time_s (n,), true place_m (n, 3), error_m (n, 3), covariance_m2 (n, 3, 3); the
    share of ranges that were used."""

    time_s: Array
    place_m: Array
    error_m: Array
    covariance_m2: Array
    used_share: float

    @property
    def distance_m(self) -> Array:
        return np.asarray(np.linalg.norm(self.error_m, axis=1))


def detector_weights(log: RangeLog) -> Array:
    """(m,) weight of each range, from a detector that runs along: 0 where occluded, else how likely it is not."""
    detector = Detector(log.anchors, DetectorSettings())
    weights = []
    for epoch in log.epochs:
        verdicts = {verdict.anchor_id: verdict for verdict in detector.process(epoch).verdicts}
        for one in epoch.ranges:
            verdict = verdicts.get(one.anchor_id)
            weights.append(0.0 if verdict is None or verdict.off else 1.0 - verdict.probability)
    return np.array(weights)


def starloc_track(
    log: RangeLog, weights: Array | None = None, *, gate_sigma: float = np.inf, slow: float = 1.0
) -> StarlocTrack:
    """One log through ``navigation.filter_ranges``, every range at its own time; weights: see ``detector_weights``.

    slow: times the sigma, for errors that stay for seconds, as ``ConstantVelocityEstimator`` has it (``SLOW``).
    """
    ranges = [one for epoch in log.epochs for one in epoch.ranges]
    number = {anchor.id: place for place, anchor in enumerate(log.anchors)}
    anchors_m = np.array([(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in log.anchors])
    times_s = np.array([one.time_s for one in ranges], float)
    every = np.ones(len(ranges), bool)
    variances_m2 = navigation.range_variances_m2((slow * RANGE_SIGMA_M) ** 2, every, weights=weights)
    start = navigation.initial_state(float(times_s[0]), log.places_m[0], position_sigma_m=START_SIGMA_M)
    filtered = navigation.filter_ranges(
        start, MOTION, times_s, np.array([number[one.anchor_id] for one in ranges]),
        np.array([one.range_m for one in ranges]), variances_m2, anchors_m, gate_sigma=gate_sigma,
    )  # fmt: skip
    last = np.cumsum([len(epoch.ranges) for epoch in log.epochs]) - 1
    right = ~log.truth_is_wrong
    return StarlocTrack(
        np.array([epoch.time_s for epoch in log.epochs])[right],
        log.places_m[right],
        (filtered.position_m[last] - log.places_m)[right],
        filtered.position_covariance_m2[last][right],
        float(np.mean(filtered.verdict == navigation.Verdict.USED)),
    )
