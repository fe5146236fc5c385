"""Arrays in .npz files."""

from __future__ import annotations

import zipfile
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["add_array"]


def add_array(archive: zipfile.ZipFile, name: str, array: npt.NDArray[Any]) -> None:
    """One array of an .npz."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
