"""A detector that looks at a map: it sees through shadow, and notices where the map is wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from detection import Detector, DetectorSettings, EpochResult, RangeEpoch, RangeMeasurement, RangingAnchor, Witness
from detection.simulation import RangingNoise, SimulatedDrive, draw_epochs, drive_along
from planning import WatchError
from planning.watching import Expected, GroundErrors, MapDetector, WatchedEpoch
from terrain import ElevationGrid
from tests.planning.watching.grounds import anchors, on_ground, ridge
from visibility import lines_of_sight

SETTINGS = DetectorSettings(max_speed_m_per_s=4.0, harmful_m=0.5)
ERRORS = GroundErrors(dem_sigma_m=1.0)


def drive(grid: ElevationGrid) -> SimulatedDrive:
    """From the open foot of the slope to close behind the ridge, 1.5 m/s."""
    level = drive_along(anchors(), [(250.0, 120.0), (430.0, 300.0), (440.0, 480.0)], 1.5)
    places_m = on_ground(grid, *level.places_m.T)
    at_m = np.array([(a.east_m, a.north_m, a.altitude_m) for a in level.anchors])
    n, k = len(places_m), len(at_m)
    lines = lines_of_sight(grid, np.repeat(places_m, k, axis=0), np.tile(at_m, (n, 1)), excess_path=True)
    assert lines.excess_path_m is not None
    return replace(level, places_m=places_m, excess_m=lines.excess_path_m.reshape(n, k))


def watched(grid: ElevationGrid, driven: SimulatedDrive, epochs: tuple[RangeEpoch, ...]) -> list[WatchedEpoch]:
    detector = MapDetector(grid, driven.anchors, SETTINGS, errors=ERRORS)
    return [detector.process(epoch) for epoch in epochs]


def errors_m(driven: SimulatedDrive, results: list[EpochResult]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    places_m = [np.full(3, np.nan) if r.position is None else r.position.position_m for r in results]
    return np.nan_to_num(np.linalg.norm(np.array(places_m) - driven.places_m, axis=1), nan=1e3)


def missed(driven: SimulatedDrive, results: list[EpochResult]) -> float:
    called = np.array([[verdict.occluded for verdict in result.verdicts] for result in results])
    return float(1.0 - called[driven.excess_m > 0.5].mean())


def test_in_the_shadow_of_a_ridge_it_misses_less_and_knows_its_place_better() -> None:
    grid = ridge(ridge_m=45.0)
    driven = drive(grid)
    assert 0.1 < (driven.excess_m > 0.5).mean() < 0.5
    epochs = draw_epochs(driven, RangingNoise(), np.random.default_rng(1))
    blind = Detector(driven.anchors, SETTINGS)
    without, withit = [blind.process(e) for e in epochs], [w.result for w in watched(grid, driven, epochs)]
    assert missed(driven, withit) <= 0.5 * missed(driven, without) + 0.01
    assert np.percentile(errors_m(driven, withit), 95) < 0.7 * np.percentile(errors_m(driven, without), 95)


def test_what_it_foretells_is_told_to_the_detector_as_a_witness() -> None:
    grid = ridge(ridge_m=45.0)
    driven = drive(grid)
    answers = watched(grid, driven, draw_epochs(driven, RangingNoise(), np.random.default_rng(2)))
    last = answers[-1]
    assert last.p_sight["A2"] < 0.1 < 0.9 < last.p_sight["A8"]
    says = {v.anchor_id: next(s for s in v.says if s.witness is Witness.PREDICTION) for v in last.result.verdicts}
    assert (says["A2"].says, says["A8"].says) == ("occluded", "clear")


def test_a_range_keeps_the_prediction_that_it_brings() -> None:
    grid = ridge()
    driven = drive(grid)
    epoch, *_ = draw_epochs(driven, RangingNoise(), np.random.default_rng(2))
    own = replace(epoch, ranges=tuple(replace(measured, p_sight=0.123) for measured in epoch.ranges))
    result = MapDetector(grid, driven.anchors, SETTINGS).process(own).result
    assert all(v.says[-1].probability == pytest.approx(0.877) for v in result.verdicts)


def test_a_ridge_that_the_map_lacks_is_a_doubt_and_so_is_one_that_is_gone() -> None:
    real = ridge(ridge_m=45.0)
    driven = drive(real)
    epochs = draw_epochs(driven, RangingNoise(), np.random.default_rng(3))
    lacking = MapDetector(ridge(ridge_m=0.0), driven.anchors, SETTINGS, errors=ERRORS)
    for epoch in epochs:
        lacking.process(epoch)
    doubts = lacking.map_doubts()
    hidden = {driven.anchors[k].id for k in np.flatnonzero((driven.excess_m > 1.0).sum(axis=0) > 20)}
    assert {doubt.anchor_id for doubt in doubts if doubt.expected is Expected.IN_SIGHT} & hidden
    for doubt in doubts:
        assert doubt.probability > 0.99
        if doubt.anchor_id in hidden:
            assert 0.0 < doubt.bearing_rad < math.pi  # they stand in the east
            assert doubt.excess_m > 0.5

    gone = drive(ridge(ridge_m=0.0))
    standing = MapDetector(ridge(ridge_m=45.0), gone.anchors, SETTINGS, errors=ERRORS)
    for epoch in draw_epochs(gone, RangingNoise(), np.random.default_rng(3)):
        standing.process(epoch)
    assert Expected.HIDDEN in {doubt.expected for doubt in standing.map_doubts()}


def test_a_map_that_is_right_is_not_doubted() -> None:
    grid = ridge(ridge_m=45.0)
    driven = drive(grid)
    found = []
    for seed in range(5):
        detector = MapDetector(grid, driven.anchors, SETTINGS, errors=ERRORS)
        for epoch in draw_epochs(driven, RangingNoise(), np.random.default_rng(seed)):
            detector.process(epoch)
        found += detector.map_doubts()
    assert found == []


def test_heights_that_are_off_by_metres_do_not_pull_the_rover_along() -> None:
    real = ridge(ridge_m=45.0)
    driven = drive(real)
    epochs = draw_epochs(driven, RangingNoise(), np.random.default_rng(4))
    high = [w.result for w in watched(ridge(8.0, ridge_m=45.0), driven, epochs)]
    assert np.median(errors_m(driven, high)[30:]) < 1.0


def test_off_the_map_it_is_a_detector() -> None:
    driven = drive(ridge())
    epochs = draw_epochs(driven, RangingNoise(), np.random.default_rng(5))[:20]
    far = ElevationGrid(np.zeros((5, 5), np.float32), 10.0, 10.0, 5000.0, 5000.0)
    settings = replace(SETTINGS, altitude_hint_m=0.0)
    blind, mapped = Detector(driven.anchors, settings), MapDetector(far, driven.anchors, settings)
    for epoch in epochs:
        told = mapped.process(epoch)
        assert told.forecast is None
        assert told.result.summary == blind.process(epoch).summary


def test_what_makes_no_sense_is_refused_and_what_is_odd_is_told() -> None:
    with pytest.raises(WatchError, match="three dimensions"):
        MapDetector(ridge(), anchors(), DetectorSettings(dimension=2))
    with pytest.raises(WatchError, match="km outside the DEM"):
        MapDetector(ridge(), [RangingAnchor("X", 5e6, 0.0, 100.0)])
    low = MapDetector(ridge(), [*anchors(), RangingAnchor("X", 100.0, 100.0, -20.0)])
    assert "X is 25.0 m below the map's ground" in low.warnings[0]


@pytest.mark.parametrize("time_s", [math.nan, -5.0])
def test_bad_epochs_are_answered_as_ever(time_s: float) -> None:
    detector = MapDetector(ridge(), anchors(), SETTINGS)
    driven = drive(ridge())
    for epoch in draw_epochs(driven, RangingNoise(), np.random.default_rng(6))[:3]:
        detector.process(epoch)
    bad = RangeEpoch(time_s, (RangeMeasurement("A1", math.nan), RangeMeasurement("nobody", 4.0)))
    assert detector.process(bad).result.rejection is not None
