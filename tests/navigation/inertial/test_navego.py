"""NaveGo's made-up drive with an ADIS16405: position and heading as python-ins has them, or better."""

import numpy as np
import pytest

from benchmarks.navigation.inertial_sets import SYNTHETIC, navego_synthetic
from navigation.inertial import navigate

pytestmark = pytest.mark.skipif(not SYNTHETIC.is_dir(), reason="NaveGo's data are not beside the checkout")

# python-ins 1.0.1, loosely coupled, t > 60 s
EAST_M, NORTH_M, DOWN_M, HEADING_DEG = 0.360, 0.229, 0.511, 0.403


def test_errors_are_those_of_python_ins_within_a_tenth():
    case = navego_synthetic()
    track = navigate(case.log, case.start, case.measurements, case.noise, case.frame)
    late = track.times_s > 60.0
    rms_m = np.sqrt(((track.position_m - case.position_m)[late] ** 2).mean(axis=0))
    assert (rms_m <= 1.1 * np.array([EAST_M, NORTH_M, DOWN_M])).all()
    off = (track.angles_rad[late, 0] - case.heading_rad[late] + np.pi) % (2.0 * np.pi) - np.pi
    assert np.degrees(np.sqrt((off**2).mean())) <= 1.1 * HEADING_DEG
