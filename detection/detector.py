"""A running detector: takes epochs in the order they come, answers each, and goes on whatever comes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from .epochs import RangeEpoch, RangingAnchor, check_anchors
from .geometric import GeometricDetection, detect_2d, detect_3d
from .intake import Intake, epoch_rejection, take_in
from .settings import DetectorSettings
from .state import AnchorState, DetectorState, Health
from .tolerances import sigma_geometric_m
from .verdicts import (
    AnchorVerdict,
    Classification,
    EpochResult,
    OdometryCondition,
    PlanningStatus,
    PositionFix,
    Rejection,
    Say,
    SearchReport,
    Sight,
    Witness,
    WitnessSay,
)

__all__ = ["Detector", "detect_epoch"]

DEFAULTS = DetectorSettings()


class Detector:
    """A running detector over fixed or flying anchors; one per rover antenna, and not for two threads at once.

    ``process`` answers epochs in the order they come and never raises for what a sensor delivers; ``state`` is a
    snapshot. Raises DetectionInputError where two anchors share an id.
    """

    def __init__(self, anchors: Sequence[RangingAnchor], settings: DetectorSettings = DEFAULTS) -> None:
        check_anchors(anchors)
        self.settings = settings
        self._anchors = {anchor.id: anchor for anchor in anchors}
        self._rejections: Counter[Rejection] = Counter()
        self._seen = {
            anchor.id: AnchorState(anchor.id, Sight.UNKNOWN, 0.5, None, float("nan"), 0, 0.0) for anchor in anchors
        }
        self._times_s: list[float] = []
        self._sequence: int | None = None
        self._epochs = 0
        self._last: EpochResult | None = None

    @property
    def state(self) -> DetectorState:
        """A snapshot: counts, the last word on each anchor, health, the last result."""
        time_s = self._times_s[-1] if self._times_s else None
        health = Health(0.0, 0.0, 0.0, ())
        return DetectorState(
            time_s, self._epochs, dict(self._rejections), tuple(self._seen.values()), health, self._last
        )

    def process(self, epoch: RangeEpoch) -> EpochResult:
        """The answer to one epoch; one that is late, out of order or a duplicate is rejected, counted and told."""
        times_s = self._times_s
        rejection = epoch_rejection(
            epoch, times_s[-1] if times_s else None, self._sequence, times_s[0] if times_s else None
        )
        if rejection is not None:
            self._rejections[rejection] += 1
            return _rejected(epoch, rejection)
        for anchor in epoch.moved:
            self._anchors[anchor.id] = anchor
        intake = take_in(epoch, self._anchors, self.settings)
        self._rejections.update(rejected.reason for rejected in intake.rejected)
        result = self._judge(epoch, intake)
        self._times_s = [*times_s[-self.settings.window + 1 :], epoch.time_s]
        self._sequence, self._epochs, self._last = epoch.sequence, self._epochs + 1, result
        return result

    def _judge(self, epoch: RangeEpoch, intake: Intake) -> EpochResult:
        settings = self.settings
        geometry = _geometry(intake, self._anchors, settings)
        verdicts = []
        for i, measured in enumerate(intake.ranges):
            undetermined = geometry.classification is Classification.UNDETERMINED
            sight = Sight.UNKNOWN if undetermined else Sight.OCCLUDED if geometry.occluded[i] else Sight.CLEAR
            says = Say.SILENT if undetermined else Say.OCCLUDED if geometry.occluded[i] else Say.CLEAR
            probability = {Sight.UNKNOWN: 0.5, Sight.OCCLUDED: 1.0, Sight.CLEAR: 0.0}[sight]
            excess_m = float(geometry.excess_m[i])
            reason = f"{measured.anchor_id} is {sight}: its range is {excess_m:+.2f} m off where the others meet."
            say = WitnessSay(Witness.GEOMETRY, says, float(geometry.statistic[i]), 1.0, reason)
            verdicts.append(
                AnchorVerdict(
                    measured.anchor_id, sight, probability, abs(probability - 0.5) * 2.0, float(geometry.statistic[i]),
                    measured.range_m, excess_m, (say,), reason,
                )
            )  # fmt: skip
            before = self._seen[measured.anchor_id]
            share = (before.occluded_share * before.ranges + (sight is Sight.OCCLUDED)) / (before.ranges + 1)
            self._seen[measured.anchor_id] = AnchorState(
                measured.anchor_id, sight, probability, epoch.time_s, measured.range_m, before.ranges + 1, share
            )
        excluded = tuple(verdict.anchor_id for verdict in verdicts if verdict.occluded)
        included = tuple(verdict.anchor_id for verdict in verdicts if not verdict.occluded)
        position = None
        if geometry.position_m is not None and geometry.covariance_m2 is not None:
            position = PositionFix(geometry.position_m, geometry.covariance_m2, geometry.checked, geometry.mirror_m)
        planning = PlanningStatus.NO_POSITION
        if position is not None:
            planning = (
                PlanningStatus.UNCHECKED
                if not position.checked
                else PlanningStatus.DEGRADED
                if excluded
                else PlanningStatus.CHECKED
            )
        summary = f"{geometry.classification.capitalize()}: {len(excluded)} of {len(verdicts)} anchors occluded."
        return EpochResult(
            epoch.time_s, None, geometry.classification, tuple(verdicts), excluded, included, position, planning,
            OdometryCondition.MISSING, geometry.search, intake.rejected, geometry.needed, summary,
        )  # fmt: skip


def detect_epoch(
    anchors: Sequence[RangingAnchor], epoch: RangeEpoch, settings: DetectorSettings = DEFAULTS
) -> EpochResult:
    """The answer to one epoch by itself, without a past; raises DetectionInputError where two anchors share an id."""
    return Detector(anchors, settings).process(epoch)


def _geometry(intake: Intake, anchors: dict[str, RangingAnchor], settings: DetectorSettings) -> GeometricDetection:
    known = [anchors[measured.anchor_id] for measured in intake.ranges]
    sigma_m = np.array(
        [
            sigma_geometric_m(
                measured.sigma_m or settings.range_sigma_m,
                anchor.sigma_m or settings.anchor_sigma_m,
                settings.calculation_sigma_m,
            )
            for measured, anchor in zip(intake.ranges, known, strict=True)
        ]
    )
    tolerance_m = settings.k_geometric * sigma_m
    if settings.geometric_tolerance_m is not None:
        tolerance_m = np.full(len(known), settings.geometric_tolerance_m)
    places = np.array([(a.east_m, a.north_m, a.altitude_m) for a in known]).reshape(-1, 3)[:, : settings.dimension]
    ranges_m = np.array([measured.range_m for measured in intake.ranges])
    detect = detect_2d if settings.dimension == 2 else detect_3d
    return detect(places, ranges_m, tolerance_m, studentised=True, search_limit=settings.search_limit)


def _rejected(epoch: RangeEpoch, rejection: Rejection) -> EpochResult:
    return EpochResult(
        epoch.time_s, rejection, Classification.UNDETERMINED, (), (), (), None, PlanningStatus.NO_POSITION,
        OdometryCondition.MISSING, SearchReport(0, True), (), "", f"The epoch was not used: {rejection}.",
    )  # fmt: skip
