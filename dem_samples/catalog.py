"""The bundled DEMs by name, each verified against the manifest before it is used."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path

from terrain import ElevationGrid, SampleError, read_dem

__all__ = ["load_sample", "sample_manifest", "sample_names", "sample_path"]

_FOLDER = Path(__file__).parent


@lru_cache(maxsize=1)
def _entries() -> dict[str, dict[str, str | int]]:
    entries: dict[str, dict[str, str | int]] = json.loads((_FOLDER / "manifest.json").read_text(encoding="utf-8"))
    return entries


def sample_names() -> tuple[str, ...]:
    """Names of the bundled DEMs, sorted."""
    return tuple(sorted(_entries()))


def sample_manifest(name: str) -> dict[str, str | int]:
    """File, title, kind, source, licence, sha256, rows, cols and what a bundled DEM shows. Raises SampleError."""
    entry = _entries().get(Path(name).stem)
    if entry is None or name not in (Path(name).stem, entry["file"]):
        raise SampleError(f"There is no bundled DEM {name[:40]!r}; there are {', '.join(sample_names())}.")
    return dict(entry)


def sample_path(name: str) -> Path:
    """The file of a bundled DEM ("jacksboro" or "jacksboro.tif"), its checksum verified. Raises SampleError."""
    entry = sample_manifest(name)
    path = _FOLDER / str(entry["file"])
    if not path.is_file():
        raise SampleError(f"The bundled DEM {path.name} is missing from this installation; install Sightline again.")
    if hashlib.sha256(path.read_bytes()).hexdigest() != entry["sha256"]:
        raise SampleError(f"The bundled DEM {path.name} is damaged: its checksum is not the manifest's.")
    return path


def load_sample(name: str) -> ElevationGrid:
    """A bundled DEM as a grid. Raises SampleError."""
    return read_dem(sample_path(name))
