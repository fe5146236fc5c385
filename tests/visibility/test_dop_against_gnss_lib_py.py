"""Pseudorange dilutions against gnss-lib-py 1.1.0; tests/authorities has its answers and how to make them."""

import json
from pathlib import Path

import numpy as np
import pytest

from visibility import dop

CASES = json.loads((Path(__file__).parents[1] / "authorities" / "gnss_lib_py_dop.json").read_text(encoding="utf-8"))
# both invert in float64; the worst case has a GDOP of some hundreds
AGREEMENT = 1e-9
GPS_ORBIT_M = 2.02e7


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{len(case['elevation_deg'])} satellites, {case['gdop']:.2f}")
@pytest.mark.parametrize("distant", [True, False])
def test_satellites_have_the_dilutions_that_gnss_lib_py_gives_them(case, distant):
    elevation_rad, azimuth_rad = np.radians(case["elevation_deg"]), np.radians(case["azimuth_deg"])
    across = np.cos(elevation_rad)
    towards = np.column_stack([across * np.sin(azimuth_rad), across * np.cos(azimuth_rad), np.sin(elevation_rad)])
    found = dop(towards * GPS_ORBIT_M, [0.0, 0.0, 0.0], "pseudorange", distant=distant)
    for name in ("gdop", "pdop", "hdop", "vdop", "tdop"):
        assert getattr(found, name) == pytest.approx(case[name], rel=AGREEMENT), name
