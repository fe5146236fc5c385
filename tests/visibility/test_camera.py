"""De Vivo's camera form, equations 10 and 11: image columns see what a running horizon sees."""

import math
from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import ElevationGrid, fractal
from tests.reference.running_horizon import seen_along_ray
from visibility import FLAT, HIDDEN, UNKNOWN, VISIBLE, Anchor, Curvature, VisibilityInputError, lines_of_sight
from visibility.sight import OUTSIDE_DEM, OUTSIDE_VIEW, camera_for_anchor, occluded_points

DATA = Path(__file__).parents[2] / "../shared/data/dem"
SMALL_WORLD = Curvature(200_000.0)


# -- equations 10 and 11


def three_row_ridge():
    heights_m = np.zeros((101, 121), np.float32)
    heights_m[30:33] = 40.0
    return ElevationGrid(heights_m, 20.0, 25.0, 500_000.0, 4_100_000.0)


def mountains():
    path = DATA / "bigtujunga.tif"
    if not path.exists():
        pytest.skip("the shared DEMs are not beside this checkout")
    with rasterio.open(path) as dem:
        heights_m = dem.read(1)[250:450, 500:750].astype(np.float32)
    return ElevationGrid(heights_m, 30.0, 30.0, 380_000.0, 3_800_000.0)


def deep_valley():
    return fractal(129, 3, slope=2.2, relief_m=800.0)


def lowest(grid):
    return *np.unravel_index(np.argmin(grid.heights_m), grid.shape), float(grid.heights_m.min()) + 2.0


def highest(grid):
    return *np.unravel_index(np.argmax(grid.heights_m), grid.shape), float(grid.heights_m.max())


def at(row_share, col_share, altitude_m):
    return lambda grid: (row_share * (grid.rows - 1), col_share * (grid.cols - 1), altitude_m)


# ground, eye, target, width of the control volume
SCENES = {
    "fractal": (lambda: fractal(129, 1, relief_m=800.0), at(0.1, 0.15, 900.0), at(0.6, 0.7, 500.0), 2500.0),
    "fractal from outside": (
        lambda: fractal(129, 2, relief_m=800.0),
        at(-0.4, 0.5, 1300.0),
        at(0.5, 0.5, 700.0),
        3500.0,
    ),
    "fractal, looking up": (deep_valley, lowest, highest, 2500.0),
    "ridge": (three_row_ridge, at(0.9, 0.5, 70.0), at(0.2, 0.5, 0.0), 1500.0),
    "mountains": (mountains, at(0.2, 0.1, 2200.0), at(0.7, 0.6, 1000.0), 4000.0),
}


def view(scene, pixels=120):
    make, eye, target, width_m = SCENES[scene]
    grid = make()
    (*eye_post, eye_m), (*target_post, target_m) = eye(grid), target(grid)
    anchor = Anchor("A", *grid.position_of(*eye_post), eye_m)
    return grid, anchor, camera_for_anchor(anchor, (*grid.position_of(*target_post), target_m), width_m, pixels)


@pytest.mark.parametrize("receiver_m", [0.0, 1.5], ids=["on the ground", "1.5 m up"])
@pytest.mark.parametrize("curvature", [FLAT, SMALL_WORLD], ids=["flat", "curved"])
@pytest.mark.parametrize("scene", SCENES)
def test_image_columns_and_a_running_horizon_see_the_same_points(scene, curvature, receiver_m):
    grid, anchor, camera = view(scene)
    found = occluded_points(camera, grid, receiver_above_ground_m=receiver_m, curvature=curvature)
    looked_at = (found.state == VISIBLE) | (found.state == HIDDEN)
    assert looked_at.sum() > 1000
    assert (found.state == HIDDEN).sum() > 100
    assert (found.state == VISIBLE).sum() > 100
    for column in range(len(found.azimuth_rad)):
        on_dem = found.state[column] != OUTSIDE_DEM
        sees = seen_along_ray(
            anchor.altitude_m,
            found.distance_m[on_dem],
            found.ground_m[column, on_dem],
            receiver_m,
            curvature.drop_per_m2,
        )
        judged = looked_at[column, on_dem]
        expected = np.array([HIDDEN, VISIBLE])[np.array(sees, bool).astype(int)]
        np.testing.assert_array_equal(found.state[column, on_dem][judged], expected[judged])


@pytest.mark.parametrize("scene", SCENES)
def test_what_image_columns_hide_is_hidden_to_line_of_sight_too(scene):
    grid, anchor, camera = view(scene)
    found = occluded_points(camera, grid, receiver_above_ground_m=2.0, spacing_m=5.0)
    looked_at = (found.state == VISIBLE) | (found.state == HIDDEN)
    points_m = np.column_stack([found.east_m[looked_at], found.north_m[looked_at], found.ground_m[looked_at] + 2.0])
    eyes_m = np.tile([anchor.east_m, anchor.north_m, anchor.altitude_m], (len(points_m), 1))
    sight = lines_of_sight(grid, eyes_m, points_m, curvature=FLAT)
    state = found.state[looked_at]
    # samples stand on the surface, so they hide nothing that it does not; it hides a little more between them
    assert (sight.verdict[state == HIDDEN] == HIDDEN).all()
    missed = (state == VISIBLE) & (sight.verdict == HIDDEN)
    assert missed.mean() < 0.01
    steps_m = [np.abs(np.diff(grid.heights_m, axis=axis)).max() for axis in (0, 1)]
    steepest = np.hypot(steps_m[0] / grid.cell_north_m, steps_m[1] / grid.cell_east_m)
    assert sight.clearance_m[missed].min(initial=0.0) > -2.5 * steepest  # a crest is at most half a spacing away


def test_the_shadow_of_a_ridge_ends_where_the_line_over_its_top_meets_the_ground():
    grid, anchor, camera = view("ridge")
    found = occluded_points(camera, grid, spacing_m=1.0)
    middle = len(found.azimuth_rad) // 2
    north_of_eye_m = found.north_m[middle] - anchor.north_m
    crest_m = grid.position_of(30, 0)[1] - anchor.north_m  # its far edge, 40 m high, seen from 70 m
    along = found.distance_m / north_of_eye_m  # the column is almost due north
    hidden = north_of_eye_m[found.state[middle] == HIDDEN]
    assert hidden.min() == pytest.approx(crest_m, abs=26.0)  # beyond the crest's far edge, on its way down
    assert along == pytest.approx(np.full(len(along), along[0]))
    assert crest_m * 70.0 / 30.0 > found.north_m[middle].max() - anchor.north_m  # the shadow reaches the border
    lit = occluded_points(camera, grid, spacing_m=1.0, receiver_above_ground_m=40.0)
    assert not (lit.state[middle] == HIDDEN).any()


def test_points_out_of_view_are_told_apart_from_hidden_ones():
    grid, _, camera = view("fractal")
    found = occluded_points(camera, grid)
    points_m = np.stack([found.east_m, found.north_m, found.ground_m], axis=-1)
    ground = np.isfinite(found.ground_m)
    np.testing.assert_array_equal(
        found.state[ground] == OUTSIDE_VIEW, ~camera.in_view(points_m + np.array([0, 0, 1e-5]))[ground]
    )
    assert (found.state == OUTSIDE_VIEW).sum() > 100
    west_m, south_m, east_m, north_m = grid.bounds_m
    beyond = (found.east_m > east_m) | (found.east_m < west_m) | (found.north_m > north_m) | (found.north_m < south_m)
    np.testing.assert_array_equal(found.state == OUTSIDE_DEM, beyond)


def test_the_columns_cover_every_post_in_view():
    grid, _, camera = view("fractal from outside", pixels=200)
    row, col = np.mgrid[0 : grid.rows, 0 : grid.cols]
    posts_m = np.stack([*grid.position_of(row, col), grid.heights_m.astype(float)], axis=-1)
    in_view = camera.in_view(posts_m)
    assert in_view.sum() > 1000
    found = occluded_points(camera, grid)
    foot_m = camera.position_m[:2]
    azimuth = np.arctan2(posts_m[in_view][:, 0] - foot_m[0], posts_m[in_view][:, 1] - foot_m[1])
    middle = (found.azimuth_rad[0] + found.azimuth_rad[-1]) / 2.0
    aside = np.abs(np.angle(np.exp(1j * (azimuth - middle))))
    half_fan = (found.azimuth_rad[-1] - found.azimuth_rad[0]) / 2.0
    assert 0.5 * half_fan < aside.max() < half_fan + 0.01


def test_unknown_ground_makes_what_lies_behind_unknown_unless_known_ground_hides_it():
    grid = three_row_ridge()
    heights_m = grid.heights_m.copy()
    heights_m[60:64, :] = np.nan
    holed = ElevationGrid(heights_m, 20.0, 25.0, 500_000.0, 4_100_000.0)
    _, _, camera = view("ridge")
    whole, found = occluded_points(camera, grid), occluded_points(camera, holed)
    np.testing.assert_array_equal(found.state == HIDDEN, whole.state == HIDDEN)
    behind = found.north_m > holed.position_of(60, 0)[1]
    lost = behind & (whole.state == VISIBLE)
    assert lost.sum() > 500
    assert (found.state[lost] == UNKNOWN).all()
    before = (found.north_m < holed.position_of(64, 0)[1] - 1.0) & (whole.state == VISIBLE)
    assert (found.state[before] == VISIBLE).all()


# -- bad input


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"target_m": (0.0, 0.0, 100.0)}, "A camera cannot point at the place where it is"),
        ({"target_m": (0.0, math.nan, 100.0)}, "must be finite numbers"),
        ({"control_volume_width_m": 0.0}, "control_volume_width_m must be a positive number, not 0.0"),
        ({"pixels": 0}, "A camera needs pixels of a positive size, not 0 of"),
        ({"pixel_size_m": -1e-5}, "A camera needs pixels of a positive size"),
    ],
)
def test_cameras_that_cannot_be_are_refused(arguments, sentence):
    question = {"target_m": (0.0, 1000.0, 0.0), "control_volume_width_m": 500.0} | arguments
    with pytest.raises(VisibilityInputError, match=sentence):
        camera_for_anchor(Anchor("A", 0.0, 0.0, 100.0), **question)


def test_views_without_upright_columns_are_refused():
    grid, anchor, camera = view("fractal")
    below_m = (anchor.east_m + 50.0, anchor.north_m, 0.0)
    downward = camera_for_anchor(anchor, below_m, 500.0)
    with pytest.raises(VisibilityInputError, match="straight below or above it in view"):
        occluded_points(downward, grid)
    rolled = camera_for_anchor(anchor, (9000.0, -9000.0, 0.0), 500.0, attitude_rad=(0.0, 0.3, 0.0))
    with pytest.raises(VisibilityInputError, match="The camera is rolled"):
        occluded_points(rolled, grid)
    for option in ({"spacing_m": 0.0}, {"spacing_m": math.nan}, {"receiver_above_ground_m": -1.0}):
        with pytest.raises(VisibilityInputError, match=next(iter(option))):
            occluded_points(camera, grid, **option)
