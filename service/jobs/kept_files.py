"""DEMs in the data folder, and the files that belong to what a store knows: written, read, sound or not, copied.

A DEM's heights lie as a plain .npy that processes can share, everything else as JSON.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from terrain import ElevationGrid, Provenance
from terrain.crs_texts import parse_crs

from .folder import digest_of, make_durable
from .recovery import NOTES

__all__ = [
    "GridFields",
    "copy_files",
    "digest_of_files",
    "grid_fields",
    "grid_of",
    "is_sound",
    "load_grid",
    "save_grid",
]

HEIGHTS = "heights_m.npy"
DESCRIPTION = "grid.json"


class ProvenanceFields(TypedDict):
    """A ``Provenance``, ready for JSON."""

    source: str
    driver: str
    conversions: Sequence[str]
    warnings: Sequence[str]


class GridFields(TypedDict):
    """An ``ElevationGrid`` without its heights, ready for JSON; crs: as WKT."""

    cell_east_m: float
    cell_north_m: float
    origin_east_m: float
    origin_north_m: float
    crs: str | None
    vertical_datum: str | None
    provenance: ProvenanceFields


def grid_fields(grid: ElevationGrid) -> GridFields:
    """What is kept of a grid besides its heights."""
    origin = grid.provenance
    return GridFields(
        cell_east_m=grid.cell_east_m,
        cell_north_m=grid.cell_north_m,
        origin_east_m=grid.origin_east_m,
        origin_north_m=grid.origin_north_m,
        crs=None if grid.crs is None else grid.crs.to_wkt(),
        vertical_datum=grid.vertical_datum,
        provenance=ProvenanceFields(
            source=origin.source, driver=origin.driver, conversions=origin.conversions, warnings=origin.warnings
        ),
    )


def grid_of(heights: Path, fields: GridFields) -> ElevationGrid:
    """The grid again; its heights are mapped into memory, so that all workers share them. Raises OSError."""
    origin = fields["provenance"]
    return ElevationGrid(
        np.load(heights, mmap_mode="r", allow_pickle=False),
        fields["cell_east_m"],
        fields["cell_north_m"],
        fields["origin_east_m"],
        fields["origin_north_m"],
        None if fields["crs"] is None else parse_crs(fields["crs"]),
        fields["vertical_datum"],
        Provenance(origin["source"], origin["driver"], tuple(origin["conversions"]), tuple(origin["warnings"])),
    )


def save_grid(grid: ElevationGrid, folder: Path) -> None:
    """Write the grid into a folder, which is made. Raises OSError."""
    folder.mkdir(parents=True)
    np.save(folder / HEIGHTS, grid.heights_m, allow_pickle=False)
    (folder / DESCRIPTION).write_text(json.dumps(grid_fields(grid), allow_nan=False), encoding="utf-8")


def load_grid(folder: Path) -> ElevationGrid:
    """The same grid again, its heights mapped. Raises OSError."""
    return grid_of(folder / HEIGHTS, json.loads((folder / DESCRIPTION).read_text(encoding="utf-8")))


def digest_of_files(folder: Path) -> str:
    """``ElevationGrid.digest`` from the files as they are, with the CRS in the words that PROJ had when it was written.

    Raises OSError, ValueError, KeyError, TypeError where they are damaged.
    """
    described = json.loads((folder / DESCRIPTION).read_text(encoding="utf-8"))
    heights_m = np.load(folder / HEIGHTS, mmap_mode="r", allow_pickle=False)
    names = ("cell_east_m", "cell_north_m", "origin_east_m", "origin_north_m")
    sha = hashlib.sha256(repr((heights_m.shape, *(float(described[name]) for name in names))).encode())
    sha.update((described["crs"] or "local").encode())
    sha.update(heights_m.data)
    return sha.hexdigest()


def is_sound(part: str, path: Path, dem_digests: dict[str, str]) -> bool:
    """Whether a DEM, a result or a job's inputs is there and holds what it held when it was written.

    dem_digests: SHA-256 of each DEM's grid, as the store has it; a result's name says what it holds.
    """
    if not path.is_dir():
        return False
    try:
        if part == "results":
            return digest_of(path) == path.name
        if part == "dems":
            return digest_of_files(path) == dem_digests.get(path.name)
        return any(path.iterdir())
    except (OSError, ValueError, TypeError, KeyError):
        return False


def copy_files(source: Path, target: Path) -> bool:
    """Copy a folder's own files and its notes, without what was drawn; False when it goes away meanwhile, or is gone.

    Raises OSError.
    """
    (target / NOTES).mkdir(parents=True)
    try:
        for path in (*source.iterdir(), *(source / NOTES).glob("*.json")):
            if path.is_file():
                shutil.copyfile(path, target / path.relative_to(source))
    except FileNotFoundError:
        shutil.rmtree(target)
        return False
    make_durable(target)
    return True
