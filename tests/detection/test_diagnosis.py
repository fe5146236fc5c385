"""What ails a whole log is named with its likely cause, and a log that nothing ails is not accused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detection import (
    Cause,
    Detector,
    DetectorSettings,
    RangeEpoch,
    RangeMeasurement,
    RangingAnchor,
    Sight,
    Suspicion,
    detect_3d,
    diagnose,
)
from tests.detection.worlds import DRONES_M, ROVER_M, true_ranges

SIGMA_M = 0.05
# a hall of 10 m by 8 m, as UWB radios are hung in
HALL = {
    "A0": (0.0, 0.0, 0.2), "A1": (10.0, 0.0, 2.8), "A2": (10.0, 8.0, 0.2), "A3": (0.0, 8.0, 2.8),
    "A4": (5.0, 0.0, 2.5), "A5": (5.0, 8.0, 0.3), "A6": (0.0, 4.0, 0.4), "A7": (10.0, 4.0, 2.6),
}  # fmt: skip
# four anchors at one height, 2 m above the tag
LEVEL = {"A0": (0.0, 0.0, 2.5), "A1": (5.77, 0.0, 2.5), "A2": (5.55, 5.69, 2.5), "A3": (0.0, 5.65, 2.5)}
PLANE = DetectorSettings(dimension=2, range_sigma_m=SIGMA_M)
SPACE = DetectorSettings(range_sigma_m=SIGMA_M)

Places = dict[str, tuple[float, float, float]]


def anchors_at(places: Places) -> list[RangingAnchor]:
    return [RangingAnchor(name, *place) for name, place in places.items()]


def walk(places: Places, count: int = 60, *, step_s: float = 0.2, flat: bool = False) -> list[RangeEpoch]:
    """A tag goes round in the middle; every radio measures to it at once."""
    rng = np.random.default_rng(4)
    epochs = []
    for number in range(count):
        angle = 0.05 * number
        tag_m = (4.0 + 2.0 * math.cos(angle), 4.0 + 2.0 * math.sin(angle), 0.0 if flat else 0.6)
        measured = [
            RangeMeasurement(name, math.dist((*place[:2], 0.0 if flat else place[2]), tag_m) + rng.normal(0.0, 0.04))
            for name, place in places.items()
        ]
        epochs.append(RangeEpoch(step_s * number, tuple(measured)))
    return epochs


def changed(epochs: list[RangeEpoch], change: Callable[[float], float]) -> list[RangeEpoch]:
    return [
        replace(epoch, ranges=tuple(replace(one, range_m=change(one.range_m)) for one in epoch.ranges))
        for epoch in epochs
    ]


def suspected(
    anchors: list[RangingAnchor], epochs: list[RangeEpoch], given: DetectorSettings = SPACE
) -> tuple[Suspicion, ...]:
    detector = Detector(anchors, given)
    return diagnose(anchors, epochs, [detector.process(epoch) for epoch in epochs], given)


@pytest.mark.parametrize("offset_m", [0.5, 0.75, -0.4])
def test_an_antenna_delay_is_named_with_its_size(offset_m: float) -> None:
    epochs = changed(walk(HALL), lambda range_m: range_m + offset_m)
    (found,) = suspected(anchors_at(HALL), epochs)
    assert found.cause is Cause.OFFSET
    assert found.value == pytest.approx(offset_m, abs=0.02)
    word = "long" if offset_m > 0.0 else "short"
    assert f"All ranges are about {abs(found.value):.2f} m too {word}" in found.sentence
    assert "calibrate the antenna delay" in found.sentence


@pytest.mark.parametrize("scale", [1.07, 0.95])
def test_a_scale_of_all_ranges_is_named_with_its_size(scale: float) -> None:
    (found,) = suspected(anchors_at(HALL), changed(walk(HALL), lambda range_m: scale * range_m))
    assert found.cause is Cause.SCALE
    assert found.value == pytest.approx(scale, abs=0.005)


def test_a_scale_shows_in_single_ranges_of_a_drive_too() -> None:
    masts: Places = {"N": (0.0, 60.0, 0.0), "E": (60.0, 0.0, 0.0), "S": (0.0, -60.0, 0.0), "W": (-60.0, 5.0, 0.0)}
    rng, epochs = np.random.default_rng(2), []
    for number in range(400):
        rover_m = (30.0 * math.cos(0.008 * number), 30.0 * math.sin(0.008 * number), 0.0)
        name = list(masts)[number % 4]
        range_m = 1.07 * (math.dist(masts[name], rover_m) + rng.normal(0.0, 0.05))
        epochs.append(RangeEpoch(0.4 * number, (RangeMeasurement(name, range_m),)))
    (found,) = suspected(anchors_at(masts), epochs, replace(PLANE, range_sigma_m=0.1))
    assert found.cause is Cause.SCALE
    assert found.value == pytest.approx(1.07, abs=0.01)


@pytest.mark.parametrize(
    ("per_metre", "word"), [(1000.0, "millimetres"), (100.0, "centimetres"), (0.001, "kilometres"), (3.28084, "feet")]
)
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_wrong_unit_of_ranges_is_asked_for(per_metre: float, word: str, dimension: Literal[2, 3]) -> None:
    places = HALL if dimension == 3 else {name: (*place[:2], 0.0) for name, place in HALL.items()}
    epochs = changed(walk(places, flat=dimension == 2), lambda range_m: per_metre * range_m)
    (found,) = suspected(anchors_at(places), epochs, replace(SPACE, dimension=dimension))
    assert found.cause is Cause.RANGE_UNIT
    assert found.value == pytest.approx(per_metre, rel=0.01)
    assert word in found.sentence
    assert found.sentence.endswith("?")


def test_the_unit_shows_in_a_single_epoch_and_where_ranges_are_beyond_any() -> None:
    epochs = changed(walk(HALL, 1), lambda range_m: 1000.0 * range_m)
    for given_ in (SPACE, replace(SPACE, max_range_m=100.0)):
        (found,) = suspected(anchors_at(HALL), epochs, given_)
        assert "millimetres" in found.sentence


def test_anchors_in_millimetres_are_asked_for() -> None:
    anchors = anchors_at({name: (1e3 * e, 1e3 * n, 1e3 * u) for name, (e, n, u) in HALL.items()})
    (found,) = suspected(anchors, walk(HALL))
    assert found.cause is Cause.RANGE_UNIT
    assert "anchors' places in millimetres" in found.sentence


@pytest.mark.parametrize(
    ("per_second", "begin", "word"),
    [(1e3, 0.0, "milliseconds"), (1e6, 0.0, "microseconds"), (1e9, 0.0, "nanoseconds"),
     (1e3, 1.7e12, "milliseconds"), (1e6, 1.7e15, "microseconds"), (1e9, 1.7e18, "nanoseconds")],
)  # fmt: skip
@pytest.mark.parametrize("step_s", [0.1, 1.0])
def test_a_wrong_unit_of_time_is_asked_for(per_second: float, begin: float, word: str, step_s: float) -> None:
    epochs = [replace(epoch, time_s=begin + per_second * epoch.time_s) for epoch in walk(HALL, step_s=step_s)]
    found = suspected(anchors_at(HALL), epochs)[0]
    assert found.cause is Cause.TIME_UNIT
    assert found.value == pytest.approx(1.0 / per_second)
    assert f"is time_s in {word}?" in found.sentence


def test_how_far_epochs_are_apart_is_told() -> None:
    epochs = [replace(epoch, time_s=1000.0 * number) for number, epoch in enumerate(walk(HALL))]
    assert suspected(anchors_at(HALL), epochs)[0].sentence.startswith("Epochs are 1000 s apart (median)")


def test_times_since_1970_in_seconds_are_none_of_these() -> None:
    assert suspected(anchors_at(HALL), [replace(one, time_s=1.7e9 + one.time_s) for one in walk(HALL)]) == ()


def test_rows_that_go_back_in_time_are_counted() -> None:
    blocks = [replace(one, ranges=(one.ranges[n],)) for n in range(8) for one in walk(HALL)]
    (found,) = suspected(anchors_at(HALL), blocks)
    assert (found.cause, found.value) == (Cause.TIME_ORDER, 7)
    assert "Rows go back in time 7 times" in found.sentence
    assert "sort them by time_s" in found.sentence


@pytest.mark.parametrize("places", [LEVEL, {name: (*place[:2], 0.0) for name, place in LEVEL.items()}])
def test_a_plane_where_space_is_needed_is_told(places: Places) -> None:
    (found,) = suspected(anchors_at(places), walk(LEVEL), PLANE)
    assert found.cause is Cause.DIMENSION
    assert "three dimensions" in found.sentence


def test_altitudes_left_at_0_are_asked_for() -> None:
    tower: Places = {name: (e, n, 4.0 * u) for name, (e, n, u) in HALL.items()}
    (found,) = suspected(anchors_at({name: (e, n, 0.0) for name, (e, n, _) in HALL.items()}), walk(tower))
    assert found.cause is Cause.ALTITUDES


def test_a_log_without_positions_says_what_is_needed_most_often() -> None:
    two = [replace(epoch, ranges=epoch.ranges[:2]) for epoch in walk(HALL)]
    (found,) = suspected(anchors_at(HALL), two)
    assert found.cause is Cause.NOT_FOUND
    assert "Only 0% of the epochs have a position" in found.sentence
    assert "2 more ranges" in found.sentence


@pytest.mark.parametrize(("dimension", "heard"), [(3, 3), (2, 2)])
def test_ranges_that_cannot_check_one_another_accuse_nobody(dimension: Literal[2, 3], heard: int) -> None:
    places = HALL if dimension == 3 else {name: (*place[:2], 0.0) for name, place in HALL.items()}
    places = {name: places[name] for name in ("A0", "A1", "A2")}
    epochs = [replace(epoch, ranges=epoch.ranges[:heard]) for epoch in walk(places, flat=dimension == 2)]
    found = suspected(anchors_at(places), epochs, replace(SPACE, dimension=dimension))
    assert not any("suspect" in one.sentence for one in found)
    for one in found:
        assert one.cause in (Cause.TOO_FEW, Cause.NOT_FOUND)
        assert one.cause is not Cause.TOO_FEW or f"100% of the epochs have {heard} ranges or fewer" in one.sentence


def test_one_range_more_checks_them_and_may_accuse() -> None:
    rng = np.random.default_rng(1)
    places = {name: HALL[name] for name in ("A0", "A1", "A2", "A4", "A5", "A7")}
    found = suspected(anchors_at(places), changed(walk(places), lambda _: float(rng.uniform(3.0, 9.0))))
    assert found
    assert not any(one.cause is Cause.TOO_FEW for one in found)


def test_ranges_at_random_are_told_to_be_far_off() -> None:
    rng = np.random.default_rng(0)
    assert suspected(anchors_at(HALL), changed(walk(HALL), lambda _: float(rng.uniform(3.0, 9.0))))


@given(
    seed=st.integers(0, 10_000),
    dimension=st.sampled_from([2, 3]),
    occluded=st.sampled_from([0.0, 0.0, 0.2]),
    size_m=st.floats(8.0, 1500.0),
    sigma_m=st.floats(0.01, 0.5),
    step_s=st.floats(0.05, 5.0),
)
@settings(max_examples=60, deadline=None)
def test_a_clean_log_is_never_accused(
    seed: int, dimension: Literal[2, 3], occluded: float, size_m: float, sigma_m: float, step_s: float
) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(dimension + 3, 11))
    places_m = np.column_stack([rng.uniform(-size_m, size_m, (count, 2)), rng.uniform(0.1, 0.8, count) * size_m])
    places_m[:, 2] *= dimension == 3
    anchors = [RangingAnchor(str(n), *map(float, place)) for n, place in enumerate(places_m)]
    speed = min(3.0, 0.02 * size_m / step_s)
    epochs = []
    hidden = np.zeros(count, bool)
    for number in range(60):
        if number % 15 == 0:
            hidden = rng.random(count) < occluded
        angle = 0.05 * number
        rover_m = np.array([20.0 * speed * step_s * math.cos(angle), 20.0 * speed * step_s * math.sin(angle), 0.0])
        ranges_m = np.linalg.norm(places_m - rover_m, axis=1) + sigma_m * rng.normal(size=count)
        ranges_m[hidden] += 40.0 * sigma_m
        measured = [RangeMeasurement(str(n), float(abs(range_m))) for n, range_m in enumerate(ranges_m)]
        epochs.append(RangeEpoch(step_s * number, tuple(measured)))
    hint_m = 0.0 if dimension == 3 else None
    given_ = DetectorSettings(dimension=dimension, range_sigma_m=sigma_m, altitude_hint_m=hint_m)
    assert suspected(anchors, epochs, given_) == ()


def test_a_session_suspects_what_the_log_does_and_forgets_what_was_long_ago() -> None:
    detector = Detector(anchors_at(HALL), SPACE)
    assert detector.suspicions() == ()
    for epoch in changed(walk(HALL), lambda range_m: range_m + 0.5):
        detector.process(epoch)
    (found,) = detector.suspicions()
    assert found.cause is Cause.OFFSET
    for epoch in walk(HALL, 400):
        detector.process(replace(epoch, time_s=100.0 + epoch.time_s))
    assert detector.suspicions() == ()


def test_a_range_that_is_too_short_is_not_occluded() -> None:
    ranges_m = true_ranges(DRONES_M, ROVER_M)
    ranges_m[[2, 5]] += (-4.0, 6.0)
    found = detect_3d(DRONES_M, ranges_m, 0.1)
    assert (np.flatnonzero(found.occluded).tolist(), np.flatnonzero(found.too_short).tolist()) == ([5], [2])
    assert found.classification == "single"
    anchors = [RangingAnchor(str(n), *map(float, place)) for n, place in enumerate(DRONES_M)]
    detector = Detector(anchors, DetectorSettings())
    for second in range(5):
        measured = tuple(RangeMeasurement(str(n), float(range_m)) for n, range_m in enumerate(ranges_m))
        answer = detector.process(RangeEpoch(float(second), measured))
        short, long = answer.verdicts[2], answer.verdicts[5]
        assert (short.sight, short.occluded, short.off) == (Sight.TOO_SHORT, False, True)
        assert (long.sight, long.occluded) == (Sight.OCCLUDED, True)
        assert answer.excluded == ("2", "5")
        assert answer.classification == "single"
        assert "too short: 2" in answer.summary
        assert "2 is too short" in short.reason
        assert "no occlusion explains" in short.reason
        assert "occluded" not in {str(say.says) for say in short.says}
