"""What a detector does with the usable part of an epoch: ask every witness, fuse, and learn for the next epoch."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .clock_offsets import aligned
from .epoch_arrays import EpochArrays, anchor_places, arrays_of
from .epoch_results import epoch_result, verdict_on
from .epochs import RangeEpoch, RangingAnchor
from .fusion import GEOMETRY_WEIGHTS, MOTION_WEIGHT, ODOMETRY_WEIGHTS, is_good_geometry
from .geometric import GeometricDetection, detect_ranges
from .health import Monitor, sensitivity_scale
from .intake import Intake
from .odometry import Motion, motion_of
from .range_changes import Change, Trusted
from .settings import DetectorSettings
from .tracking import Tracker
from .tracks import Track
from .verdicts import AnchorVerdict, EpochResult, OdometryCondition, PositionFix, Say, Sight
from .witnesses import geometry_says, motion_says, odometry_says, prediction_says

__all__ = ["Judge"]


class Judge:
    """The witnesses of a session and what they remember; changed in place."""

    def __init__(self, anchors: Sequence[RangingAnchor], settings: DetectorSettings) -> None:
        self._settings = settings
        self._anchors = {anchor.id: anchor for anchor in anchors}
        self._numbers = {anchor.id: number for number, anchor in enumerate(anchors)}
        self._places_m = anchor_places(self._anchors, settings.dimension)
        self._scale = sensitivity_scale(settings)
        self.monitor = Monitor()
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget track and windows, as after a clock was set back; counts and health stay."""
        self._trusted = {anchor_id: Trusted(deque(maxlen=self._settings.window)) for anchor_id in self._anchors}
        self._tracker = Tracker(len(self._anchors), self._settings)
        self._motion: Motion | None = None

    @property
    def track(self) -> Track | None:
        """The rover's track, where there is one."""
        return self._tracker.track

    def epoch_result(self, epoch: RangeEpoch, base_time_s: float, intake: Intake) -> EpochResult:
        """The answer to the usable part of an epoch."""
        self._move(epoch)
        settings = self._settings
        time_s = epoch.time_s - settings.ranging_offset_s
        motion = self._driven(intake)
        self._tracker.foretell(time_s, motion)
        speed = 0.0 if self.track is None else self.track.speed_m_per_s
        arrays = arrays_of(
            intake.ranges, self._anchors, self._numbers, self._places_m, time_s, settings, self._scale, speed
        )
        moment = arrays.at_one_moment(self._tracker.track, time_s, settings.max_speed_m_per_s)
        geometry = detect_ranges(
            moment,
            settings.dimension,
            self._tracker.hint_m(),
            refine=True,
            studentised=True,
            limit=settings.search_limit,
        )
        excess_m, sigma_m = self._tracker.follow(arrays, geometry, time_s)
        direction = self._directions(geometry)
        changes = [
            self._trusted[measured.anchor_id].judge(measured.range_m, sigma, settings, self._scale)
            for measured, sigma in zip(intake.ranges, arrays.heard.sigmas_m.tolist(), strict=True)
        ]
        weights = self._weights(geometry, arrays, motion, changes)
        verdicts = []
        for i, measured in enumerate(intake.ranges):
            harmful_m = float(arrays.harmful_m[i])
            least_m = float(0.5 * arrays.heard.sigmas_m[i])
            says = (
                geometry_says(geometry, i, weights[0]),
                odometry_says(changes[i], weights[1]),
                motion_says(float(excess_m[i]), float(sigma_m[i]), least_m, harmful_m, MOTION_WEIGHT),
                prediction_says(measured.p_sight),
            )
            # a track that is not settled still knows more than ranges that allow no position
            by_track = says[2].says is not Say.SILENT or math.isnan(geometry.excess_m[i])
            best_m = float(excess_m[i] if by_track else geometry.excess_m[i])
            verdicts.append(verdict_on(measured, best_m, harmful_m, says, settings))
        self._learn(verdicts, changes, arrays, direction)
        position = self._position(geometry, verdicts, time_s)
        condition = OdometryCondition.MISSING if motion is None else motion.condition
        return epoch_result(
            base_time_s, tuple(verdicts), position, condition, geometry.search, intake.rejected, geometry.needed
        )

    def _move(self, epoch: RangeEpoch) -> None:
        """Anchors that fly: their ranges are no longer to be compared with those from where they were."""
        for anchor in epoch.moved:
            if anchor.id in self._anchors:
                self._anchors[anchor.id] = anchor
                self._trusted[anchor.id] = Trusted(deque(maxlen=self._settings.window))
        if epoch.moved:
            self._places_m = anchor_places(self._anchors, self._settings.dimension)

    def _driven(self, intake: Intake) -> Motion | None:
        """The motion since the epoch before, noted for health and added to what each trusted range looks back on."""
        motion = None
        if intake.odometry is not None:
            raw = motion_of(intake.odometry, self._settings)
            ahead_s = self._settings.odometry_offset_s - self._settings.ranging_offset_s
            motion, self._motion = aligned(self._motion, raw, ahead_s), raw
            self.monitor.note_odometry(motion.reliable)
        for trusted in self._trusted.values():
            trusted.drive(motion)
        return motion

    def _weights(
        self, geometry: GeometricDetection, arrays: EpochArrays, motion: Motion | None, changes: Sequence[Change | None]
    ) -> tuple[float, float]:
        """Weights of geometry and odometry by conditions and by how well they did so far (fusion step 2)."""
        good = False
        if geometry.covariance_m2 is not None:
            mean_sigma_m = float(arrays.heard.sigmas_m.mean())
            good = is_good_geometry(math.sqrt(float(np.trace(geometry.covariance_m2))) / mean_sigma_m)
        reliable = motion is not None and motion.reliable and not self.monitor.odometry_fails
        # many violations at once speak against odometry that cannot be cross-checked, not against all anchors
        violations = sum(change is not None and change.violated for change in changes)
        if violations > 1 and 2 * violations > len(changes):
            reliable = False
        geometry_weight = GEOMETRY_WEIGHTS[0 if good else 1] * self.monitor.accuracy("geometry")
        odometry_weight = ODOMETRY_WEIGHTS[0 if reliable else 1] * self.monitor.accuracy("odometry")
        return geometry_weight, odometry_weight

    def _directions(self, geometry: GeometricDetection) -> npt.NDArray[np.float64] | None:
        """(n, 3) unit vectors from the rover to all anchors, where the rover's place is known."""
        place_m = np.zeros(3)
        if self._tracker.track is not None:
            place_m = self._tracker.track.place_m
        elif geometry.position_m is not None and geometry.checked and geometry.mirror_m is None:
            place_m[: self._settings.dimension] = geometry.position_m
        else:
            return None
        offset_m = self._places_m - place_m
        toward: npt.NDArray[np.float64] = offset_m / np.maximum(np.linalg.norm(offset_m, axis=1, keepdims=True), 1e-6)
        return toward

    def _learn(
        self,
        verdicts: Sequence[AnchorVerdict],
        changes: Sequence[Change | None],
        arrays: EpochArrays,
        directions: npt.NDArray[np.float64] | None,
    ) -> None:
        for i, (verdict, change) in enumerate(zip(verdicts, changes, strict=True)):
            for say in verdict.says[:2]:
                if say.says is not Say.SILENT:
                    self.monitor.note(say.witness, say.says is Say.OCCLUDED and verdict.sight is Sight.CLEAR)
            violated = change is not None and change.violated and not change.shorter
            if verdict.sight is Sight.CLEAR or (verdict.sight is Sight.UNKNOWN and not violated):
                toward = None
                if directions is not None:
                    east, north, up = directions[arrays.heard.index[i]].tolist()
                    toward = (east, north, up)
                self._trusted[verdict.anchor_id].trust(verdict.range_m, float(arrays.heard.sigmas_m[i]), toward)

    def _position(
        self, geometry: GeometricDetection, verdicts: Sequence[AnchorVerdict], time_s: float
    ) -> PositionFix | None:
        fix = self._tracker.position(time_s)
        if fix is not None:
            return fix
        if geometry.position_m is None or geometry.covariance_m2 is None:
            return None
        return PositionFix(geometry.position_m, geometry.covariance_m2, geometry.checked, geometry.mirror_m)
