"""A log replayed through a detector: every answer, and what the whole of it comes to."""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields

import numpy as np

from detection import (
    Detector,
    DetectorSettings,
    DetectorState,
    EpochResult,
    Health,
    PlanningStatus,
    RangeEpoch,
    RangingAnchor,
)
from navigation import Estimator, RoverEstimate
from planning.watching import MapDetector, MapDoubt
from service.live.imu import LogReadings
from service.live.keeping import Kept
from service.live.limits import DetectorLimits
from service.live.request import ANCHORS, RANGES, DetectorIn, EpochIn
from service.live.sessions import Bench, DetectorSession
from service.live.watching import MaybeMapped, memory_of

__all__ = ["AnchorSummary", "Episode", "Replay", "ReplaySummary", "rehearse", "replay"]

MOST_NEEDS = 5  # of what would settle epochs, the most frequent


@dataclass(frozen=True, slots=True)
class Episode:
    """An anchor called occluded from its range at ``from_s`` to that at ``to_s``, in every range between."""

    anchor_id: str
    from_s: float
    to_s: float
    ranges: int
    greatest_excess_m: float


@dataclass(frozen=True, slots=True)
class AnchorSummary:
    """What became of an anchor's ranges. sights: how many of them were called what."""

    anchor: RangingAnchor
    ranges: int
    sights: Mapping[str, int]
    occluded_share: float | None
    median_excess_m: float | None
    last_sight: str | None

    def document(self) -> dict[str, object]:
        """Ready for JSON."""
        return {
            **asdict(self.anchor),
            "ranges": self.ranges,
            **self.sights,
            "occluded_share": self.occluded_share,
            "median_excess_m": self.median_excess_m,
            "last_sight": self.last_sight,
        }


@dataclass(frozen=True, slots=True)
class ReplaySummary:
    """A replayed log in numbers: epochs, seconds, counts by word, shares 0..1, milliseconds per epoch."""

    epochs: int
    epochs_used: int
    from_s: float | None
    to_s: float | None
    classifications: Mapping[str, int]
    planning: Mapping[str, int]
    availability: float | None
    odometry: Mapping[str, int]
    rejections: Mapping[str, int]
    needed: Mapping[str, int]
    searches_cut_short: int
    anchors: tuple[AnchorSummary, ...]
    episodes: tuple[Episode, ...]
    health: Health
    settings: DetectorSettings
    epoch_time_ms: Mapping[str, float]
    version: str

    def document(self) -> dict[str, object]:
        """Ready for JSON: null for what JSON has no number for."""
        told = {field.name: getattr(self, field.name) for field in fields(self)}
        written = {
            "anchors": [anchor.document() for anchor in self.anchors],
            "episodes": [asdict(episode) for episode in self.episodes],
            "health": asdict(self.health),
            "settings": asdict(self.settings),
        }
        return {name: _finite(value) for name, value in {**told, **written}.items()}


@dataclass(frozen=True, slots=True)
class Replay:
    """What came of a log. results: one per epoch, in the log's order. times_s: how long each took.

    p_sight: by epoch and anchor, what a map foretold, None without one; p_usable: the same of signals, None without
    radios. doubts: where ranges contradict it.
    estimates: by epoch, of a filter that went along; None without one.
    """

    anchors: tuple[RangingAnchor, ...]
    settings: DetectorSettings
    epochs: tuple[RangeEpoch, ...]
    results: tuple[EpochResult, ...]
    times_s: tuple[float, ...]
    state: DetectorState
    p_sight: tuple[Mapping[str, float], ...] | None = None
    doubts: tuple[MapDoubt, ...] = ()
    estimates: tuple[RoverEstimate | None, ...] | None = None
    p_usable: tuple[Mapping[str, float], ...] | None = None

    def episodes(self) -> list[Episode]:
        """Every stretch in which an anchor was called occluded, in the order of their beginnings."""
        episodes = [episode for anchor in self.anchors for episode in _episodes_of(anchor.id, self.results)]
        return sorted(episodes, key=lambda episode: (episode.from_s, episode.anchor_id))

    def summary(self) -> ReplaySummary:
        """The whole of it in numbers."""
        used = [result for result in self.results if result.rejection is None]
        milliseconds = 1e3 * np.asarray(self.times_s) if self.times_s else np.zeros(1)
        return ReplaySummary(
            epochs=len(self.results),
            epochs_used=len(used),
            from_s=used[0].time_s if used else None,
            to_s=used[-1].time_s if used else None,
            classifications=_counts(result.classification for result in used),
            planning=_counts(result.planning for result in used),
            availability=_share(sum(r.planning is not PlanningStatus.NO_POSITION for r in used), len(used)),
            odometry=_counts(result.odometry for result in used),
            rejections=_counts(reason for reason, count in self.state.rejections.items() for _ in range(count)),
            needed=dict(list(_counts(r.needed for r in used if r.needed).items())[:MOST_NEEDS]),
            searches_cut_short=sum(not result.search.complete for result in used),
            anchors=tuple(self._anchor(anchor) for anchor in self.anchors),
            episodes=tuple(self.episodes()),
            health=self.state.health,
            settings=self.settings,
            epoch_time_ms={
                "median": float(np.median(milliseconds)),
                "p99": float(np.percentile(milliseconds, 99)),
                "largest": float(milliseconds.max()),
            },
            version=importlib.metadata.version("sightline"),
        )

    def _anchor(self, anchor: RangingAnchor) -> AnchorSummary:
        verdicts = [v for result in self.results for v in result.verdicts if v.anchor_id == anchor.id]
        occluded = [verdict for verdict in verdicts if verdict.occluded]
        excesses_m = [verdict.excess_m for verdict in occluded if np.isfinite(verdict.excess_m)]
        return AnchorSummary(
            anchor=anchor,
            ranges=len(verdicts),
            sights=_counts(verdict.sight for verdict in verdicts),
            occluded_share=_share(len(occluded), len(verdicts)),
            median_excess_m=float(np.median(excesses_m)) if excesses_m else None,
            last_sight=str(verdicts[-1].sight) if verdicts else None,
        )


def replay(
    anchors: Sequence[RangingAnchor],
    epochs: Sequence[RangeEpoch],
    settings: DetectorSettings,
    progress: Callable[[float], None] | None = None,
    mapped: MapDetector | None = None,
    estimator: Estimator | None = None,
    readings: LogReadings | None = None,
) -> Replay:
    """Send the epochs through one detector, in their order; mapped: a fresh one of the same that looks at a map.

    estimator: a fresh filter that goes along, that of ``mapped`` where there is one. readings: what it takes besides.
    Raises DetectionInputError.
    """
    rehearse()  # kernels are loaded before the first epoch is timed
    detector = MaybeMapped(mapped or Detector(anchors, settings), estimator)
    watched, times_s = [], []
    for number, epoch in enumerate(epochs, 1):
        begin_s = time.perf_counter()
        if readings is not None:
            readings.give(epoch.time_s)
        watched.append(detector.process(epoch))
        times_s.append(time.perf_counter() - begin_s)
        if readings is not None:
            readings.note()
        if progress is not None and number % 64 == 0:
            progress(number / len(epochs))
    results = tuple(one.result for one in watched)
    p_sight = None if mapped is None else tuple(one.p_sight for one in watched)
    p_usable = None if mapped is None or not mapped.radios else tuple(one.p_usable for one in watched)
    doubts = () if mapped is None else mapped.map_doubts()
    estimates = None if estimator is None else tuple(one.estimate for one in watched)
    told = (p_sight, doubts, estimates, p_usable)
    return Replay(tuple(anchors), settings, tuple(epochs), results, tuple(times_s), detector.state, *told)


def _episodes_of(anchor_id: str, results: Sequence[EpochResult]) -> Iterator[Episode]:
    run: list[tuple[float, float]] = []
    for result in results:
        verdict = next((verdict for verdict in result.verdicts if verdict.anchor_id == anchor_id), None)
        if verdict is None:
            continue
        if verdict.occluded:
            run.append((result.time_s, verdict.excess_m))
        elif run:
            yield _episode(anchor_id, run)
            run = []
    if run:
        yield _episode(anchor_id, run)


def _episode(anchor_id: str, run: Sequence[tuple[float, float]]) -> Episode:
    excesses_m = [excess_m for _, excess_m in run if np.isfinite(excess_m)]
    return Episode(anchor_id, run[0][0], run[-1][0], len(run), max(excesses_m, default=float("nan")))


def _counts(words: Iterable[object]) -> dict[str, int]:
    return {str(word): count for word, count in Counter(words).most_common()}


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {name: _finite(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def rehearse() -> None:
    """Load what a detector needs by using it, in both dimensions: a range that lies, odometry, then all ranges lie."""
    ranges = [{**measured, "range_m": measured["range_m"] + 3.0 * (n == 1)} for n, measured in enumerate(RANGES)]
    odometry = {"duration_s": 1.0, "wheel_m": (0.1, 0.0), "accelerometer_m": (0.1, 0.0, 0.0), "heading_deg": 90.0}
    for dimension in (2, 3):
        asked = DetectorIn.model_validate({"anchors": ANCHORS, "settings": {"dimension": dimension}})
        limits = DetectorLimits(len(ANCHORS), asked.settings.search_limit, 0, 1)
        kept, memory = Kept("rehearsal", "", 1.0, asked), memory_of(asked, None)
        session = DetectorSession(kept, memory, limits, Bench(), time.monotonic)
        for time_s in range(3):
            epoch = {"time_s": float(time_s), "ranges": ranges, "odometry": odometry if time_s else None}
            session.answer(EpochIn.model_validate(epoch))
        for time_s in range(3, 15):
            apart = [{**one, "range_m": one["range_m"] * (1.0 + 0.1 * n)} for n, one in enumerate(RANGES)]
            session.answer(EpochIn.model_validate({"time_s": float(time_s), "ranges": apart}))
        session.state()  # it looks for the cause
