"""The column-wise sweep against the exact one."""

import numpy as np
import pytest

from benchmarks.visibility.deviation import deviation
from terrain import ElevationGrid
from terrain.synthetic import fractal
from tests.visibility.grounds import clearing_eye, eye, hills, real_dem, rough, window
from visibility import FLAT, Curvature, min_visible_altitude
from visibility.sight.sectors import share_out
from visibility.sight.sweeps import fast_sweep


def misclassified_share(grid, anchors, above_ground_m=0.0):
    fast = min_visible_altitude(grid, anchors, mode="fast").visible(above_ground_m=above_ground_m)
    exact = min_visible_altitude(grid, anchors, mode="exact").visible(above_ground_m=above_ground_m)
    return float((fast != exact).mean())


def test_at_most_half_a_percent_of_a_small_rough_fractal_is_misclassified():
    grid = fractal(256, seed=1)
    assert misclassified_share(grid, [clearing_eye(grid, 128, 128, above_m=100.0)]) <= 0.005


def test_at_most_a_fifth_of_a_percent_of_real_mountains_is_misclassified():
    grid = window(real_dem("bigtujunga.tif"), 100, 300, 300, 400)
    rng = np.random.default_rng(11)
    anchors = [
        clearing_eye(grid, *(rng.random(2) * (299, 399)), above_m=above_m, name=f"A{above_m}")
        for above_m in (10.0, 30.0, 60.0, 120.0)
    ]
    assert misclassified_share(grid, anchors) <= 0.002
    assert misclassified_share(grid, anchors, above_ground_m=1.5) <= 0.002


@pytest.mark.parametrize("shape", [(2, 2), (3, 70), (70, 3), (40, 65), (65, 40), (130, 131)])
def test_every_post_is_written_once_wherever_the_eye_is(shape):
    rng = np.random.default_rng(7)
    grid = rough(1, *shape)
    rows, cols = shape
    eyes = [(0.0, 0.0, 90.0), (rows - 1.0, cols - 1.0, 90.0), (rows // 2, cols / 2 + 0.25, 90.0)]
    eyes += [(*(rng.random(2) * (3 * rows, 3 * cols) - (rows, cols)), 90.0) for _ in range(12)]
    # a whole number of posts away from the diagonals' rays, where two sectors meet
    eyes += [(float(r), float(c), 90.0) for r, c in rng.integers(-rows, 2 * rows, (12, 2))]
    out_m = np.full((len(eyes), rows, cols), np.nan, np.float32)
    fast_sweep(grid.heights_m, [(float(r), float(c), z) for r, c, z in eyes], (0.0, 0.0), out_m)
    assert not np.isnan(out_m).any()
    assert (out_m >= grid.heights_m).all()


def test_smooth_ground_is_answered_within_a_decimetre_of_exact():
    rows, cols = np.mgrid[0:80, 0:90]
    heights_m = 60.0 * np.sin(rows / 9.0) * np.cos(cols / 11.0)
    grid = rough(0, 80, 90, relief_m=0.0)
    grid = type(grid)(heights_m, 30.0, 30.0)
    anchor = clearing_eye(grid, 40, 45, above_m=80.0)
    fast = min_visible_altitude(grid, [anchor], mode="fast").altitude_m
    exact = min_visible_altitude(grid, [anchor], mode="exact").altitude_m
    assert np.quantile(np.abs(fast - exact), 0.99) < 2.0
    assert np.median(np.abs(fast - exact)) < 0.1


def test_curvature_lowers_fast_and_exact_alike():
    grid = hills(65)
    anchor = clearing_eye(grid, 30.5, 12.25)
    world = Curvature(30_000.0)
    curved = min_visible_altitude(grid, [anchor], curvature=world).altitude_m
    exact = min_visible_altitude(grid, [anchor], mode="exact", curvature=world).altitude_m
    flat = min_visible_altitude(grid, [anchor], curvature=FLAT).altitude_m
    assert np.median(np.abs(curved - exact)) < 0.25 * np.median(np.abs(flat - exact))


@pytest.mark.parametrize("at", [(404, 350), (60, 350), (350, 404), (350, 60)])
def test_a_wall_along_the_grid_hides_nothing_before_it(at):
    heights_m = np.zeros((701, 701), np.float32)
    row, col = at
    wall = (slice(None), slice(col + 1, None)) if col == 350 else (slice(row + 1, None), slice(None))
    heights_m[wall] = 200.0
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    altitude_m = min_visible_altitude(grid, [clearing_eye(grid, row, col, above_m=10.0)], "fast", FLAT).altitude_m[0]
    assert altitude_m[heights_m == 0.0].max() == 0.0


@pytest.mark.parametrize("beyond", [0.3, 3.0, 10.0])
def test_from_beyond_a_border_every_post_on_it_is_seen(beyond):
    grid = fractal(256, seed=2, relief_m=800.0)
    last = 255.0
    places = [(-beyond, 70.25), (last + beyond, 200.0), (90.0, -beyond), (130.5, last + beyond)]
    anchors = [eye(grid, row, col, 1000.0, name=f"A{n}") for n, (row, col) in enumerate(places)]
    altitude_m = min_visible_altitude(grid, anchors, "fast", FLAT).altitude_m
    near = [(0, slice(None)), (255, slice(None)), (slice(None), 0), (slice(None), 255)]
    for number, border in enumerate(near):
        np.testing.assert_array_equal(altitude_m[number][border], grid.heights_m[border])


@pytest.mark.parametrize("beyond", [0.3, 3.0, 7.28, 12.0])
def test_from_beyond_a_border_altitudes_beside_it_are_as_good_as_anywhere(beyond):
    grid = fractal(257, seed=6, relief_m=900.0)
    last = 256.0
    places = [(-beyond, 70.25), (last + beyond, 200.0), (90.0, -beyond), (130.5, last + beyond), (-beyond, -beyond)]
    places.append((last + beyond, last + 2.0))
    anchors = [clearing_eye(grid, row, col, above_m=60.0, name=f"A{n}") for n, (row, col) in enumerate(places)]
    fast_m, exact_m = (min_visible_altitude(grid, anchors, mode, FLAT).altitude_m for mode in ("fast", "exact"))
    # an altitude over a post follows from a slope over ground before it: no error beyond the relief of neighbours there
    for number, anchor in enumerate(anchors):
        found = deviation(grid, anchor, fast_m[number], exact_m[number], (0.0,))
        assert found.wild == 0
        assert found.mean(0.0) <= 0.003


@pytest.mark.parametrize(("row", "col"), [(-0.5, 31.3), (-40.0, 70.0), (66.0, -3.0), (30.5, 68.0), (-2.0, 300.0)])
def test_fans_of_entering_rays_follow_one_another_without_a_gap(row, col):
    grid = hills(65)
    work = share_out([(row, col, 900.0)], grid.heights_m, (0.0, 0.0), 64, 1, follow_borders=True)
    for axis, direction in ((0, 1), (0, -1), (1, 1), (1, -1)):
        own = work.blocks[(work.blocks["axis"] == axis) & (work.blocks["direction"] == direction)]
        starts = own["t_0"] + own["first_ray"] * own["dt"]
        ends = own["t_0"] + (own["first_ray"] + own["rays"] - 1) * own["dt"]
        np.testing.assert_array_equal(starts[1:], ends[:-1])
        assert (ends > starts).all()


def test_many_anchors_answer_as_each_alone():
    grid = hills(65)
    anchors = [clearing_eye(grid, row, 60.0 - row, name=f"A{row}") for row in (3.0, 20.5, 44.0, 70.0)]
    together = min_visible_altitude(grid, anchors)
    for number, anchor in enumerate(anchors):
        np.testing.assert_array_equal(together.altitude_m[number], min_visible_altitude(grid, [anchor]).altitude_m[0])


def test_progress_ends_at_one_and_never_falls():
    grid = hills(33)
    shares = []
    min_visible_altitude(grid, [eye(grid, 3, n, 900.0, f"A{n}") for n in range(20)], progress=shares.append)
    assert shares[-1] == 1.0
    assert shares == sorted(shares)
    assert len(shares) >= 3


@pytest.mark.parametrize("shape", [(2, 40), (40, 2), (120, 90)])
@pytest.mark.parametrize(("rise_outward_m", "error_m"), [(-10.0, 0.05), (10.0, 2.0)], ids=["falls", "rises"])
@pytest.mark.parametrize("side", ["north", "south", "west", "east"])
def test_an_anchor_on_any_border_of_a_plane_sees_all_of_it(side, rise_outward_m, error_m, shape):
    row, col = np.mgrid[0 : shape[0], 0 : shape[1]]
    outward = {"north": -row, "south": row, "west": -col, "east": col}[side]
    grid = ElevationGrid(outward * rise_outward_m, 30.0, 30.0)
    at = {"north": (0, 7), "south": (shape[0] - 1, 7), "west": (7, 0), "east": (7, shape[1] - 1)}[side]
    at = tuple(min(index, size - 1) for index, size in zip(at, shape, strict=True))
    standing = eye(grid, *at, float(grid.heights_m[at]) + 0.001)
    margin_m = min_visible_altitude(grid, [standing], curvature=FLAT).altitude_m[0] - grid.heights_m
    assert margin_m.max() <= error_m
