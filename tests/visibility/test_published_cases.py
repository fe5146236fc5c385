"""Cases that others published: GDAL's and JanCaha's viewshed tests, and a real profile over Mount Mitchell.

Where a case depends on an interpolation that is not the triangulated surface, what must agree all the same is tested,
and docs/published-viewshed-cases.md explains the rest.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from terrain import ElevationGrid
from visibility import Anchor, AntennaLimits, line_of_sight, lines_of_sight, min_visible_altitude

DATA = Path(__file__).parents[2] / "../shared/data"
PAGE = Path(__file__).parents[2] / "docs/published-viewshed-cases.md"
PRINTED_DIGITS = 1e-5

if not (DATA / "viewshed/cases.json").exists():
    pytest.skip("the shared data are not beside this checkout", allow_module_level=True)

CASES = {case["id"]: case for case in json.loads((DATA / "viewshed/cases.json").read_text())}
EXACT = [name for name, case in CASES.items() if case["exact_geometry"] is True and "dem" in case]
WITH_VISIBILITY = [name for name in EXACT if "visible" in CASES[name]["expect"]]
PROFILES = [name for name in EXACT if len(CASES[name]["dem"]) == 1]
OUTSIDE = [name for name in CASES if name.startswith("gdal_oor_")]
BANDS = [name for name in CASES if name.startswith("gdal_sd_")]


def ask(case, mode):
    """(altitude over each post, visible 0/1, heights) as our engine answers a case."""
    heights_m = np.array(case["dem"], np.float32)
    col, row = case["observer_xy"]
    inside = 0 <= row < heights_m.shape[0] and 0 <= col < heights_m.shape[1]
    ground_m = float(heights_m[row, col]) if inside else case["observer_elevation"]
    limits = AntennaLimits(
        min_range_m=case.get("min_distance", 0.0),
        max_range_m=case.get("max_distance", math.inf),
        azimuth_from_rad=math.radians(case["start_azimuth_deg"]) if "start_azimuth_deg" in case else None,
        azimuth_to_rad=math.radians(case["end_azimuth_deg"]) if "end_azimuth_deg" in case else None,
        min_elevation_rad=math.radians(case.get("min_pitch_deg", -90.0)),
        max_elevation_rad=math.radians(case.get("max_pitch_deg", 90.0)),
    )
    observer = Anchor("observer", float(col), -float(row), ground_m + case["observer_height"], limits=limits)
    answer = min_visible_altitude(ElevationGrid(heights_m, case["cell"], case["cell"]), [observer], mode)
    return (
        answer.altitude_m[0].astype(float),
        answer.visible(above_ground_m=case["target_height"])[0],
        heights_m.astype(float),
    )


def assert_as_published(case, mode, where=...):
    altitude_m, visible, heights_m = ask(case, mode)
    expect = {name: np.atleast_2d(table)[where] for name, table in case["expect"].items() if name != "tolerance"}
    compared = 0
    for name, ours in (
        ("visible", visible),
        ("min_visible_elevation_DEM", altitude_m),
        ("min_height_above_ground", altitude_m - heights_m),
    ):
        if name in expect:
            np.testing.assert_allclose(ours[where], expect[name], atol=PRINTED_DIGITS, err_msg=name)
            compared += 1
    assert compared > 0


def on_a_line_of_posts(case):
    """Posts on the row, the column or the grid's diagonal through the observer: there every interpolation agrees."""
    col, row = case["observer_xy"]
    rows, cols = np.array(case["dem"]).shape
    r, c = np.mgrid[0:rows, 0:cols]
    return (r == row) | (c == col) | (r - c == row - col)


# -- what any correct code must answer


@pytest.mark.parametrize("name", EXACT)
def test_exact_mode_answers_every_case_of_exact_geometry_as_published(name):
    assert_as_published(CASES[name], "exact")


@pytest.mark.parametrize("name", [*PROFILES, "gdal_low_mask"])
def test_fast_mode_answers_profiles_and_the_pitch_limit_as_published(name):
    assert_as_published(CASES[name], "fast")


@pytest.mark.parametrize("name", WITH_VISIBILITY)
def test_line_of_sight_to_each_post_gives_the_published_visibility(name):
    case = CASES[name]
    heights_m = np.array(case["dem"], np.float32)
    row, col = np.mgrid[0 : heights_m.shape[0], 0 : heights_m.shape[1]]
    posts_m = np.column_stack([col.ravel(), -row.ravel(), heights_m.ravel()]).astype(float)
    eye = posts_m[case["observer_xy"][1] * heights_m.shape[1] + case["observer_xy"][0]]
    sight = lines_of_sight(ElevationGrid(heights_m, 1.0, 1.0), np.tile(eye, (len(posts_m), 1)), posts_m)
    np.testing.assert_array_equal(sight.verdict, np.ravel(case["expect"]["visible"]))


def test_the_published_profile_has_its_visible_points_and_the_depth_of_its_shadows():
    case = CASES["jancaha_los_profile"]
    heights_m = np.array([[case["observer"]["elevation"], *case["profile"]["elevation"]]], np.float32)
    grid = ElevationGrid(heights_m, 1.0, 1.0)
    eye_m = case["observer"]["elevation"] + case["observer"]["offset"]
    expect, tolerance_m = case["expect"], case["expect"]["tolerance"]
    answer = min_visible_altitude(grid, [Anchor("observer", 0.0, 0.0, eye_m)], "exact").altitude_m[0, 0, 1:]
    for k, distance_m in enumerate(case["profile"]["distance"]):
        target_m = float(heights_m[0, distance_m])
        sight = line_of_sight(grid, (0.0, 0.0, eye_m), (distance_m, 0.0, target_m))
        assert sight.verdict == ("clear" if expect["visible"][k] else "blocked")
        angle_deg = math.degrees(math.atan2(target_m - eye_m, distance_m))
        assert angle_deg == pytest.approx(expect["view_angle_deg"][k], abs=tolerance_m)
        if not expect["visible"][k]:
            # "negative = depth of shadow (how far the target must be raised)"
            assert target_m - answer[k] == pytest.approx(expect["elev_diff_local_horizon_all"][k], abs=tolerance_m)


@pytest.mark.parametrize(("sample", "above_ground_m", "seen"), [(39, 2.0, 17), (0, 2.0, 2), (61, 120.0, 30)])
def test_the_profile_over_mount_mitchell_has_the_counted_samples_in_sight(sample, above_ground_m, seen):
    profile = json.loads((DATA / "dem/mount_mitchell_srtm1_profile.json").read_text())
    heights_m = np.array([profile["elevation_m"]], np.float32)
    cell_m = profile["distance_km_end"] * 1000.0 / (profile["n"] - 1)
    grid = ElevationGrid(heights_m, cell_m, cell_m)
    eye_m = (sample * cell_m, 0.0, float(heights_m[0, sample]) + above_ground_m)
    for mode in ("exact", "fast"):
        visible = min_visible_altitude(grid, [Anchor("observer", *eye_m)], mode).visible(above_ground_m=0.0)
        assert (visible == 1).sum() == seen
    targets_m = np.column_stack([np.arange(80) * cell_m, np.zeros(80), heights_m[0].astype(float)])
    assert (lines_of_sight(grid, np.tile(eye_m, (80, 1)), targets_m).verdict == 1).sum() == seen


# -- what must agree although the published surface is another


@pytest.mark.parametrize("name", ["gdal_simple_height", *OUTSIDE])
def test_rows_columns_and_diagonals_through_the_observer_are_as_published(name):
    where = on_a_line_of_posts(CASES[name])
    assert where.any()
    assert_as_published(CASES[name], "exact", where)


def test_the_boolean_map_of_the_rough_little_grid_is_as_published():
    case = CASES["gdal_simple_height"]
    _, visible, _ = ask(case, "exact")
    np.testing.assert_array_equal(visible, case["expect"]["visible"])


@pytest.mark.parametrize("mode", ["exact", "fast"])
def test_the_range_ring_is_the_published_one_and_a_true_ring(mode):
    case = CASES["gdal_min_max_mask"]
    _, visible, _ = ask(case, mode)
    row, col = np.mgrid[0:15, 0:15]
    distance = np.hypot(row - 7, col - 7)
    np.testing.assert_array_equal(visible, (distance >= 2) & (distance <= 6))
    # the published window begins one row higher than it says
    np.testing.assert_array_equal(visible[1:13, 1:14], np.array(case["expect"]["visible_in_window"])[1:])


@pytest.mark.parametrize("mode", ["exact", "fast"])
def test_the_azimuth_sector_is_the_published_one_but_for_cells_that_its_edge_only_touches(mode):
    case = CASES["gdal_angle_0_30"]
    _, visible, _ = ask(case, mode)
    ours, published = visible[0:9, 8:14].astype(bool), np.array(case["expect"]["visible_in_window"], bool)
    assert not (ours & ~published).any()
    north, east = 8 - np.mgrid[0:9, 0:6][0], np.mgrid[0:9, 0:6][1]
    off_edge = east * math.cos(math.radians(30.0)) - north * math.sin(math.radians(30.0))
    assert ((published & ~ours) <= ((off_edge > 0.0) & (off_edge < math.sqrt(0.5)))).all()
    assert not visible[9:].any()


def test_the_upper_pitch_limit_agrees_along_the_observers_row():
    case = CASES["gdal_high_mask"]
    _, visible, _ = ask(case, "exact")
    # published 2 = its ground is above the limit, seen or not; both 0 and 2 are "not visible" here
    np.testing.assert_array_equal(visible[7] == 1, np.array(case["expect"]["code"])[7] == 1)


@pytest.mark.parametrize("name", BANDS)
def test_what_an_error_band_calls_certain_is_what_we_say(name):
    _, visible, _ = ask(CASES[name], "exact")
    code = np.atleast_2d(CASES[name]["expect"]["code"])
    assert (visible[code == 255] == 1).all()
    assert (visible[code == 0] == 0).all()


def test_every_published_case_is_listed_on_the_page():
    page = PAGE.read_text(encoding="utf-8")
    assert [name for name in CASES if f"`{name}`" not in page] == []
