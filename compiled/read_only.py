"""Arrays as grids hold them: not to be written."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

__all__ = ["read_only"]

Number = TypeVar("Number", bound=np.generic)


def read_only(array: npt.NDArray[Number]) -> npt.NDArray[Number]:
    """A view of the same numbers that cannot be written through; the array itself stays as it is.

    Writable and read-only arrays are two types to numba: a kernel that is given both is compiled twice, and a large
    one takes half a minute. Whatever a kernel only reads is handed to it like a grid's heights, read-only.
    """
    view = array.view()
    view.setflags(write=False)
    return view
