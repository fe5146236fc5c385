"""A running detector: takes epochs in the order they come, answers each, and goes on whatever comes."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence

from .epoch_arrays import anchor_places, arrays_of
from .epoch_results import rejected_epoch
from .epochs import RangeEpoch, RangingAnchor, check_anchors
from .errors import DetectionInputError
from .faults.calibration import Calibrated, Calibration, calibration_of
from .faults.diagnosis import EpochNote, note_of, places_of, suspicions_of
from .faults.suspicions import Suspicion
from .geometric import MOST_RANGES
from .intake import EpochOrder, take_in
from .judging import Judge
from .motion.odometry import Motion
from .motion.tracking import Tracker
from .motion.tracks import foretold
from .settings import DetectorSettings
from .standing import detect_standing
from .state import AnchorRecord, DetectorState, sensitivity_scale
from .verdicts import EpochResult, PositionFix, Rejection

__all__ = ["Detector", "detect_epoch", "meeting_place"]

DEFAULTS = DetectorSettings()
NOTED = 240  # epochs that a diagnosis of the session looks back on


class Detector:
    """A running detector over fixed or flying anchors; one per rover antenna, and not for two threads at once.

    ``process`` answers epochs in the order they come and never raises for what a sensor delivers; ``state`` is a
    snapshot. Raises DetectionInputError where two anchors share an id, or for more than 62 of them.
    """

    def __init__(self, anchors: Sequence[RangingAnchor], settings: DetectorSettings = DEFAULTS) -> None:
        if len(anchors) > MOST_RANGES:
            raise DetectionInputError(f"A detector takes at most {MOST_RANGES} anchors, not {len(anchors)}.")
        check_anchors(anchors)
        self.settings = settings
        self._order = EpochOrder(settings.window)
        self._rejections: Counter[Rejection] = Counter()
        self._seen = {anchor.id: AnchorRecord() for anchor in anchors}
        self._judge = Judge(anchors, settings)
        self._epochs = 0
        self._last: EpochResult | None = None
        self._places_m = places_of(anchors)
        self._notes: deque[EpochNote] = deque(maxlen=NOTED)
        self._suspected: tuple[Suspicion, ...] | None = None  # of these notes, once somebody asked

    @property
    def state(self) -> DetectorState:
        """A snapshot: counts, the last word on each anchor, health, the last result, the track."""
        track = self._judge.track
        place_m = velocity_m_per_s = None
        if track is not None:
            east_m, north_m, up_m, east, north, up = track.state[:6].tolist()
            place_m, velocity_m_per_s = (east_m, north_m, up_m), (east, north, up)
        return DetectorState(
            self._order.time_s, self._epochs, dict(self._rejections),
            tuple(record.state(anchor_id) for anchor_id, record in self._seen.items()), self._judge.monitor.health(),
            self._last, place_m, velocity_m_per_s,
        )  # fmt: skip

    def foretold(self, time_s: float) -> PositionFix | None:
        """Where the track leads by a time on the ranging clock, unchecked, without what is yet to be measured.

        None without a track.
        """
        track, d = self._judge.track, self.settings.dimension
        if track is None:
            return None
        then_s = max(time_s - self.settings.ranging_offset_s, track.time_s)
        place_m, covariance_m2 = foretold(track, then_s, self.settings)
        return PositionFix(place_m[:d], covariance_m2[:d, :d], checked=False)

    @property
    def motion(self) -> Motion | None:
        """Odometry of the latest epoch as it was used: on the ranging clock, its heading set right; None without."""
        return self._judge.motion

    def suspicions(self) -> tuple[Suspicion, ...]:
        """What the latest epochs as a whole suffer from: units, order, faults that all ranges share; often nothing."""
        if self._suspected is None:
            self._suspected = suspicions_of(tuple(self._notes), self.settings)
        return self._suspected

    def calibration(self, what: Calibrated) -> Calibration | None:
        """What the latest epochs say of an offset of all ranges, of a scale, or of each anchor; None: nothing."""
        return calibration_of([note for note in self._notes if note.rejection is None], self.settings, what)

    def process(self, epoch: RangeEpoch) -> EpochResult:
        """The answer to one epoch; one that is late, out of order or a duplicate is rejected, counted and told.

        A duplicate has the time or number of the latest epoch, or time and ranges of one of the last 240. Ten other old
        epochs in a row that are in order among themselves mean that the sender's clock was set back: the track and the
        windows begin anew.
        """
        rejection = self._order.rejection(epoch)
        if rejection in (Rejection.LATE, Rejection.OUT_OF_ORDER) and self._has_come(epoch):
            rejection = Rejection.DUPLICATE
        if rejection in (Rejection.LATE, Rejection.OUT_OF_ORDER) and self._order.was_set_back(epoch):
            self._judge.begin_anew()
            rejection = None
        base_time_s = epoch.time_s - self.settings.ranging_offset_s + self.settings.base_offset_s
        if rejection is not None:
            self._rejections[rejection] += 1
            result = rejected_epoch(epoch, base_time_s, rejection)
            self._note(epoch, result)
            return result
        intake = take_in(epoch, self._seen, self.settings)
        self._rejections.update(rejected.reason for rejected in intake.rejected)
        result = self._judge.epoch_result(epoch, base_time_s, intake)
        self._order.accept(epoch)
        self._remember(epoch, result)
        return result

    def _has_come(self, epoch: RangeEpoch) -> bool:
        """Whether it is one of the latest epochs that were used, sent again."""
        return any(
            note.time_s == epoch.time_s and note.rejection is None and note.measured == epoch.ranges
            for note in self._notes
        )

    def _note(self, epoch: RangeEpoch, result: EpochResult) -> None:
        self._notes.append(note_of(epoch, result, self._places_m))
        self._suspected = None

    def _remember(self, epoch: RangeEpoch, result: EpochResult) -> None:
        self._epochs += 1
        self._last = result
        if epoch.moved:
            self._places_m = self._places_m | places_of(one for one in epoch.moved if one.id in self._places_m)
        self._note(epoch, result)
        for verdict in result.verdicts:
            self._seen[verdict.anchor_id].note(verdict, epoch.time_s)


def detect_epoch(
    anchors: Sequence[RangingAnchor], epoch: RangeEpoch, settings: DetectorSettings = DEFAULTS
) -> EpochResult:
    """The answer to one epoch by itself, without a past; raises DetectionInputError where two anchors share an id."""
    return Detector(anchors, settings).process(epoch)


def meeting_place(
    anchors: Sequence[RangingAnchor], epoch: RangeEpoch, settings: DetectorSettings = DEFAULTS
) -> PositionFix | None:
    """Where the ranges of one epoch meet, unchecked: the place of ``detect_epoch`` in half its time, without verdicts.

    None where they allow no place.
    """
    known = {anchor.id: anchor for anchor in anchors}
    known |= {anchor.id: anchor for anchor in epoch.moved if anchor.id in known}
    numbers = {anchor_id: number for number, anchor_id in enumerate(known)}
    intake, time_s = take_in(epoch, known, settings), epoch.time_s - settings.ranging_offset_s
    tracker = Tracker(len(known), settings)
    tracker.foretell(time_s, None)
    places_m = anchor_places(known, settings.dimension)
    scale = sensitivity_scale(settings)
    arrays = arrays_of(intake.ranges, known, numbers, places_m, time_s, settings, scale, 0.0)
    moment = arrays.at_one_moment(tracker.track, time_s, settings.max_speed_m_per_s)
    found = detect_standing(moment, intake.ground, settings.dimension, tracker.hint_m(), settings)
    if found.position_m is None or found.covariance_m2 is None:
        return None
    return PositionFix(found.position_m, found.covariance_m2, checked=False, mirror_m=found.mirror_m)
