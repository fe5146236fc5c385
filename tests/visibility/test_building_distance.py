"""How near buildings are: the exact distance to their triangles, and which points are inside."""

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.reference.nearest_triangle import distance_to_triangle_m
from tests.reference.solid_angle import is_inside
from tests.visibility.meshes import as_buildings, box, level
from visibility import Buildings, Curvature, VisibilityInputError, line_of_sight
from visibility.cover import clear_of_buildings, nearest_building
from visibility.cover.building_distance import solid_bodies


def slow_m(buildings, point):
    """Distance to the nearest triangle of all."""
    return min(distance_to_triangle_m(point, corners) for corners in buildings.vertices_m[buildings.faces])


def town(count, seed=5):
    """Boxes and odd solids, some over each other, on and above the ground."""
    rng = np.random.default_rng(seed)
    solids = []
    for number in range(count):
        solid = trimesh.creation.icosphere(1, 8.0) if number % 3 == 0 else trimesh.creation.box((12.0, 9.0, 15.0))
        solid.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
        solid.apply_translation(rng.uniform((0, -200, 10), (200, 0, 60)))
        solids.append(solid)
    return solids


def test_the_distance_is_that_to_the_nearest_of_all_triangles():
    buildings = as_buildings(trimesh.util.concatenate(town(9)))
    points_m = np.random.default_rng(6).uniform((-30, -230, -10), (230, 30, 90), (60, 3))
    found = nearest_building(buildings, points_m)
    for point, distance_m, nearest_m in zip(points_m, found.distance_m, found.nearest_m, strict=True):
        if distance_m > 0.0:
            assert distance_m == pytest.approx(slow_m(buildings, point), abs=1e-9)
            assert np.linalg.norm(point - nearest_m) == pytest.approx(distance_m, abs=1e-9)


def test_a_point_is_inside_where_the_faces_of_a_body_are_all_around_it():
    solids = town(12)
    buildings = as_buildings(trimesh.util.concatenate(solids))
    points_m = np.vstack([solid.centroid + np.random.default_rng(7).normal(0.0, 6.0, (20, 3)) for solid in solids])
    inside = nearest_building(buildings, points_m).distance_m < 0.0
    expected = [any(is_inside(point, solid.triangles) for solid in solids) for point in points_m]
    assert inside.tolist() == expected
    assert 0 < sum(expected) < len(points_m)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-40.0, 40.0)] * 3),
    st.tuples(st.floats(1.0, 30.0), st.floats(1.0, 30.0), st.floats(1.0, 30.0)),
    st.booleans(),
)
def test_of_a_box_the_distance_is_known_in_closed_form_whatever_the_winding(point, size, turned):
    width_m, depth_m, top_m = size
    mesh = box(0.0, 0.0, width_m, depth_m, top_m)
    faces = mesh.faces.copy()
    if turned:
        faces[::2] = faces[::2, ::-1]
    found = nearest_building(Buildings(mesh.vertices, faces), point)
    half = np.array([width_m, depth_m, top_m]) / 2.0
    out_m = np.abs(np.array(point) - (0.0, 0.0, top_m / 2.0)) - half
    assume(abs(out_m.max()) > 1e-9)  # on the surface neither answer is wrong
    if (out_m < 0.0).all():  # inside: to a wall or the roof, never the floor
        assert found.distance_m[0] == pytest.approx(-min(-out_m[0], -out_m[1], top_m - point[2]), abs=1e-9)
    else:
        assert found.distance_m[0] == pytest.approx(np.linalg.norm(np.maximum(out_m, 0.0)), abs=1e-9)


def test_a_point_straight_below_edges_and_corners_of_the_roof_is_inside_once():
    mesh = trimesh.creation.box((20.0, 20.0, 10.0))
    mesh = mesh.subdivide().subdivide()  # vertices and edges of the roof straight above every point
    across_m = np.arange(-7.5, 7.6, 2.5)
    points_m = np.array([(east_m, north_m, 0.0) for east_m in across_m for north_m in across_m])
    assert (nearest_building(as_buildings(mesh), points_m).distance_m < 0.0).all()


def test_a_building_without_a_floor_has_an_inside_and_one_without_a_wall_has_none():
    mesh = box(0.0, 0.0)
    normals = mesh.face_normals
    for missing, is_solid in (((0, 0, -1), True), ((1, 0, 0), False), ((0, 0, 1), False)):
        kept = mesh.faces[normals @ missing < 0.5]
        buildings = Buildings(mesh.vertices, kept)
        found = nearest_building(buildings, [(0.0, 0.0, 4.0)])
        assert solid_bodies(buildings).tolist() == [is_solid]
        assert (found.distance_m[0] < 0.0) == is_solid
        assert found.open_bodies == (0 if is_solid else 1)


def test_a_sheet_on_the_ground_is_no_solid():
    sheet = Buildings([(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0)], [(0, 1, 2), (0, 2, 3)])
    found = nearest_building(sheet, [(4.0, 4.0, 2.0), (4.0, 4.0, -2.0)])
    np.testing.assert_allclose(found.distance_m, [2.0, 2.0])


def test_of_two_bodies_around_a_point_the_one_that_is_harder_to_leave_counts():
    both = trimesh.util.concatenate([box(0.0, 0.0, 20.0, 20.0, 50.0), box(4.0, 0.0, 60.0, 60.0, 50.0)])
    assert nearest_building(as_buildings(both), [(0.0, 0.0, 5.0)]).distance_m[0] == pytest.approx(-26.0)


def test_far_from_the_origin_nothing_is_lost():
    points_m = np.random.default_rng(8).uniform(-20.0, 20.0, (40, 3))
    here = nearest_building(as_buildings(box(0.0, 0.0)), points_m)
    shift_m = np.array([500_000.0, 4_100_000.0, 1500.0])
    far_box = box(0.0, 0.0)
    far_box.apply_translation(shift_m)
    far = nearest_building(as_buildings(far_box), points_m + shift_m)
    np.testing.assert_allclose(far.distance_m, here.distance_m, atol=1e-8)


def test_no_points_are_answered_with_none_and_points_that_are_none_are_refused():
    buildings = as_buildings(box(0.0, 0.0))
    assert nearest_building(buildings, []).distance_m.shape == (0,)
    for bad in ([(1.0, 2.0)], "here", [(1.0, np.nan, 2.0)]):
        with pytest.raises(VisibilityInputError, match="points_m"):
            nearest_building(buildings, bad)


# -- sight past buildings


def test_a_line_is_clear_of_buildings_where_line_of_sight_says_so():
    grid = level()
    buildings = as_buildings(trimesh.util.concatenate([box(100, -100), box(200, -50, 30.0, 10.0, 25.0)]))
    rng = np.random.default_rng(9)
    points_m, anchors_m = rng.uniform((60, -180, 1), (260, -20, 30), (40, 3)), rng.uniform((0, -200, 5), 300, (5, 3))
    anchors_m[:, 1] = -100.0
    clear = clear_of_buildings(grid, buildings, points_m, anchors_m)
    for number, anchor_m in enumerate(anchors_m):
        for point, told in zip(points_m, clear[:, number], strict=True):
            sight = line_of_sight(grid, tuple(anchor_m), tuple(point), buildings=buildings)
            assert told == (sight.blocked_by != "building")
    assert 0 < clear.sum() < clear.size


def test_a_satellite_behind_a_wall_is_hidden_and_one_over_it_is_not():
    wall = as_buildings(box(120.0, -100.0, 2.0, 80.0, 10.0))
    east = np.array([1.0, 0.0, 0.4]), np.array([1.0, 0.0, 0.6])  # the wall's top is at a slope of 10/19 and less
    anchors_m = [(100.0, -100.0, 0.5) + 2e7 * way for way in east]
    clear = clear_of_buildings(level(), wall, [(100.0, -100.0, 0.5)], anchors_m, Curvature(6_371_000.0, 1.0))
    assert clear.tolist() == [[False, True]]


def test_lines_that_nobody_asks_about_are_not_said_to_be_clear():
    clear = clear_of_buildings(
        level(), as_buildings(box(100, -100)), [(10, -10, 5)], [(20, -20, 5), (30, -30, 5)], asked=[[True, False]]
    )
    assert clear.tolist() == [[True, False]]
    with pytest.raises(VisibilityInputError, match="anchors_m"):
        clear_of_buildings(level(), as_buildings(box(100, -100)), [(10, -10, 5)], [(20, -20)])
