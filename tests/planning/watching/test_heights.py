"""How wrong a map's heights are, as ranges have it: grazing lines and flat geometry are no fault of the map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import DetectorSettings, GroundHeight, RangeEpoch, RangeMeasurement, RangingAnchor, detect_epoch
from planning.watching.heights import HeightCheck, free_height

SIGMA_M, HARMLESS_M, DEM_SIGMA_M = 0.1, 0.3, 0.3
ANCHORS = {
    f"A{n + 1}": (120.0 * math.sin(n * math.pi / 4.0), 120.0 * math.cos(n * math.pi / 4.0), up_m)
    for n, up_m in enumerate((-8.1, -13.8, -6.8, -2.3, 4.0, 7.7, 7.5, 3.6))
}
ROVER_M = (3.0, -2.0, 1.5)


def scale_after(grazing_m: dict[str, float], map_off_m: float, *, told: bool = True) -> float:
    """The factor on the map's sigma after 80 epochs, one in two seconds; told: whether the map has who grazes."""
    generator, check = np.random.default_rng(5), HeightCheck(DEM_SIGMA_M)
    ground = GroundHeight(ROVER_M[0], ROVER_M[1], ROVER_M[2] + map_off_m, 0.0, 0.0, DEM_SIGMA_M)
    anchors = [RangingAnchor(name, *at_m) for name, at_m in ANCHORS.items()]
    settings = DetectorSettings(range_sigma_m=SIGMA_M, harmful_m=HARMLESS_M)
    p_sight = {name: 0.0 if told and name in grazing_m else 1.0 for name in ANCHORS}
    for n in range(80):
        ranges = tuple(
            RangeMeasurement(name, math.dist(at_m, ROVER_M) + grazing_m.get(name, 0.0) + SIGMA_M * noise)
            for (name, at_m), noise in zip(ANCHORS.items(), generator.standard_normal(8).tolist(), strict=True)
        )
        result = detect_epoch(anchors, RangeEpoch(2.0 * n, ranges, ground=ground), settings)
        free = free_height(result, ANCHORS, dict.fromkeys(ANCHORS, 1.0), p_sight, ground, SIGMA_M, HARMLESS_M)
        if free is not None:
            check.note(*free, 2.0 * n)
    return check.scale


def test_a_right_map_is_believed_also_where_lines_graze() -> None:
    assert scale_after({}, 0.0) < 1.3
    assert scale_after({"A1": 0.15, "A8": 0.2}, 0.0) < 1.3 < scale_after({"A1": 0.15, "A8": 0.2}, 0.0, told=False)


@pytest.mark.parametrize("off_m", [-5.0, 5.0])
def test_a_map_that_is_metres_off_is_believed_less(off_m: float) -> None:
    assert scale_after({}, off_m) > 4.0
    assert scale_after({"A1": 0.15, "A8": 0.2}, off_m) > 4.0
