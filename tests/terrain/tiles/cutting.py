"""DEMs cut into tiles for one test, in the ways in which tiles come."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import rasterio

from tests.terrain.files import write_tif

SECONDS_3 = 1.0 / 1200.0


def rough(rows: int, cols: int, seed: int = 7) -> np.ndarray:
    """Heights (rows, cols) float32 that no two neighbours share."""
    noise = np.random.default_rng(seed).normal(size=(rows, cols)).cumsum(axis=0).cumsum(axis=1)
    return (600.0 + 3.0 * noise / np.abs(noise).max() * 100.0).astype(np.float32)


def cuts(posts: int, pieces: int, *, shared: bool) -> list[tuple[int, int]]:
    """(first, last) post of each piece; with shared edges the last of one is the first of the next."""
    edges = [round(piece * (posts - 1) / pieces) for piece in range(pieces + 1)]
    return [(start + (0 if shared or not start else 1), end) for start, end in pairwise(edges)]


def cut_tif(
    folder: Path, heights: np.ndarray, transform: rasterio.Affine, *, shared: bool, pieces: int = 3, **profile: Any
) -> list[Path]:
    """A DEM as pieces × pieces GeoTIFFs."""
    folder.mkdir(exist_ok=True)
    paths = []
    for first_row, last_row in cuts(heights.shape[0], pieces, shared=shared):
        for first_col, last_col in cuts(heights.shape[1], pieces, shared=shared):
            part = heights[first_row : last_row + 1, first_col : last_col + 1]
            moved = transform @ rasterio.Affine.translation(first_col, first_row)
            path = folder / f"tile_{first_row}_{first_col}.tif"
            paths.append(write_tif(path, part, transform=moved, **profile))
    return paths


def write_hgt(folder: Path, heights: np.ndarray, west_deg: int, south_deg: int) -> Path:
    """One SRTM tile of 3 arc seconds: 1201 × 1201 posts of whole metres, big-endian."""
    assert heights.shape == (1201, 1201)
    folder.mkdir(exist_ok=True)
    name = f"{'N' if south_deg >= 0 else 'S'}{abs(south_deg):02d}{'E' if west_deg >= 0 else 'W'}{abs(west_deg):03d}.hgt"
    (folder / name).write_bytes(heights.astype(">i2").tobytes())
    return folder / name
