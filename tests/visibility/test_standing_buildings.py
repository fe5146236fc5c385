"""Buildings that stand on a grid hide in every answer about sight: maps and lines, beside rays and slow solids."""

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate

from terrain import ElevationGrid, fractal
from tests.reference.roofs import lowest_clear, prism
from tests.visibility.meshes import as_buildings, box, level
from visibility import (
    FLAT,
    HIDDEN,
    VISIBLE,
    Anchor,
    AnchorError,
    Buildings,
    Curvature,
    DistantAnchor,
    anchor_above_ground,
    line_of_sight,
    lines_of_sight,
    min_visible_altitude,
    profile,
)
from visibility.cover import (
    Footprint,
    lowered_m,
    mesh_blocks,
    standing_footprints,
    standing_mesh,
    with_standing,
)
from visibility.cover.ray_triangle import grid_surface_mesh

EARTH = Curvature(6_371_000.0, 4.0 / 3.0)


def town(grid, count, rng, tallest_m=40.0):
    """Turned rectangles all over a grid, which may overlap."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    found = []
    for _ in range(count):
        at = rng.uniform((west_m, south_m), (east_m, north_m))
        half = rng.uniform(3.0, 15.0, 2)
        outline = rotate(shapely.box(*(at - half), *(at + half)), rng.uniform(0.0, 90.0))
        found.append(Footprint(outline, rng.uniform(3.0, tallest_m)))
    return found


def solids(grid, footprints):
    """The same as closed meshes from far below the ground up to the roof, for ray tracing: walls, floor and roof."""
    vertices, faces = [], []
    standing = [standing_footprints(grid, [footprint]) for footprint in footprints]
    for footprint, one in zip(footprints, standing, strict=True):
        ring = np.array(footprint.outline.exterior.coords)[:-1]
        for triangle in prism(ring, -1000.0, one.highest_m):
            faces.append(np.arange(3) + 3 * len(faces))
            vertices.append(triangle)
    return Buildings(np.concatenate(vertices), np.array(faces), "solids")


@pytest.mark.parametrize("curvature", [FLAT, EARTH], ids=["flat", "curved"])
@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_minimum_altitudes_are_where_trying_altitudes_begins_to_see_past_the_solids(mode, curvature):
    rng = np.random.default_rng(3)
    # posts 300 m apart, so that the body's curve counts: 3 m over 7 km
    grid = ElevationGrid(np.zeros((11, 13), np.float32), 300.0, 250.0, 1000.0, 5000.0)
    rings = [
        np.array([[2000.0, 3400.0], [2300.0, 3450.0], [2250.0, 3900.0], [1980.0, 3800.0]]),
        np.array([[3000.0, 2900.0], [3400.0, 3000.0], [3100.0, 3300.0]]),
        np.array([[3500.0, 4200.0], [4100.0, 4300.0], [3600.0, 4700.0]]),
    ]
    tops_m = (40.0, 25.0, 60.0)
    footprints = [Footprint(shapely.Polygon(ring), top_m) for ring, top_m in zip(rings, tops_m, strict=True)]
    eyes = [Anchor("A", 1234.5, 2777.7, 30.0), Anchor("B", 4321.0, 4876.5, 90.0), Anchor("C", 900.0, 5100.0, 12.0)]
    found = min_visible_altitude(
        with_standing(grid, [standing_footprints(grid, footprints)]), eyes, mode, curvature
    ).altitude_m
    c = curvature.drop_per_m2
    for number, eye in enumerate(eyes):
        bare = min_visible_altitude(grid, [eye], "exact", curvature).altitude_m[0]
        for row, col in rng.integers((0, 0), grid.shape, (40, 2)).tolist():
            east_m, north_m = grid.position_of(row, col)
            # seen from the eye, everything is lowered by c·d²
            triangles = []
            for ring, top_m in zip(rings, tops_m, strict=True):
                # cut into short pieces, so that a lowered roof bends as the ground does
                fine = shapely.get_coordinates(shapely.segmentize(shapely.Polygon(ring), 60.0))[:-1]
                offset2 = ((fine - [eye.east_m, eye.north_m]) ** 2).sum(axis=1)
                for i in range(len(fine)):
                    j = (i + 1) % len(fine)
                    low, high = (np.array([*fine[k], -500.0]) for k in (i, j))
                    up_low, up_high = (np.array([*fine[k], top_m - c * offset2[k]]) for k in (i, j))
                    triangles += [(low, high, up_high), (low, up_high, up_low)]
            drop_m = c * ((east_m - eye.east_m) ** 2 + (north_m - eye.north_m) ** 2)
            place = (eye.east_m, eye.north_m, eye.altitude_m)
            wanted = lowest_clear(triangles, place, east_m, north_m, -400.0, 3000.0) + drop_m
            inside = [
                top
                for ring, top in zip(rings, tops_m, strict=True)
                if shapely.Polygon(ring).covers(shapely.Point(east_m, north_m))
            ]
            wanted = max(wanted, float(bare[row, col]), *inside)
            assert found[number, row, col] == pytest.approx(wanted, abs=0.01), (eye.id, row, col)


@pytest.mark.parametrize("seed", range(3))
def test_no_post_of_a_town_on_hills_differs_from_rays_against_triangles(seed):
    rng = np.random.default_rng(seed)
    grid = fractal(61, seed, cell_m=10.0, relief_m=60.0)
    footprints = town(grid, 150, rng)
    covered = with_standing(grid, [standing_footprints(grid, footprints)])
    middle_m = (float(np.mean(grid.bounds_m[::2])), float(np.mean(grid.bounds_m[1::2])))
    ground, blocks = grid_surface_mesh(grid, EARTH, middle_m), solids(grid, footprints)
    lowered = Buildings(
        np.column_stack(
            [blocks.vertices_m[:, :2], blocks.vertices_m[:, 2] - lowered_m(EARTH, middle_m, blocks.vertices_m)]
        ),
        blocks.faces,
        "",
    )
    anchors = [
        Anchor(str(number), *place, 140.0 + 25.0 * number)
        for number, place in enumerate(rng.uniform(grid.bounds_m[:2], grid.bounds_m[2:], (4, 2)).tolist())
    ]
    found = min_visible_altitude(covered, anchors, "exact", EARTH)
    rows, cols = np.indices(grid.shape)
    east_m, north_m = grid.position_of(rows.ravel(), cols.ravel())
    for number, anchor in enumerate(anchors):
        altitude_m = grid.heights_m.ravel() + rng.uniform(0.0, 60.0, grid.heights_m.size)
        points_m = np.column_stack([east_m, north_m, altitude_m])
        eyes_m = np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], points_m.shape)

        def straight(places_m):
            return np.column_stack([places_m[:, :2], places_m[:, 2] - lowered_m(EARTH, middle_m, places_m)])

        hits = [mesh_blocks(mesh, straight(points_m), straight(eyes_m), "embree") for mesh in (ground, lowered)]
        blocked = hits[0].blocked | hits[1].blocked
        margin_m = altitude_m - found.altitude_m[number].ravel()
        told = np.abs(margin_m) > 2.0 * max(hit.tolerance_m for hit in hits)
        assert told.mean() > 0.999
        np.testing.assert_array_equal(blocked[told], margin_m[told] < 0.0)
        lines = lines_of_sight(covered, points_m, eyes_m, curvature=EARTH)
        np.testing.assert_array_equal(lines.verdict[told] == HIDDEN, blocked[told])
        # what meets solids beside the ground is said to
        only = told & hits[1].blocked & ~hits[0].blocked
        assert lines.hits_building[only].all()
        assert only.sum() > 50


def test_a_map_and_its_lines_agree_to_the_millimetre_also_where_one_ends_under_a_roof():
    rng = np.random.default_rng(11)
    grid = level(100.0)
    covered = with_standing(grid, [standing_footprints(grid, town(grid, 60, rng))])
    anchor = Anchor("A", 153.3, -97.1, 145.0)
    found = min_visible_altitude(covered, [anchor], "exact").altitude_m[0]
    rows, cols = np.indices(grid.shape)
    points_m = np.column_stack([*grid.position_of(rows.ravel(), cols.ravel()), found.ravel() + 1e-3])
    eyes_m = np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], points_m.shape)
    assert (lines_of_sight(covered, eyes_m, points_m).verdict == VISIBLE).all()
    points_m[:, 2] -= 3e-3
    assert (lines_of_sight(covered, eyes_m, points_m).verdict == HIDDEN).all()


def test_a_line_says_what_of_a_building_is_in_its_way_and_by_how_much():
    grid = level()
    tower = with_standing(grid, [standing_footprints(grid, [Footprint(shapely.box(140, -110, 160, -90), 10.0)])])
    through = line_of_sight(tower, (50, -100, 5), (250, -100, 7))
    assert (through.verdict, through.blocked_by) == ("blocked", "building")
    assert through.clearance_m == pytest.approx(5.9 - 10.0)
    assert through.blocking_point_m == pytest.approx((140.0, -100.0, 10.0))
    assert line_of_sight(tower, (50, -100, 10.0), (250, -100, 10.0)).verdict == "clear"
    assert line_of_sight(tower, (50, -100, 5), (150, -100, 5)).verdict == "blocked"  # ends inside
    on_top = line_of_sight(tower, (150, -100, 10.0), (250, -100, 10.0))
    assert on_top.verdict == "clear"


def test_a_profile_has_the_roofs_with_their_walls_where_the_line_crosses_them():
    grid = level()
    low, high = Footprint(shapely.box(120, -110, 180, -90), 10.0), Footprint(shapely.box(140, -110, 160, -90), 25.0)
    built = with_standing(grid, [standing_footprints(grid, [low, high])])
    start, end = (52.0, -101.0, 5.0), (252.0, -101.0, 7.0)
    found, bare = profile(built, start, end), profile(grid, start, end)
    east_m = 52.0 + found.distance_m
    beside_m = np.abs(east_m - 150.0) - 1e-6  # a wall belongs to what is higher
    roof_m = np.where(beside_m <= 30.0, np.where(beside_m <= 10.0, 25.0, 10.0), np.nan)
    np.testing.assert_allclose(found.roof_m, roof_m)
    for wall_m in (120.0, 140.0, 160.0, 180.0):
        assert np.sum(np.isclose(np.abs(east_m - wall_m), 1e-3, atol=1e-6)) == 2
    np.testing.assert_allclose(found.line_m, 5.0 + found.distance_m / 100.0)
    np.testing.assert_allclose(found.clearance_m, np.interp(found.distance_m, bare.distance_m, bare.clearance_m))
    assert set(np.round(bare.distance_m, 6)) <= set(np.round(found.distance_m, 6))
    assert np.isnan(bare.roof_m).all()


def test_a_mesh_hides_as_the_footprint_of_the_same_box_does():
    grid = level(12.0)
    anchors = [Anchor("A", 20.5, -20.5, 20.0), Anchor("S", 190.0, -10.0, 80.0)]
    mesh = standing_mesh(as_buildings(box(150, -100, top_m=22.0, base_m=12.0)))
    assert mesh.edges_m.shape == (8, 2, 3)  # of the roof and of the foot; no diagonals, no uprights
    footprint = standing_footprints(grid, [Footprint(shapely.box(140, -110, 160, -90), 10.0)])
    one, other = (min_visible_altitude(with_standing(grid, [part]), anchors).altitude_m for part in (mesh, footprint))
    np.testing.assert_allclose(one, other, atol=1e-4)
    assert (one > 12.001).any()


def test_a_gable_hides_up_to_its_ridge():
    grid = level()
    corners = [(140, -110, 6), (160, -110, 6), (140, -90, 6), (160, -90, 6), (150, -110, 12), (150, -90, 12)]
    faces = [(0, 4, 5), (0, 5, 2), (1, 3, 5), (1, 5, 4)]
    gable = with_standing(grid, [standing_mesh(Buildings(np.array(corners, float), np.array(faces), "gable"))])
    found = min_visible_altitude(gable, [Anchor("A", 50.0, -100.0, 12.0)]).altitude_m[0]
    assert found[20, 50] == pytest.approx(12.0, abs=1e-4)  # level over the ridge
    assert found[20, 30] == pytest.approx(12.0, abs=1e-4)  # the post under the ridge itself
    assert found[20, 29] == pytest.approx(9.0, abs=1e-4)  # half way up the slope
    assert found[20, 20] == 0.0


def test_satellites_are_hidden_by_a_wall_as_its_height_and_their_elevation_say():
    grid = level(rows=21, cols=61)
    wall = with_standing(grid, [standing_footprints(grid, [Footprint(shapely.box(140, -200, 145, 100), 10.0)])])
    west = DistantAnchor("S", np.radians(270.0), np.radians(45.0), 2.2e7)
    found = min_visible_altitude(wall, [west]).altitude_m[0]
    # east of the wall its shadow falls by one metre in one; 150 m is post 30, 5 m beyond the wall
    np.testing.assert_allclose(found[10, 28:34], [10.0, 10.0, 5.0, 0.0, 0.0, 0.0], atol=2e-3)


def test_an_anchor_inside_a_building_is_refused_and_one_on_its_roof_is_not():
    grid = level()
    covered = with_standing(grid, [standing_footprints(grid, [Footprint(shapely.box(140, -110, 160, -90), 10.0)])])
    with pytest.raises(AnchorError, match="is inside a building"):
        min_visible_altitude(covered, [anchor_above_ground(covered, "A", 150.0, -100.0, 6.0)])
    seen = min_visible_altitude(covered, [anchor_above_ground(covered, "A", 150.0, -100.0, 10.5)])
    assert (seen.visible(above_ground_m=11.0) == VISIBLE).all()


def test_windows_of_ground_keep_what_stands_around_them():
    grid = level()
    covered = with_standing(grid, [standing_footprints(grid, [Footprint(shapely.box(140, -110, 160, -90), 10.0)])])
    anchor = Anchor("A", 50.0, -100.0, 8.0)
    whole = min_visible_altitude(covered, [anchor]).altitude_m[:, :, 40:]
    part = min_visible_altitude(covered.window(0, 40, 40, 60), [anchor]).altitude_m
    np.testing.assert_allclose(part, whole, atol=1e-4)
    assert covered.digest != grid.digest


def test_triangulated_roofs_cover_courtyards_only_where_there_is_a_roof():
    outline = shapely.Polygon(
        [(100, -150), (180, -150), (180, -60), (100, -60)], [[(120, -130), (160, -130), (160, -80), (120, -80)]]
    )
    grid = level()
    covered = with_standing(grid, [standing_footprints(grid, [Footprint(outline, 10.0)])])
    # straight from above, only what is under the roof is hidden
    found = min_visible_altitude(covered, [Anchor("A", 140.2, -100.2, 1e5)]).altitude_m[0]
    assert found[20, 28] == pytest.approx(0.0, abs=0.02)  # (140, -100), in the courtyard
    assert found[20, 22] == pytest.approx(10.0)  # (110, -100), under the roof
    assert sum(part.area for part in covered.standing.outlines) == pytest.approx(outline.area)
