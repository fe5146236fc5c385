"""Buildings on the planner's page: taken from a file, hiding on the map and in the profile, and taken away again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import dem_samples
from terrain import to_lon_lat
from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import (
    at,
    field,
    in_view,
    let_go,
    mission,
    place_anchors,
    press_button,
    settled,
    shares,
    take,
)

HIGH_M, WALL = 90.0, ((647000.0, 5136800.0), (649200.0, 5136900.0))
BEHIND = (648000.0, 5137000.0)


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """A long hall that tells no height, and a road."""
    grid = dem_samples.load_sample("valley")
    (west, south), (east, north) = WALL
    corners = [(west, south), (east, south), (east, north), (west, north), (west, south)]
    ring = [list(to_lon_lat(grid, *corner)) for corner in corners]
    shapes: list[tuple[dict[str, Any], dict[str, Any]]] = [
        ({"building": "yes", "note": "a hall"}, {"type": "Polygon", "coordinates": [ring]}),
        ({"highway": "track"}, {"type": "LineString", "coordinates": ring[:2]}),
    ]
    features = [{"type": "Feature", "properties": tags, "geometry": shape} for tags, shape in shapes]
    path = tmp_path / "town.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_buildings_of_a_file_hide_on_the_map_and_stand_in_the_profile(
    page: Browser, server: Server, town: Path
) -> None:
    take(page, "valley")
    place_anchors(page)
    bare = shares(page)
    page.click("#mode-ground")
    page.upload("#buildings-file", town)
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('height')")
    assert in_view(page, "#refusal")
    assert mission(page)["buildings"] is None
    page.choose(field(page, "Where no height is told"), str(HIGH_M))
    page.until("planner.mission().buildings !== null")
    page.until("document.querySelector('.inspector').textContent.includes('1 building of town.geojson')")
    page.complaints.clear()  # the refusal of a hall without a height
    built = shares(page)
    assert built[0] > bare[0], "more places see nobody"
    kept = mission(page)
    body = {
        "dem_id": kept["ground"]["dem_id"],
        "anchors": [
            {"id": one["id"], "east_m": one["east_m"], "north_m": one["north_m"], "above_ground_m": one["height_m"]}
            for one in kept["anchors"]
        ],
        "receiver_above_ground_m": 1.5,
        "cover": {"footprints": {"geojson": kept["buildings"]["geojson"], "default_height_m": HIGH_M}},
    }
    answer = server.client.post("/visibility-maps", json=body, headers={"Prefer": "wait=60"}).json()
    assert built[0] == pytest.approx(100.0 * answer["result"]["count_histogram"][0]["share"], abs=0.3)
    page.click_at(*at(page, *BEHIND))
    press_button(page, "Profile to D1")
    page.until("(document.querySelector('.drawer .u-legend')?.textContent ?? '').includes('roofs')")
    page.click("#undo")
    page.until("planner.mission().buildings === null")
    assert shares(page) == pytest.approx(bare, abs=0.05)


def test_footprints_let_go_on_the_page_are_buildings_and_outlive_it(page: Browser, town: Path) -> None:
    take(page, "valley")
    page.choose(field(page, "Where no height is told"), "12")
    let_go(page, [town])
    told = "(document.getElementById('notice')?.textContent ?? '')"
    page.until(f"{told}.includes('1 building; 1 other shape was passed over')")
    settled(page)
    page.open(page.value("location.href"))
    page.until("!!window.planner && planner.mission().buildings?.default_height_m === 12")
    page.until("!!document.getElementById('drop-buildings')")
    page.click("#drop-buildings")
    page.until("planner.mission().buildings === null")
