"""The control volume: visible sets and dilutions of every voxel, in blocks, whole and in sections."""

from __future__ import annotations

import numpy as np
import pytest

import visibility
from terrain import ElevationGrid, height_at
from tests.visibility.grounds import hills
from tests.visibility.morphing_cases import low_anchors, satellites
from visibility import VISIBLE, Anchor, AntennaLimits, VisibilityInputError, min_visible_altitude
from visibility.air.control_volumes import (
    AltitudeLayers,
    altitude_layers,
    control_volume,
    volume_blocks,
    volume_slabs,
    whole_volume,
)
from visibility.air.volume_views import horizontal_section, vertical_section


def bits(words, anchors):
    """(anchors, ...) bool of visible sets (..., words)."""
    return np.stack([(words[..., a // 64] >> np.uint64(a % 64)) & np.uint64(1) == 1 for a in range(anchors)])


def holed_hills(size=17):
    grid = hills(size)
    heights_m = grid.heights_m.copy()
    heights_m[4:7, 9:12] = np.nan
    return ElevationGrid(heights_m, grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)


def many_anchors(grid, count, **more):
    rng = np.random.default_rng(8)
    west_m, south_m, east_m, north_m = grid.bounds_m
    top_m = float(np.nanmax(grid.heights_m))
    return [
        Anchor(f"A{n}", rng.uniform(west_m, east_m), rng.uniform(south_m, north_m), top_m + rng.uniform(5, 90), **more)
        for n in range(count)
    ]


@pytest.mark.parametrize("above_ground", [False, True], ids=["absolute", "above ground"])
@pytest.mark.parametrize("count", [5, 64, 70])
def test_each_voxel_sees_what_the_minimum_visible_altitude_says(count, above_ground):
    grid = holed_hills()
    limits = AntennaLimits(min_range_m=60.0, max_range_m=400.0)
    surfaces = min_visible_altitude(grid, many_anchors(grid, count, limits=limits))
    low_m = 0.0 if above_ground else float(np.nanmin(grid.heights_m))
    layers = altitude_layers(low_m, low_m + 420.0, 60.0, above_ground=above_ground)
    voxels = whole_volume(control_volume(surfaces, layers))
    for number, height_m in enumerate(layers.altitudes_m):
        height = {"above_ground_m" if above_ground else "altitude_m": float(height_m)}
        expected = surfaces.visible(**height)
        np.testing.assert_array_equal(bits(voxels.seen[number], count), expected == VISIBLE)
        np.testing.assert_array_equal(bits(voxels.unknown[number], count), expected == visibility.UNKNOWN)
    np.testing.assert_array_equal(voxels.count, bits(voxels.seen, count).sum(axis=0))
    np.testing.assert_array_equal(np.isnan(voxels.dop), voxels.unknown_count > 0)


@pytest.mark.parametrize("kind", ["ranging", "pseudorange", "tdoa"])
@pytest.mark.parametrize("measure", ["gdop", "pdop", "hdop", "vdop"])
def test_each_voxel_has_the_dilution_of_its_visible_set(kind, measure):
    grid, anchors, ceiling_m = low_anchors(7)
    surfaces = min_visible_altitude(grid, anchors)
    layers = altitude_layers(ceiling_m - 400.0, ceiling_m, 100.0)
    voxels = whole_volume(control_volume(surfaces, layers, measure=measure, kind=kind))
    east_m, north_m = grid.position_of(*np.mgrid[0 : grid.rows, 0 : grid.cols])
    positions_m = [(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors]
    for number, altitude_m in enumerate(layers.altitudes_m):
        points_m = np.stack([east_m, north_m, np.full(grid.shape, altitude_m)], axis=-1).reshape(-1, 3)
        seen = bits(voxels.seen[number], len(anchors)).reshape(len(anchors), -1).T
        expected = getattr(visibility.dop(positions_m, points_m, kind, visible=seen), measure)
        np.testing.assert_allclose(voxels.dop[number].ravel(), expected, rtol=1e-6)


def test_nothing_is_in_sight_below_the_ground():
    grid, anchors, _ = low_anchors(6)
    below = AltitudeLayers([float(grid.heights_m.min()) - 10.0, float(grid.heights_m.max())])
    voxels = whole_volume(control_volume(min_visible_altitude(grid, anchors), below))
    assert not voxels.seen[0].any()
    assert np.isposinf(voxels.dop[0]).all()


@pytest.mark.parametrize("block_voxels", [1, 100, 10_000])
def test_blocks_are_the_whole_volume_in_pieces_of_bounded_size(block_voxels):
    grid = holed_hills()
    surfaces = min_visible_altitude(grid, many_anchors(grid, 6))
    volume = control_volume(surfaces, altitude_layers(0.0, 90.0, 30.0, above_ground=True))
    layers, rows, cols = volume.shape
    blocks = list(volume_blocks(volume, block_voxels=block_voxels))
    assert all(block.dop.size <= max(block_voxels, layers * cols) for block in blocks)
    ends = np.cumsum([block.dop.shape[1] for block in blocks]).tolist()
    assert [block.first_row for block in blocks] == [0, *ends[:-1]]
    whole = whole_volume(volume)
    for name in ("seen", "unknown", "dop"):
        np.testing.assert_array_equal(np.concatenate([getattr(b, name) for b in blocks], axis=1), getattr(whole, name))
    assert whole.dop.shape == (layers, rows, cols)


def test_slabs_are_the_whole_volume_layer_by_layer():
    grid = holed_hills()
    surfaces = min_visible_altitude(grid, many_anchors(grid, 70))
    low_m = float(np.nanmin(grid.heights_m))
    volume = control_volume(surfaces, altitude_layers(low_m, low_m + 300.0, 50.0), one_dop_per_set=True)
    whole = whole_volume(volume)
    slabs = list(volume_slabs(volume, block_voxels=2 * grid.rows * grid.cols))
    assert [slab.first_layer for slab in slabs] == [0, 2, 4, 6]
    for name in ("seen", "unknown", "dop"):
        np.testing.assert_array_equal(np.concatenate([getattr(slab, name) for slab in slabs]), getattr(whole, name))
    sets = list(volume_slabs(volume, block_voxels=1, sets_only=True))
    np.testing.assert_array_equal(np.concatenate([slab.seen for slab in sets]), whole.seen)
    assert all(slab.dop.size == 0 for slab in sets)


def test_a_window_of_surfaces_answers_as_the_whole_does():
    grid = holed_hills()
    surfaces = min_visible_altitude(grid, many_anchors(grid, 5))
    window = surfaces.window(2, 9, 3, 12)
    layers = altitude_layers(0.0, 300.0, 60.0, above_ground=True)
    of_window, of_whole = (whole_volume(control_volume(lines, layers)) for lines in (window, surfaces))
    np.testing.assert_array_equal(of_window.seen, of_whole.seen[:, 2:10, 3:13])
    np.testing.assert_array_equal(of_window.unknown, of_whole.unknown[:, 2:10, 3:13])
    np.testing.assert_allclose(of_window.dop, of_whole.dop[:, 2:10, 3:13], rtol=1e-6)


def test_bounds_choose_the_posts_within_them():
    grid, anchors, ceiling_m = low_anchors(6, size=17)
    surfaces = min_visible_altitude(grid, anchors)
    layers = altitude_layers(ceiling_m - 100.0, ceiling_m, 50.0)
    west_m, north_m = grid.position_of(3, 5)
    east_m, south_m = grid.position_of(9, 11)
    part = control_volume(surfaces, layers, bounds_m=(west_m, south_m, east_m, north_m))
    assert part.shape == (3, 7, 7)
    assert part.voxels == 147
    assert part.grid.bounds_m == pytest.approx((west_m, south_m, east_m, north_m))
    whole = whole_volume(control_volume(surfaces, layers))
    np.testing.assert_array_equal(whole_volume(part).dop, whole.dop[:, 3:10, 5:12])
    everything = control_volume(surfaces, layers, bounds_m=(-1e9, -1e9, 1e9, 1e9))
    assert everything.shape == (3, 17, 17)


def test_one_dilution_per_visible_set_is_exact_for_satellites_and_near_the_middle_for_drones():
    grid, drones, ceiling_m = low_anchors(6)
    layers = altitude_layers(ceiling_m - 200.0, ceiling_m, 40.0)
    for anchors in (satellites(9, seed=3), drones):
        surfaces = min_visible_altitude(grid, anchors)
        true = whole_volume(control_volume(surfaces, layers)).dop
        short = whole_volume(control_volume(surfaces, layers, one_dop_per_set=True))
        sets = short.seen[..., 0]
        for visible_set in np.unique(sets):
            assert len(np.unique(short.dop[sets == visible_set])) == 1
        if anchors is not drones:
            np.testing.assert_allclose(short.dop, true, rtol=1e-6)


def test_a_vertical_section_follows_a_bent_line_through_the_volume():
    grid = holed_hills()
    surfaces = min_visible_altitude(grid, many_anchors(grid, 6))
    layers = altitude_layers(0.0, float(np.nanmax(grid.heights_m)) + 100.0, 40.0)
    volume = control_volume(surfaces, layers)
    corners = [grid.position_of(1, 2), grid.position_of(1, 14), grid.position_of(15, 14)]
    cut = vertical_section(volume, corners)
    assert cut.distance_m[-1] == pytest.approx(12 * grid.cell_east_m + 14 * grid.cell_north_m)
    posts = [(1, col) for col in range(2, 15)] + [(row, 14) for row in range(2, 16)]
    row, col = np.array(posts).T
    whole = whole_volume(volume)
    np.testing.assert_array_equal(cut.ground_m, grid.heights_m[row, col])
    np.testing.assert_array_equal(cut.dop, whole.dop[:, row, col])
    np.testing.assert_array_equal(cut.count, whole.count[:, row, col])
    np.testing.assert_array_equal(cut.unknown_count, whole.unknown_count[:, row, col])
    assert cut.below_ground[0].any()
    assert not cut.count[cut.below_ground].any()
    assert cut.altitude_m[:, 0].tolist() == layers.altitudes_m.tolist()


def test_between_posts_a_vertical_section_has_the_surface_and_air_down_to_it():
    grid, anchors, ceiling_m = low_anchors(6)
    volume = control_volume(min_visible_altitude(grid, anchors), altitude_layers(0.0, ceiling_m, 5.0))
    cut = vertical_section(volume, [grid.position_of(1.3, 1.2), grid.position_of(6.8, 7.4)], spacing_m=3.0)
    np.testing.assert_allclose(cut.ground_m, height_at(grid, cut.east_m, cut.north_m), rtol=1e-6)
    buried = cut.altitude_m < cut.ground_m
    assert buried.any()
    assert not cut.count[buried].any()
    assert np.isinf(cut.dop[buried]).all()
    row = np.rint((grid.origin_north_m - cut.north_m) / grid.cell_north_m).astype(int)
    col = np.rint((cut.east_m - grid.origin_east_m) / grid.cell_east_m).astype(int)
    whole, post_m = whole_volume(volume), grid.heights_m[row, col]
    over = ~buried & (cut.altitude_m >= post_m)
    np.testing.assert_array_equal(cut.count[over], whole.count[:, row, col][over])
    # where the post stands higher than the surface beside it, the air between is that over the post
    between = ~buried & (cut.altitude_m < post_m)
    assert between.any()
    lowest = np.argmax(cut.altitude_m >= post_m, axis=0)
    np.testing.assert_array_equal(
        cut.count[between], np.broadcast_to(cut.count[lowest, np.arange(len(lowest))], cut.count.shape)[between]
    )


def test_a_vertical_section_of_layers_above_ground_lies_on_the_ground():
    grid, anchors, _ = low_anchors(6)
    volume = control_volume(min_visible_altitude(grid, anchors), altitude_layers(0.0, 90.0, 30.0, above_ground=True))
    cut = vertical_section(volume, [grid.position_of(4, 0), grid.position_of(4, 8)])
    np.testing.assert_allclose(cut.altitude_m - cut.ground_m, [[0.0], [30.0], [60.0], [90.0]] * np.ones(9), atol=1e-3)
    assert not cut.below_ground.any()


@pytest.mark.parametrize("height", [{"altitude_m": 320.0}, {"above_ground_m": 15.0}], ids=["altitude", "above ground"])
def test_a_horizontal_section_is_one_layer_at_any_height(height):
    grid, anchors, ceiling_m = low_anchors(6)
    surfaces = min_visible_altitude(grid, anchors)
    volume = control_volume(surfaces, altitude_layers(0.0, ceiling_m, 100.0))
    cut = horizontal_section(volume, **height)
    np.testing.assert_array_equal(cut.count, (surfaces.visible(**height) == VISIBLE).sum(axis=0))
    assert cut.dop.shape == grid.shape
    base_m = grid.heights_m if "above_ground_m" in height else 0.0
    np.testing.assert_allclose(cut.altitude_m, base_m + next(iter(height.values())), rtol=1e-6)


def ready(layers=None, **options):
    grid, anchors, _ = low_anchors(5)
    surfaces = min_visible_altitude(grid, anchors)
    return control_volume(surfaces, layers or altitude_layers(0.0, 100.0, 10.0, above_ground=True), **options)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: altitude_layers(0.0, 100.0, 0.0), "step_m must be a number of metres > 0, not 0.0."),
        (
            lambda: altitude_layers(100.0, 50.0, 1.0),
            "Layers must go from a low to a higher altitude, not 100.0 to 50.0",
        ),
        (lambda: altitude_layers(0.0, 1e6, 0.1), "10,000,001 layers every 0.1 m are more than the limit of 100,000;"),
        (lambda: AltitudeLayers([]), "Layers must be a list of altitudes, not of shape (0,)."),
        (lambda: AltitudeLayers([1.0, 1.0]), "Layer altitudes must be finite and ascend."),
        (lambda: AltitudeLayers([-1.0, 1.0], above_ground=True), "Layers above ground must be >= 0 m, not -1 m."),
        (
            lambda: ready(altitude_layers(-500.0, -100.0, 100.0)),
            "The ceiling, the highest layer at -100 m, is below the ground, which begins at",
        ),
        (lambda: ready(bounds_m=(1e7, 1e7, 2e7, 2e7)), "No post lies within west 1e+07, south 1e+07,"),
        (lambda: ready(bounds_m=(0.0, float("nan"), 10.0, 10.0)), "No post lies within west 0, south nan,"),
        (lambda: ready(measure="edop"), "measure must be one of gdop, pdop, hdop, vdop, tdop, not 'edop'."),
        (lambda: ready(measure="tdop"), "tdop needs kind 'pseudorange'; 'ranging' solves for no clock."),
        (
            lambda: whole_volume(ready(), max_voxels=890),
            "The volume has 891 voxels (11 layers × 9 × 9), more than the limit of 890,",
        ),
        (lambda: vertical_section(ready(), [(0.0, 0.0)]), "A section needs two or more points"),
        (lambda: vertical_section(ready(), [(0.0, 0.0), (9e9, 0.0)]), "The section's point (9000000000.0, 0.0) lies"),
        (lambda: vertical_section(ready(), [(0.0, 0.0), (0.0, 0.0)]), "A section's points must not all be the same."),
        (
            lambda: vertical_section(ready(), [(0.0, 0.0), (1.0, 1.0)], spacing_m=-1.0),
            "spacing_m must be a number of metres > 0, not -1.0.",
        ),
        (lambda: horizontal_section(ready()), "Give exactly one of altitude_m and above_ground_m"),
    ],
)
def test_a_question_without_an_answer_is_refused_in_one_sentence(ask, sentence):
    with pytest.raises(VisibilityInputError) as refused:
        ask()
    assert str(refused.value).startswith(sentence)
