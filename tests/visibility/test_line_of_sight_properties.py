"""What must hold for every line over every ground, whatever the numbers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from terrain import ElevationGrid
from visibility import FLAT, HIDDEN, UNKNOWN, VISIBLE, Curvature, lines_of_sight

ROUNDING_M = 1e-6
CLEARLY_M = 1e-3
unhurried = settings(deadline=None)  # the first call loads the compiled kernels
CURVATURES = st.sampled_from([FLAT, Curvature(50_000.0)])


@st.composite
def scenes(draw, voids=True):
    """(heights, cells, n lines' starts, ends), around and over the grid, above and below its ground."""
    rows, cols = draw(st.integers(2, 7)), draw(st.integers(2, 7))
    heights = st.integers(0, 40).map(float)
    heights_m = draw(
        hnp.arrays(np.float32, (rows, cols), elements=st.one_of(heights, st.just(np.nan)) if voids else heights)
    )
    cells_m = draw(st.sampled_from([(1.0, 1.0), (30.0, 30.0), (7.0, 13.0)]))
    seed = draw(st.integers(0, 2**32 - 1))
    snapped = draw(st.booleans())
    rng = np.random.default_rng(seed)
    ends = []
    for _ in range(2):
        row, col = rng.uniform(-1.5, rows + 0.5, 12), rng.uniform(-1.5, cols + 0.5, 12)
        if snapped:
            row, col = np.round(2.0 * row) / 2.0, np.round(2.0 * col) / 2.0
        ends.append(np.column_stack([col * cells_m[0], -row * cells_m[1], rng.uniform(0.0, 60.0, 12)]))
    return heights_m, cells_m, *ends


def scan(heights_m, cells_m, start_m, end_m, curvature=FLAT, origin_m=(0.0, 0.0), unknown="unknown"):
    grid = ElevationGrid(heights_m, *cells_m, *origin_m)
    return lines_of_sight(grid, start_m, end_m, curvature=curvature, unknown=unknown)


def assert_same(one, other):
    np.testing.assert_allclose(one.clearance_m, other.clearance_m, atol=ROUNDING_M)
    np.testing.assert_array_equal(one.over_unknown, other.over_unknown)
    told = np.abs(one.clearance_m) > CLEARLY_M
    np.testing.assert_array_equal(one.verdict[told], other.verdict[told])


@unhurried
@given(scenes(), CURVATURES)
def test_swapping_the_ends_changes_nothing(scene, curvature):
    heights_m, cells_m, start_m, end_m = scene
    assert_same(
        scan(heights_m, cells_m, start_m, end_m, curvature), scan(heights_m, cells_m, end_m, start_m, curvature)
    )


@unhurried
@given(scenes(), CURVATURES, st.floats(0.0, 30.0), st.floats(0.0, 30.0))
def test_raising_either_end_never_hides(scene, curvature, lift_start_m, lift_end_m):
    heights_m, cells_m, start_m, end_m = scene
    low = scan(heights_m, cells_m, start_m, end_m, curvature)
    high = scan(
        heights_m, cells_m, start_m + np.array([0, 0, lift_start_m]), end_m + np.array([0, 0, lift_end_m]), curvature
    )
    assert (high.clearance_m >= low.clearance_m - ROUNDING_M).all()
    assert not ((low.verdict == VISIBLE) & (high.verdict != VISIBLE)).any()


@unhurried
@given(scenes(), CURVATURES, st.data())
def test_raising_a_post_never_reveals(scene, curvature, data):
    heights_m, cells_m, start_m, end_m = scene
    row = data.draw(st.integers(0, heights_m.shape[0] - 1))
    col = data.draw(st.integers(0, heights_m.shape[1] - 1))
    raised_m = heights_m.copy()
    raised_m[row, col] += data.draw(st.integers(0, 50))
    before = scan(heights_m, cells_m, start_m, end_m, curvature)
    after = scan(raised_m, cells_m, start_m, end_m, curvature)
    assert (after.clearance_m <= before.clearance_m + ROUNDING_M).all()
    assert not ((before.verdict == HIDDEN) & (after.verdict != HIDDEN)).any()


@unhurried
@given(scenes(voids=False), CURVATURES, st.data())
def test_forgetting_a_post_never_makes_a_line_clear_or_blocked(scene, curvature, data):
    heights_m, cells_m, start_m, end_m = scene
    forgotten_m = heights_m.copy()
    row = data.draw(st.integers(0, heights_m.shape[0] - 1))
    col = data.draw(st.integers(0, heights_m.shape[1] - 1))
    forgotten_m[row, col] = np.nan
    before = scan(heights_m, cells_m, start_m, end_m, curvature)
    after = scan(forgotten_m, cells_m, start_m, end_m, curvature)
    changed = before.verdict != after.verdict
    assert (after.verdict[changed] == UNKNOWN).all()
    opened = scan(forgotten_m, cells_m, start_m, end_m, curvature, unknown="open")
    shut = scan(forgotten_m, cells_m, start_m, end_m, curvature, unknown="blocked")
    assert (opened.verdict != UNKNOWN).all()
    assert (shut.verdict != UNKNOWN).all()
    assert (opened.verdict >= shut.verdict).all()


@unhurried
@given(scenes(), CURVATURES)
def test_the_frame_may_be_shifted(scene, curvature):
    heights_m, cells_m, start_m, end_m = scene
    shift_m = np.array([1024.0 * cells_m[0], -4096.0 * cells_m[1], 0.0])
    there = scan(heights_m, cells_m, start_m + shift_m, end_m + shift_m, curvature, (shift_m[0], shift_m[1]))
    assert_same(scan(heights_m, cells_m, start_m, end_m, curvature), there)


@unhurried
@given(scenes(), CURVATURES, st.integers(-400, 4000))
def test_all_heights_may_be_shifted(scene, curvature, up_m):
    heights_m, cells_m, start_m, end_m = scene
    lift = np.array([0.0, 0.0, float(up_m)])
    assert_same(
        scan(heights_m, cells_m, start_m, end_m, curvature),
        scan(heights_m + np.float32(up_m), cells_m, start_m + lift, end_m + lift, curvature),
    )


@unhurried
@given(scenes(), CURVATURES)
def test_the_world_may_be_transposed(scene, curvature):
    # the diagonal from (row, col) to (row + 1, col + 1) stays where it is
    heights_m, cells_m, start_m, end_m = scene
    turned = [np.column_stack([-points[:, 1], -points[:, 0], points[:, 2]]) for points in (start_m, end_m)]
    assert_same(
        scan(heights_m, cells_m, start_m, end_m, curvature), scan(heights_m.T, cells_m[::-1], *turned, curvature)
    )


@unhurried
@given(scenes(), CURVATURES)
def test_the_world_may_be_turned_by_half(scene, curvature):
    heights_m, cells_m, start_m, end_m = scene
    corner_m = np.array([(heights_m.shape[1] - 1) * cells_m[0], -(heights_m.shape[0] - 1) * cells_m[1]])
    turned = [np.column_stack([corner_m - points[:, :2], points[:, 2]]) for points in (start_m, end_m)]
    assert_same(
        scan(heights_m, cells_m, start_m, end_m, curvature),
        scan(heights_m[::-1, ::-1], cells_m, *turned, curvature),
    )


@unhurried
@given(scenes(voids=False), st.integers(0, 2**32 - 1))
def test_a_world_whose_squares_are_flat_may_be_mirrored(scene, seed):
    # elsewhere a mirror turns the diagonals, which is another surface
    heights_m, cells_m, start_m, end_m = scene
    rng = np.random.default_rng(seed)
    flat_squares_m = rng.integers(0, 20, (heights_m.shape[0], 1)) + rng.integers(0, 20, (1, heights_m.shape[1]))
    width_m = (heights_m.shape[1] - 1) * cells_m[0]
    mirrored = [np.column_stack([width_m - points[:, 0], points[:, 1:]]) for points in (start_m, end_m)]
    assert_same(scan(flat_squares_m, cells_m, start_m, end_m), scan(flat_squares_m[:, ::-1], cells_m, *mirrored))


@unhurried
@given(scenes(voids=False), CURVATURES, st.floats(0.0, 1.0))
def test_a_tower_anywhere_on_the_line_always_blocks(scene, curvature, share):
    heights_m, cells_m, start_m, end_m = scene
    rows, cols = heights_m.shape
    for start, end in zip(start_m, end_m, strict=True):
        east_m, north_m = (start + share * (end - start))[:2]
        row, col = -north_m / cells_m[1], east_m / cells_m[0]
        if not (0 <= row <= rows - 1 and 0 <= col <= cols - 1):
            continue
        tower_m = heights_m.copy()
        tower_m[int(row) : int(row) + 2, int(col) : int(col) + 2] = 1e4
        sight = scan(tower_m, cells_m, [start], [end], curvature)
        assert sight.verdict[0] == HIDDEN


@unhurried
@given(scenes(voids=False), CURVATURES)
def test_the_detour_is_positive_just_where_the_line_is_blocked(scene, curvature):
    heights_m, cells_m, start_m, end_m = scene
    grid = ElevationGrid(heights_m, *cells_m)
    sight = lines_of_sight(grid, start_m, end_m, curvature=curvature, excess_path=True, wavelength_m=0.1)
    blocked = sight.verdict == HIDDEN
    assert (sight.excess_path_m[blocked] > 0.0).all()
    assert (sight.excess_path_m[~blocked] == 0.0).all()
    assert (sight.fresnel_clearance[blocked & (sight.clearance_m < -CLEARLY_M)] < 0.0).all()
    assert (sight.fresnel_clearance[~blocked] >= -1e-4).all()
    back = lines_of_sight(grid, end_m, start_m, curvature=curvature, excess_path=True, wavelength_m=0.1)
    np.testing.assert_allclose(back.excess_path_m, sight.excess_path_m, atol=ROUNDING_M)
    told = np.abs(sight.clearance_m) > CLEARLY_M
    assert back.fresnel_clearance[told] == pytest.approx(sight.fresnel_clearance[told], rel=1e-3, abs=1e-3)
