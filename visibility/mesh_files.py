"""Triangles out of uploaded mesh files, without ever opening anything but the file itself."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import MeshError

if TYPE_CHECKING:
    import trimesh

__all__ = ["FORMATS", "MAX_FACES", "MAX_FILE_BYTES", "read_mesh_bytes", "triangles_of"]

FORMATS = (".stl", ".obj", ".ply", ".glb")
MAX_FILE_BYTES = 128 * 1024 * 1024
MAX_FACES = 2_000_000

_GLB_HEADER = struct.Struct("<4sIIII")


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
    if suffix == ".glb":
        _refuse_hazards(name, data, max_faces)
    # here, because importing it takes as long as everything else together and few questions have buildings
    import trimesh

    try:
        # a stream without a name and no resolver: references have nothing to resolve against
        scene = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], resolver=None, **_options(suffix))
    except Exception as error:  # a damaged file makes the format readers raise anything
        raise MeshError(f"{name} is not a readable {suffix} mesh: {_sentence(error)}") from error
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
    faces_so_far = 0
    for node in scene.graph.nodes_geometry:
        transform, geometry_name = scene.graph[node]
        geometry = scene.geometry[geometry_name]
        if not hasattr(geometry, "faces"):
            continue
        faces_so_far += len(geometry.faces)
        if faces_so_far > max_faces:
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


def _refuse_hazards(name: str, data: bytes, max_faces: int) -> None:
    """Refuse a .glb that points outside itself, whose nodes form a loop, or that claims more than it can hold."""
    try:
        magic, _, _, length, kind = _GLB_HEADER.unpack_from(data)
        document = json.loads(data[_GLB_HEADER.size : _GLB_HEADER.size + length])
        if magic != b"glTF" or kind != 0x4E4F534A or not isinstance(document, dict):
            raise ValueError("no glTF header")
        uris = [part["uri"] for key in ("buffers", "images") for part in document.get(key, []) if "uri" in part]
        claimed = sum(int(accessor["count"]) for accessor in document.get("accessors", []))
        children = [child for node in document.get("nodes", []) for child in node.get("children", [])]
        parents = {
            child: number for number, node in enumerate(document.get("nodes", [])) for child in node.get("children", [])
        }
    except (struct.error, ValueError, TypeError, KeyError, AttributeError) as error:
        raise MeshError(f"{name} is not a readable .glb mesh: {_sentence(error)}") from error
    outside = [str(uri) for uri in uris if not str(uri).startswith("data:")]
    if outside:
        raise MeshError(f"{name} refers to {outside[0][:60]!r}; embed everything in the .glb, nothing else is opened.")
    if claimed > 16 * max_faces:
        raise MeshError(f"{name} claims {claimed:,} values, more than {max_faces:,} triangles (the limit) can need.")
    if len(children) != len(set(children)) or _loops(parents):
        raise MeshError(f"{name} is not a readable .glb mesh: its nodes do not form a tree.")


def _loops(parents: dict[int, int]) -> bool:
    """Whether following parents upwards ever comes back."""
    finished: set[int] = set()
    for start in parents:
        trail: set[int] = set()
        node: int | None = start
        while node is not None and node not in finished:
            if node in trail:
                return True
            trail.add(node)
            node = parents.get(node)
        finished |= trail
    return False


def _sentence(error: BaseException) -> str:
    text = str(error).strip().splitlines()
    return (text[0] if text else type(error).__name__).rstrip(".") + "."
