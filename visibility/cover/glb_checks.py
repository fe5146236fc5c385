"""What a .glb must be before it is read: whole in itself, a tree, and no larger than its own bytes."""

from __future__ import annotations

import json
import struct
from typing import Any

from visibility.errors import MeshError

__all__ = ["check_glb", "sentence_of"]

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
