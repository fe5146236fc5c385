"""What a session remembers as bytes, and back: for a service that starts again, of the same release alone.

They are pickles that may name nothing but what a detector is made of, and hold no map: grid and area are put in their
places anew.
"""

from __future__ import annotations

import functools
import hashlib
import io
import pickle
from pathlib import Path

import numpy as np
import shapely

import detection
import navigation
import planning.watching
from service.live.watching import Memory
from terrain import ElevationGrid

__all__ = ["SnapshotError", "freeze", "thaw"]

GRID, AREA = "grid", "area"
OURS = ("detection", "navigation", "planning.watching", "service.live", "visibility", "terrain")
THEIRS = frozenset({
    ("collections", "deque"), ("collections", "Counter"), ("collections", "OrderedDict"), ("builtins", "set"),
    ("numpy", "ndarray"), ("numpy", "dtype"), ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"), ("numpy._core.numeric", "_frombuffer"),
})  # fmt: skip


class SnapshotError(Exception):
    """Bytes that are no snapshot of this release."""


class _Pickler(pickle.Pickler):
    def persistent_id(self, obj: object) -> str | None:
        if isinstance(obj, ElevationGrid):
            return GRID
        return AREA if isinstance(obj, shapely.Geometry) else None


class _Unpickler(pickle.Unpickler):
    def __init__(self, data: bytes, grid: ElevationGrid | None, area: shapely.Geometry | None) -> None:
        super().__init__(io.BytesIO(data))
        self._there = {GRID: grid, AREA: area}

    def persistent_load(self, pid: object) -> ElevationGrid | shapely.Geometry:
        there = self._there.get(str(pid))
        if there is None:
            raise SnapshotError("It looks at a map that is not there.")
        return there

    def find_class(self, module_name: str, global_name: str) -> object:
        ours = any(module_name == one or module_name.startswith(f"{one}.") for one in OURS)
        if not (ours or (module_name, global_name) in THEIRS) or "." in global_name:
            raise SnapshotError(f"A snapshot has no {module_name}.{global_name}.")
        found: object = super().find_class(module_name, global_name)
        if ours and not isinstance(found, type):
            raise SnapshotError(f"A snapshot calls no {module_name}.{global_name}.")
        return found


def freeze(memory: Memory) -> bytes:
    """The memory as bytes, with what code made it."""
    stream = io.BytesIO()
    stream.write(_release())
    _Pickler(stream, pickle.HIGHEST_PROTOCOL).dump(memory)
    return stream.getvalue()


def thaw(data: bytes, grid: ElevationGrid | None, area: shapely.Geometry | None = None) -> Memory:
    """The memory again; grid: of the session's DEM, area: its part of it.

    Raises SnapshotError for what is damaged or of another release.
    """
    release = _release()
    if not data.startswith(release):
        raise SnapshotError("It was made by another release.")
    try:
        memory = _Unpickler(data[len(release) :], grid, area).load()
    except (pickle.UnpicklingError, EOFError, AttributeError, TypeError, ValueError, IndexError, KeyError) as error:
        raise SnapshotError("It is damaged.") from error
    if not isinstance(memory, Memory):
        raise SnapshotError("It is damaged.")
    return memory


@functools.cache
def _release() -> bytes:
    """Digest of all code whose objects are frozen: what another release makes of them is anyone's guess."""
    whole = hashlib.sha256(np.__version__.encode())
    here = [Path(__file__), *(Path(__file__).with_name(name) for name in ("watching.py", "imu.py"))]
    for package in (detection, navigation, planning.watching):
        here += sorted(Path(str(package.__file__)).parent.rglob("*.py"))
    for path in here:
        whole.update(path.read_bytes())
    return whole.digest()
