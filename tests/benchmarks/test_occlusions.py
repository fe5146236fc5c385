"""The simulated occlusions of docs/detection-simulation.md: the truth is the ground's, tables and pictures come out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import terrain
import visibility
from benchmarks.detection.occlusion_scenarios import BY_EPOCH, SCENARIOS, SESSION, drives_of, run
from benchmarks.detection.occlusion_terrain import ANTENNA_M, Place, ground_drives, jacksboro
from benchmarks.detection.occlusions import over_terrain
from detection import RangingAnchor


def test_excess_over_ground_is_that_of_the_line_and_zero_where_it_is_clear() -> None:
    place = jacksboro()
    drives = ground_drives(place, 2, 200.0, np.random.default_rng(4))
    for drive in drives:
        for n in (0, 40, 99):
            for k, anchor in enumerate(place.anchors):
                ends = (tuple(drive.places_m[n].tolist()), (anchor.east_m, anchor.north_m, anchor.altitude_m))
                line = visibility.line_of_sight(place.ground, *ends)
                assert drive.excess_m[n, k] == pytest.approx(line.excess_path_m, abs=1e-9)
                assert (drive.excess_m[n, k] == 0.0) == (line.verdict == "clear")


def test_over_a_ridge_the_excess_is_the_string_over_its_crest() -> None:
    ridge = terrain.ridge(crest_m=100.0)
    drone = RangingAnchor("D1", -800.0, 0.0, 60.0)
    place = Place(ridge, (drone,), (500.0, 0.0), 300.0)
    for drive in ground_drives(place, 3, 100.0, np.random.default_rng(1)):
        assert drive.p_sight is not None
        assert drive.p_sight.max() < 0.01
        for place_m, excess_m in zip(drive.places_m, drive.excess_m[:, 0], strict=True):
            here, eye = np.array([*place_m[:2], ANTENNA_M]), np.array([-800.0, 0.0, 60.0])
            share = (0.0 - eye[0]) / (here[0] - eye[0])
            crest = np.array([0.0, eye[1] + share * (here[1] - eye[1]), 100.0])
            string_m = np.linalg.norm(eye - crest) + np.linalg.norm(crest - here)
            assert excess_m == pytest.approx(string_m - np.linalg.norm(eye - here), abs=0.05)


def test_a_scenario_hides_as_many_as_it_says_and_the_same_seed_measures_the_same() -> None:
    two = SCENARIOS[1]
    for drive, epochs in drives_of(two, 2, np.random.default_rng(0)):
        assert set((drive.excess_m > 0.0).sum(axis=1).tolist()) == {0, 2}
        assert len(epochs) == len(drive.times_s)
    found = run(two, 1, seed=3)
    assert found == run(two, 1, seed=3)
    assert set(found.judged) == {BY_EPOCH, SESSION}
    assert found.judged[SESSION].true_positives.value > 0.95
    assert found.judged[SESSION].position_rms_m.value < found.plain_rms_m


def test_drives_over_ground_give_a_row_per_way_of_judging_and_three_pictures(tmp_path: Path) -> None:
    rows, sentence = over_terrain(2, tmp_path)
    assert [row[0] for row in rows] == ["Jacksboro, 8 drones"] * 3
    assert sentence.startswith("Hidden: ")
    pictures = {path.name: path.read_bytes()[:8] for path in tmp_path.iterdir()}
    assert pictures == dict.fromkeys(("drive.png", "places.png", "response.png"), b"\x89PNG\r\n\x1a\n")
