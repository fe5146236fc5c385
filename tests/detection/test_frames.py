"""Frames that do not belong together are named, with their angle; what merely drifts, stands or is right is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import Cause, Detector, DetectorSettings, OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor
from detection.faults.frames import Step, frame_of_headings

PLACES_M = [(0, 0, 60), (300, 0, 40), (300, 300, 70), (0, 300, 50), (150, 150, 90), (80, 220, 30)]
RANGE_SIGMA_M = 0.1


def loop(count: int = 120) -> list[complex]:
    """Places on a loop of 40 m about (150, 120), east + i·north: clockwise once and a half."""
    return [complex(150.0, 120.0) + 40.0 * np.exp(-1j * 3.0 * np.pi * k / count) for k in range(count)]


def steps(turn: complex = 1.0, *, mirrored: bool = False, drift_rad: float = 0.0, noise: int = 0) -> list[Step]:
    """Steps along the loop, as they are driven told turned by ``turn``; a drift over the whole."""
    places, rng = loop(), np.random.default_rng(noise)
    told = [Step(None, (places[0].real, places[0].imag))]
    for k in range(1, len(places)):
        moved = (places[k] - places[k - 1]) * turn * np.exp(-1j * drift_rad * k / len(places))
        moved = moved.conjugate() if mirrored else moved
        at = places[k] + 0.1 * complex(*rng.standard_normal(2))
        told.append(Step((moved.real, moved.imag), (at.real, at.imag)))
    return told


@pytest.mark.parametrize("off_deg", [3.0, -25.0, 90.0])
def test_headings_of_another_north_are_told_with_the_angle_by_which_to_turn_them(off_deg: float) -> None:
    anticlockwise = np.exp(1j * math.radians(off_deg))
    (told,) = frame_of_headings(steps(anticlockwise), RANGE_SIGMA_M)
    assert told.cause is Cause.FRAME
    assert math.degrees(told.value) == pytest.approx(off_deg, abs=0.6)
    assert told.sigma < math.radians(0.5)
    assert f"{math.degrees(told.value):+.1f}°" in told.sentence


def test_headings_of_the_tail_are_told_as_such() -> None:
    (told,) = frame_of_headings(steps(-1.0), RANGE_SIGMA_M)
    assert "tail" in told.sentence


def test_axes_taken_for_one_another_are_told_as_such() -> None:
    (told,) = frame_of_headings(steps(1j, mirrored=True), RANGE_SIGMA_M)
    assert "NED for ENU" in told.sentence


@pytest.mark.parametrize("seed", range(20))
def test_headings_that_are_right_are_not_accused(seed: int) -> None:
    assert frame_of_headings(steps(noise=seed), RANGE_SIGMA_M) == []


def test_a_heading_that_drifts_is_no_other_north() -> None:
    assert frame_of_headings(steps(drift_rad=math.radians(30.0)), RANGE_SIGMA_M) == []


def test_a_straight_way_does_not_tell_turned_from_mirrored() -> None:
    straight = [Step((0.0, 1.0), (0.0, float(k))) for k in range(100)]
    turned = [Step((1.0, 0.0), (0.0, float(k))) for k in range(100)]
    assert frame_of_headings(straight, RANGE_SIGMA_M) == []
    assert frame_of_headings(turned, RANGE_SIGMA_M) == []


def test_wheels_that_tell_another_length_are_no_other_frame() -> None:
    assert frame_of_headings(steps(2.0 * np.exp(1j)), RANGE_SIGMA_M) == []


def session(anchors: list[RangingAnchor], turned_rad: float | None) -> Detector:
    detector = Detector(anchors, DetectorSettings(range_sigma_m=RANGE_SIGMA_M, altitude_hint_m=1.0))
    places, rng = loop(), np.random.default_rng(4)
    for k, place in enumerate(places):
        rover_m = (place.real, place.imag, 1.5)
        ranges = tuple(
            RangeMeasurement(anchor.id, math.dist(at_m, rover_m) + RANGE_SIGMA_M * rng.standard_normal())
            for anchor, at_m in zip(anchors, PLACES_M, strict=True)
        )
        motion = None
        if k and turned_rad is not None:
            moved = place - places[k - 1]
            motion = OdometryIncrement(
                1.0, (abs(moved), 0.0), heading_rad=math.atan2(moved.real, moved.imag) - turned_rad
            )
        detector.process(RangeEpoch(float(k), ranges, motion))
    return detector


def test_a_session_names_the_north_of_its_headings_and_nothing_where_they_are_right() -> None:
    anchors = [RangingAnchor(f"A{n}", *map(float, place)) for n, place in enumerate(PLACES_M)]
    (told,) = session(anchors, math.radians(20.0)).suspicions()
    assert told.cause is Cause.FRAME
    assert math.degrees(told.value) == pytest.approx(20.0, abs=1.5)
    assert session(anchors, 0.0).suspicions() == ()


def test_places_in_degrees_are_told_with_their_order() -> None:
    metres = math.radians(6_371_000.0)
    degrees = [
        (9.0 + e / (metres * math.cos(math.radians(47.0))), 47.0 + n / metres, float(up)) for e, n, up in PLACES_M
    ]
    anchors = [RangingAnchor(f"A{n}", *place) for n, place in enumerate(degrees)]
    (told,) = session(anchors, None).suspicions()
    assert told.cause is Cause.FRAME
    assert "longitude, latitude" in told.sentence
    swapped = [RangingAnchor(f"A{n}", north, east, up) for n, (east, north, up) in enumerate(degrees)]
    (told,) = session(swapped, None).suspicions()
    assert "latitude, longitude" in told.sentence
