"""Buildings in .obj and .ply: read whatever they hold besides, refused where they make no sense."""

import pytest

from tests.visibility.meshes import level
from visibility import MeshError, read_buildings


def test_a_ply_that_announces_more_than_its_bytes_is_refused(tmp_path):
    path = tmp_path / "hollow.ply"
    path.write_text(
        "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    with pytest.raises(MeshError, match=r"hollow.ply announces 4,000,000,001 elements, more than its \d+ bytes"):
        read_buildings(path, level())


def test_an_obj_is_read_however_its_faces_are_written(tmp_path):
    path = tmp_path / "house.obj"
    path.write_text(
        "# a square and a triangle\no a\nv 0 0 0\nv 10 0 0\nv 10 10 0 1.0\nv 0 10 0 0.5 0.5 0.5\nvt 0 0\n"
        "usemtl red\nf 1/1 2/1/1 \\\n3//1 4\ng b\nv 0 0 5\nf -1 1 2\n"
    )
    buildings = read_buildings(path, level(), heights="absolute")
    assert buildings.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 0, 1]]
    assert buildings.vertices_m[4].tolist() == [0.0, 0.0, 5.0]


@pytest.mark.parametrize("line", ["f", "f 1 2", "f 1 2 9", "f 0 1 2", "f -9 1 2", "f a b c", "v 1", "v x y z"])
def test_an_obj_with_a_line_that_makes_no_sense_is_refused(tmp_path, line):
    path = tmp_path / "house.obj"
    path.write_text(f"v 0 0 0\nv 10 0 0\nv 0 10 0\n{line}\n")
    with pytest.raises(MeshError, match=r"house\.obj"):
        read_buildings(path, level(), heights="absolute")
