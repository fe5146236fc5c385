"""A session's detector, with a map to look at or without, under one form; and where its ranges contradict the map."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from detection import (
    Calibrated,
    Calibration,
    Detector,
    DetectorState,
    EpochResult,
    RangeEpoch,
    RangeMeasurement,
    RangingAnchor,
    Suspicion,
)
from navigation import ESTIMATORS, Estimator
from navigation.drives import InertialEstimator
from navigation.inertial import TangentFrame
from planning.driving.frames import MIDDLE_LATITUDE_DEG, map_frame
from planning.watching import (
    Advice,
    DarkStretch,
    Drive,
    GroundErrors,
    MapDetector,
    MapDoubt,
    MoveAdvice,
    PathAdvice,
    WatchedEpoch,
)
from service.errors import RequestError
from service.files.geojson import Feature, collection_of, coordinates_of, feature
from service.files.layer import replacing
from service.live.imu import Felt, InertialUnitIn, felt
from service.live.request import DetectorIn, EpochIn
from service.parts.doubts import doubts_by_anchor
from service.parts.map_area import area_shape
from terrain import ElevationGrid
from visibility.signal import RADIOS

__all__ = ["NO_MAP", "MaybeMapped", "Memory", "Occlusions", "looked_at", "memory_of", "tangent_of", "write_doubts"]

NO_MAP = "The detector looks at no map: open one with dem_id."


def looked_at(grid: ElevationGrid) -> ElevationGrid:
    """The same grid once kernels are loaded by looking over another, so that no epoch waits for that."""
    _looked()
    return grid


@functools.cache
def _looked() -> None:
    """One epoch over a plain, of six anchors with radios."""
    plain = ElevationGrid(np.zeros((9, 9), np.float32), 100.0, 100.0)
    places_m = [(50.0, -50.0, 60.0), (750.0, -100.0, 90.0), (700.0, -700.0, 70.0), (60.0, -760.0, 110.0),
                (400.0, -40.0, 130.0), (420.0, -780.0, 50.0)]  # fmt: skip
    anchors = [RangingAnchor(f"{number}", *place_m) for number, place_m in enumerate(places_m)]
    detector = MapDetector(plain, anchors, radios={one.id: RADIOS["868MHz"] for one in anchors})
    ranges = [
        RangeMeasurement(one.id, math.dist(at, (380.0, -410.0, 1.5))) for one, at in zip(anchors, places_m, strict=True)
    ]
    detector.process(RangeEpoch(0.0, tuple(ranges)))


class MaybeMapped:
    """A detector that may look at a map; ``process`` tells what the map foretold, which may be nothing."""

    def __init__(self, detector: Detector | MapDetector, estimator: Estimator | None = None) -> None:
        self._detector = detector
        self._estimator = estimator  # beside a detector without a map; one with a map has its own

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be known of the anchors over the map, and of map doubts that are passed over."""
        return self._detector.warnings if isinstance(self._detector, MapDetector) else ()

    @property
    def state(self) -> DetectorState:
        """As ``Detector.state``."""
        return self._detector.state

    def suspicions(self) -> tuple[Suspicion, ...]:
        """As ``Detector.suspicions``."""
        return self._detector.suspicions()

    def calibration(self, what: Calibrated) -> Calibration | None:
        """As ``Detector.calibration``."""
        return self._detector.calibration(what)

    def process(self, epoch: RangeEpoch) -> WatchedEpoch:
        """The answer to one epoch."""
        if isinstance(self._detector, MapDetector):
            return self._detector.process(epoch)
        result = self._detector.process(epoch)
        step = None if self._estimator is None else self._estimator.step(epoch, result, self._detector.motion)
        return WatchedEpoch(result, None, (), {}, step)

    def advise(self, drive: Drive, last_m: float | None) -> Advice | None:
        """What lies ahead on a path; None while there is no place. Raises RequestError where there is no map."""
        return self._mapped().advise(drive, last_m)

    def advise_move(self, drive: Drive, stretch: DarkStretch, movable: Sequence[str]) -> MoveAdvice:
        """The drone to move before a stretch. Raises RequestError where there is no map, PlacementError."""
        return self._mapped().advise_move(drive, stretch, movable)

    def advise_path(self, drive: Drive, stretch: DarkStretch, at_m: float) -> PathAdvice:
        """A way round a stretch. Raises RequestError where there is no map."""
        return self._mapped().advise_path(drive, stretch, at_m)

    def _mapped(self) -> MapDetector:
        if not isinstance(self._detector, MapDetector):
            raise RequestError(NO_MAP)
        return self._detector

    def map_doubts(self) -> bytes:
        """Where ranges contradict the map, as GeoJSON. Raises RequestError where there is no map."""
        mapped = self._mapped()
        collection = _doubts_collection(mapped.grid, mapped.map_doubts())
        return json.dumps(collection, allow_nan=False).encode()


class Occlusions:
    """For each anchor, from when to when every one of its ranges has been occluded."""

    def __init__(self) -> None:
        self._runs: dict[str, tuple[float, float]] = {}

    def take_in(self, result: EpochResult) -> None:
        """Verdicts of one epoch; one that is unknown neither ends a run nor begins one."""
        for verdict in result.verdicts:
            if verdict.occluded:
                since_s, _ = self._runs.get(verdict.anchor_id, (result.time_s, result.time_s))
                self._runs[verdict.anchor_id] = since_s, result.time_s
            elif verdict.sight in ("clear", "too short"):
                self._runs.pop(verdict.anchor_id, None)

    def lasting(self, at_least_s: float) -> list[str]:
        """Ids of the anchors whose ranges have been occluded so long, in the order in which that began."""
        runs = sorted(self._runs.items(), key=lambda run: run[1])
        return [anchor_id for anchor_id, (since_s, until_s) in runs if until_s - since_s >= at_least_s]


@dataclass(slots=True)
class Memory:
    """What a session remembers: its detector, since when which anchors have been occluded, the last epoch that came.

    calibration: is applied to every range first. inertial: its filter, where that takes inertial readings; felt: what
    became of the last epoch's, which end at felt_s. Changed in place.
    """

    detector: MaybeMapped
    occlusions: Occlusions = field(default_factory=Occlusions)
    acknowledged: dict[str, float | int | None] | None = None
    calibration: Calibration | None = None
    inertial: InertialEstimator | None = None
    felt: Felt | None = None
    felt_s: float | None = None

    def process(self, asked: EpochIn) -> WatchedEpoch:
        """The answer to one epoch."""
        epoch = asked.epoch()
        self.felt, self.felt_s = felt(asked.imu, self.inertial, asked.time_s, self.felt_s)
        watched = self.detector.process(epoch if self.calibration is None else self.calibration.applied(epoch))
        if watched.result.rejection is None:
            self.occlusions.take_in(watched.result)
            self.acknowledged = {"time_s": asked.time_s, "sequence": asked.sequence}
        return watched


def memory_of(asked: DetectorIn, grid: ElevationGrid | None) -> Memory:
    """What a new session remembers; grid: with what stands there.

    Raises DetectionInputError, WatchError, StateError, AreaError.
    """
    given, estimator = asked.calibration, _estimator_of(asked, grid)
    inertial = estimator if isinstance(estimator, InertialEstimator) else None
    calibration = None
    if given is not None:
        offsets_m = {one.id: given.anchor_offsets_m.get(one.id, given.offset_m) for one in asked.anchors}
        calibration = Calibration(given.scale, 0.0, offsets_m)
    return Memory(_detector_of(asked, grid, estimator), calibration=calibration, inertial=inertial)


def _estimator_of(asked: DetectorIn, grid: ElevationGrid | None) -> Estimator | None:
    """A fresh filter, where one is asked for. Raises StateError, MeasurementError, FrameError."""
    if asked.estimator is None:
        return None
    anchors, settings = [anchor.anchor() for anchor in asked.anchors], asked.settings.settings()
    if asked.estimator != "inertial":
        return ESTIMATORS[asked.estimator](anchors, settings)
    unit = asked.imu or InertialUnitIn.model_validate({})
    latitude_deg = unit.lat_deg if grid is None or grid.crs is None else None
    return InertialEstimator(anchors, settings, unit.settings(), tangent_of(grid, anchors, latitude_deg))


def tangent_of(
    grid: ElevationGrid | None, anchors: Sequence[RangingAnchor], latitude_deg: float | None
) -> TangentFrame:
    """Gravity and the body's turning amid anchors; latitude_deg: where no map tells it, None = in the middle.

    Raises FrameError, and StateError for a latitude beside a map that tells its own.
    """
    if grid is None or not anchors:
        return TangentFrame(math.radians(MIDDLE_LATITUDE_DEG if latitude_deg is None else latitude_deg))
    middle_m = np.mean([(one.east_m, one.north_m, one.altitude_m) for one in anchors], axis=0)
    return map_frame(grid, middle_m, latitude_deg).tangent


def _detector_of(asked: DetectorIn, grid: ElevationGrid | None, estimator: Estimator | None) -> MaybeMapped:
    """The detector that a session asks for; grid: of its dem_id. Raises as ``memory_of``."""
    anchors, settings = [anchor.anchor() for anchor in asked.anchors], asked.settings.settings()
    if grid is None:
        return MaybeMapped(Detector(anchors, settings), estimator)
    errors = GroundErrors(asked.dem_sigma_m, asked.dem_correlation_m, asked.dem_shift_sigma_m)
    doubts, passed_over = doubts_by_anchor(grid, asked.doubts, {one.id: (one.east_m, one.north_m) for one in anchors})
    mapped = MapDetector(
        *(grid, anchors, settings, asked.antenna_above_ground_m, errors),
        area=area_shape(grid, asked.area),
        estimator=estimator,
        doubts=doubts,
        radios={one.id: one.radio.radio() for one in asked.anchors if one.radio is not None},
    )
    mapped.warnings += passed_over
    return MaybeMapped(mapped)


def _doubts_collection(grid: ElevationGrid, doubts: tuple[MapDoubt, ...]) -> dict[str, object]:
    """A line (a point, where the rover stood) for each contradiction, with its bearing, anchor and how sure it is."""
    return collection_of(grid, [_feature(grid, doubt) for doubt in doubts])


def write_doubts(grid: ElevationGrid, doubts: tuple[MapDoubt, ...], path: Path) -> None:
    """The same as a file, whole or not at all. Raises OSError."""
    with replacing(path) as unfinished:
        text = json.dumps(_doubts_collection(grid, doubts), allow_nan=False, indent=1)
        unfinished.write_text(text, encoding="utf-8")


def _feature(grid: ElevationGrid, doubt: MapDoubt) -> Feature:
    coordinates = coordinates_of(grid, np.array(doubt.places_m, np.float64).reshape(-1, 2))
    told = {
        "anchor_id": doubt.anchor_id,
        "expected": str(doubt.expected),
        "from_s": doubt.from_s,
        "to_s": doubt.to_s,
        "ranges": doubt.ranges,
        "bearing_deg": round(math.degrees(doubt.bearing_rad), 2),
        "distance_m": round(doubt.distance_m, 2),
        "excess_m": round(doubt.excess_m, 2) if math.isfinite(doubt.excess_m) else None,
        "probability": round(doubt.probability, 4),
    }
    if len(coordinates) == 1:
        return feature("Point", coordinates[0], told)
    return feature("LineString", coordinates, told)
