"""Triangles out of uploaded mesh files, without ever opening anything but the file itself."""

from __future__ import annotations

import io
import re
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from visibility.cover.glb_checks import check_glb, sentence_of
from visibility.errors import MeshError

if TYPE_CHECKING:
    import trimesh

__all__ = ["FORMATS", "MAX_FACES", "MAX_FILE_BYTES", "read_mesh_bytes", "triangles_of"]

FORMATS = (".stl", ".obj", ".ply", ".glb")
MAX_FILE_BYTES = 128 * 1024 * 1024
MAX_FACES = 2_000_000

HEAD_BYTES = 65_536


def read_mesh_bytes(path: Path, max_bytes: int = MAX_FILE_BYTES) -> bytes:
    """What is in a file whose ending is that of a mesh. Raises MeshError."""
    _suffix(path.name)
    try:
        size = path.stat().st_size
        if size > max_bytes:
            raise MeshError(f"{path.name} has {size:,} bytes; the limit is {max_bytes:,}.")
        return path.read_bytes()
    except OSError as error:
        raise MeshError(f"{path.name} cannot be read: {error.strerror}.") from error


def triangles_of(
    data: bytes, name: str, *, max_faces: int = MAX_FACES
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """(vertices (n, 3), faces (m, 3)) of a .stl, .obj, .ply or .glb file, in the file's own axes. Raises MeshError."""
    suffix = _suffix(name)
    if suffix == ".obj":
        return _obj(name, data, max_faces)
    if suffix == ".glb":
        check_glb(name, data, max_faces)
    if suffix == ".ply":
        _refuse_hollow_ply(name, data)
    # here, because importing it takes as long as everything else together and few questions have buildings
    import trimesh

    try:
        # a stream without a name and no resolver: references have nothing to resolve against
        scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], resolver=None, **_options(suffix))
    except MemoryError:
        raise
    except Exception as error:  # a damaged file makes the format readers raise anything
        raise MeshError(f"{name} is not a readable {suffix} mesh: {sentence_of(error)}") from error
    return _flat(name, scene, max_faces)


def _suffix(name: str) -> str:
    suffix = Path(name).suffix.lower()
    if suffix not in FORMATS:
        raise MeshError(f"{name} is not a mesh format that is read here; use one of {', '.join(FORMATS)}.")
    return suffix


def _options(suffix: str) -> dict[str, Any]:
    # unprocessed, or vertices that are not numbers would be dropped without a word
    return {"process": False} if suffix == ".stl" else {"process": False, "skip_materials": True}


def _flat(name: str, scene: trimesh.Scene, max_faces: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Every placed copy of every mesh of a scene, as one pair of arrays."""
    placed = []
    faces_so_far = vertices_so_far = 0
    for node in scene.graph.nodes_geometry:
        transform, geometry_name = scene.graph[node]
        geometry = scene.geometry[geometry_name]
        if not hasattr(geometry, "faces"):
            continue
        faces_so_far += len(geometry.faces)
        vertices_so_far += len(geometry.vertices)
        if faces_so_far > max_faces or vertices_so_far > 3 * MAX_FACES:
            raise MeshError(f"{name} has more than {max_faces:,} triangles, the limit; simplify or split it.")
        placed.append((np.asarray(geometry.vertices, np.float64), np.asarray(geometry.faces, np.int64), transform))
    if faces_so_far == 0:
        raise MeshError(f"{name} holds no triangles.")
    vertices, faces, base = [], [], 0
    for points, triangles, transform in placed:
        vertices.append(points @ transform[:3, :3].T + transform[:3, 3])
        faces.append(triangles + base)
        base += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def _obj(name: str, data: bytes, max_faces: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Vertices and faces of a .obj, polygons as fans; whatever else it holds is of no use here and passed over."""
    places: list[list[bytes]] = []
    faces: list[tuple[int, int, int]] = []
    try:
        for line in data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
            words = line.split()
            if words and words[0] == b"v":
                if len(words) < 4:
                    raise ValueError("a vertex has fewer than three numbers")
                places.append(words[1:4])
            elif words and words[0] == b"f":
                numbers = [int(word.partition(b"/")[0]) for word in words[1:]]
                # counted from 1, or backwards from the vertex before this line
                if len(numbers) < 3:
                    raise ValueError("a face has fewer than three corners")
                first, *others = [number - 1 if number > 0 else len(places) + number for number in numbers]
                faces += [(first, *pair) for pair in pairwise(others)]
                if len(faces) > max_faces:
                    raise MeshError(f"{name} has more than {max_faces:,} triangles, the limit; simplify or split it.")
        vertices_m = np.array(places, np.float64).reshape(-1, 3)
        return vertices_m, np.array(faces, np.int64).reshape(-1, 3)
    except (ValueError, OverflowError) as error:
        raise MeshError(f"{name} is not a readable .obj mesh: {sentence_of(error)}") from error


def _refuse_hollow_ply(name: str, data: bytes) -> None:
    """Refuse a .ply whose head announces more than its bytes can hold: memory is taken for what is announced."""
    head = data[: data.find(b"end_header") if b"end_header" in data[:HEAD_BYTES] else HEAD_BYTES]
    announced = [int(count) for count in re.findall(rb"^\s*element\s+\S+\s+(\d{1,18})", head, re.MULTILINE)]
    if sum(announced) > len(data):
        raise MeshError(f"{name} announces {sum(announced):,} elements, more than its {len(data):,} bytes can hold.")
