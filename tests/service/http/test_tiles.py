"""Raster layers of results as bare numbers: every level and tile is what the GeoTIFF holds there."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import rasterio

from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server


@pytest.fixture(scope="module")
def job(server: Server) -> dict[str, Any]:
    dem = server.sample("jacksboro")
    anchors = [{"id": "A", "east_m": 740000.0, "north_m": 4030000.0, "above_ground_m": 60.0}]
    body = {"dem_id": dem["id"], "site_above_ground_m": 10.0, "max_range_m": 900.0, "sites": 0}
    sites = server.client.post("/site-maps", json=body, headers={"Prefer": "wait=60"}).json()
    sight = server.client.post(
        "/visibility-maps", json={"dem_id": dem["id"], "anchors": anchors}, headers={"Prefer": "wait=60"}
    ).json()
    return {"seen.tif": sites, "count.tif": sight}


def bands_of(server: Server, here: str, layer: str) -> npt.NDArray[Any]:
    """As another library reads the layer's own file."""
    with rasterio.open(io.BytesIO(server.client.get(f"{here}/layers/{layer}").content)) as source:
        return source.read()


@pytest.mark.parametrize("layer", ["seen.tif", "count.tif"])
def test_levels_and_tiles_are_the_values_of_the_layer(server: Server, job: dict[str, Any], layer: str) -> None:
    here = job[layer]["links"]["self"]
    told = server.client.get(f"{here}/tiles/{layer}").json()
    whole = bands_of(server, here, layer)
    assert (len(told["bands"]), np.dtype(told["data_type"])) == (len(whole), whole.dtype)
    assert [(one["level"], one["rows"], one["cols"]) for one in told["levels"]] == [(0, 353, 415), (1, 177, 208)]
    for level in told["levels"]:
        picked = whole[:, :: 2 ** level["level"], :: 2 ** level["level"]]
        assert server.client.get(level["href"]).content == picked.tobytes()
        for row in range(-(-level["rows"] // 256)):
            for col in range(-(-level["cols"] // 256)):
                tile = picked[:, 256 * row : 256 * row + 256, 256 * col : 256 * col + 256]
                assert server.client.get(f"{level['href']}/{row}/{col}").content == tile.tobytes()


def test_what_is_not_there_is_told_and_what_is_known_is_not_sent_again(server: Server, job: dict[str, Any]) -> None:
    here = job["seen.tif"]["links"]["self"]
    assert_problem(server.client.get(f"{here}/tiles/seen.tif/2"), 404, "not-found", "levels 0 to 1")
    assert_problem(server.client.get(f"{here}/tiles/seen.tif/0/2/0"), 404, "not-found", "2 rows and 2 columns")
    assert_problem(server.client.get(f"{here}/tiles/sites.csv/0"), 404, "not-found", "raster layer")
    first = server.client.get(f"{here}/tiles/seen.tif/1")
    again = server.client.get(f"{here}/tiles/seen.tif/1", headers={"If-None-Match": first.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")
    part = server.client.get(f"{here}/tiles/seen.tif/1", headers={"Range": "bytes=8-15"})
    assert (part.status_code, part.content) == (206, first.content[8:16])
