"""An epoch's ranges as arrays: tolerances from the parts of the error, prior odds, times, and one moment for all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .epochs import RangeMeasurement, RangingAnchor
from .motion.tracks import Heard, Track
from .settings import DetectorSettings, sigma_geometric_m
from .subset_search import Ranges

__all__ = ["EpochArrays", "anchor_places", "arrays_of"]

Floats = npt.NDArray[np.float64]

# Without a prediction an anchor is taken to be in sight as often as this.
USUAL_SIGHT = 0.9
SURE = 0.01  # no prediction is taken for surer than this


def _penalty(p_sight: float) -> float:
    p = min(max(p_sight, SURE), 1.0 - SURE)
    return 2.0 * math.log(p / (1.0 - p))


USUAL_PENALTY = _penalty(USUAL_SIGHT)


@dataclass(frozen=True, slots=True, eq=False)
class EpochArrays:
    """heard: for the track. places_m: (m, 3) of the anchors. harmful_m: (m,) excess from which a range is occluded."""

    heard: Heard
    places_m: Floats
    tolerances_m: Floats
    harmful_m: Floats
    penalties: Floats

    def at_one_moment(self, track: Track | None, time_s: float, max_speed_m_per_s: float) -> Ranges:
        """The ranges as if measured at ``time_s``: carried there along the track, or less sure by the speed limit."""
        heard, places_m = self.heard, self.places_m
        late_s = time_s - heard.times_s
        ranges_m, sigmas_m, tolerances_m = heard.ranges_m, heard.sigmas_m, self.tolerances_m
        if late_s.any():
            if track is None:
                grown = np.sqrt(1.0 + (late_s * max_speed_m_per_s / (3.0 * sigmas_m)) ** 2)
                sigmas_m, tolerances_m = sigmas_m * grown, tolerances_m * grown
            else:
                offset_m = track.place_m - places_m
                distance_m = np.maximum(np.linalg.norm(offset_m, axis=1), 1e-6)
                ranges_m = np.maximum(ranges_m + (offset_m @ track.state[3:6]) / distance_m * late_s, 1e-3)
        return Ranges(places_m, ranges_m, sigmas_m, tolerances_m, self.penalties)

    def supporting(self, excess_m: Floats, sigma_m: Floats, k: float) -> int:
        """How many ranges fit a track without any excess, as unsure as it is: k of these sigmas."""
        unsure_m, tolerances_m = k * sigma_m, self.tolerances_m
        return int(np.count_nonzero(np.abs(excess_m) <= np.sqrt(tolerances_m * tolerances_m + unsure_m * unsure_m)))


def anchor_places(anchors: Mapping[str, RangingAnchor], dimension: int) -> Floats:
    """(n, 3) east, north, altitude of all anchors; altitude zero in two dimensions."""
    return np.array(
        [(a.east_m, a.north_m, a.altitude_m if dimension == 3 else 0.0) for a in anchors.values()], np.float64
    ).reshape(-1, 3)


def arrays_of(
    ranges: Sequence[RangeMeasurement],
    anchors: Mapping[str, RangingAnchor],
    numbers: Mapping[str, int],
    places_m: Floats,
    time_s: float,
    settings: DetectorSettings,
    scale: float,
    speed_m_per_s: float,
) -> EpochArrays:
    """Ranges that passed the intake, as arrays. numbers: index of each anchor; scale: on all tolerances."""

    def sigma_m(measured_sigma_m: float | None, anchor_sigma_m: float) -> float:
        return sigma_geometric_m(
            settings.range_sigma_m if measured_sigma_m is None else measured_sigma_m,
            anchor_sigma_m or settings.anchor_sigma_m,
            settings.calculation_sigma_m,
            speed_m_per_s,
            settings.time_sigma_s,
        )

    usual_sigma_m = sigma_m(None, 0.0)  # of all ranges but those that bring, or whose anchor brings, their own
    index, ranges_m, sigmas_m, times_s, p_sight, penalties = [], [], [], [], [], []
    for measured in ranges:
        anchor = anchors[measured.anchor_id]
        index.append(numbers[measured.anchor_id])
        ranges_m.append(measured.range_m)
        own = measured.sigma_m is not None or anchor.sigma_m > 0.0
        sigmas_m.append(sigma_m(measured.sigma_m, anchor.sigma_m) if own else usual_sigma_m)
        times_s.append(time_s if measured.time_s is None else min(measured.time_s - settings.ranging_offset_s, time_s))
        p_sight.append(USUAL_SIGHT if measured.p_sight is None else measured.p_sight)
        penalties.append(USUAL_PENALTY if measured.p_sight is None else _penalty(measured.p_sight))
    sigmas = np.array(sigmas_m, np.float64)
    tolerances_m = scale * settings.k_geometric * sigmas
    if settings.geometric_tolerance_m is not None:
        tolerances_m = np.full(len(sigmas), scale * settings.geometric_tolerance_m)
    harmful_m = tolerances_m if settings.harmful_m is None else np.full(len(sigmas), settings.harmful_m)
    heard = Heard(
        places_m, np.array(index, np.int64), np.array(ranges_m, np.float64), sigmas, np.array(times_s, np.float64),
        np.array(p_sight, np.float64),
    )  # fmt: skip
    return EpochArrays(heard, places_m[heard.index], tolerances_m, harmful_m, np.array(penalties, np.float64))
