"""The isosurface lies where a dilution passes its limit."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import visibility
from terrain import ElevationGrid
from tests.visibility.morphing_cases import low_anchors
from visibility import Anchor, VisibilityInputError, min_visible_altitude
from visibility.air.control_volumes import altitude_layers, control_volume, whole_volume
from visibility.air.isosurfaces import isosurface
from visibility.dilution.dop_questions import FlightLimit

CORNERS = ((0.0, 0.0), (400.0, 0.0), (0.0, -400.0), (400.0, -400.0))


def volume_of(above_ground=False, **options):
    grid, anchors, ceiling_m = low_anchors(7)
    surfaces = min_visible_altitude(grid, anchors)
    low_m, high_m = (0.0, 400.0) if above_ground else (float(grid.heights_m.min()), ceiling_m)
    return control_volume(surfaces, altitude_layers(low_m, high_m, 10.0, above_ground=above_ground), **options)


@pytest.mark.parametrize("above_ground", [False, True], ids=["absolute", "above ground"])
def test_every_vertex_is_among_voxels_of_which_some_are_flyable_and_some_not(above_ground):
    limit = FlightLimit(2.5)
    volume = volume_of(above_ground)
    grid, layers = volume.grid, volume.layers
    surface = isosurface(volume, limit)
    assert len(surface.faces) > 100
    flyable = whole_volume(volume).dop < limit.dop_limit
    east_m, north_m, altitude_m = surface.vertices_m.T
    row, col = grid.post_at(east_m, north_m)
    base_m = map_coordinates(grid.heights_m.astype(float), [row, col], order=1, mode="nearest") if above_ground else 0.0
    at = np.stack([(altitude_m - base_m - layers.altitudes_m[0]) / 10.0, row, col])
    slack = 1e-3  # of a voxel, for what float32 makes of an index
    low, high = np.floor(at + slack).astype(int), np.ceil(at - slack).astype(int)
    corners = [flyable[tuple(np.where(up, high.T, low.T).T)] for up in itertools.product((False, True), repeat=3)]
    between = (low != high).any(axis=0)
    assert between.mean() > 0.9
    assert np.any(corners, axis=0)[between].all()
    assert not np.all(corners, axis=0)[between].any()


def test_a_smooth_surface_lies_on_the_limit_within_the_voxel_size():
    """Four anchors at one altitude over flat ground: all in sight everywhere, and the dilution peaks at their plane."""
    grid = ElevationGrid(np.zeros((11, 11), np.float32), 40.0, 40.0)
    surfaces = min_visible_altitude(grid, [Anchor(f"A{n}", *corner, 100.0) for n, corner in enumerate(CORNERS)])
    limit, step_m = FlightLimit(4.0), 5.0
    surface = isosurface(control_volume(surfaces, altitude_layers(0.0, 220.0, step_m)), limit)
    assert len(surface.vertices_m) > 100
    positions_m = [(*corner, 100.0) for corner in CORNERS]
    along = np.linspace(-1.0, 1.0, 41)[:, None]
    sides = np.zeros((len(surface.vertices_m), 2), bool)
    for way_m in ((40.0, 0.0, 0.0), (0.0, 40.0, 0.0), (0.0, 0.0, step_m)):
        for number, vertex_m in enumerate(surface.vertices_m):
            flyable = visibility.dop(positions_m, vertex_m + along * way_m).pdop < limit.dop_limit
            sides[number] |= (flyable.any(), not flyable.all())
    assert sides.all()


def test_a_surface_made_block_by_block_is_the_same_surface():
    whole = isosurface(volume_of(), FlightLimit(2.5))
    pieces = isosurface(volume_of(), FlightLimit(2.5), block_voxels=1)
    assert pieces.vertices_m.shape == whole.vertices_m.shape
    middles_m = [surface.vertices_m[surface.faces].mean(axis=1) for surface in (pieces, whole)]
    in_order = [middle_m[np.lexsort(middle_m.round(1).T)] for middle_m in middles_m]
    assert np.allclose(*in_order, atol=0.11)


def test_normals_point_to_the_flyable_side():
    grid = ElevationGrid(np.zeros((11, 11), np.float32), 40.0, 40.0)
    surfaces = min_visible_altitude(grid, [Anchor(f"A{n}", *corner, 100.0) for n, corner in enumerate(CORNERS)])
    surface = isosurface(control_volume(surfaces, altitude_layers(100.0, 220.0, 5.0)), FlightLimit(4.0))
    a, b, c = (surface.vertices_m[surface.faces[:, corner]] for corner in range(3))
    up = np.cross(b - a, c - a)[:, 2]
    # above their plane the anchors fix the height better the higher one is
    assert np.median(np.sign(up)) == 1.0


def test_a_volume_on_one_side_of_the_limit_has_no_surface():
    assert isosurface(volume_of(), FlightLimit(0.1)).vertices_m.shape == (0, 3)


def test_what_makes_no_surface_is_refused_in_one_sentence():
    with pytest.raises(VisibilityInputError, match="The volume holds hdop of ranging, but the limit is one on pdop"):
        isosurface(volume_of(measure="hdop"), FlightLimit(2.0))
    grid, anchors, ceiling_m = low_anchors(5)
    one_layer = control_volume(min_visible_altitude(grid, anchors), altitude_layers(ceiling_m, ceiling_m, 1.0))
    with pytest.raises(VisibilityInputError, match="A surface needs two or more layers, rows and columns"):
        isosurface(one_layer, FlightLimit(2.0))
    with pytest.raises(VisibilityInputError, match="more than the limit of 10"):
        isosurface(volume_of(), FlightLimit(2.0), max_voxels=10)
