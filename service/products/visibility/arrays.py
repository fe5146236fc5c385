"""All arrays of a visibility map in one .npz."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from service.products.visibility.calculate import VisibilityMap

__all__ = ["add_array", "write_arrays"]


def write_arrays(finished: VisibilityMap, path: Path) -> None:
    """The arrays and what places them; read with numpy.load, no pickles in it."""
    grid = finished.grid
    arrays: dict[str, npt.NDArray[Any]] = {
        "heights_m": grid.heights_m,
        "visible": finished.visible,
        "min_visible_altitude_m": finished.altitude_m,
        "count": finished.count,
        "unknown_count": finished.unknown_count,
        "anchor_ids": np.array([anchor.id for anchor in finished.anchors]),
        "anchor_positions_m": np.array([(a.east_m, a.north_m, a.altitude_m) for a in finished.anchors]),
        "origin_m": np.array([grid.origin_east_m, grid.origin_north_m]),
        "cell_m": np.array([grid.cell_east_m, grid.cell_north_m]),
        "crs": np.array("" if grid.crs is None else grid.crs.to_wkt()),
    }
    # numpy's own compressed writer knows only the slow level 6
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            add_array(archive, name, array)


def add_array(archive: zipfile.ZipFile, name: str, array: npt.NDArray[Any]) -> None:
    """One array of an .npz."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
