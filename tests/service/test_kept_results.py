"""Results of every product on disk come back as they were and draw the same, also those that an older one kept."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.jobs.kept_files import load, save
from service.products import Product, Work
from service.products.registry import PRODUCTS
from tests.service.asked import ASKED
from tests.service.small_flights import HIGH, MAP, flight_request
from tests.service.small_maps import small_grid
from tests.service.small_paths import ACROSS, path_request

# products that keep arrays and draw later; the others write all their layers at once
KEPT = {name: ASKED[name] for name, product in PRODUCTS.items() if product.finished is not None}
CASES: Mapping[str, tuple[str, dict[str, Any]]] = {
    **{name: (name, asked) for name, asked in KEPT.items()},
    "visibility-map at an altitude": (
        "visibility-map",
        {**KEPT["visibility-map"], "receiver_altitude_m": 40.0, "curvature": "flat"},
    ),
    "path that is none": ("path", path_request(ACROSS)),
    "flight above a map": ("flight", flight_request(morphing_map=MAP, **HIGH)),
    "flight that is none": ("flight", flight_request(ceiling_altitude_m=70.0)),
}
# other pictures are drawn by the same functions, and take a second each
DRAWN = (".tif", ".csv", ".geojson", ".json", ".plan", ".gif", "cut-1.png")


@functools.cache
def result_of(case: str, crs: str | None = "EPSG:32611") -> tuple[Product, Any]:
    name, asked = CASES[case]
    product = PRODUCTS[name]
    return product, product.calculate(small_grid(crs), product.parameters.model_validate(asked), Work())


def assert_draws_the_same(product: Product, finished: Any, loaded: Any, folder: Path) -> None:
    parameters, told = finished.parameters.model_dump(mode="json"), finished.answer.model_dump(mode="json")
    layers = [layer for layer in product.layers if layer.is_of(parameters) and layer.is_in(told)]
    for layer in [layer for layer in layers if layer.name.endswith(DRAWN)]:
        layer.save(finished, folder / f"before-{layer.name}")
        layer.save(loaded, folder / f"after-{layer.name}")
        before, after = ((folder / f"{when}-{layer.name}").read_bytes() for when in ("before", "after"))
        assert before == after, layer.name


@pytest.mark.parametrize("crs", ["EPSG:32611", None])
@pytest.mark.parametrize("case", CASES)
def test_a_kept_result_comes_back_the_same_and_draws_the_same(tmp_path: Path, case: str, crs: str | None) -> None:
    product, finished = result_of(case, crs)
    save(product, finished, tmp_path / "kept")
    again, loaded = load(PRODUCTS, tmp_path / "kept")
    assert again is product
    assert loaded.answer == finished.answer
    json.dumps(loaded.answer.model_dump(mode="json"), allow_nan=False)
    assert (loaded.anchors, loaded.parameters) == (finished.anchors, finished.parameters)
    assert (loaded.grid.digest, loaded.grid.provenance) == (finished.grid.digest, finished.grid.provenance)
    assert product.arrays
    for name in product.arrays:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(finished, name))
        assert getattr(getattr(loaded, name), "dtype", None) == getattr(getattr(finished, name), "dtype", None)
    assert_draws_the_same(product, finished, loaded, tmp_path)


@pytest.mark.parametrize("case", KEPT)
def test_a_result_that_an_older_sightline_kept_still_draws(tmp_path: Path, case: str) -> None:
    product, finished = result_of(case)
    kept = tmp_path / "kept"
    save(product, finished, kept)
    # it kept the answer in the store alone, and told some things besides the arrays
    (kept / "answer.json").unlink()
    path = kept / f"{product.name}.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"format": 1, "calculation": {}, "plain": {}}))
    _, loaded = load(PRODUCTS, kept, finished.answer.model_dump(mode="json"))
    assert loaded.answer == finished.answer
    assert_draws_the_same(product, finished, loaded, tmp_path)


@pytest.mark.parametrize("case", KEPT)
def test_a_folder_without_its_description_or_of_another_format_is_no_result(tmp_path: Path, case: str) -> None:
    product, finished = result_of(case)
    save(product, finished, tmp_path)
    description = tmp_path / f"{product.name}.json"
    description.write_text(description.read_text().replace('"format": 2', '"format": 99'))
    with pytest.raises(ValueError, match="format 99"):
        load(PRODUCTS, tmp_path)
    description.unlink()
    with pytest.raises(FileNotFoundError):
        load(PRODUCTS, tmp_path)


@pytest.mark.parametrize("name", PRODUCTS)
def test_every_layer_has_a_name_of_its_own_and_a_sentence(name: str) -> None:
    product = PRODUCTS[name]
    assert len(product.layer) == len(product.layers) > 0
    assert [layer.name for layer in product.layers if not layer.description.endswith(".")] == []
