"""A running detector that looks at a map: prediction and detection in one loop.

Before each epoch the map is asked, at the place and uncertainty to which the session's track leads, whom the rover
should see and how high the ground is. The detector weighs both in; what ranges say is held against the map in turn.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely

from detection import (
    Calibrated,
    Calibration,
    Detector,
    DetectorSettings,
    DetectorState,
    EpochResult,
    PositionFix,
    RangeEpoch,
    RangeMeasurement,
    RangingAnchor,
    Suspicion,
    meeting_place,
)
from navigation import Estimator, RoverEstimate
from planning.errors import WatchError
from terrain import ElevationGrid
from visibility import Curvature
from visibility.sight import SightDoubt
from visibility.signal import Radio

from .advice import Advice, DarkStretch, Drive, advise
from .detours import PathAdvice, advise_path
from .doubts import Doubts, MapDoubt, Trust, off_without_map
from .forecasts import DEFAULT_ERRORS, GroundErrors, SightForecast, ground_amid
from .heights import HeightCheck, free_height
from .lookouts import Lookout
from .moves import MoveAdvice, advise_move

__all__ = ["MapDetector", "WatchedEpoch"]

USUAL = DetectorSettings()
LOOKS = 3  # at the map before a session has a track: a place tells whom to believe, and that a better place


@dataclass(frozen=True, slots=True, eq=False)
class WatchedEpoch:
    """The answer to one epoch, with what the map foretold of it.

    forecast: None where the session had no place, or one off the map or outside the area. p_direct: by anchor, as the
    detector was told it. estimate: of the session's own filter, where it has one that has begun.
    """

    result: EpochResult
    forecast: SightForecast | None
    anchor_ids: tuple[str, ...]
    p_direct: Mapping[str, float]
    estimate: RoverEstimate | None = None

    @property
    def p_sight(self) -> Mapping[str, float]:
        """By anchor, the map's probability of sight; anchors of which it knows nothing are left out."""
        return {} if self.forecast is None else _known(self.anchor_ids, self.forecast.p_sight)

    @property
    def p_usable(self) -> Mapping[str, float]:
        """By anchor, the probability that enough of its signal arrives; those without a radio are left out."""
        return {} if self.forecast is None else _known(self.anchor_ids, self.forecast.p_usable)


class MapDetector:
    """A ``Detector`` whose anchors' sight and whose rover's height a map foretells; not for two threads at once.

    grid: the map, in the frame of the anchors. antenna_above_ground_m: of the rover, which stands on the ground.
    errors: how wrong the map may be. area: a polygon in the grid's frame; where the rover is outside it, the map is not
    asked; ground outside hides all the same. A range that brings its own p_sight keeps it. estimator: a fresh filter
    that goes along. doubts: by anchor, what ranges of earlier drives said against the map; forgotten of one that moves.
    radios: by anchor; the detector then hears how likely a range that arrives came straight, trees on the grid and all.
    Raises WatchError, SignalError, and DetectionInputError as Detector does.
    """

    def __init__(
        self,
        grid: ElevationGrid,
        anchors: Sequence[RangingAnchor],
        settings: DetectorSettings = USUAL,
        antenna_above_ground_m: float = 1.5,
        errors: GroundErrors = DEFAULT_ERRORS,
        curvature: Curvature | None = None,
        area: shapely.Geometry | None = None,
        estimator: Estimator | None = None,
        doubts: Mapping[str, tuple[SightDoubt, ...]] | None = None,
        radios: Mapping[str, Radio] | None = None,
    ) -> None:
        if settings.dimension != 3:
            raise WatchError("A map is of use in three dimensions only; leave dimension at 3.")
        if not anchors:
            raise WatchError("A map tells of anchors; give at least one, or leave the DEM out.")
        self._lookout = Lookout(grid, anchors, antenna_above_ground_m, curvature, area, doubts or {}, radios or {})
        self.warnings, self.errors = self._lookout.warnings, errors
        self._somewhere = ground_amid(grid, anchors, antenna_above_ground_m)
        if settings.altitude_hint_m is None:
            settings = replace(settings, altitude_hint_m=self._somewhere.altitude_m)
        self._detector = Detector(anchors, settings)
        self._estimator = estimator
        self._doubts = Doubts()
        self._heights = HeightCheck(errors.dem_sigma_m)
        self._trust = Trust()

    @property
    def grid(self) -> ElevationGrid:
        """The map."""
        return self._lookout.grid

    @property
    def radios(self) -> Mapping[str, Radio]:
        """By anchor."""
        return self._lookout.radios

    @property
    def settings(self) -> DetectorSettings:
        """As the detector has them; the altitude hint is the map's where none was given."""
        return self._detector.settings

    @property
    def state(self) -> DetectorState:
        """A snapshot, as ``Detector.state``."""
        return self._detector.state

    def suspicions(self) -> tuple[Suspicion, ...]:
        """As ``Detector.suspicions``."""
        return self._detector.suspicions()

    def calibration(self, what: Calibrated) -> Calibration | None:
        """As ``Detector.calibration``."""
        return self._detector.calibration(what)

    def map_doubts(self) -> tuple[MapDoubt, ...]:
        """Where the ranges of the session contradict the map, in the order in which that began."""
        return self._doubts.found(dict(self._lookout.places_m))

    def advise(self, drive: Drive, last_m: float | None = None) -> Advice | None:
        """What lies ahead on a path, of anchors that stand as they do now; None while the session has no place.

        last_m: where on the path the rover was before. Anchors that ranges have for hidden against the map stay hidden.
        """
        time_s = self.state.time_s
        place = None if time_s is None else self._detector.foretold(time_s)
        if place is None:
            return None
        look = self._lookout
        return advise(
            look.grid, drive, place, look.ranging(),
            antenna_above_ground_m=look.antenna_above_ground_m, range_sigma_m=self.settings.range_sigma_m,
            occluded=self._doubts.hidden(), last_m=last_m, errors=self.errors, curvature=look.curvature,
            doubts=look.doubts, radios=look.radios,
        )  # fmt: skip

    def advise_move(self, drive: Drive, stretch: DarkStretch, movable: Sequence[str]) -> MoveAdvice:
        """The drone to move before a stretch that was advised. Raises PlacementError, AnchorError."""
        look = self._lookout
        return advise_move(
            look.grid, drive, stretch, look.standing(), movable=movable, occluded=self._doubts.hidden(),
            antenna_above_ground_m=look.antenna_above_ground_m, curvature=look.curvature,
        )  # fmt: skip

    def advise_path(self, drive: Drive, stretch: DarkStretch, at_m: float) -> PathAdvice:
        """A way round a stretch that was advised; at_m: where on the path the rover is."""
        look, occluded = self._lookout, self._doubts.hidden()
        above_m = look.antenna_above_ground_m
        return advise_path(look.grid, drive, stretch, look.standing(), at_m, occluded, above_m, look.curvature)

    def process(self, epoch: RangeEpoch) -> WatchedEpoch:
        """The answer to one epoch; the same as ``Detector.process`` where the map has nothing to say."""
        self._lookout.move(epoch.moved)
        places_m = self._lookout.places_m
        ids = tuple(places_m)
        forecast = self._foresee(epoch)
        if forecast is None:
            result = self._detector.process(epoch)
            return WatchedEpoch(result, None, ids, {}, self._estimate(epoch, result))
        told = {
            anchor_id: self._trust.believed(p_direct)
            for anchor_id, p_direct in zip(ids, forecast.p_direct.tolist(), strict=True)
            if not (math.isnan(p_direct) or self._doubts.stands(anchor_id))
        }
        ranges = tuple([_with_prediction(measured, told) for measured in epoch.ranges])
        asked = replace(epoch, ranges=ranges, ground=epoch.ground or forecast.ground)
        result = self._detector.process(asked)
        p_direct = dict(zip(ids, forecast.p_direct.tolist(), strict=True))
        self._compare(result, p_direct)
        p_sight = dict(zip(ids, forecast.p_sight.tolist(), strict=True))
        sigma_m, harmless_m = self.settings.range_sigma_m, self._harmful_m()
        free = free_height(result, places_m, p_direct, p_sight, forecast.ground, sigma_m, harmless_m)
        if free is not None:
            self._heights.note(*free, result.time_s)
        return WatchedEpoch(result, forecast, ids, told, self._estimate(asked, result))

    def _estimate(self, epoch: RangeEpoch, result: EpochResult) -> RoverEstimate | None:
        if self._estimator is None:
            return None
        return self._estimator.step(epoch, result, self._detector.motion)

    def _foresee(self, epoch: RangeEpoch) -> SightForecast | None:
        """The map's word where the track leads; without one, where the epoch's own ranges meet on the ground."""
        if not math.isfinite(epoch.time_s):
            return None
        place = self._detector.foretold(epoch.time_s)
        if place is not None:
            return self._forecast(place)
        anchors = self._lookout.ranging()
        forecast: SightForecast | None = None
        fix: PositionFix | None = None
        asked = replace(epoch, ground=epoch.ground or self._somewhere)
        for _ in range(LOOKS):
            before, fix = fix, meeting_place(anchors, asked, self.settings)
            if forecast is not None and _is_same(before, fix):
                break  # from the same place the map says the same
            forecast = None if fix is None else self._forecast(fix)
            if forecast is None:
                return None
            told = dict(zip(self._lookout.places_m, forecast.p_direct.tolist(), strict=True))
            ranges = tuple([_with_prediction(measured, told) for measured in epoch.ranges])
            asked = replace(epoch, ranges=ranges, ground=epoch.ground or forecast.ground)
        return forecast

    def _forecast(self, place: PositionFix) -> SightForecast | None:
        errors = replace(self.errors, dem_sigma_m=self.errors.dem_sigma_m * self._heights.scale)
        return self._lookout.forecast(place, errors, self._harmful_m())

    def _harmful_m(self) -> float:
        settings = self.settings
        return settings.harmful_m or settings.geometric_tolerance_m or settings.k_geometric * settings.range_sigma_m

    def _compare(self, result: EpochResult, p_direct: Mapping[str, float]) -> None:
        """Hold the verdicts against the map: how often it is right, and where it is not."""
        place_m = self._detector.state.position_m
        if place_m is None:
            return
        for verdict in result.verdicts:
            p = p_direct[verdict.anchor_id]
            p_off = off_without_map(verdict)
            if p_off is None or math.isnan(p):
                continue
            self._doubts.note(verdict, p_off, p, result.time_s, place_m, self._lookout.places_m[verdict.anchor_id])
            self._trust.note(p, p_off)


def _known(ids: Sequence[str], values: npt.NDArray[np.float64]) -> dict[str, float]:
    return {name: value for name, value in zip(ids, values.tolist(), strict=True) if not math.isnan(value)}


def _is_same(one: PositionFix | None, other: PositionFix | None) -> bool:
    """Whether the map would be asked the same at both."""
    return (
        one is not None
        and other is not None
        and np.array_equal(one.position_m, other.position_m)
        and np.array_equal(one.covariance_m2, other.covariance_m2)
    )


def _with_prediction(measured: RangeMeasurement, told: Mapping[str, float]) -> RangeMeasurement:
    if measured.p_sight is not None or math.isnan(told.get(measured.anchor_id, math.nan)):
        return measured
    p = told[measured.anchor_id]
    return RangeMeasurement(measured.anchor_id, measured.range_m, measured.sigma_m, p, measured.time_s)
