"""The street canyon: fixes are as good as the satellites in sight, and bubbles hold what they promise."""

import numpy as np
import pytest

import navigation
from benchmarks.navigation.urban_canyon import MOST_PDOP, SETTLED, canyon, drive, geometry, within
from benchmarks.visibility.paper_case import ALMANAC_FILE
from visibility import dop

pytestmark = pytest.mark.skipif(not ALMANAC_FILE.exists(), reason="needs ../shared/data")


@pytest.fixture(scope="module")
def case():
    return canyon()


def test_walls_hide_satellites_and_leave_some(case):
    seen = case.in_sight.sum(axis=1)
    assert seen.max() >= 8
    assert seen.min() < 4
    grid = case.grid
    rows = np.round((grid.origin_north_m - case.points_m[:, 1]) / grid.cell_north_m).astype(int)
    cols = np.round((case.points_m[:, 0] - grid.origin_east_m) / grid.cell_east_m).astype(int)
    assert (grid.heights_m[rows, cols] == 0.0).all()  # the way is in the street


def test_the_geometry_of_a_fix_is_what_dilution_of_precision_says(case):
    found = geometry(case.points_m, case.anchors_m, case.in_sight)
    for epoch in (0, 200, 400):
        pdop = dop(case.anchors_m[case.in_sight[epoch]], case.points_m[epoch], "pseudorange").pdop
        told = np.sqrt(np.trace(found[epoch]))
        assert told == pytest.approx(pdop, rel=1e-6) if pdop <= MOST_PDOP else np.isnan(told)


def test_bubbles_hold_what_they_promise_and_not_when_reflections_are_taken_in(case):
    shares = {}
    for reflect in (False, True):
        drives = drive(case, "geometry", 12, 3, reflect=reflect)
        sphere_m = navigation.radius_of_confidence(drives.covariance_m2[:, SETTLED:], within(2.0))
        shares[reflect] = np.mean(drives.distance_m[:, SETTLED:] <= sphere_m)
    assert shares[False] == pytest.approx(within(2.0), abs=0.05)
    assert shares[True] < 0.5
