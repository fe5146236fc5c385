"""A turned grid is the grid turned, and many eyes that share one see what each sees alone."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain import ElevationGrid, fractal
from visibility import FLAT, Anchor, min_visible_altitude
from visibility.sight.kernels.turning import turn
from visibility.sight.sweeps import MANY_EYES


@settings(deadline=None)  # the first example compiles
@given(rows=st.integers(1, 150), cols=st.integers(1, 150), seed=st.integers(0, 2**32 - 1))
def test_a_grid_of_any_size_is_turned(rows: int, cols: int, seed: int) -> None:
    heights_m = np.random.default_rng(seed).normal(size=(rows, cols)).astype(np.float32)
    turned_m = np.zeros((cols, rows), np.float32)
    turn(heights_m, turned_m)
    np.testing.assert_array_equal(turned_m, heights_m.T)


@pytest.mark.parametrize("shape", [(97, 140), (200, 66)])
def test_many_anchors_at_once_see_what_each_sees_alone(shape: tuple[int, int]) -> None:
    heights_m: npt.NDArray[np.float32] = fractal(256, seed=7, relief_m=400.0).heights_m[: shape[0], : shape[1]].copy()
    heights_m[20:30, 40:50] = np.nan
    grid = ElevationGrid(heights_m, 30.0, 20.0)
    rng = np.random.default_rng(3)
    # on the map and beyond every side of it
    height_m, width_m = shape[0] * 20.0, shape[1] * 30.0
    anchors = [
        Anchor(f"A{i}", float(east_m), float(north_m), 900.0)
        for i, (east_m, north_m) in enumerate(rng.uniform(-0.3, 1.3, (MANY_EYES + 2, 2)) * (width_m, height_m))
    ]
    together = min_visible_altitude(grid, anchors, "fast", FLAT)
    for number, anchor in enumerate(anchors):
        alone = min_visible_altitude(grid, [anchor], "fast", FLAT)
        np.testing.assert_array_equal(together.altitude_m[number], alone.altitude_m[0])
