"""A window of a grid is the same ground at the same place."""

import numpy as np
import pytest

from terrain import ElevationGrid, ElevationGridError, height_at


def test_a_window_keeps_posts_where_they_are():
    heights_m = np.random.default_rng(4).uniform(0.0, 90.0, (7, 9)).astype(np.float32)
    grid = ElevationGrid(heights_m, 30.0, 20.0, 500.0, 900.0, "EPSG:32611", "a datum")
    part = grid.window(2, 5, 1, 8)
    assert np.array_equal(part.heights_m, heights_m[2:6, 1:9])
    assert part.bounds_m == (530.0, 800.0, 740.0, 860.0)
    assert (part.crs, part.vertical_datum, part.provenance) == (grid.crs, grid.vertical_datum, grid.provenance)
    east_m, north_m = [541.0, 700.0], [855.0, 811.0]
    np.testing.assert_allclose(height_at(part, east_m, north_m), height_at(grid, east_m, north_m), atol=1e-6)


def test_a_window_without_posts_is_refused():
    with pytest.raises(ElevationGridError, match="with posts in it"):
        ElevationGrid(np.zeros((4, 4), np.float32), 1.0, 1.0).window(3, 2, 0, 3)
