"""Buildings and trees of results that are read again, and depths of canopy by direction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from pydantic import ValidationError

from service.ground.levels import at_level
from service.jobs.kept_cover import save_cover, with_kept_cover
from service.jobs.kept_files import load, save
from service.parts.cover import CoverParameters, covered
from service.parts.cover_told import cover_told
from service.products.registry import PRODUCTS
from terrain import ElevationGrid
from tests.service.small_maps import small_grid
from tests.service.small_paths import at
from tests.service.test_cover_of_products import COVER, footprints
from tests.service.test_signals_of_products import finished, grid_point
from visibility.cover import Canopy
from visibility.signal import RADIOS, Foliage, foliage_of, signals, with_foliage

SKY = {"elevation_edges_deg": [0.0, 20.0, 90.0], "depth_per_m": [[0.01, 0.02], [0.03, 0.04]]}


def test_a_result_that_is_read_again_stands_under_the_same_buildings_and_trees(tmp_path: Path) -> None:
    cover = {**COVER, "canopy": {"top_m": 12.0, "base_m": 1.0, "model": "density", "sky": SKY}}
    found = finished("visibility-map", cover=cover)
    save(PRODUCTS["visibility-map"], found, tmp_path / "kept")
    _, again = load(PRODUCTS, tmp_path / "kept")
    assert again.grid.digest == found.grid.digest != small_grid().digest
    assert again.answer.dem.cover == found.answer.dem.cover
    assert (again.answer.dem.cover.canopy.by_direction, again.answer.dem.cover.canopy.mean_top_m) == (True, 12.0)
    assert again.answer.dem.cover.buildings.solids == len(footprints()["features"])


def densities(grid: ElevationGrid) -> npt.NDArray[np.float32]:
    assert grid.trees is not None
    assert grid.trees.density_per_m is not None
    return grid.trees.density_per_m


def test_a_density_at_each_post_is_kept_thinned_and_cut_with_its_trees(tmp_path: Path) -> None:
    grid = small_grid()
    density = np.arange(grid.heights_m.size, dtype=np.float32).reshape(grid.shape) / 1000.0
    twelve_m = np.full(grid.shape, 12.0, np.float32)
    wooded = with_foliage(grid, Foliage(Canopy(grid, twelve_m, 0.0 * twelve_m, density_per_m=density), "density"))
    plain = with_foliage(grid, Foliage(Canopy(grid, twelve_m, 0.0 * twelve_m), "density", 0.01))
    assert wooded.digest != plain.digest
    told = save_cover(wooded, tmp_path)
    np.testing.assert_array_equal(densities(with_kept_cover(grid, tmp_path, told)), density)
    np.testing.assert_array_equal(densities(wooded.window(2, 9, 4, 19)), density[2:10, 4:20])
    np.testing.assert_allclose(densities(at_level(wooded, 1))[0, 0], density[:2, :2].mean(), rtol=1e-6)
    assert foliage_of(with_kept_cover(grid, tmp_path, told)) is not None
    cover = cover_told(wooded)
    assert cover is not None
    assert cover.canopy is not None
    assert cover.canopy.mean_density_per_m == pytest.approx(float(density.mean()))
    assert "of 0.359/m in the mean" in dict(cover.sentences())["  its cost"]


def test_depths_by_direction_weaken_by_where_the_way_leads_up() -> None:
    canopy = {"top_m": 30.0, "model": "density", "sky": SKY}
    grid = covered(small_grid("EPSG:32611"), CoverParameters.model_validate({"cover": {"canopy": canopy}}))
    low_m = np.array(grid_point(grid, {**at(450.0, 229.0), "above_ground_m": 2.0}))
    # up to the east and to the west, by less than 20° and by more: sectors begin at north, each half a turn
    reach_m = np.array([(60.0, 0.0, 10.0), (-60.0, 0.0, 10.0), (20.0, 0.0, 25.0), (-20.0, 0.0, 25.0)])
    ends_m = low_m + reach_m
    found = signals(grid, np.broadcast_to(low_m, ends_m.shape), ends_m, RADIOS["868MHz"])
    back = signals(grid, ends_m, np.broadcast_to(low_m, ends_m.shape), RADIOS["868MHz"])
    per_m = found.canopy_db / found.canopy_m / (10.0 / np.log(10.0))
    np.testing.assert_allclose(per_m, [0.01, 0.02, 0.03, 0.04])
    np.testing.assert_allclose(back.canopy_db, found.canopy_db)
    for wrong, sentence in (
        ({"elevation_edges_deg": [20.0, 0.0]}, "ascending edges"),
        ({"depth_per_m": [[0.01], [0.02, 0.03]]}, "equally many sectors"),
    ):
        with pytest.raises(ValidationError, match=sentence):
            CoverParameters.model_validate({"cover": {"canopy": {**canopy, "sky": {**SKY, **wrong}}}})
