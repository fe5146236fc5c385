"""Looking without taking: HEAD, and Range headers that can and cannot be met."""

from __future__ import annotations

from typing import Any

import pytest

from service.http.problems import MEDIA_TYPE
from tests.service.running import Server

ANCHOR = {"id": "D1", "lon_deg": -84.2392, "lat_deg": 36.3300, "above_ground_m": 150.0}


@pytest.fixture(scope="module")
def path(server: Server, jacksboro: dict[str, Any]) -> str:
    """A finished visibility map."""
    asked = {"dem_id": jacksboro["id"], "anchors": [ANCHOR]}
    answer = server.client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    return answer.headers["Location"]


def test_head_is_possible_wherever_get_is(server: Server, jacksboro: dict[str, Any], path: str) -> None:
    whole = server.client.get("/openapi.json").json()["paths"]
    plain = [at for at, operations in whole.items() if "get" in operations and "{" not in at]
    for at in [*plain, path, f"/dems/{jacksboro['id']}", f"{path}/layers/count.tif", "/problems/range"]:
        looked = server.client.head(at)
        assert (looked.status_code, looked.content) == (200, b""), at
        assert looked.headers["Content-Type"] == server.client.get(at).headers["Content-Type"], at
    assert server.client.head("/dems/nothing").status_code == 404
    assert all("head" not in operations for operations in whole.values())


BAD_RANGES = ["bytes=99999999-", "bytes=9-3", "bytes=x-y", "bytes=0-1_0", "furlongs=0-3", "nonsense", "bytes="]


@pytest.mark.parametrize("asked", BAD_RANGES)
def test_a_range_that_cannot_be_met_is_a_problem(server: Server, path: str, asked: str) -> None:
    whole = server.client.get(f"{path}/layers/count.tif")
    answer = server.client.get(f"{path}/layers/count.tif", headers={"Range": asked})
    assert answer.status_code == 416
    assert answer.headers["Content-Type"] == MEDIA_TYPE
    assert answer.headers["Content-Range"] == f"bytes */{len(whole.content)}"
    assert answer.json()["type"] == "/problems/range"
    assert f"{len(whole.content):,}" in answer.json()["detail"]
