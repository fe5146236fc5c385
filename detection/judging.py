"""What a detector does with the usable part of an epoch: ask every witness, fuse, and learn for the next epoch."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from .epoch_arrays import EpochArrays, anchor_places, arrays_of
from .epoch_results import epoch_result, verdict_on
from .epochs import RangeEpoch, RangingAnchor
from .fusion import GEOMETRY_WEIGHTS, MOTION_WEIGHT, ODOMETRY_WEIGHTS, is_good_geometry
from .geometric import GeometricDetection
from .intake import Intake
from .motion.odometry import Motion, aligned, motion_of
from .motion.tracking import Tracker
from .motion.tracks import Track
from .settings import DetectorSettings
from .standing import detect_standing
from .state import Monitor, sensitivity_scale
from .verdicts import AnchorVerdict, EpochResult, OdometryCondition, PositionFix, Say, Sight
from .witnesses import Change, Trusted, geometry_says, motion_says, odometry_says, prediction_says

__all__ = ["Judge"]

CLEAR, UNKNOWN, SILENT = Sight.CLEAR, Sight.UNKNOWN, Say.SILENT


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
        self.motion: Motion | None = None  # of the latest epoch, as it was used

    @property
    def track(self) -> Track | None:
        """The rover's track, where there is one."""
        return self._tracker.track

    def epoch_result(self, epoch: RangeEpoch, base_time_s: float, intake: Intake) -> EpochResult:
        """The answer to the usable part of an epoch."""
        self._move(epoch)
        settings = self._settings
        time_s = epoch.time_s - settings.ranging_offset_s
        self.motion = motion = self._driven(intake)
        self._tracker.foretell(time_s, motion)
        if intake.ground is not None:
            self._tracker.stand(intake.ground, time_s)
        speed = 0.0 if self.track is None else self.track.speed_m_per_s
        arrays = arrays_of(
            intake.ranges, self._anchors, self._numbers, self._places_m, time_s, settings, self._scale, speed
        )
        moment = arrays.at_one_moment(self._tracker.track, time_s, settings.max_speed_m_per_s)
        geometry = detect_standing(moment, intake.ground, settings.dimension, self._tracker.hint_m(), settings)
        excess_m, sigma_m = self._tracker.follow(arrays, moment, geometry, time_s)
        rover_m = self._rover_m(geometry)
        changes = [
            self._trusted[measured.anchor_id].judge(measured.range_m, sigma, settings, self._scale)
            for measured, sigma in zip(intake.ranges, arrays.heard.sigmas_m.tolist(), strict=True)
        ]
        verdicts = self._verdicts(intake, arrays, geometry, changes, (excess_m.tolist(), sigma_m.tolist()), motion)
        self._learn(verdicts, changes, arrays, rover_m)
        position = self._position(geometry, verdicts, time_s)
        self.monitor.note_heading(self._tracker.heading.warning())
        condition = OdometryCondition.MISSING if motion is None else motion.condition
        if condition is OdometryCondition.RELIABLE and self._tracker.heading.contradicted:
            condition = OdometryCondition.MISLED
        return epoch_result(
            base_time_s, tuple(verdicts), position, condition, geometry.search, intake.rejected, geometry.needed
        )

    def _verdicts(
        self,
        intake: Intake,
        arrays: EpochArrays,
        geometry: GeometricDetection,
        changes: Sequence[Change | None],
        by_track: tuple[list[float], list[float]],
        motion: Motion | None,
    ) -> list[AnchorVerdict]:
        """What the witnesses make of each range together. by_track: its excess, and the sigma of its distance."""
        geometry_weight, odometry_weight = self._weights(geometry, arrays, motion, changes)
        harmful_m = arrays.harmful_m.tolist()
        says = zip(
            geometry_says(geometry, geometry_weight),
            odometry_says(changes, odometry_weight),
            motion_says(*by_track, (0.5 * arrays.heard.sigmas_m).tolist(), harmful_m, MOTION_WEIGHT),
            prediction_says([measured.p_sight for measured in intake.ranges]),
            strict=True,
        )
        verdicts = []
        for measured, told, harm_m, track_m, meeting_m in zip(
            intake.ranges, says, harmful_m, by_track[0], geometry.excess_m.tolist(), strict=True
        ):
            # a track that is not settled still knows more than ranges that allow no position
            best_m = track_m if told[2].says is not SILENT or math.isnan(meeting_m) else meeting_m
            verdicts.append(verdict_on(measured, best_m, harm_m, told, self._settings))
        return verdicts

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
            motion, self._motion = self._tracker.led(aligned(self._motion, raw, ahead_s)), raw
            self.monitor.note_odometry(motion.reliable)
        reliable = motion if motion is not None and motion.reliable else None
        for trusted in self._trusted.values():
            trusted.drive(reliable)
        return motion

    def _weights(
        self, geometry: GeometricDetection, arrays: EpochArrays, motion: Motion | None, changes: Sequence[Change | None]
    ) -> tuple[float, float]:
        """Weights of geometry and odometry by conditions and by how well they did so far (fusion step 2)."""
        good = False
        if geometry.covariance_m2 is not None:
            mean_sigma_m = sum(arrays.heard.sigmas_m.tolist()) / len(changes)
            good = is_good_geometry(math.sqrt(float(geometry.covariance_m2.trace())) / mean_sigma_m)
        reliable = motion is not None and motion.reliable and not self.monitor.odometry_fails
        # many violations at once speak against odometry that cannot be cross-checked, not against all anchors
        violations = sum([change is not None and change.violated for change in changes])
        if violations > 1 and 2 * violations > len(changes):
            reliable = False
        geometry_weight = GEOMETRY_WEIGHTS[0 if good else 1] * self.monitor.accuracy("geometry")
        odometry_weight = ODOMETRY_WEIGHTS[0 if reliable else 1] * self.monitor.accuracy("odometry")
        return geometry_weight, odometry_weight

    def _rover_m(self, geometry: GeometricDetection) -> list[float] | None:
        """East, north, altitude (zero in two dimensions) of the rover, where its place is known."""
        if self._tracker.track is not None:
            return [*self._tracker.track.place_m.tolist()]
        if geometry.position_m is not None and geometry.checked and geometry.mirror_m is None:
            return [*geometry.position_m.tolist(), 0.0][:3]
        return None

    def _learn(
        self,
        verdicts: Sequence[AnchorVerdict],
        changes: Sequence[Change | None],
        arrays: EpochArrays,
        rover_m: Sequence[float] | None,
    ) -> None:
        """Note who was overruled, and which ranges the next ones are to be compared with."""
        for verdict, change, sigma_m, anchor_m in zip(
            verdicts, changes, arrays.heard.sigmas_m.tolist(), arrays.places_m.tolist(), strict=True
        ):
            clear = verdict.sight is CLEAR
            for say in verdict.says[:2]:
                if say.says is not SILENT:
                    self.monitor.note(say.witness, clear and say.says is not Say.CLEAR)
            violated = change is not None and change.violated and not change.shorter
            if clear or (verdict.sight is UNKNOWN and not violated):
                toward = None if rover_m is None else _direction(rover_m, anchor_m)
                self._trusted[verdict.anchor_id].trust(verdict.range_m, sigma_m, toward)

    def _position(
        self, geometry: GeometricDetection, verdicts: Sequence[AnchorVerdict], time_s: float
    ) -> PositionFix | None:
        fix = self._tracker.position(time_s)
        if fix is not None:
            return fix
        if geometry.position_m is None or geometry.covariance_m2 is None:
            return None
        checked = geometry.checked and self._tracker.is_known(geometry.covariance_m2)
        return PositionFix(geometry.position_m, geometry.covariance_m2, checked, geometry.mirror_m)


def _direction(rover_m: Sequence[float], anchor_m: Sequence[float]) -> tuple[float, float, float]:
    """The unit vector from the rover to an anchor."""
    east_m, north_m, up_m = anchor_m[0] - rover_m[0], anchor_m[1] - rover_m[1], anchor_m[2] - rover_m[2]
    distance_m = max(math.sqrt(east_m * east_m + north_m * north_m + up_m * up_m), 1e-6)
    return east_m / distance_m, north_m / distance_m, up_m / distance_m
