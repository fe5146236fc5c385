"""Drones at one height leave two places: both are followed until a hint or the ranges settle which is the rover's."""

from __future__ import annotations

import numpy as np
import pytest

from detection import Detector, DetectorSettings, PlanningStatus, RangeEpoch, RangeMeasurement, RangingAnchor, detect_3d
from tests.detection.worlds import DRONES_M, ROVER_M, STEP_M, drive, heard, named, off_m, true_ranges, world


def level_drones() -> list[RangingAnchor]:
    return [RangingAnchor(f"D{i + 1}", float(e), float(n), 80.0) for i, (e, n, _) in enumerate(DRONES_M[:6])]


def test_level_drones_leave_two_tracks_and_an_epoch_says_both() -> None:
    anchors = level_drones()
    detector = Detector(anchors)
    answer = drive(detector, anchors, range(20))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is not None
    assert answer.position.position_m[2] == pytest.approx(2.0, abs=0.2)
    assert answer.position.mirror_m[2] == pytest.approx(158.0, abs=0.2)


def test_a_hint_or_a_drone_that_climbs_settles_the_side() -> None:
    anchors = level_drones()
    hinted = Detector(anchors, DetectorSettings(altitude_hint_m=0.0))
    answer = drive(hinted, anchors, range(10))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is None
    detector = Detector(anchors)
    drive(detector, anchors, range(20))
    climbed = [RangingAnchor("D1", 0.0, 0.0, 120.0), *anchors[1:]]
    ranges = tuple(RangeMeasurement(n, r) for n, r in named(climbed, ROVER_M + 2.0 * STEP_M).items())
    detector.process(RangeEpoch(2.0, ranges, moved=(climbed[0],)))
    answer = drive(detector, climbed, range(21, 40))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is None
    assert off_m(answer, 39) < 0.2


@pytest.mark.parametrize("off_line_m", [0.0, 0.02])
@pytest.mark.parametrize("side_m", [150.0, -150.0])
def test_an_altitude_says_nothing_of_the_side_of_masts_along_a_road(side_m: float, off_line_m: float) -> None:
    rng = np.random.default_rng(4)
    along, aside = np.array([np.cos(0.47), np.sin(0.47), 0.0]), np.array([-np.sin(0.47), np.cos(0.47), 0.0])
    for _ in range(20):
        off_m = off_line_m * rng.normal(size=6)
        places_m = [
            200.0 * n * along + off_m[n] * aside + [0.0, 0.0, up_m]
            for n, up_m in enumerate((20.0, 35.0, 15.0, 40.0, 25.0, 30.0))
        ]
        rover_m = 450.0 * along + side_m * aside + [0.0, 0.0, 2.0]
        ranges_m = np.linalg.norm(places_m - rover_m, axis=1) + 0.1 * rng.normal(size=6)
        found = detect_3d(np.array(places_m), ranges_m, 0.3, sigma_m=0.1, hint_m=(np.nan, np.nan, 2.0))
        assert found.position_m is not None
        assert found.mirror_m is not None
        nearer_m = min(np.linalg.norm(np.subtract(place_m, rover_m)) for place_m in (found.position_m, found.mirror_m))
        assert nearer_m < 10.0


def test_drones_at_one_height_and_a_place_on_the_map_leave_two_heights() -> None:
    anchors = level_drones()
    detector = Detector(anchors, DetectorSettings(side_hint_m=(float(ROVER_M[0]), float(ROVER_M[1]))))
    answer = drive(detector, anchors, range(20))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is not None


def test_a_track_that_begins_on_the_wrong_side_of_a_shallow_layer_is_corrected_by_the_ranges() -> None:
    rng = np.random.default_rng(3)
    lost = 0
    for _ in range(12):
        places_m = np.column_stack([DRONES_M[:8, :2] / 60.0, rng.uniform(2.0, 2.8, 8)])
        anchors = [RangingAnchor(f"A{i}", *map(float, place)) for i, place in enumerate(places_m)]
        rover_m, step_m = np.array([2.0, 2.0, 1.3]), np.array([1.0, 0.4, 0.0])
        detector = Detector(anchors)
        for number in range(40):
            place_m = rover_m + 0.07 * number * step_m
            ranges_m = {n: r + 0.1 * rng.normal() for n, r in named(anchors, place_m).items()}
            answer = detector.process(heard(0.07 * number, ranges_m))
        assert answer.position is not None
        lost += np.linalg.norm(answer.position.position_m - place_m) > 0.8
    assert lost == 0


@pytest.mark.parametrize(("seed", "occluded"), [(7149, 0), (5269, 0), (7938, 3), (5124, 3)])
def test_a_descent_that_crosses_the_anchors_is_no_second_place(seed: int, occluded: int) -> None:
    """From above the anchors it goes where the one from below went; its last step was once taken for the answer."""
    anchors_m, rover_m = world(seed, 9, 3)
    ranges_m = true_ranges(anchors_m, rover_m)
    hidden = np.random.default_rng(seed).permutation(9)[:occluded]
    ranges_m[hidden] += 3.0 + 4.0 * np.arange(occluded)
    found = detect_3d(anchors_m, ranges_m, 0.1, hint_m=(np.nan, np.nan, 0.0))
    assert found.position_m == pytest.approx(rover_m, abs=1e-6)
    assert (found.mirror_m, found.nearly_m) == (None, None)


def test_ranges_that_are_not_sure_of_a_side_leave_the_place_on_the_hinted_one() -> None:
    """Where noise lifts the place above a shallow layer and none is left below, it is held in the layer's plane."""
    rng = np.random.default_rng(12)
    above = {True: 0, False: 0}
    for _ in range(300):
        layer_m = np.column_stack([DRONES_M[:, :2] / 60.0, 2.4 + rng.uniform(-0.4, 0.4, 8)])
        rover_m = np.array([rng.uniform(1.0, 5.0), rng.uniform(1.0, 5.0), 1.9])
        ranges_m = true_ranges(layer_m, rover_m) + 0.1 * rng.normal(size=8)
        for hinted in above:
            found = detect_3d(layer_m, ranges_m, 0.3, hint_m=(np.nan, np.nan, 0.0) if hinted else None)
            if found.position_m is not None and found.mirror_m is None:
                above[hinted] += int(found.position_m[2] > 2.6)
    assert above[False] >= 5
    assert above[True] == 0


def test_a_shallow_layer_of_anchors_is_tried_from_both_sides() -> None:
    """Ranges with errors may fit the wrong side of a nearly level layer better; a hint keeps the right one."""
    rng = np.random.default_rng(11)
    wrong = {True: 0, False: 0}
    for _ in range(60):
        layer_m = np.column_stack([DRONES_M[:, :2] / 60.0, rng.uniform(2.0, 2.8, 8)])
        rover_m = np.array([rng.uniform(1.0, 5.0), rng.uniform(1.0, 5.0), 1.2])
        ranges_m = true_ranges(layer_m, rover_m) + 0.1 * rng.normal(size=8)
        for hinted in wrong:
            hint = (np.nan, np.nan, 0.0) if hinted else None
            found = detect_3d(layer_m, ranges_m, 0.3, hint_m=hint)
            assert found.position_m is not None
            told = [found.position_m] if found.mirror_m is None else [found.position_m, found.mirror_m]
            wrong[hinted] += min(float(np.linalg.norm(place - rover_m)) for place in told) > 1.2
    assert wrong[True] <= 1
    assert wrong[True] <= wrong[False]


@pytest.mark.parametrize("hint_m", [None, 40.0])
@pytest.mark.parametrize("every_s", [1.0, 0.1])
def test_a_flight_through_the_plane_of_its_anchors_is_told_of_on_both_sides(
    hint_m: float | None, every_s: float
) -> None:
    """Up and down between 40 m below level drones and 40 m above them."""
    rng, anchors = np.random.default_rng(0), level_drones()
    settings = DetectorSettings(range_sigma_m=0.05, vertical_acceleration_m_per_s2=1.5, altitude_hint_m=hint_m)
    detector = Detector(anchors, settings)
    off, passed = [], 0
    for number in range(round(150.0 / every_s)):
        time_s = number * every_s
        place_m = np.array([150.0, 160.0, 80.0 - 40.0 * np.cos(2.0 * np.pi * time_s / 160.0)])
        ranges_m = {name: r + 0.05 * rng.normal() for name, r in named(anchors, place_m).items()}
        answer = detector.process(heard(time_s, ranges_m))
        assert answer.position is not None
        told = [answer.position.position_m]
        if answer.position.mirror_m is not None:
            told.append(answer.position.mirror_m)
        sigma_m = float(np.sqrt(np.trace(answer.position.covariance_m2)))
        nearest_m = min(float(np.linalg.norm(place - place_m)) for place in told)
        off.append(nearest_m > 5.0 * sigma_m and answer.position.checked)
        passed += place_m[2] > 90.0 and len(told) == 2
    assert sum(off) == 0
    assert passed > 0.4 * len(off)


TENT_M = np.array([(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0), (50.0, 130.0)])


@pytest.mark.parametrize(
    ("heights_m", "middle_m"),
    [
        ((20.0, 20.0, 20.0, 20.0, 20.0), 20.0),
        ((20.0, 50.0, 60.0, 30.0, 48.0), 40.0),
        ((20.0, 29.0, 29.0, 20.0, 24.5), 24.5),
        ((20.5, 19.5, 20.4, 19.7, 20.1), 20.0),
        ((21.0, 19.0, 20.8, 19.4, 20.2), 20.0),
        ((22.0, 19.0, 21.5, 18.0, 21.0), 20.0),
    ],
    ids=["level", "16 degrees", "5 degrees", "within 0.5 m", "within 1 m", "within 2 m"],
)
def test_one_of_the_places_told_holds_where_a_rover_passes_the_plane_of_its_anchors(
    heights_m: tuple[float, ...], middle_m: float
) -> None:
    anchors = [
        RangingAnchor(f"A{i}", *xy, up) for i, (xy, up) in enumerate(zip(TENT_M.tolist(), heights_m, strict=True))
    ]
    for seed in (11, 12):
        rng, detector = np.random.default_rng(seed), Detector(anchors, DetectorSettings(range_sigma_m=0.1))
        for t in range(150):
            round_m = 50.0 + 30.0 * np.array([np.cos(t / 30.0), np.sin(t / 30.0)])
            place_m = np.array([*round_m, middle_m + 15.0 * np.sin(t / 12.0)])
            told = detector.process(
                heard(float(t), {n: r + 0.1 * rng.normal() for n, r in named(anchors, place_m).items()})
            )
            if told.position is None or told.planning is not PlanningStatus.CHECKED:
                continue
            sides_m = [side_m for side_m in (told.position.position_m, told.position.mirror_m) if side_m is not None]
            weight = np.linalg.pinv(told.position.covariance_m2)
            assert min((side_m - place_m) @ weight @ (side_m - place_m) for side_m in sides_m) < 5.0**2
