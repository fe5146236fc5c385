"""Buildings over HTTP: in a request they hide, and what cannot be used of them is refused."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from affine import Affine
from rasterio.io import MemoryFile

from service.products.registry import PRODUCTS
from tests.service.http.test_bad_requests import assert_problem
from tests.service.http.test_every_product import posted
from tests.service.running import Server
from tests.service.small_maps import NORTH_M, WEST_M
from tests.service.small_paths import at
from tests.service.test_cover_of_products import COVER, footprints


def test_a_map_with_buildings_shows_less_and_one_without_their_heights_is_refused(
    server: Server, ground: dict[str, Any]
) -> None:
    product = PRODUCTS["visibility-map"]
    bare, built = posted(server, product, ground), posted(server, product, ground, cover=COVER)
    assert (bare.status_code, built.status_code) == (201, 201), built.text
    seen = [sum(one["visible_share"] for one in answer.json()["result"]["anchors"]) for answer in (bare, built)]
    assert seen[1] < seen[0]
    grounds = [answer.json()["result"]["dem"]["cover"] for answer in (bare, built)]
    assert (grounds[0], grounds[1]["buildings"]["solids"]) == (None, len(footprints()["features"]))
    dem = server.client.get(f"/dems/{ground['id']}").json()
    assert (dem["id"], "cover" in dem) == (ground["id"], False), "what stands on a DEM comes with requests"
    town = footprints()
    del town["features"][0]["properties"]["height"]
    refused = posted(server, product, ground, cover={"footprints": {"geojson": town}})
    assert_problem(refused, 422, "cover", "the first is way/0")


def test_answers_about_a_job_stay_short_however_long_its_request(server: Server, ground: dict[str, Any]) -> None:
    product, town = PRODUCTS["visibility-map"], footprints()
    first = town["features"][0]
    first["properties"]["note"] = "x" * 100_000
    made = posted(server, product, ground, cover={"footprints": {"geojson": town}}).json()
    answer = server.client.get(made["links"]["self"])
    assert len(answer.content) < 20_000
    told = answer.json()
    assert "cover" not in told["request"]
    assert "cover" not in told["result"]["parameters"]
    assert told["request"]["anchors"] == made["request"]["anchors"]
    whole = server.client.get(told["links"]["request"])
    assert whole.json()["cover"]["footprints"]["geojson"] == town
    again = server.client.post(product.path, json=whole.json(), headers={"Prefer": "wait=60"}).json()
    assert again["result"]["anchors"] == told["result"]["anchors"]
    assert server.client.get(f"{product.path}/nobody/request").status_code == 404
    short = posted(server, product, ground, cover=COVER).json()
    assert "cover" in short["request"]


def test_a_raster_of_trees_has_no_more_cells_than_a_dem_may_have(server: Server, ground: dict[str, Any]) -> None:
    """2,000,000 on this service; packed, the few kilobytes of it would be a DEM of any size."""
    product, refusals = PRODUCTS["visibility-map"], []
    for rows in (1999, 2001):
        with MemoryFile() as file:
            with file.open(
                driver="GTiff", width=1000, height=rows, count=1, dtype="float32", compress="deflate",
                crs="EPSG:32611", transform=Affine(1.0, 0.0, WEST_M, 0.0, -1.0, NORTH_M),
            ) as raster:  # fmt: skip
                raster.write(np.zeros((1, rows, 1000), np.float32))
            packed = base64.b64encode(file.read()).decode()
        canopy = {"heights": {"name": "trees.tif", "base64": packed}}
        refusals.append(posted(server, product, ground, cover={"canopy": canopy}))
    assert refusals[0].status_code == 201, refusals[0].text
    assert_problem(refusals[1], 422, "dem-too-large", "2,001,000 cells")
    assert "more than the limit of 2,000,000" in refusals[1].json()["detail"]


def test_lines_of_sight_are_blocked_by_buildings_and_tell_what_was_assumed(
    server: Server, ground: dict[str, Any]
) -> None:
    ends = [{**at(95.0, 229.0), "above_ground_m": 5.0}, {**at(330.0, 229.0), "above_ground_m": 2.0}]
    pairs, town = [dict(zip(("from", "to"), ends, strict=True))], footprints()
    town["features"][0]["properties"]["min_height"] = "4"
    product = PRODUCTS["lines-of-sight"]
    bare = posted(server, product, ground, pairs=pairs).json()
    built = posted(server, product, ground, pairs=pairs, cover={"footprints": {"geojson": town}}).json()
    assert [answer["lines"][0]["verdict"] for answer in (bare, built)] == ["clear", "blocked"]
    assert any("count as solid below" in warning for warning in built["result"]["warnings"])


def test_a_profile_tells_the_roofs_under_the_line(server: Server, ground: dict[str, Any]) -> None:
    ends = [{**at(95.0, 229.0), "above_ground_m": 5.0}, {**at(330.0, 229.0), "above_ground_m": 2.0}]
    body = {"dem_id": ground["id"], "pairs": [dict(zip(("from", "to"), ends, strict=True))], "max_places": 12}
    (bare,) = server.client.post("/profiles", json=body).json()["profiles"]
    (built,) = server.client.post("/profiles", json={**body, "cover": COVER}).json()["profiles"]
    assert (bare["verdict"], bare["roof_m"], built["verdict"]) == ("clear", None, "blocked")
    roofs = [(far, roof) for far, roof in zip(built["distance_m"], built["roof_m"], strict=True) if roof is not None]
    # the first block is 40 m wide and 60 m high over the ground under its middle
    assert 135.0 - 1e-3 <= roofs[0][0] <= roofs[-1][0] <= 175.0 + 1e-3
    assert roofs[0][1] == roofs[-1][1] == pytest.approx(built["blocking_point"]["altitude_m"], abs=2e-3)
    assert len(built["distance_m"]) <= 12
