"""What one dilution per visible set costs: nothing for satellites, much for drones near by."""

from __future__ import annotations

import pytest

from benchmarks.terrains import fractal_grid
from benchmarks.visibility.dilution import drones, error_of_one_per_set, satellites
from visibility import FLAT, Anchor, DistantAnchor, min_visible_altitude
from visibility.dilution import DopKind

GRID = fractal_grid(341)  # 10.2 km


def error_over(anchors: list[Anchor | DistantAnchor], edge_m: float, kind: DopKind) -> tuple[float, float]:
    """(median, largest) relative error over a box so wide."""
    found = error_of_one_per_set(min_visible_altitude(GRID, anchors, curvature=FLAT), edge_m, kind, across=16)
    assert found.sets > 2
    return found.median, found.largest


@pytest.mark.parametrize("edge_m", [1000.0, 10_000.0])
def test_for_satellites_one_dop_per_visible_set_is_as_good_as_one_per_point(edge_m: float) -> None:
    # 10 km seen from 20 200 km turn a direction by half a milliradian
    _, largest = error_over([*satellites()], edge_m, "pseudorange")
    assert largest < 1e-3


@pytest.mark.parametrize("kind", ["ranging", "pseudorange"])
def test_for_drones_it_errs_by_several_percent_over_1_km_and_more_over_10_km(kind: DopKind) -> None:
    near, far = (error_over([*drones(GRID, 16)], edge_m, kind)[0] for edge_m in (1000.0, 10_000.0))
    assert 0.01 < near < far
