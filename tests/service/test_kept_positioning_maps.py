"""DOP maps and morphing maps come back from disk as they were, also those that an older Sightline kept."""

import json

import numpy as np
import pytest

from service.jobs.kept_files import load, save
from service.products import Work
from service.products.dop import DOP_MAP
from service.products.morphing import MORPHING_MAP
from service.products.registry import PRODUCTS
from tests.service.cli.positioning_words import PLACES
from tests.service.small_maps import NORTH_M, WEST_M, small_grid

ANCHORS = [
    {"id": name, "east_m": WEST_M + e, "north_m": NORTH_M + n, "above_ground_m": h}
    for name, (e, n, h) in PLACES.items()
]
PLACE = {"east_m": WEST_M + 200.0, "north_m": NORTH_M - 200.0, "above_ground_m": 2.0}
POINTS = [
    {"time_s": 0.0, "east_m": WEST_M + 100.0, "north_m": NORTH_M - 100.0, "altitude_m": 350.0},
    {"time_s": 60.0, "east_m": WEST_M + 700.0, "north_m": NORTH_M - 300.0, "altitude_m": 400.0},
]
OVER_TIME = {"tracks": [{"id": "T", "points": POINTS}], "frames": {"to_s": 60.0, "step_s": 60.0}}
MAPS = [
    (DOP_MAP, {"cuts": [{"altitude_m": 40.0}], "path": [PLACE]}, "cut-1.png"),
    (MORPHING_MAP, {"ceiling_altitude_m": 400.0, **OVER_TIME}, "animation.gif"),
]


def made(product, more):
    fields = {"anchors": ANCHORS, "dop_limit": 6.0, **more}
    return product.calculate(small_grid(), product.parameters.model_validate(fields), Work())


@pytest.mark.parametrize(("product", "more", "layer"), MAPS, ids=lambda value: getattr(value, "name", ""))
def test_a_kept_map_comes_back_the_same_and_draws_the_same(tmp_path, product, more, layer):
    finished = made(product, more)
    save(product, finished, tmp_path / "kept")
    again, loaded = load(PRODUCTS, tmp_path / "kept")
    assert again is product
    assert loaded.answer == finished.answer
    assert (loaded.anchors, loaded.parameters) == (finished.anchors, finished.parameters)
    for name in product.arrays:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(finished, name))
    for which, one in (("before", finished), ("after", loaded)):
        product.layer[layer].save(one, tmp_path / which)
    assert (tmp_path / "before").read_bytes() == (tmp_path / "after").read_bytes()


@pytest.mark.parametrize(("product", "more", "layer"), MAPS, ids=lambda value: getattr(value, "name", ""))
def test_a_map_that_an_older_sightline_kept_still_draws(tmp_path, product, more, layer):
    finished = made(product, more)
    kept = tmp_path / "kept"
    save(product, finished, kept)
    # it kept the answer in the store alone, and told some things besides the arrays
    (kept / "answer.json").unlink()
    path = kept / f"{product.name}.json"
    described = json.loads(path.read_text()) | {"format": 1, "calculation": {}, "plain": {"frame_sources": []}}
    path.write_text(json.dumps(described))
    _, loaded = load(PRODUCTS, kept, finished.answer.model_dump(mode="json"))
    assert loaded.answer == finished.answer
    for which, one in (("before", finished), ("after", loaded)):
        product.layer[layer].save(one, tmp_path / which)
    assert (tmp_path / "before").read_bytes() == (tmp_path / "after").read_bytes()
