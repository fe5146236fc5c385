"""Inertial navigation along with a detector: a rover on a circle that hears nothing for a while, and bad readings."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from detection import Detector, DetectorSettings, RangeEpoch, RangeMeasurement, RangingAnchor
from navigation import ConstantVelocityEstimator, Estimator, StateError
from navigation.drives import DriveSettings, InertialEstimator
from navigation.inertial import TangentFrame

Floats = npt.NDArray[np.float64]

FRAME = TangentFrame(math.radians(45.0))
GRAVITY = float(np.linalg.norm(FRAME.gravity_m_per_s2(np.zeros(3))))
SPEED, TURN, HZ = 1.5, 0.1, 50
SETTINGS = DetectorSettings(max_speed_m_per_s=3.0)
PLACES = [(-60, -50, 30), (70, -40, 45), (50, 80, 25), (-40, 70, 60), (0, -90, 50), (90, 20, 20)]
ANCHORS = [RangingAnchor(f"A{n}", *map(float, at)) for n, at in enumerate(PLACES)]


def place_m(time_s: float) -> Floats:
    """On a circle of 15 m, clockwise, north at the beginning."""
    turned, radius_m = TURN * time_s, SPEED / TURN
    return np.array([radius_m * (1.0 - math.cos(turned)), radius_m * math.sin(turned), 2.0])


def readings(time_s: int, generator: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Of the second up to a time: pushed to the right by v·ω, turning right, which is down about the unit's z."""
    times_s = time_s - 1.0 + np.arange(1, HZ + 1) / HZ
    forces = np.tile([0.0, -SPEED * TURN, GRAVITY], (HZ, 1)) + generator.normal(0.0, 0.02, (HZ, 3))
    rates = np.tile([0.0, 0.0, -TURN], (HZ, 1)) + generator.normal(0.0, 1e-3, (HZ, 3))
    return times_s, forces, rates


def epoch(time_s: int, generator: np.random.Generator, heard: bool) -> RangeEpoch:
    ranges = [
        RangeMeasurement(
            a.id, math.dist((a.east_m, a.north_m, a.altitude_m), place_m(time_s)) + generator.normal(0, 0.05)
        )
        for a in ANCHORS
    ]
    return RangeEpoch(float(time_s), tuple(ranges) if heard else ())


def driven(estimator: Estimator, silent: range) -> list[float]:
    """Distance of the estimate from the rover over half a minute, NaN where there is none."""
    generator, detector, off_m = np.random.default_rng(5), Detector(ANCHORS, SETTINGS), []
    for time_s in range(1, 31):
        felt = readings(time_s, generator)
        if isinstance(estimator, InertialEstimator):
            used, told = estimator.feel(*felt)
            assert (used, told) == (HZ, ())
        asked = epoch(time_s, generator, time_s not in silent)
        found = estimator.step(asked, detector.process(asked), detector.motion)
        off_m.append(math.nan if found is None else float(np.linalg.norm(found.position_m - place_m(time_s))))
        if found is not None and isinstance(estimator, InertialEstimator) and estimator.riding:
            assert off_m[-1] < found.bubble_m
    return off_m


def test_through_silence_on_a_circle_it_keeps_its_way() -> None:
    silent = range(20, 28)
    estimator = InertialEstimator(ANCHORS, SETTINGS, DriveSettings(heading_rad=0.0), FRAME)
    riding = driven(estimator, silent)
    gliding = driven(ConstantVelocityEstimator(ANCHORS, SETTINGS), silent)
    assert estimator.riding
    assert riding[26] < 0.25 * gliding[26]
    assert riding[26] < 1.0
    assert np.nanmedian(riding[10:19]) < 0.2


def test_what_a_unit_delivers_wrongly_is_told_and_left_out() -> None:
    estimator, generator = InertialEstimator(ANCHORS, SETTINGS, frame=FRAME), np.random.default_rng(1)
    times_s, forces, rates = readings(1, generator)
    forces[3] = math.nan
    times_s[10] = times_s[9]
    times_s[20] = times_s[5]
    used, told = estimator.feel(times_s, forces, rates)
    assert used == HZ - 3
    assert told == (
        "Inertial readings that are not finite, not used: 1.",
        "Inertial readings no later than the one before, not used: 2.",
    )
    times_s, forces, rates = readings(2, generator)
    for force, rate, said in (
        (forces / 9.80665, rates, "in g, it seems"),
        (forces, 400.0 * rates, "in degrees, it seems"),
        (forces * [1.0, -1.0, -1.0], rates, "axes='frd' would fit"),
        (forces[:, [2, 0, 1]], rates, "x axis points up"),
    ):
        used, (sentence,) = estimator.feel(times_s, force, rate)
        assert used == 0
        assert said in sentence
    assert estimator.feel(times_s, forces, rates) == (HZ, ())
    assert estimator.feel(times_s, forces, rates)[0] == 0


def test_a_course_at_speed_is_the_heading() -> None:
    settings, generator = DetectorSettings(max_speed_m_per_s=20.0), np.random.default_rng(3)
    estimator, detector = InertialEstimator(ANCHORS, settings, frame=FRAME), Detector(ANCHORS, settings)
    for time_s in range(1, 16):
        times_s, _, _ = readings(time_s, generator)
        forces = np.tile([0.0, 0.0, GRAVITY], (HZ, 1)) + generator.normal(0.0, 0.02, (HZ, 3))
        estimator.feel(times_s, forces, generator.normal(0.0, 1e-3, (HZ, 3)))
        rover_m = (-70.0 + 10.0 * time_s, 10.0, 2.0)  # east
        ranges = [RangeMeasurement(a.id, math.dist((a.east_m, a.north_m, a.altitude_m), rover_m)) for a in ANCHORS]
        asked = RangeEpoch(float(time_s), tuple(ranges))
        found = estimator.step(asked, detector.process(asked), detector.motion)
    assert estimator.riding
    assert found is not None
    assert math.dist(found.position_m, rover_m) < min(1.0, found.bubble_m)
    assert found.velocity_m_per_s[:2] == pytest.approx([10.0, 0.0], abs=0.5)


def test_readings_that_stop_end_it_and_the_other_filter_begins_anew() -> None:
    estimator = InertialEstimator(ANCHORS, SETTINGS, DriveSettings(heading_rad=0.0), FRAME)
    generator, detector, riding = np.random.default_rng(2), Detector(ANCHORS, SETTINGS), []
    for time_s in range(1, 26):
        if time_s <= 15:
            estimator.feel(*readings(time_s, generator))
        asked = epoch(time_s, generator, heard=True)
        found = estimator.step(asked, detector.process(asked), detector.motion)
        riding.append(estimator.riding)
    assert riding[14]
    assert not riding[15]
    assert found is not None
    assert np.linalg.norm(found.position_m - place_m(25)) < 1.0


def test_two_dimensions_are_refused() -> None:
    with pytest.raises(StateError, match="three dimensions"):
        InertialEstimator(ANCHORS, DetectorSettings(dimension=2))
