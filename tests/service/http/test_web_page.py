"""The planner at the bare address and the reference: their files; and the pictures and legends of maps."""

from __future__ import annotations

import io
import re
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

import dem_samples
from service.http.web_page import BUILT
from tests.service.running import Server

PAGE = BUILT.parent
ANCHORS = [
    {"id": name, "lon_deg": lon_deg, "lat_deg": lat_deg, "above_ground_m": 150.0}
    for name, lon_deg, lat_deg in (("D1", -84.2392, 36.33), ("D2", -84.1443, 36.3836), ("D3", -84.1107, 36.2963))
]


def asked(server: Server, kind: str, dem: dict[str, Any], **more: Any) -> dict[str, httpx.Response]:
    """The layers of a finished map, and itself as "map"."""
    answer = server.client.post(
        f"/{kind}", json={"dem_id": dem["id"], "anchors": ANCHORS, **more}, headers={"Prefer": "wait=60"}
    )
    assert answer.status_code == 201, answer.text
    at = {layer["name"]: layer["href"] for layer in answer.json()["layers"]}
    return {"map": answer, **{name: server.client.get(at[name]) for name in ("overlay.png", "legend.json")}}


def pixels(answer: httpx.Response) -> np.ndarray:
    assert answer.headers["Content-Type"] == "image/png"
    return np.asarray(Image.open(io.BytesIO(answer.content)))


@pytest.mark.parametrize(("path", "script"), [("/", "/page/index.js"), ("/docs", "/page/docs.js")])
def test_planner_and_reference_are_built_pages_that_load_only_their_own(server: Server, path: str, script: str) -> None:
    answer = server.client.get(path)
    assert answer.status_code == 200
    assert answer.headers["Content-Type"].startswith("text/html")
    head = server.client.head(path)
    assert (head.status_code, head.content) == (200, b"")
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert "unsafe" not in answer.headers["Content-Security-Policy"]
    references = re.findall(r'(?:src|href)="([^"]*)"', answer.text)
    assert script in references
    assert [one for one in references if not one.startswith(("/page/", "data:,"))] == []


@pytest.mark.parametrize("name", sorted(path.name for path in BUILT.iterdir()))
def test_every_file_of_the_page_is_served(server: Server, name: str) -> None:
    answer = server.client.get(f"/page/{name}")
    assert answer.status_code == 200
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["Cache-Control"] == "no-cache"
    # one that is kept packed comes out as the script that it is
    if name.endswith(".js.gz"):
        assert answer.headers["Content-Type"].startswith("text/javascript")
        assert b"SwaggerUIBundle" in answer.content


@pytest.mark.parametrize("path", ["/page/nothing.js", "/page/", "/page/../app.py", "/page/%2e%2e/package.json"])
def test_beside_the_page_there_is_nothing(server: Server, path: str) -> None:
    answer = server.client.get(path)
    assert answer.status_code == 404
    assert answer.headers["Content-Type"] == "application/problem+json"


def test_the_page_offers_the_bundled_grounds() -> None:
    offered = re.search(r"SAMPLES = \[(.*?)\]", (PAGE / "src" / "api" / "dems.ts").read_text(encoding="utf-8"))
    assert offered is not None
    assert sorted(re.findall(r'"(\w+)"', offered[1])) == sorted(dem_samples.sample_names())


def test_a_hillshade_shows_light_and_shade_and_is_clear_over_unknown_ground(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    answer = server.client.get(jacksboro["links"]["hillshade"])
    shown = pixels(answer)
    rows, cols = jacksboro["rows"], jacksboro["cols"]
    assert shown.shape[0] * cols == shown.shape[1] * rows
    clear = shown[..., 3] == 0
    assert clear.mean() == pytest.approx(jacksboro["unknown_posts"] / (rows * cols), abs=1e-9)
    light = shown[~clear][:, 0]
    assert int(np.percentile(light, 95)) - int(np.percentile(light, 5)) > 60
    again = server.client.get(jacksboro["links"]["hillshade"], headers={"If-None-Match": answer.headers["ETag"]})
    assert again.status_code == 304


def test_nobody_sees_a_ground_that_is_not_there(server: Server) -> None:
    answer = server.client.get(f"/dems/{'0' * 32}/hillshade.png")
    assert answer.status_code == 404
    assert answer.json()["type"] == "/problems/not-found"


def test_the_legend_of_a_visibility_map_counts_what_the_map_counts(server: Server, jacksboro: dict[str, Any]) -> None:
    answers = asked(server, "visibility-maps", jacksboro)
    legend, result = answers["legend.json"].json(), answers["map"].json()["result"]
    told = {kind["label"]: kind["posts"] for kind in legend["classes"] if kind["posts"] is not None}
    # surely nobody is in sight of these; the histogram counts those that may see somebody among them
    told["0"] += told.pop("unknown", 0)
    assert told == {str(share["visible_anchors"]): share["posts"] for share in result["count_histogram"]}
    assert sum(kind["share"] or 0.0 for kind in legend["classes"]) == pytest.approx(1.0)
    assert_colours_are_those_of(answers)


def test_the_legend_of_a_dop_map_counts_what_the_map_counts(server: Server, jacksboro: dict[str, Any]) -> None:
    answers = asked(server, "dop-maps", jacksboro, dop_limit=4.0)
    legend, result = answers["legend.json"].json(), answers["map"].json()["result"]
    assert legend["title"] == "PDOP"
    within = sum(kind["share"] for kind in legend["classes"][:3])
    assert within == pytest.approx(result["share_within_limit"], abs=1e-9)
    assert_colours_are_those_of(answers)


def assert_colours_are_those_of(answers: dict[str, httpx.Response]) -> None:
    """Relief darkens a colour and keeps its hue, so each class has pixels as bright as the legend, about its share."""
    shown = pixels(answers["overlay.png"])
    colours = shown[shown[..., 3] == 255][:, :3].astype(float)
    legend = answers["legend.json"].json()
    kinds = [kind for kind in legend["classes"] if kind["posts"] is not None and kind["label"] != "unknown"]
    table = np.array([[int(kind["colour"][i : i + 2], 16) for i in (1, 3, 5)] for kind in kinds], float)
    hue = table / np.linalg.norm(table, axis=1, keepdims=True)
    nearest = np.argmax(colours @ hue.T, axis=1)
    for number, kind in enumerate(kinds):
        assert np.mean(nearest == number) == pytest.approx(kind["share"], abs=0.03), kind
