"""Whatever the service's document has with an id, and whatever asks on a ground: of another tenant's it tells nothing.

How often, in what time and behind which quotas is the subject of ``test_two_tenants``.
"""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
import rasterio

from service.access.callers import Scope
from service.access.keys import add_key
from service.jobs.marker import claimed
from service.live.request import ANCHORS
from service.products.registry import PRODUCTS
from terrain import write_npz
from tests.service.asked import ASKED
from tests.service.running import Server, running
from tests.service.small_maps import small_grid
from tests.terrain.tiles.cutting import cut_tif, rough

# what alpha has made of them; of the others its map has to serve as an id
MADE = ("visibility-map", "window-map", "path", "lines-of-sight", "navigation", "protection-levels")
METRES = rasterio.Affine(30, 0, 700_000, 0, -30, 5_100_000)
# what stands in paths besides the id, and what queries need
PARTS = {"level": "0", "row": "0", "col": "0", "version": "1"}
QUERIES = {"level": "0", "of": "offset"}
BODIES: dict[str, Any] = {
    "/epochs": {"epochs": [{"time_s": 0.0, "ranges": []}]},
    "/drive": {"path_m": [[0.0, 0.0], [10.0, 0.0]]},
    "/missions/": {"name": "mine now"},
    "/replans": {"start": {"east_m": 0.0, "north_m": 0.0}},
}
MISSING = (404, 410)


@dataclass(frozen=True)
class Two:
    """A service, a client of each tenant, and ids of what the first has, by collection."""

    server: Server
    alpha: httpx.Client
    beta: httpx.Client
    ids: dict[str, list[str]]


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Two]:
    place = tmp_path_factory.mktemp("tenants")
    folder = claimed(place / "data")
    keys = [add_key(folder / "keys.json", one, one, (Scope.CALCULATE,))[1] for one in ("alpha", "beta")]
    write_npz(small_grid(), place / "small.npz")
    tiles = cut_tif(place / "tiles", rough(50, 60, seed=3), METRES, shared=True)
    with running(folder) as server:
        alpha, beta = (
            httpx.Client(base_url=server.url, headers={"Authorization": f"Bearer {key}"}, timeout=120, trust_env=False)
            for key in keys
        )
        with alpha, beta:
            yield Two(server, alpha, beta, made_by(alpha, place / "small.npz", tiles))


def made_by(client: httpx.Client, ground: Path, tiles: list[Path]) -> dict[str, list[str]]:
    def made(path: str, **sent: Any) -> str:
        answer = client.post(path, headers={"Prefer": "wait=60"}, **sent)
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    dem = made("/dems", files={"file": ("small.npz", ground.read_bytes())})
    joined = made("/dems", files=[("file", (tile.name, tile.read_bytes())) for tile in tiles])
    mission = made("/missions", json={"name": "secret survey"})
    detector = made("/detectors", json={"anchors": ANCHORS})
    jobs = {
        product.path: [made(product.path, json={**ASKED[name], "dem_id": dem})]
        for name, product in PRODUCTS.items()
        if name in MADE
    }
    others = {product.path: jobs[PRODUCTS["visibility-map"].path] for product in PRODUCTS.values()}
    return {**others, **jobs, "/dems": [dem, joined], "/missions": [mission], "/detectors": [detector]}


def asked_with_ids(two: Two) -> Iterator[tuple[str, str, str, dict[str, str], Any]]:
    """(method, path, the id in it, query, body) of every operation that has an id, for everything of alpha's."""
    document = two.server.client.get("/openapi.json").json()
    layers = {product.path: product.layers[0].name for product in PRODUCTS.values() if product.layers}
    for path, item in document["paths"].items():
        collection = path.partition("/{")[0]
        layer = layers.get(collection, "x")
        parts = {**PARTS, "name": layer, "layer": layer}
        for method, operation in item.items() if collection in two.ids else ():
            needed = [
                one["name"] for one in operation.get("parameters", ()) if one["in"] == "query" and one["required"]
            ]
            body = next((body for part, body in BODIES.items() if part in path and method != "get"), None)
            for id in two.ids[collection]:
                filled = re.sub(r"\{\w+\}", id, path, count=1)
                for part, value in parts.items():
                    filled = filled.replace(f"{{{part}}}", value)
                assert "{" not in filled, path
                if filled != path:
                    yield method.upper(), filled, id, {name: QUERIES[name] for name in needed}, body
                    if method == "get":
                        yield "HEAD", filled, id, {name: QUERIES[name] for name in needed}, None


def test_every_path_with_an_id_is_to_others_as_if_nobody_had_it(two: Two) -> None:
    number, chance = 0, random.Random(18)
    for method, path, id, query, body in asked_with_ids(two):
        nobodys = f"{chance.getrandbits(128):032x}"
        headers = {} if method in ("GET", "HEAD") else {"If-Match": "*"}
        told = [
            two.beta.request(method, path.replace(id, one), params=query, json=body, headers=headers)
            for one in (id, nobodys)
        ]
        answers = [(one.status_code, one.text.replace(id, "ID").replace(nobodys, "ID")) for one in told]
        assert answers[0] == answers[1], (method, path)
        assert answers[0][0] in MISSING, (method, path, answers[0])
        number += 1
    assert number > 150


@pytest.mark.parametrize("name", ASKED)
def test_no_product_is_calculated_on_the_ground_of_another(two: Two, name: str) -> None:
    nobodys = f"{random.Random(name).getrandbits(128):032x}"
    for dem_id in two.ids["/dems"]:
        told = [two.beta.post(PRODUCTS[name].path, json={**ASKED[name], "dem_id": one}) for one in (dem_id, nobodys)]
        answers = [(one.status_code, one.text.replace(dem_id, "ID").replace(nobodys, "ID")) for one in told]
        assert answers[0] == answers[1]
        assert answers[0][0] == 404


def test_a_map_or_a_detector_of_another_is_none_to_plan_on(two: Two) -> None:
    dem = two.beta.post("/dems", params={"sample": "valley"}).raise_for_status().json()
    nobodys = "5" * 32
    for name, field, theirs in (
        ("path", "map_id", two.ids["/visibility-maps"][0]),
        ("repositioning", "detector_id", two.ids["/detectors"][0]),
    ):
        asked = {key: value for key, value in ASKED[name].items() if key not in ("morphing_map", "occluded")}
        told = [
            two.beta.post(PRODUCTS[name].path, json={**asked, "dem_id": dem["id"], field: one})
            for one in (theirs, nobodys)
        ]
        answers = [(one.status_code, one.text.replace(theirs, "ID").replace(nobodys, "ID")) for one in told]
        assert answers[0] == answers[1], (name, answers)
        assert answers[0][0] in (404, 410, 422), (name, answers[0])


def test_lists_are_each_ones_own_also_from_a_place_of_anothers_on(two: Two) -> None:
    for path in two.ids:
        mine = two.alpha.get(path, params={"limit": 1}).json()
        has = path in ("/dems", "/missions", "/detectors") or any(PRODUCTS[name].path == path for name in MADE)
        assert mine["total"] > 0 if has else mine["total"] == 0
        for query in ({}, {"cursor": mine["next"]} if mine.get("next") else {}):
            theirs = two.beta.get(path, params=query).json()
            assert not {id for ids in two.ids.values() for id in ids if id in json.dumps(theirs)}, path


def test_alpha_still_has_all_of_it(two: Two) -> None:
    for path, ids in two.ids.items():
        product = next((one for one in PRODUCTS.values() if one.path == path), None)
        if product is None or product.name in MADE:
            assert [two.alpha.get(f"{path}/{id}").status_code for id in ids] == [200] * len(ids), path
