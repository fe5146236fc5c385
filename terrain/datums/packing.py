"""The grid of a geoid model as a small file: whole centimetres, as differences from post to post, compressed.

``python -m terrain.datums.packing egm96_15.gtx egm96.npz`` makes the file that comes with Sightline from NGA's grid,
in any format that GDAL reads.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

__all__ = ["CENTIMETRES", "pack", "unpack"]

# per metre
CENTIMETRES = 100.0


def pack(geoid_height_m: npt.NDArray[np.floating], path: Path) -> None:
    """Write geoid heights, (rows, cols) metres, rounded to 1 cm, as int16 differences along rows and columns."""
    whole = np.rint(np.asarray(geoid_height_m, np.float64) * CENTIMETRES).astype(np.int64)
    steps = np.diff(np.diff(whole, axis=1, prepend=0), axis=0, prepend=0)
    limits = np.iinfo(np.int16)
    if steps.min() < limits.min or steps.max() > limits.max:
        raise ValueError("Neighbouring geoid heights differ by more than 16 bits of centimetres hold.")
    np.savez_compressed(path, steps=steps.astype(np.int16))


def unpack(path: Path) -> npt.NDArray[np.float64]:
    """The geoid heights of such a file, (rows, cols) metres."""
    with np.load(path, allow_pickle=False) as archive:
        steps = archive["steps"].astype(np.int64)
    heights_m: npt.NDArray[np.float64] = np.cumsum(np.cumsum(steps, axis=0), axis=1) / CENTIMETRES
    return heights_m


def _main(source: str, target: str) -> None:
    import rasterio

    with rasterio.open(source) as grid:
        pack(grid.read(1), Path(target))


if __name__ == "__main__":
    _main(*sys.argv[1:])
