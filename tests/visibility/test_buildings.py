"""Buildings: read from files that nobody vouches for, stood on the DEM, and in the way of sight lines."""

import contextlib
import json
import struct
import sys

import numpy as np
import pytest
import trimesh

from terrain import ElevationGrid
from visibility import (
    HIDDEN,
    UNKNOWN,
    VISIBLE,
    Anchor,
    Buildings,
    Curvature,
    MeshError,
    line_of_sight,
    lines_of_sight,
    read_buildings,
    visible_with_buildings,
)

FORMATS = ["stl", "obj", "ply", "glb"]


def level(height_m=0.0, rows=41, cols=61, cell_m=5.0):
    return ElevationGrid(np.full((rows, cols), height_m, np.float32), cell_m, cell_m)


def box(east_m, north_m, width_m=20.0, depth_m=20.0, top_m=10.0, base_m=0.0):
    mesh = trimesh.creation.box((width_m, depth_m, top_m - base_m))
    mesh.apply_translation((east_m, north_m, (top_m + base_m) / 2.0))
    return mesh


def as_buildings(mesh):
    return Buildings(mesh.vertices, mesh.faces, "box")


def write(tmp_path, mesh, suffix):
    path = tmp_path / f"city.{suffix}"
    if suffix == "glb":  # that format's up is y, its north -z
        mesh = mesh.copy()
        mesh.apply_transform(np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float))
    path.write_bytes(mesh.export(file_type=suffix) if suffix != "obj" else mesh.export(file_type="obj").encode())
    return path


def extent(buildings):
    return np.concatenate([buildings.vertices_m.min(axis=0), buildings.vertices_m.max(axis=0)])


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


# -- files that nobody vouches for

watchers: list[list[str]] = []  # an audit hook cannot be taken away again, so it asks who is listening


def tell(event, arguments):
    if event == "open" and watchers:
        watchers[-1].append(str(arguments[0]))


sys.addaudithook(tell)


@contextlib.contextmanager
def opened_files():
    watchers.append([])
    yield watchers[-1]
    watchers.pop()


def glb(document, blob=b""):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if blob:
        chunks += struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def triangle_glb(**changes):
    blob = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0]], np.float32).tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(blob)}],
        "buffers": [{"byteLength": len(blob)}],
    }
    return glb(document | changes, blob)


def test_the_hand_made_glb_is_sound(tmp_path):
    path = tmp_path / "one.glb"
    path.write_bytes(triangle_glb())
    assert len(read_buildings(path, level(), heights="absolute").faces) == 1


def secret(tmp_path):
    path = tmp_path / "secret.mtl"
    path.write_text("newmtl a\nKd 1 1 1\nmap_Kd /etc/hostname\n")
    return path


def test_references_in_obj_and_ply_are_never_opened(tmp_path):
    hidden = secret(tmp_path)
    obj = tmp_path / "house.obj"
    obj.write_text(f"mtllib {hidden}\nmtllib secret.mtl\nusemtl a\nv 0 0 0\nv 10 0 0\nv 0 10 5\nf 1 2 3\n")
    ply = tmp_path / "house.ply"
    ply.write_text(
        f"ply\nformat ascii 1.0\ncomment TextureFile {hidden}\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n10 0 0\n0 10 5\n3 0 1 2\n"
    )
    for path in (obj, ply):
        read_buildings(path, level(), heights="absolute")  # imports what it needs
        with opened_files() as opened:
            assert len(read_buildings(path, level(), heights="absolute").faces) == 1
        assert opened == [str(path)]


@pytest.mark.parametrize(
    "changes",
    [
        {"buffers": [{"byteLength": 36, "uri": "/etc/hostname"}]},
        {"buffers": [{"byteLength": 36}, {"byteLength": 9, "uri": "http://localhost/x.bin"}]},
        {"images": [{"uri": "../secret.png"}]},
    ],
    ids=["buffer path", "buffer URL", "image"],
)
def test_a_glb_that_refers_to_other_files_is_refused(tmp_path, changes):
    path = tmp_path / "spy.glb"
    path.write_bytes(triangle_glb(**changes))
    with (
        opened_files() as opened,
        pytest.raises(
            MeshError, match=r"spy.glb refers to '.*'; embed everything in the .glb, nothing else is opened."
        ),
    ):
        read_buildings(path, level())
    assert opened == [str(path)]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"nodes": [{"mesh": 0, "children": [1]}, {"children": [0]}]}, "its nodes do not form a tree"),
        ({"nodes": [{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]}, "do not form a tree"),
        (
            {"accessors": [{"componentType": 5126, "count": 4_000_000_000, "type": "VEC3"}]},
            "claims 4,000,000,000 values",
        ),
        ({"nodes": [{"mesh": 0}] * 200, "scenes": [{"nodes": list(range(200))}]}, "more than 100 triangles, the limit"),
        ({"nodes": [{"mesh": 7}]}, "is not a readable .glb mesh|holds no triangles"),
        ({"buffers": 3}, "is not a readable .glb mesh"),
    ],
    ids=["loop", "shared child", "huge accessor", "many copies", "no such mesh", "nonsense"],
)
def test_a_glb_that_would_hang_or_swell_is_refused(tmp_path, changes, sentence):
    path = tmp_path / "bomb.glb"
    path.write_bytes(triangle_glb(**changes))
    with pytest.raises(MeshError, match=sentence):
        read_buildings(path, level(), max_faces=100)


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize(
    "content", [b"", b"hello, this is no mesh", bytes(range(256)) * 4], ids=["empty", "text", "noise"]
)
def test_a_file_that_is_no_mesh_is_refused_in_one_sentence(tmp_path, suffix, content):
    path = tmp_path / f"thing.{suffix}"
    path.write_bytes(content)
    with pytest.raises(
        MeshError, match=rf"thing.{suffix} (is not a readable .{suffix} mesh: .*|holds no triangles)\.$"
    ):
        read_buildings(path, level())


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_truncated_file_is_refused(tmp_path, suffix):
    whole = write(tmp_path, trimesh.creation.icosphere(3), suffix).read_bytes()
    path = tmp_path / f"half.{suffix}"
    path.write_bytes(whole[: len(whole) // 2] if suffix != "obj" else whole[: whole.index(b"\nf ") + 1])
    with pytest.raises(MeshError, match=f"half.{suffix}"):
        read_buildings(path, level())


def test_points_without_triangles_are_refused(tmp_path):
    path = tmp_path / "points.ply"
    path.write_bytes(trimesh.PointCloud(np.random.default_rng(1).random((9, 3))).export(file_type="ply"))
    with pytest.raises(MeshError, match=r"points.ply holds no triangles\."):
        read_buildings(path, level())


def test_too_large_a_file_and_too_many_triangles_are_refused_with_the_limit(tmp_path):
    path = write(tmp_path, box(100, -100), "stl")
    with pytest.raises(MeshError, match=r"city.stl has 684 bytes; the limit is 600\."):
        read_buildings(path, level(), max_bytes=600)
    with pytest.raises(MeshError, match=r"city.stl has more than 11 triangles, the limit"):
        read_buildings(path, level(), max_faces=11)


def test_vertices_that_are_not_numbers_are_refused(tmp_path):
    path = tmp_path / "nan.stl"
    path.write_text(
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 nan\nvertex 0 1 0\nendloop\nendfacet\n"
        "endsolid a\n"
    )
    with pytest.raises(MeshError, match=r"nan.stl has 1 vertices that are not finite numbers; repair the file"):
        read_buildings(path, level())


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("city.dae", r"city.dae is not a mesh format that is read here; use one of .stl, .obj, .ply, .glb\."),
        ("city.zip", "is not a mesh format"),
        ("missing.stl", r"missing.stl cannot be read: No such file or directory\."),
    ],
)
def test_other_formats_and_missing_files_are_refused(tmp_path, name, sentence):
    if "missing" not in name:
        (tmp_path / name).write_bytes(b"anything")
    with pytest.raises(MeshError, match=sentence):
        read_buildings(tmp_path / name, level())


def test_buildings_without_known_ground_below_are_refused_unless_absolute(tmp_path):
    path = write(tmp_path, trimesh.util.concatenate([box(100, -100), box(5000, -50)]), "stl")
    with pytest.raises(
        MeshError, match=r"1 of 2 buildings in city.stl have no known ground below, one at east 5000.0 m"
    ):
        read_buildings(path, level())
    assert read_buildings(path, level(), heights="absolute").count == 2
    with pytest.raises(MeshError, match="2 of 2 buildings"):
        read_buildings(path, level(np.nan))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [({"heights": "floating"}, "heights must be one of above_ground, absolute"), ({"up": "x"}, "up must be y or z")],
)
def test_options_that_do_not_exist_are_refused(tmp_path, options, sentence):
    with pytest.raises(MeshError, match=sentence):
        read_buildings(write(tmp_path, box(100, -100), "stl"), level(), **options)


@pytest.mark.parametrize(
    ("vertices", "faces", "sentence"),
    [
        (np.empty((0, 3)), np.empty((0, 3)), "holds no triangles"),
        (np.zeros((3, 2)), [[0, 1, 2]], r"vertices \(n, 3\)"),
        (np.zeros((3, 3)), [[0, 1, 3]], "number vertices which are not there"),
        (np.zeros((3, 3)), [[0, 1, -1]], "number vertices which are not there"),
        (np.full((3, 3), np.inf), [[0, 1, 2]], "3 vertices that are not finite"),
    ],
)
def test_arrays_that_are_no_mesh_are_refused(vertices, faces, sentence):
    with pytest.raises(MeshError, match=sentence):
        Buildings(vertices, faces)
