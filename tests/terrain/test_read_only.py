"""A read-only view shows its array's numbers, and leaves the array alone."""

import numba
import numpy as np
import pytest

from compiled.read_only import read_only
from terrain import ElevationGrid


def test_a_read_only_view_shows_what_its_array_holds_and_cannot_be_written():
    array = np.zeros((2, 3), np.float32)
    view = read_only(array)
    array[1, 2] = 5.0
    assert view[1, 2] == 5.0
    with pytest.raises(ValueError, match="read-only"):
        view[0, 0] = 1.0


def test_the_array_itself_stays_writable():
    array = np.zeros(3)
    read_only(array)[...]
    array[0] = 1.0
    assert array[0] == 1.0


def test_kernels_take_a_read_only_view_for_the_same_type_as_a_grids_heights():
    grid = ElevationGrid(np.zeros((2, 3)), 30.0, 30.0)
    assert numba.typeof(read_only(np.zeros((2, 3), np.float32))) == numba.typeof(grid.heights_m)
