"""When a track begins, how it is carried from epoch to epoch, and when it is given up."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..epoch_arrays import EpochArrays
from ..epochs import GroundHeight
from ..geometric import GeometricDetection, detect_ranges
from ..kernels import misfits
from ..settings import DetectorSettings
from ..subset_search import Ranges, squared_sigmas
from ..verdicts import PositionFix
from .headings import Heading
from .odometry import Motion
from .tracks import Heard, Track, begin, follow, foretold, is_sane, mirrored_near, on_ground, with_displacement

__all__ = ["Tracker"]

Floats = npt.NDArray[np.float64]

RECENT_S = 5.0  # ranges so old still help to begin a track
SILENCE_S = 30.0  # without any range for so long a track says nothing any more
LOST_EPOCHS = 5  # so often in a row ranges have to meet elsewhere
LOST_S = 2.0  # and for so long, where not all do: what is occluded alike meets elsewhere too, in passing
# Ranges that are all too long by less than their tolerance may still meet, elsewhere: k sigma of each, several times.
LOST_TOLERANCES = 4.0
CONFIRMED_S = 60.0  # a track that ranges confirmed is believed for so long over some that meet elsewhere
AGREES = 5.0  # sigmas up to which a track may be where most ranges of an epoch meet
# A track takes the slow half of its ranges' errors for excesses and is too sure of the rest: the worst of 230,000
# simulated epochs was 6.7 of its sigmas off, where three of the sigmas told should hold all.
TOLD = 2.5
# Of two tracks, one on each side of the anchors, one is dropped when all ranges since make it so much less likely.
SETTLED_LOG_ODDS = math.log(1e6)


class Tracker:
    """The track of a session, and the last range of each anchor from which one can begin; changed in place.

    Where a track may as well begin on the other side of the anchors, a second one does, until the ranges settle it.
    """

    def __init__(self, anchors: int, settings: DetectorSettings) -> None:
        self._settings = settings
        self._anchors = anchors
        self._last: dict[int, tuple[float, float, float, float]] = {}  # index: time, range, sigma, tolerance
        self._elsewhere = 0
        self._elsewhere_since_s = 0.0
        self._off = False  # of what it tells of its place, where the latest ranges meet
        self._confirmed_s = -math.inf  # when ranges that check one another last met at the track
        self._passed = False  # by the plane of the anchors: hints of a side hold no longer
        self._to_plane_m = np.zeros(settings.dimension)  # from the track to the plane of the anchors, where it is near
        self._sides_told = math.inf  # sigmas by which an epoch's ranges tell the track from its mirrored place
        self._contradicted = False  # by most ranges of the latest epoch
        self._bent_m2 = 0.0  # square of how far along its tangent a sphere of a last range bends off by its tolerance
        self.track: Track | None = None
        self._rival: Track | None = None
        self.heading = Heading(settings)
        self._unled: Track | None = None  # the track that is told of no heading; None where none was told
        self._told: Motion | None = None  # the latest motion with a heading, as it came

    def led(self, motion: Motion) -> Motion:
        """The motion with its heading set right by what the ranges have shown of it, or without one that does harm."""
        self._told = motion if motion.reliable and motion.displacement_m is not None else None
        return self.heading.led(motion)

    def foretell(self, time_s: float, motion: Motion | None) -> None:
        """Before an epoch's ranges: give up a track after a long silence; tell it of odometry that has a heading."""
        if self.track is not None and time_s - self.track.time_s > SILENCE_S:
            self.track = self._rival = self._unled = None
        if self.track is None and self._settings.start_m is not None and not self._last:
            place_m = np.array(self._settings.start_m)
            spread_m2 = np.eye(len(place_m)) * self._settings.start_sigma_m**2
            self.track = begin(place_m, spread_m2, time_s, self._anchors, self._settings)
        if motion is not None and motion.reliable and motion.displacement_m is not None:
            told = motion, motion.displacement_m, self._settings
            if self.track is not None:
                self._unled = self._unled or self.track
                self.track = with_displacement(self.track, *told)
            if self._rival is not None:
                self._rival = with_displacement(self._rival, *told)

    def stand(self, ground: GroundHeight, time_s: float) -> None:
        """Tell every track how high the ground is where it leads to by then."""
        self.track, self._rival, self._unled = (
            track and on_ground(track, ground, time_s) for track in (self.track, self._rival, self._unled)
        )

    def hint_m(self) -> Floats:
        """(d,) where the rover is on its side of anchors in one plane: the track's place, or what the settings say."""
        d = self._settings.dimension
        if self.track is not None and self._rival is None:
            return self.track.place_m[:d]
        hint = np.full(d, np.nan)
        if self._passed:
            return hint
        if self._settings.side_hint_m is not None:
            hint[:2] = self._settings.side_hint_m
        if d == 3 and self._settings.altitude_hint_m is not None:
            hint[2] = self._settings.altitude_hint_m
        return hint

    def follow(
        self, arrays: EpochArrays, moment: Ranges, geometry: GeometricDetection, time_s: float
    ) -> tuple[Floats, Floats]:
        """(excess of each range, sigma of its distance) by the track, which goes on or begins; inf without one.

        moment: the ranges as ``geometry`` was asked about them.
        """
        heard, count = arrays.heard, len(arrays.heard.ranges_m)
        self._remember(arrays)
        if self.track is None:
            self._begin(arrays, geometry, time_s)
            return np.full(count, np.nan), np.full(count, np.inf)
        before = self.track.log_likelihood
        by_others = self._by_others(self.track, moment, geometry, time_s)
        self.track, excess_m, sigma_m = follow(self.track, heard, by_others, time_s, self._settings)
        if self._unled is not None:
            with_it = self.track.log_likelihood - before
            excess_m, sigma_m = self._judge_heading(arrays, moment, geometry, time_s, with_it, (excess_m, sigma_m))
        if self._rival is not None:
            excess_m, sigma_m = self._settle(self._rival, heard, by_others, time_s, excess_m, sigma_m)
        usual_m, d = self._settings.range_sigma_m, self._settings.dimension
        mirrored, self._sides_told = mirrored_near(self.track, arrays.places_m, usual_m, d)
        self._to_plane_m = np.zeros(d)
        if mirrored is not None:
            self._passed = True
            self._to_plane_m = (mirrored.place_m[:d] - self.track.place_m[:d]) / 2.0
            if self._rival is None or self._sides_told <= 1.0:  # so near, the likelihood told no sides either
                self._rival = mirrored
        supporting = arrays.supporting(excess_m, sigma_m, self._settings.k_geometric)
        lost = self._is_lost(geometry, supporting, time_s)
        self._contradicted = (
            self._off or self._elsewhere > 0 or (count > self._settings.dimension and 2 * supporting < count)
        )
        if lost or not is_sane(self.track, self._settings.dimension):
            self.track = self._rival = self._unled = None
            self._elsewhere = 0
            self._begin(arrays, geometry, time_s)
            return np.full(count, np.nan), np.full(count, np.inf)
        return excess_m, sigma_m

    def _judge_heading(
        self,
        arrays: EpochArrays,
        moment: Ranges,
        geometry: GeometricDetection,
        time_s: float,
        with_it: float,
        by_track: tuple[Floats, Floats],
    ) -> tuple[Floats, Floats]:
        """Let the track without a heading hear the same ranges; it becomes the track where the heading does harm."""
        if self._unled is None:
            return by_track
        before = self._unled.log_likelihood
        by_others = self._by_others(self._unled, moment, geometry, time_s)
        self._unled, *by_unled = follow(self._unled, arrays.heard, by_others, time_s, self._settings)
        if self._told is None:
            return by_track
        without_it = self._unled.log_likelihood - before
        if not self.heading.judge(self._told, self._unled, with_it, without_it):
            return by_track
        self.track, self._rival = self._unled, None
        return by_unled[0], by_unled[1]

    def _settle(
        self, rival: Track, heard: Heard, by_others: Floats, time_s: float, excess_m: Floats, sigma_m: Floats
    ) -> tuple[Floats, Floats]:
        """Let the likelier of both tracks be the track, and drop the other once it is far less likely, or the same."""
        rival, rival_excess_m, rival_sigma_m = follow(rival, heard, by_others, time_s, self._settings)
        track = self.track
        if track is None or not track.log_likelihood >= rival.log_likelihood:
            self.track, track, rival = rival, rival, track or rival
            excess_m, sigma_m = rival_excess_m, rival_sigma_m
        d, apart_m = self._settings.dimension, track.place_m - rival.place_m
        one_place = apart_m @ apart_m < track.covariance[:d, :d].trace()
        # where ranges tell neither side, what a guess of the motion makes likelier is no proof
        tells = self._sides_told > 1.0 or self._told is not None
        settled = tells and not track.log_likelihood - rival.log_likelihood < SETTLED_LOG_ODDS
        self._rival = None if one_place or settled else rival
        return excess_m, sigma_m

    def _by_others(self, track: Track, moment: Ranges, geometry: GeometricDetection, time_s: float) -> Floats:
        """(m, 2) excess of each range over where the others of its epoch meet, and its variance; inf = not told.

        Told where most ranges meet, more than unknowns, and the track may be there: else either may be the phantom.
        """
        flat, count = self._settings.dimension == 2, len(moment.ranges_m)
        told = np.full((count, 2), math.inf)
        if not geometry.checked or 2 * geometry.count <= count or geometry.position_m is None:
            return told
        ahead = foretold(track, time_s, self._settings)
        kept = sum([1 << i for i, left_out in enumerate(geometry.occluded.tolist()) if not left_out])
        for found_m in (geometry.position_m, geometry.mirror_m):
            if found_m is not None:
                place_m = (*found_m.tolist(), 0.0)[:3]
                misfits.by_others(moment, kept, flat, place_m, ahead, AGREES, told)
                if np.isfinite(told[:, 1]).any():
                    break
        return told

    def position(self, time_s: float) -> PositionFix | None:
        """The track's place from its second epoch on, checked where more anchors than unknowns were heard of late.

        Not where most of the latest ranges contradict it, or meet elsewhere: it may follow a phantom.
        """
        if self.track is None or self.track.since_s == time_s:
            return None
        d = self._settings.dimension
        heard = int(np.count_nonzero(time_s - self.track.heard_s <= RECENT_S))
        mirror_m = None if self._rival is None else self._rival.place_m[:d].copy()
        covariance_m2 = self.track.covariance[:d, :d].copy()
        checked = heard > d and not self._contradicted and self.is_known(covariance_m2)
        # between both sides of a plane that it is near, any place may be the rover's
        told_m2 = TOLD**2 * covariance_m2 + np.outer(self._to_plane_m, self._to_plane_m)
        return PositionFix(self.track.place_m[:d].copy(), told_m2, checked, mirror_m)

    def _remember(self, arrays: EpochArrays) -> None:
        heard = arrays.heard
        columns = heard.times_s, heard.ranges_m, heard.sigmas_m, arrays.tolerances_m
        rows = zip(*(column.tolist() for column in columns), strict=True)
        self._last.update(zip(heard.index.tolist(), rows, strict=True))
        self._bent_m2 = 2.0 * max([last[1] * last[3] for last in self._last.values()], default=0.0)

    def is_known(self, covariance_m2: Floats) -> bool:
        """Whether a place is sure enough for its covariance, and all else that is linear, to mean anything.

        Far off a few close anchors it is not: the ranges leave every direction open.
        """
        return 0.0 <= float(covariance_m2.trace()) < self._bent_m2

    def _begin(self, arrays: EpochArrays, geometry: GeometricDetection, time_s: float) -> None:
        """Begin where this epoch's ranges meet, or the last range of each anchor where one epoch has too few."""
        d = self._settings.dimension
        if len(arrays.heard.ranges_m) <= d:
            recent = {i: last for i, last in self._last.items() if time_s - last[0] <= RECENT_S}
            if len(recent) <= d:
                return
            index = np.array(list(recent), np.int64)
            times_s, ranges_m, sigmas_m, tolerances_m = np.array(list(recent.values())).T.copy()
            heard = Heard(arrays.heard.anchors_m, index, ranges_m, sigmas_m, times_s, np.full(len(index), 0.5))
            together = EpochArrays(heard, heard.anchors_m[index], tolerances_m, tolerances_m, np.zeros(len(index)))
            moment = together.at_one_moment(None, time_s, self._settings.max_speed_m_per_s)
            geometry = self._detect(moment)
        else:
            index = arrays.heard.index
        if geometry.position_m is None or geometry.covariance_m2 is None or not geometry.checked:
            return
        if not self.is_known(geometry.covariance_m2):
            return
        self._elsewhere, self._confirmed_s = 0, -math.inf
        too_long_m = {int(index[i]): float(geometry.excess_m[i]) for i in np.flatnonzero(geometry.off)}
        other_m = geometry.nearly_m if geometry.mirror_m is None else geometry.mirror_m
        self.track, self._rival = (
            None
            if place_m is None
            else begin(place_m, geometry.covariance_m2, time_s, self._anchors, self._settings, too_long_m)
            for place_m in (geometry.position_m, other_m)
        )

    def _detect(self, moment: Ranges) -> GeometricDetection:
        settings = self._settings
        return detect_ranges(
            moment, settings.dimension, self.hint_m(), refine=True, studentised=True, limit=settings.search_limit
        )

    def _is_lost(self, geometry: GeometricDetection, supporting: int, time_s: float) -> bool:
        """Whether ranges meet elsewhere, clearly, and epoch after epoch: then the track follows a phantom.

        Either all do. Or, for seconds, so many more than fit the track that they tell by themselves which are too long:
        more over the unknowns than are left out. Anchors that are occluded alike look the same from a good track; so
        one that ranges have confirmed of late is not given up for less than all of them.
        """
        d, count, out = self._settings.dimension, geometry.count, geometry.least_occluded
        self._off = False
        if self.track is None or geometry.position_m is None or geometry.covariance_m2 is None:
            return False
        if count <= d + 1 or not geometry.checked:
            return False
        places_m = [place_m for place_m in (geometry.position_m, geometry.mirror_m) if place_m is not None]
        off_m = min((place_m - self.track.place_m[:d] for place_m in places_m), key=lambda off_m: float(off_m @ off_m))
        spread_m2 = geometry.covariance_m2 + self.track.covariance[:d, :d]
        off2 = squared_sigmas(off_m, spread_m2) / self._settings.k_geometric**2
        if off2 > 1.0:
            told_m2 = geometry.covariance_m2 + TOLD**2 * self.track.covariance[:d, :d]
            self._off = squared_sigmas(off_m, told_m2) > self._settings.k_geometric**2
        if off2 <= (1.0 if out else LOST_TOLERANCES**2):
            self._elsewhere = 0
            if off2 <= 1.0 and supporting > d + 1:
                self._confirmed_s = time_s
            return False
        if out and (count - d <= out or count - supporting < out or time_s - self._confirmed_s <= CONFIRMED_S):
            return False
        if self._elsewhere == 0:
            self._elsewhere_since_s = time_s
        self._elsewhere += 1
        return self._elsewhere >= LOST_EPOCHS and (out == 0 or time_s - self._elsewhere_since_s >= LOST_S)
