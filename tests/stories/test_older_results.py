"""What was calculated outlives a restart, of every product, and so do results that an older Sightline stored."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.products import Product
from service.products.registry import PRODUCTS
from terrain import write_npz
from tests.service.asked import ASKED
from tests.service.running import Server, running
from tests.service.small_maps import small_grid

# a field of its result that came later, or might have
LATER = dict.fromkeys(PRODUCTS, "error_statement") | {
    "visibility-map": "undecided_posts",
    "lines-of-sight": "curvature",
    "navigation": "lever_arm_m",
}
Stored = dict[str, tuple[dict[str, Any], dict[str, bytes]]]


def forget(database: Path) -> None:
    """Take a field out of every stored result, as if it were written before the field existed."""
    connection = sqlite3.connect(database)
    for job_id, kind, summary in connection.execute("SELECT id, kind, summary FROM jobs").fetchall():
        older: dict[str, Any] = json.loads(summary)
        del older[LATER[kind]]
        connection.execute("UPDATE jobs SET summary = ? WHERE id = ?", (json.dumps(older), job_id))
    connection.commit()
    connection.close()


def layers_of(server: Server, job: dict[str, Any]) -> dict[str, bytes]:
    names = [layer["href"] for layer in job["layers"] if not layer["name"].endswith((".png", ".gif"))]
    return {name: server.client.get(name).raise_for_status().content for name in names}


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Stored]:
    """A data folder that holds a result of every product, and what was answered of each; layers are drawn of half."""
    folder = tmp_path_factory.mktemp("stored") / "data"
    write_npz(small_grid(), folder.parent / "small.npz")
    told: Stored = {}
    with running(folder, workers=1) as server:
        dem_id = server.upload(folder.parent / "small.npz")["id"]
        for number, (name, product) in enumerate(PRODUCTS.items()):
            asked = {"dem_id": dem_id, **ASKED[name]}
            answer = server.client.post(product.path, json=asked, headers={"Prefer": "wait=60"}, timeout=120.0)
            assert answer.status_code == 201, answer.text
            told[name] = answer.json(), layers_of(server, answer.json()) if number % 2 == 0 else {}
    return folder, told


@pytest.fixture(scope="module")
def again(stored: tuple[Path, Stored]) -> Iterator[Server]:
    with running(stored[0], workers=1) as server:
        yield server


@pytest.fixture(scope="module")
def older(stored: tuple[Path, Stored], again: Server) -> Iterator[Server]:
    """The service on the same folder, whose store lacks a field of every result."""
    again.stop()
    forget(stored[0] / "sightline.sqlite3")
    with running(stored[0], workers=1) as server:
        yield server


@pytest.mark.parametrize("product", PRODUCTS.values(), ids=list(PRODUCTS))
def test_a_result_outlives_a_restart(again: Server, stored: tuple[Path, Stored], product: Product) -> None:
    told, layers = stored[1][product.name]
    assert again.client.get(told["links"]["self"]).json() == told
    for href, content in (layers or layers_of(again, told)).items():
        assert again.client.get(href).raise_for_status().content == content


@pytest.mark.parametrize("product", PRODUCTS.values(), ids=list(PRODUCTS))
def test_a_result_without_a_field_that_came_later_is_told_as_it_is(
    older: Server, stored: tuple[Path, Stored], product: Product
) -> None:
    told, layers = stored[1][product.name]
    answer = older.client.get(told["links"]["self"])
    assert answer.status_code == 200, answer.text
    expected = {name: value for name, value in told["result"].items() if name != LATER[product.name]}
    assert answer.json() == {**told, "result": expected}
    (listed,) = older.client.get(product.path).json()[product.plural]
    assert listed["links"]["self"] == told["links"]["self"]
    assert layers_of(older, told).keys() >= layers.keys()
