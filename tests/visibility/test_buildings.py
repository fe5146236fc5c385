"""Buildings: stood on the DEM, and in the way of sight lines."""

import numpy as np
import pytest
import trimesh

from terrain import ElevationGrid
from tests.visibility.meshes import FORMATS, as_buildings, box, extent, level, write
from visibility import HIDDEN, UNKNOWN, VISIBLE, Anchor, Curvature, line_of_sight, lines_of_sight, read_buildings
from visibility.cover import visible_with_buildings

# -- reading and placing


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_gives_the_same_buildings_standing_on_the_ground(tmp_path, suffix):
    two = trimesh.util.concatenate([box(100, -100), box(200, -50, 30.0, 10.0, 25.0)])
    placed = read_buildings(write(tmp_path, two, suffix), level(300.0))
    np.testing.assert_allclose(extent(placed), [90, -110, 300, 215, -45, 325], atol=1e-4)
    assert placed.count == 2
    assert len(placed.faces) == 24
    as_told = read_buildings(write(tmp_path, two, suffix), level(300.0), heights="absolute")
    np.testing.assert_allclose(extent(as_told), [90, -110, 0, 215, -45, 25], atol=1e-4)


def test_each_body_stands_on_the_ground_below_its_own_middle(tmp_path):
    east_m = np.arange(61) * 5.0
    slope = ElevationGrid(np.tile(east_m * 0.1, (41, 1)).astype(np.float32), 5.0, 5.0)
    two = trimesh.util.concatenate([box(100, -100), box(200, -100)])
    placed = read_buildings(write(tmp_path, two, "stl"), slope)
    tops_m = np.unique(np.round(placed.vertices_m[:, 2], 3))
    np.testing.assert_allclose(tops_m, [10.0, 20.0, 30.0])  # bases at 10 and 20, tops at 20 and 30


def test_the_file_may_have_its_own_origin_and_upward_axis(tmp_path):
    grid = ElevationGrid(np.zeros((41, 61), np.float32), 5.0, 5.0, 500_000.0, 4_100_000.0)
    path = write(tmp_path, box(0, 0, 20, 40), "ply")
    placed = read_buildings(path, grid, origin_east_m=500_100.0, origin_north_m=4_099_900.0)
    np.testing.assert_allclose(extent(placed), [500_090, 4_099_880, 0, 500_110, 4_099_920, 10])
    lying = read_buildings(path, level(), up="y", origin_east_m=100.0, origin_north_m=-100.0, heights="absolute")
    np.testing.assert_allclose(extent(lying), [90, -110, -20, 110, -100, 20])


def test_a_glb_scene_keeps_the_place_of_each_copy(tmp_path):
    scene = trimesh.Scene()
    one = box(0, 0, 10, 10, 8)
    one.apply_transform(np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float))
    for east_m in (50.0, 90.0):
        scene.add_geometry(one, transform=trimesh.transformations.translation_matrix((east_m, 0, 60.0)))
    path = tmp_path / "copies.glb"
    path.write_bytes(scene.export(file_type="glb"))
    placed = read_buildings(path, level())
    np.testing.assert_allclose(extent(placed), [45, -65, 0, 95, -55, 8], atol=1e-4)
    assert placed.count == 2


# -- in the way


def test_a_building_blocks_the_line_through_it_and_not_the_line_over_it():
    grid, tower = level(), as_buildings(box(150, -100))
    through = line_of_sight(grid, (50, -100, 5), (250, -100, 5), buildings=tower)
    assert (through.verdict, through.blocked_by) == ("blocked", "building")
    assert through.clearance_m == 5.0  # of the ground
    assert through.blocking_point_m == pytest.approx((140.0, -100.0, 5.0), abs=1e-3)
    assert through.blocking_distance_m == pytest.approx(90.0, abs=1e-3)
    for ends in (
        [(50, -100, 10.01), (250, -100, 10.01)],
        [(50, -111, 5), (250, -111, 5)],
        [(50, -100, 5), (139, -100, 5)],
    ):
        clear = line_of_sight(grid, *ends, buildings=tower)
        assert (clear.verdict, clear.blocked_by) == ("clear", None)
    assert line_of_sight(grid, (50, -100, 5), (250, -100, 5)).verdict == "clear"


@pytest.mark.parametrize("engine", ["embree", "moller_trumbore"])
def test_swapping_the_ends_meets_the_same_building(engine):
    rng = np.random.default_rng(1)
    start_m, end_m = (
        np.column_stack([rng.uniform(0, 300, 200), rng.uniform(-200, 0, 200), rng.uniform(0.1, 15, 200)]) for _ in "12"
    )
    tower = as_buildings(box(150, -100, 60, 60))
    there = lines_of_sight(level(), start_m, end_m, buildings=tower, engine=engine)
    back = lines_of_sight(level(), end_m, start_m, buildings=tower, engine=engine)
    assert 20 < there.hits_building.sum() < 180
    np.testing.assert_array_equal(there.verdict, back.verdict)


def test_known_buildings_block_over_unknown_ground_too():
    heights_m = np.zeros((41, 61), np.float32)
    heights_m[:, 20:24] = np.nan
    grid = ElevationGrid(heights_m, 5.0, 5.0)
    ends = (50, -100, 5), (250, -100, 5)
    assert line_of_sight(grid, *ends).verdict == "unknown"
    seen = line_of_sight(grid, *ends, buildings=as_buildings(box(150, -100)))
    assert (seen.verdict, seen.blocked_by) == ("blocked", "building")


def test_ground_that_blocks_stays_the_blocking_point():
    heights_m = np.zeros((41, 61), np.float32)
    heights_m[:, 40] = 50.0
    sight = line_of_sight(
        ElevationGrid(heights_m, 5.0, 5.0), (50, -100, 5), (250, -100, 5), buildings=as_buildings(box(150, -100))
    )
    assert (sight.blocked_by, sight.blocking_point_m[0]) == ("ground", pytest.approx(200.0))


@pytest.mark.parametrize(("top_m", "verdict"), [(11.0, "clear"), (12.0, "blocked")])
def test_curvature_lifts_buildings_with_the_ground_they_stand_on(top_m, verdict):
    grid = ElevationGrid(np.zeros((3, 401), np.float32), 100.0, 100.0)
    earth = Curvature(6_371_000.0, 4.0 / 3.0)
    bulge_m = earth.drop_per_m2 * 20_000.0**2  # 23.5 m at the middle of 40 km: 11.5 m are left of 35
    assert 35.0 - bulge_m == pytest.approx(11.46, abs=0.01)
    tower = as_buildings(box(20_000, -100, top_m=top_m))
    sight = line_of_sight(grid, (0, -100, 35), (40_000, -100, 35), curvature=earth, buildings=tower)
    assert sight.verdict == verdict
    if verdict == "blocked":
        assert sight.blocking_point_m == pytest.approx((19_990.0, -100.0, 35.0 - bulge_m), abs=0.1)


def segment_meets_box(start, end, low, high):
    """Slab test, the textbook way: does the open segment pass through the inside of an axis-aligned box?"""
    near, far = 0.0, 1.0
    for axis in range(3):
        step = end[axis] - start[axis]
        if step == 0.0:
            if not low[axis] < start[axis] < high[axis]:
                return False
            continue
        a, b = sorted(((low[axis] - start[axis]) / step, (high[axis] - start[axis]) / step))
        near, far = max(near, a), min(far, b)
    return near < far


@pytest.mark.parametrize("engine", ["embree", "moller_trumbore"])
def test_the_map_with_buildings_is_the_map_of_their_shadows(engine):
    grid = level(100.0, 31, 41)
    anchors = [Anchor("A", 3.0, -77.0, 130.0), Anchor("B", 111.0, 20.0, 108.0), Anchor("C", 77.0, -61.0, 160.0)]
    low, high = np.array([70.5, -93.5, 100.0]), np.array([103.5, -48.5, 117.0])
    size = high - low
    tower = trimesh.creation.box(size)
    tower.apply_translation((low + high) / 2.0)
    seen = visible_with_buildings(grid, anchors, 1.5, as_buildings(tower), engine)
    assert seen.shape == (3, 31, 41)
    for number, anchor in enumerate(anchors):
        eye = (anchor.east_m, anchor.north_m, anchor.altitude_m)
        shadow = np.array(
            [[segment_meets_box(eye, (c * 5.0, -r * 5.0, 101.5), low, high) for c in range(41)] for r in range(31)]
        )
        assert shadow.sum() > 50
        np.testing.assert_array_equal(seen[number], np.where(shadow, HIDDEN, VISIBLE))


def test_a_building_hides_posts_behind_unknown_ground_and_leaves_unknown_posts_unknown():
    heights_m = np.zeros((21, 41), np.float32)
    heights_m[:, 10] = np.nan
    grid = ElevationGrid(heights_m, 5.0, 5.0)
    tower = as_buildings(box(100, -50, 10, 300, 40))
    (seen,) = visible_with_buildings(grid, [Anchor("A", 2.0, -52.0, 20.0)], 1.5, tower)
    assert (seen[:, :9] == VISIBLE).all()
    assert (seen[:, 10:18] == UNKNOWN).all()
    assert (seen[:, 22:] == HIDDEN).all()
