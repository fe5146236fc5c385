"""Triangles out of uploaded mesh files, never opening another file; what a .glb must be before it is read."""

from __future__ import annotations

import io
import json
import re
import struct
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from visibility.errors import MeshError

if TYPE_CHECKING:
    import trimesh

__all__ = ["FORMATS", "MAX_FACES", "MAX_FILE_BYTES", "check_glb", "read_mesh_bytes", "sentence_of", "triangles_of"]

_HEADER = struct.Struct("<4sIIII")
JSON_CHUNK = 0x4E4F534A
BYTES_OF_COMPONENT = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# A node is placed by walking up to the root: no scene of buildings is deeper or has more.
DEEPEST, MOST_NODES = 256, 100_000
# Accessors may share bytes, as interleaved attributes and repeated meshes do, but not without end.
SHARED = 8


def check_glb(name: str, data: bytes, max_faces: int) -> None:
    """Refuse a .glb that points outside itself, whose nodes are no tree, or that claims more than it holds.

    Raises MeshError.
    """
    try:
        document = _document(data)
        uris = [part["uri"] for key in ("buffers", "images") for part in document.get(key, []) if "uri" in part]
        outside = [str(uri) for uri in uris if not str(uri).startswith("data:")]
        if outside:
            raise MeshError(
                f"{name} refers to {outside[0][:60]!r}; embed everything in the .glb, nothing else is opened."
            )
        wrong = _wrong_tree(document.get("nodes", [])) or _wrong_accessors(document, len(data), max_faces)
    except RecursionError as error:
        raise MeshError(f"{name} is not a readable .glb mesh: its JSON is nested too deeply.") from error
    except (struct.error, ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError) as error:
        raise MeshError(f"{name} is not a readable .glb mesh: {sentence_of(error)}") from error
    if wrong:
        raise MeshError(f"{name} {wrong}")


def sentence_of(error: BaseException) -> str:
    """What a library's error says, in one line."""
    text = str(error).strip().splitlines()
    return (text[0] if text else type(error).__name__).rstrip(".") + "."


def _document(data: bytes) -> dict[str, Any]:
    magic, _, _, length, kind = _HEADER.unpack_from(data)
    if magic != b"glTF" or kind != JSON_CHUNK:
        raise ValueError("no glTF header")
    document = json.loads(data[_HEADER.size : _HEADER.size + length])
    if not isinstance(document, dict):
        raise ValueError("no glTF header")
    return document


def _wrong_tree(nodes: list[dict[str, Any]]) -> str:
    children = [child for node in nodes for child in node.get("children", [])]
    parents = {child: number for number, node in enumerate(nodes) for child in node.get("children", [])}
    if len(children) != len(parents):
        return "is not a readable .glb mesh: its nodes do not form a tree."
    if len(nodes) > MOST_NODES:
        return f"has {len(nodes):,} nodes, more than the limit of {MOST_NODES:,}."
    depth: dict[int, int] = {}
    for start in parents:
        trail: list[int] = []
        node: int | None = start
        while node is not None and node not in depth:
            trail.append(node)
            if len(trail) > len(parents) + 1:
                return "is not a readable .glb mesh: its nodes do not form a tree."
            node = parents.get(node)
        above = 0 if node is None else depth[node]
        depth |= {one: above + number for number, one in enumerate(reversed(trail), 1)}
    deepest = max(depth.values(), default=0)
    return f"has nodes {deepest:,} deep, more than the limit of {DEEPEST}." if deepest > DEEPEST else ""


def _wrong_accessors(document: dict[str, Any], file_bytes: int, max_faces: int) -> str:
    accessors, views, claimed_bytes = document.get("accessors", []), document.get("bufferViews", []), 0
    for number, accessor in enumerate(accessors):
        count = int(accessor["count"])
        item_bytes = BYTES_OF_COMPONENT[accessor["componentType"]] * COMPONENTS[accessor["type"]]
        if "sparse" in accessor:
            return f"has a sparse accessor ({number}), which is not read here; write it in full."
        # without a view of bytes it would be zeros, as many as it likes
        held_bytes = int(views[accessor["bufferView"]]["byteLength"]) if "bufferView" in accessor else 0
        if count < 0 or count * item_bytes > min(held_bytes, file_bytes):
            return f"claims {count:,} values in accessor {number}, more than it holds."
        claimed_bytes += count * item_bytes
    if claimed_bytes > SHARED * file_bytes:
        return f"claims {claimed_bytes:,} bytes of values out of {file_bytes:,}, the same ones again and again."
    corners = 0
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            used = [primitive["attributes"]["POSITION"], *([primitive["indices"]] if "indices" in primitive else [])]
            corners += sum(int(accessors[number]["count"]) for number in used)
    if corners > 6 * max_faces:
        return f"claims {corners:,} corners, more than {max_faces:,} triangles (the limit) can need."
    return ""


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
