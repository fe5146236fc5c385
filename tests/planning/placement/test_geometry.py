"""How well spread placed anchors are is told whatever they were placed for, and a row of them is not passed over."""

import math

import numpy as np
import pytest

from planning.placement import (
    Goal,
    area_targets,
    candidate_points,
    join_candidates,
    place_anchors,
    placement_geometry,
)
from terrain import ElevationGrid

FLAT = ElevationGrid(np.zeros((20, 30), np.float32), 30.0, 30.0)
ROW = [(100.0 + 150.0 * n, -300.0) for n in range(4)]
SPREAD = [(20.0, -20.0), (850.0, -30.0), (30.0, -550.0), (430.0, -290.0)]
HEIGHTS_M = (60.0, 90.0, 300.0, 120.0)


def placed(places, goal, heights_m=(60.0,) * 4, weight=None):
    masts = [
        candidate_points(FLAT, [at], above_ground_m=[height]) for at, height in zip(places, heights_m, strict=True)
    ]
    return place_anchors(FLAT, join_candidates(masts), area_targets(FLAT, 1.5, weight=weight), len(places), goal)


def pdop_by_hand(anchors, point_m):
    rows = np.array([(a.east_m, a.north_m, a.altitude_m) for a in anchors]) - point_m
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    return math.sqrt(np.trace(np.linalg.inv(rows.T @ rows)))


def test_a_row_of_anchors_is_told_with_the_objective_that_mends_it():
    geometry = placement_geometry(FLAT, placed(ROW, Goal("coverage", min_anchors=4)))
    assert geometry.useless == geometry.no_fix == 1.0
    assert math.isinf(geometry.median)
    assert "stand in a row" in geometry.warning
    assert "--objective dop" in geometry.warning


def test_anchors_that_are_well_spread_are_told_their_dilution_point_by_point():
    found = placed(SPREAD, Goal("coverage", min_anchors=4, dop_limit=3.0), HEIGHTS_M)
    geometry = placement_geometry(FLAT, found)
    by_hand = np.array([pdop_by_hand(found.anchors, point) for point in found.targets.point_m])
    assert geometry.median == pytest.approx(np.sort(by_hand)[(len(by_hand) - 1) // 2])
    assert geometry.within_limit == pytest.approx(np.mean(by_hand < 3.0))
    assert (geometry.no_fix, geometry.warning) == (0.0, None)
    assert geometry.useless == pytest.approx(np.mean(by_hand > 20.0), abs=1e-12)


def test_ground_counts_by_its_weight():
    weight = np.full(FLAT.shape, 1.0)
    weight[3, 4] = 1e9
    found = placed(SPREAD, Goal("coverage", min_anchors=4), HEIGHTS_M, weight)
    assert placement_geometry(FLAT, found).median == pytest.approx(
        pdop_by_hand(found.anchors, (4 * 30.0, -3 * 30.0, 1.5)), rel=1e-6
    )


def test_whoever_wants_no_position_is_not_warned_of_bad_ones():
    geometry = placement_geometry(FLAT, placed(ROW, Goal("coverage", min_anchors=2)))
    assert geometry.useless == 1.0
    assert geometry.warning is None
