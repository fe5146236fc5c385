"""Whatever a sensor delivers, the session answers, counts and goes on; misuse is told at once."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detection import (
    DetectionInputError,
    Detector,
    DetectorSettings,
    OdometryIncrement,
    PlanningStatus,
    RangeEpoch,
    RangeMeasurement,
    RangingAnchor,
    Rejection,
    detect_3d,
)
from tests.detection.worlds import DRONES_M

ANCHORS = [
    RangingAnchor(name, *place)
    for name, place in {"A": (0, 0, 9), "B": (90, 0, 3), "C": (90, 80, 12), "D": (0, 80, 1), "E": (40, 30, 20)}.items()
]
ROVER = (31.0, 42.0, 1.0)


def epoch(time_s: float, **spoilt: float) -> RangeEpoch:
    ranges_m = {
        anchor.id: math.dist((anchor.east_m, anchor.north_m, anchor.altitude_m), ROVER) for anchor in ANCHORS
    } | spoilt
    return RangeEpoch(time_s, tuple(RangeMeasurement(name, range_m) for name, range_m in ranges_m.items()))


@pytest.mark.parametrize(
    ("range_m", "reason"),
    [
        (-1.0, Rejection.NOT_POSITIVE),
        (0.0, Rejection.NOT_POSITIVE),
        (math.nan, Rejection.NOT_FINITE),
        (math.inf, Rejection.NOT_FINITE),
        (1e12, Rejection.TOO_LONG),
    ],
)
def test_a_range_that_cannot_be_one_is_named_counted_and_left_out(range_m: float, reason: Rejection) -> None:
    detector = Detector(ANCHORS)
    answer = detector.process(epoch(0.0, B=range_m))
    assert [(rejected.anchor_id, rejected.reason) for rejected in answer.rejected] == [("B", reason)]
    assert "B" not in answer.included + answer.excluded
    assert detector.state.rejections == {reason: 1}
    assert detector.process(epoch(1.0)).rejected == ()


# a swarm of six within a hand's breadth of one another, ten kilometres away: its ranges tell how far, not which way
SWARM_M = [
    (0.013, -0.013, 0.064), (0.01, -0.054, 0.036), (0.13, 0.095, -0.07), (-0.127, -0.062, 0.004),
    (-0.233, -0.022, -0.125), (-0.073, -0.054, -0.032),
]  # fmt: skip
FROM_AFAR_M = [
    (10440.459, 10440.537, 10440.261, 10440.702, 10440.589, 10440.547),
    (10440.508, 10440.442, 10440.2, 10440.474, 10440.609, 10440.534),
]


def test_a_close_swarm_far_away_confirms_no_position() -> None:
    detector = Detector([RangingAnchor(f"D{i}", *place_m) for i, place_m in enumerate(SWARM_M)])
    for second, ranges_m in enumerate(FROM_AFAR_M * 5):
        measured = tuple(RangeMeasurement(f"D{i}", range_m) for i, range_m in enumerate(ranges_m))
        answer = detector.process(RangeEpoch(float(second), measured))
        assert answer.planning in (PlanningStatus.UNCHECKED, PlanningStatus.NO_POSITION)
    assert detector.state.epochs == 10


@pytest.mark.parametrize("dimension", [2, 3])
def test_anchors_so_close_that_rounding_decides_end_no_session(dimension: Literal[2, 3]) -> None:
    for seed in range(60):
        rng = np.random.default_rng(seed)
        places_m = rng.normal(size=(6, 3)) * 10.0 ** rng.uniform(-3.0, 0.0)
        rover_m = 10.0 ** rng.uniform(2.0, 4.8) * rng.normal(size=3)
        if dimension == 2:
            places_m[:, 2] = rover_m[2] = 0.0
        anchors = [RangingAnchor(f"D{i}", *place_m) for i, place_m in enumerate(places_m.tolist())]
        detector = Detector(anchors, DetectorSettings(dimension=dimension))
        for second in range(8):
            ranges_m = np.linalg.norm(places_m - rover_m, axis=1) + 0.1 * rng.normal(size=6)
            measured = tuple(RangeMeasurement(f"D{i}", range_m) for i, range_m in enumerate(ranges_m.tolist()))
            fix = detector.process(RangeEpoch(float(second), measured)).position
            if fix is not None:
                variances_m2 = np.linalg.eigvalsh(fix.covariance_m2)
                assert variances_m2[0] > -1e-9 * variances_m2[-1]
                assert not fix.checked or math.sqrt(variances_m2[-1]) < 0.1 * min(ranges_m)


def test_epochs_that_come_twice_late_or_out_of_order_are_told_and_counted() -> None:
    detector = Detector(ANCHORS, DetectorSettings(window=3))
    for time_s in range(6):
        assert detector.process(epoch(float(time_s))).rejection is None
    assert detector.process(epoch(5.0)).rejection is Rejection.DUPLICATE
    assert detector.process(epoch(4.5)).rejection is Rejection.OUT_OF_ORDER
    assert detector.process(epoch(0.5)).rejection is Rejection.LATE
    assert detector.process(epoch(math.nan)).rejection is Rejection.BAD_TIME
    assert detector.process(epoch(6.0)).rejection is None
    assert detector.state.epochs == 7
    assert sum(detector.state.rejections.values()) == 4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tolerance_m": 0.0}, "tolerance_m must be finite and > 0"),
        ({"tolerance_m": -1.0}, "tolerance_m must be finite and > 0"),
        ({"tolerance_m": [0.1, 0.1]}, "tolerance_m must be one number or"),
        ({"sigma_m": 0.0}, "sigma_m must be finite and > 0"),
        ({"ranges_m": [1.0, np.nan, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]}, "ranges_m must be finite and > 0"),
        ({"ranges_m": [[1.0]]}, "ranges_m must be"),
        ({"anchor_positions_m": DRONES_M[:, :2]}, "anchor_positions_m must be"),
        ({"anchor_positions_m": np.full((8, 3), np.inf)}, "anchor_positions_m must be"),
        ({"hint_m": (0.0, 0.0)}, "hint_m must be"),
        ({"method": "guess"}, "method must be refined or seed"),
        ({"search_limit": 0}, "search_limit must be at least 1"),
    ],
)
def test_misuse_is_told_in_one_sentence(change: dict[str, object], words: str) -> None:
    asked: dict[str, object] = {"anchor_positions_m": DRONES_M, "ranges_m": np.full(8, 100.0)} | change
    with pytest.raises(DetectionInputError, match=words):
        detect_3d(**asked)


@pytest.mark.parametrize(
    ("measured", "reason"),
    [
        (RangeMeasurement("Z", 50.0), Rejection.UNKNOWN_ANCHOR),
        (RangeMeasurement("B", 50.0, sigma_m=0.0), Rejection.BAD_SIGMA),
        (RangeMeasurement("B", 50.0, sigma_m=math.nan), Rejection.BAD_SIGMA),
        (RangeMeasurement("B", 50.0, sigma_m=1e308), Rejection.BAD_SIGMA),
        (RangeMeasurement("B", 50.0, p_sight=1.5), Rejection.BAD_PRIOR),
        (RangeMeasurement("B", 50.0, p_sight=math.nan), Rejection.BAD_PRIOR),
        (RangeMeasurement("B", 50.0, time_s=math.inf), Rejection.BAD_TIME),
    ],
)
def test_what_else_can_be_wrong_with_a_range_is_named_too(measured: RangeMeasurement, reason: Rejection) -> None:
    good = tuple(one for one in epoch(0.0).ranges if one.anchor_id != "B")
    answer = Detector(ANCHORS).process(RangeEpoch(0.0, (*good, measured)))
    assert [(one.anchor_id, one.reason) for one in answer.rejected] == [(measured.anchor_id, reason)]
    assert len(answer.verdicts) == 4


def test_of_an_anchor_that_comes_twice_neither_range_is_used() -> None:
    ranges = epoch(0.0).ranges
    answer = Detector(ANCHORS).process(RangeEpoch(0.0, (*ranges, RangeMeasurement("B", 12.0))))
    assert [one.reason for one in answer.rejected] == [Rejection.ANCHOR_TWICE] * 2
    assert [verdict.anchor_id for verdict in answer.verdicts] == ["A", "C", "D", "E"]


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_too_few_ranges_are_an_answer_and_the_session_goes_on(count: int) -> None:
    detector = Detector(ANCHORS)
    answer = detector.process(RangeEpoch(0.0, epoch(0.0).ranges[:count]))
    assert answer.classification == "undetermined"
    assert answer.planning in ("no position", "unchecked")
    assert answer.excluded == ()
    assert answer.needed
    assert detector.process(epoch(1.0)).classification == "none"


@pytest.mark.parametrize(
    "odometry",
    [
        OdometryIncrement(0.0, (1.0, 0.0)),
        OdometryIncrement(-1.0, (1.0, 0.0)),
        OdometryIncrement(1.0, (math.nan, 0.0)),
        OdometryIncrement(1.0, None, (0.0, math.inf, 0.0)),
        OdometryIncrement(1.0, (1.0, 0.0), heading_rad=math.nan),
    ],
)
def test_odometry_that_cannot_be_is_set_aside_and_the_ranges_are_judged(odometry: OdometryIncrement) -> None:
    detector = Detector(ANCHORS)
    answer = detector.process(RangeEpoch(0.0, epoch(0.0).ranges, odometry))
    assert answer.odometry == "missing"
    assert detector.state.rejections == {Rejection.BAD_ODOMETRY: 1}
    assert len(answer.verdicts) == 5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"geometric_tolerance_m": 0.0}, "geometric_tolerance_m must be a number > 0"),
        ({"odometry_tolerance_m": -0.1}, "odometry_tolerance_m must be a number > 0"),
        ({"k_geometric": 0.0}, "k_geometric must be a number > 0"),
        ({"range_sigma_m": math.nan}, "range_sigma_m must be a number > 0"),
        ({"wheel_sigma_m": -1.0}, "wheel_sigma_m must be a number >= 0"),
        ({"base_offset_s": math.inf}, "base_offset_s must be a number finite"),
        ({"persistence": 0.0}, "persistence must lie above 0"),
        ({"window": 0}, "window must be at least 1"),
        ({"search_limit": 0}, "search_limit must be at least 1"),
        ({"start_m": (1.0, 2.0)}, "start_m must be 3 finite metres"),
        ({"dimension": 4}, "dimension must be 2 or 3"),
        ({"terrain": "sea"}, "terrain must be open, mixed or complex"),
        ({"criticality": "none"}, "criticality must be low, normal or high"),
    ],
)
def test_settings_that_make_no_sense_are_refused_in_one_sentence(change: dict[str, object], words: str) -> None:
    with pytest.raises(DetectionInputError, match=words):
        DetectorSettings(**change)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"id": ""}, "needs a non-empty id"),
        ({"north_m": math.nan}, "north_m must be finite"),
        ({"sigma_m": -1.0}, "sigma_m must be >= 0"),
    ],
)
def test_an_anchor_that_makes_no_sense_is_refused(change: dict[str, object], words: str) -> None:
    anchor: dict[str, object] = {"id": "A", "east_m": 0.0, "north_m": 0.0} | change
    with pytest.raises(DetectionInputError, match=words):
        RangingAnchor(**anchor)


@given(
    numbers=st.lists(
        st.tuples(st.sampled_from("ABCDEZ"), st.floats(allow_nan=True, allow_infinity=True), st.floats(-1.0, 30.0)),
        max_size=30,
    )
)
@settings(max_examples=50, deadline=None)
def test_no_number_that_a_sensor_may_deliver_ends_a_session(numbers: list[tuple[str, float, float]]) -> None:
    detector = Detector(ANCHORS)
    for name, range_m, time_s in numbers:
        detector.process(RangeEpoch(time_s, (RangeMeasurement(name, range_m), RangeMeasurement("A", 40.0))))
    assert detector.process(epoch(40.0)).rejection is None
