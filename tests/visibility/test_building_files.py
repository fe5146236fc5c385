"""Building files that nobody vouches for: none opens another file, hangs or swells; each is refused in a sentence."""

import contextlib
import json
import struct
import sys

import numpy as np
import pytest
import trimesh

from tests.visibility.meshes import FORMATS, box, level, write
from visibility import Buildings, MeshError, read_buildings

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
        MeshError,
        match=r"1 of 2 buildings in city.stl have no known ground below, one at \(5000.0 m east, -50.0 m north\)",
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


def sparse_accessor(count):
    part = {"bufferView": 0, "componentType": 5125}
    return {
        "componentType": 5126,
        "count": count,
        "type": "VEC3",
        "sparse": {"count": 1, "indices": part, "values": {"bufferView": 0}},
    }


VIEWED = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"accessors": [sparse_accessor(3)]}, r"has a sparse accessor \(0\)"),
        ({"accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}]}, "more than it holds"),
        ({"accessors": [{**VIEWED, "type": "MAT4"}]}, "claims 3 values in accessor 0, more than it holds"),
        ({"accessors": [{**VIEWED, "count": -3}]}, "claims -3 values"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}] * 250}]}, "claims 750 corners"),
        ({"nodes": [*({"children": [n + 1]} for n in range(300)), {"mesh": 0}]}, "has nodes 301 deep"),
        ({"nodes": [{"mesh": 0}] * 100_001}, "has 100,001 nodes"),
    ],
    ids=["sparse", "no bytes", "wide", "negative", "copied", "deep", "many nodes"],
)
def test_a_glb_that_claims_more_than_its_bytes_is_refused_before_memory_is_taken_for_it(tmp_path, changes, sentence):
    path = tmp_path / "bomb.glb"
    path.write_bytes(triangle_glb(**changes))
    with pytest.raises(MeshError, match=sentence):
        read_buildings(path, level(), max_faces=100)


def test_a_glb_that_claims_its_bytes_again_and_again_is_refused(tmp_path):
    blob = bytes(120_000)
    accessors = [{**VIEWED, "count": 10_000}] * 40
    views = {"bufferViews": [{"buffer": 0, "byteLength": len(blob)}], "buffers": [{"byteLength": len(blob)}]}
    path = tmp_path / "bomb.glb"
    path.write_bytes(glb({"accessors": accessors, **views}, blob))
    with pytest.raises(MeshError, match="the same ones again and again"):
        read_buildings(path, level())


def test_a_glb_whose_json_is_nested_without_end_is_refused(tmp_path):
    text = b'{"asset":' + b"[" * 200_000
    chunk = struct.pack("<II", len(text), 0x4E4F534A) + text
    path = tmp_path / "deep.glb"
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk)
    with pytest.raises(MeshError, match=r"deep.glb is not a readable .glb mesh: its JSON is nested too deeply\."):
        read_buildings(path, level())
