"""The morphing map in time: tracks, frames that recompute only what moved, availability."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tests.reference.column_scan import runs
from tests.visibility.morphing_cases import low_anchors
from visibility import Anchor, AnchorError, AntennaLimits, DistantAnchor, VisibilityInputError, min_visible_altitude
from visibility.air.morphing_maps import morphing_map
from visibility.air.morphing_times import availability, morphing_frames
from visibility.dilution.dop_questions import FlightLimit
from visibility.sight.anchor_tracks import AnchorTrack
from visibility.sight.minimum_altitude import SurfaceCache

LIMIT = FlightLimit(2.5)


def track(times_s=(0.0, 10.0, 30.0), id="T"):
    return AnchorTrack(id, times_s, [(100.0 + 10.0 * n, -100.0, 500.0 + 5.0 * n) for n in range(len(times_s))])


def test_a_track_is_straight_and_even_between_its_times():
    moving = track()
    assert moving.at(0.0) == Anchor("T", 100.0, -100.0, 500.0)
    assert moving.at(5.0) == Anchor("T", 105.0, -100.0, 502.5)
    assert moving.at(20.0) == Anchor("T", 115.0, -100.0, 507.5)
    assert moving.at(30.0) == Anchor("T", 120.0, -100.0, 510.0)


@pytest.mark.parametrize("time_s", [-0.1, 30.1, float("nan")])
def test_a_time_outside_a_track_is_refused_before_the_first_frame(time_s):
    grid, anchors, ceiling_m = low_anchors(5)
    with pytest.raises(VisibilityInputError) as refused:
        morphing_frames(grid, [*anchors, track()], [time_s], LIMIT, ceiling_m=ceiling_m)
    assert "\n" not in str(refused.value)
    if time_s == time_s:
        assert str(refused.value).startswith("Anchor track T runs from 0 s to 30 s, so nothing is known of it at")


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: AnchorTrack("T", [], np.empty((0, 3))), r"Anchor track T needs as many positions \(n, 3\) as times"),
        (lambda: AnchorTrack("T", [0.0, 1.0], [(0.0, 0.0, 9.0)]), "Anchor track T needs as many positions"),
        (lambda: AnchorTrack("T", [1.0, 1.0], [(0.0, 0.0, 9.0)] * 2), "Anchor track T: times_s must be finite and"),
        (lambda: AnchorTrack("T", [0.0], [(0.0, np.nan, 9.0)]), "Anchor T: north_m must be a finite number"),
    ],
)
def test_a_track_that_cannot_be_flown_is_refused(make, sentence):
    with pytest.raises(AnchorError, match=sentence):
        make()


def test_each_frame_is_the_map_of_its_moment():
    grid, anchors, ceiling_m = low_anchors(6)
    low = anchors[0]
    moving = AnchorTrack("T", [0.0, 60.0], [(low.east_m, low.north_m, 700.0), (low.east_m + 90.0, low.north_m, 650.0)])
    everyone = (*anchors, moving)
    frames = list(morphing_frames(grid, everyone, [0.0, 30.0, 60.0], LIMIT, ceiling_m=ceiling_m))
    assert [frame.time_s for frame in frames] == [0.0, 30.0, 60.0]
    for frame in frames:
        assert frame.anchors == (*anchors, moving.at(frame.time_s))
        alone = morphing_map(min_visible_altitude(grid, frame.anchors), LIMIT, ceiling_m=ceiling_m)
        np.testing.assert_array_equal(frame.map.altitude_m, alone.altitude_m)
        np.testing.assert_array_equal(frame.map.state, alone.state)


def test_one_of_sixteen_anchors_that_moves_recomputes_only_itself():
    grid, anchors, ceiling_m = low_anchors(15)
    moving = AnchorTrack("T", [0.0, 90.0], [(60.0, -60.0, 700.0), (120.0, -60.0, 700.0)])
    asked = []

    def counting(*args, **options):
        asked.append(len(args[1]))
        return min_visible_altitude(*args, **options)

    cache = SurfaceCache(grid, calculate=counting)
    times_s = [0.0, 30.0, 60.0, 90.0]
    list(morphing_frames(grid, (*anchors, moving), times_s, LIMIT, ceiling_m=ceiling_m, cache=cache))
    assert asked == [16, 1, 1, 1]
    assert (cache.computed, cache.reused) == (19, 45)


class Riser:
    """A satellite that is above the horizon from a time on."""

    def at(self, time_s):
        return DistantAnchor("R", 1.0, 0.9) if time_s >= 10.0 else None


def test_a_satellite_joins_when_it_rises():
    grid, anchors, ceiling_m = low_anchors(4)
    frames = list(morphing_frames(grid, (*anchors, Riser()), [0.0, 10.0], LIMIT, ceiling_m=ceiling_m))
    assert [len(frame.anchors) for frame in frames] == [4, 5]
    before, after = (np.nan_to_num(frame.map.altitude_m, nan=np.inf) for frame in frames)
    assert (after <= before + 0.02).all()
    assert (after < before).any()


def test_a_cache_forgets_what_is_not_asked_for_any_more():
    grid, anchors, _ = low_anchors(4)
    cache = SurfaceCache(grid)
    for some in (anchors, anchors[:2], anchors):
        answer = cache.surfaces(some)
        np.testing.assert_array_equal(answer.altitude_m, min_visible_altitude(grid, some).altitude_m)
    assert (cache.computed, cache.reused) == (6, 4)


def test_a_cache_remembers_the_latest_of_those_that_it_is_told_to():
    grid, anchors, _ = low_anchors(4)
    cache = SurfaceCache(grid, remembers=2)
    for anchor in anchors:
        cache.surfaces((anchor,))
    answer = cache.surfaces(anchors[1:])
    np.testing.assert_array_equal(answer.altitude_m, min_visible_altitude(grid, anchors[1:]).altitude_m)
    assert (cache.computed, cache.reused) == (4, 3), "one was asked for last, two are remembered"
    cache.surfaces(anchors[:1])
    assert cache.computed == 5, "the oldest was forgotten"


def test_availability_tells_first_last_and_the_longest_run():
    grid, anchors, ceiling_m = low_anchors(6)
    away_m = (-4000.0, 4000.0, 3000.0)
    here = [(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors]
    # three of the six leave at 20 s, come back at 40 s and stay
    times_s = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    moving = [
        AnchorTrack(f"M{n}", times_s, [place if time_s not in (20.0, 30.0) else away_m for time_s in times_s])
        for n, place in enumerate(here)
    ]
    frames = list(morphing_frames(grid, moving, times_s[:2] + times_s[4:], LIMIT, ceiling_m=ceiling_m))
    gone = morphing_frames(grid, [*anchors[:3], *moving[3:]], times_s, FlightLimit(1.9), ceiling_m=ceiling_m)
    kept_there, frames_of_gone = itertools.tee(gone)
    found = availability(frames_of_gone, above_ground_m=40.0)
    flyable = np.array([grid.heights_m + 40.0 >= frame.map.safe_above_m for frame in kept_there])
    times = np.array(times_s)
    for row, col in itertools.product(range(grid.rows), range(grid.cols)):
        here_s = times[flyable[:, row, col]]
        if here_s.size == 0:
            assert np.isnan(found.first_s[row, col])
            assert found.share[row, col] == 0.0
            continue
        assert found.first_s[row, col] == here_s[0]
        assert found.last_s[row, col] == here_s[-1]
        assert found.share[row, col] == pytest.approx(here_s.size / 7)
        longest_s = max(times[stop - 1] - times[start] for start, stop in runs(flyable[:, row, col]))
        assert found.longest_to_s[row, col] - found.longest_from_s[row, col] == longest_s
    always = availability(frames, altitude_m=ceiling_m)
    np.testing.assert_array_equal(always.share == 1.0, np.isfinite(frames[0].map.altitude_m))


def test_availability_needs_one_height_and_frames():
    for heights in ({}, {"altitude_m": 1.0, "above_ground_m": 1.0}):
        with pytest.raises(VisibilityInputError, match="Give exactly one of altitude_m and above_ground_m"):
            availability([], **heights)
    with pytest.raises(VisibilityInputError, match="Availability needs at least one frame"):
        availability([], altitude_m=1.0)
    with pytest.raises(VisibilityInputError, match=r"above ground >= 0 m, not -1\.0"):
        availability([], above_ground_m=-1.0)


def test_times_must_ascend_and_a_cache_must_be_of_the_grid():
    grid, anchors, ceiling_m = low_anchors(4)
    for times_s, sentence in (([], "At least one time is needed"), ([1.0, 1.0], "Times must be finite and ascend")):
        with pytest.raises(VisibilityInputError, match=sentence):
            morphing_frames(grid, anchors, times_s, LIMIT, ceiling_m=ceiling_m)
    other = low_anchors(4, size=17)[0]
    with pytest.raises(VisibilityInputError, match="belongs to another grid"):
        morphing_frames(grid, anchors, [0.0], LIMIT, ceiling_m=ceiling_m, cache=SurfaceCache(other))


class Rising:
    """A satellite-like anchor that is there from a time on."""

    def __init__(self, anchor, from_s):
        self.anchor, self.from_s = anchor, from_s

    def at(self, time_s):
        return self.anchor if time_s >= self.from_s else None


@pytest.mark.parametrize("left", [0, 1, 2])
@pytest.mark.parametrize("above_ground", [False, True])
def test_while_there_are_too_few_anchors_the_frame_is_closed_and_says_so(left, above_ground):
    grid, anchors, ceiling_m = low_anchors(5)
    ceiling = {"ceiling_m": 200.0 if above_ground else ceiling_m, "ceiling_above_ground": above_ground}
    moving = [*anchors[:left], *(Rising(anchor, 10.0) for anchor in anchors[left:])]
    early, late = morphing_frames(grid, moving, [0.0, 10.0], LIMIT, **ceiling)
    assert early.map.warnings[0].startswith("At 0 s there is no fix anywhere: A map of pdop from ranging needs at")
    blind = [replace(anchor, limits=AntennaLimits(max_range_m=1e-3)) for anchor in anchors]
    expected = morphing_map(min_visible_altitude(grid, blind), LIMIT, **ceiling)
    for name in ("altitude_m", "safe_above_m", "state", "no_flight_intervals"):
        assert np.array_equal(getattr(early.map, name), getattr(expected, name), equal_nan=True), name
    open_map = morphing_map(min_visible_altitude(grid, anchors), LIMIT, **ceiling)
    assert np.array_equal(late.map.altitude_m, open_map.altitude_m, equal_nan=True)


def test_anchors_that_never_fix_a_position_are_refused_before_the_first_frame():
    grid, anchors, ceiling_m = low_anchors(5)
    with pytest.raises(VisibilityInputError, match="needs at least 3 anchors; 2 are given"):
        morphing_frames(grid, anchors[:2], [0.0, 1.0], LIMIT, ceiling_m=ceiling_m)


def test_a_track_into_the_ground_is_refused_before_the_first_frame():
    grid, anchors, ceiling_m = low_anchors(5)
    place = (anchors[0].east_m, anchors[0].north_m)
    diving = AnchorTrack("T", [0.0, 10.0], [(*place, 900.0), (*place, -900.0)])
    with pytest.raises(AnchorError, match="T"):
        morphing_frames(grid, [*anchors[1:], diving], [0.0, 10.0], LIMIT, ceiling_m=ceiling_m)
