"""More anchors found by rules that were drawn on the planner's map, and what each place would see as a layer."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import LineString, Point, Polygon

import dem_samples
from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import at, field, mission, place_anchors, settled, shares, take

FORBIDDEN = ((645000.0, 5135200.0), (648000.0, 5135200.0), (648000.0, 5139600.0), (645000.0, 5139600.0))
ROAD = ((650800.0, 5135400.0), (650800.0, 5139400.0))
APART_M = 900.0


def draw(page: Browser, tool: str, places: tuple[tuple[float, float], ...]) -> None:
    """Click the corners, the last one twice."""
    page.click(f"#tool-{tool}")
    page.until(f"document.getElementById('tool-{tool}').getAttribute('aria-pressed') === 'true'")
    for place in places[:-1]:
        page.click_at(*at(page, *place))
    page.click_at(*at(page, *places[-1]), times=2)
    page.until(f"document.getElementById('tool-{tool}').getAttribute('aria-pressed') === 'false'")


def find(page: Browser, number: int) -> list[tuple[float, float]]:
    """Where the places lie that were found, once all are taken."""
    before = len(mission(page)["anchors"])
    page.click("#find-more")
    page.until(f"document.querySelectorAll('#found .list li').length === {number}")
    page.value("[...document.querySelectorAll('#found button')].find((b) => b.textContent === 'Take all').click()")
    page.until(f"planner.mission().anchors.length === {before + number}")
    return [(one["east_m"], one["north_m"]) for one in mission(page)["anchors"][before:]]


def test_places_that_are_found_keep_the_rules_that_were_drawn(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.click("#rules")
    draw(page, "no-fly", FORBIDDEN)
    draw(page, "stand-off", ROAD)
    page.choose(field(page, "Stand-off 1, m"), str(APART_M))
    page.choose(field(page, "Apart, at least, m"), "400")
    page.choose(field(page, "How many"), "4")
    rules = mission(page)["rules"]
    no_fly = Polygon([(one["east_m"], one["north_m"]) for one in rules["no_fly"][0]])
    road = LineString([(one["east_m"], one["north_m"]) for one in rules["stand_off"][0]["places"]])
    found = [Point(place) for place in find(page, 4)]
    assert all(not no_fly.contains(place) for place in found)
    assert all(road.distance(place) >= APART_M for place in found)
    assert all(one.distance(two) >= 400.0 for one in found for two in found if one is not two)
    # they are one step of undo each, and the rules can be taken away again
    page.click("#undo")
    assert len(mission(page)["anchors"]) == 6


def test_the_map_before_and_after_and_the_ceiling(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.click("#find-more")
    page.until("document.querySelectorAll('#found .list li').length === 2")
    page.click("#map-count")
    before = shares(page)
    page.click("#map-after")
    after = shares(page)
    assert sum(after) == pytest.approx(100.0, abs=0.5)
    assert after[0] < before[0], "with more anchors fewer places see nobody"
    page.value("[...document.querySelectorAll('#found button')].find((b) => b.textContent === 'Take all').click()")
    page.click("#map-count")
    assert shares(page) == pytest.approx(after, abs=0.3), "what was foretold is what comes"
    page.click("#rules")
    heights_m = dem_samples.load_sample("valley").heights_m
    ceiling_m, sought_m = 800.0, 100.0
    page.choose(field(page, "Ceiling, altitude"), str(ceiling_m))
    page.click("input[value=ceiling]")
    assert shares(page)[0] == pytest.approx(100.0 * np.mean(heights_m + sought_m <= ceiling_m), abs=0.1)
    page.choose(field(page, "Ceiling above ground"), str(sought_m - 1.0))
    assert shares(page)[0] == 0.0


def test_places_for_the_least_error_are_those_of_who_names_no_objective(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.choose(field(page, "Places every"), "500")
    page.click("#find-more")
    page.until("document.querySelectorAll('#found .list li').length === 2")
    told = page.text("#found p")
    assert page.text("#found .hint").startswith("Chosen of ")
    assert "of a lattice" in page.text("#found .hint")
    kept = mission(page)
    names = ("id", "east_m", "north_m")
    body = {
        "dem_id": kept["ground"]["dem_id"],
        "anchors": [
            {**{name: one[name] for name in names}, one["height_from"]: one["height_m"]} for one in kept["anchors"]
        ],
        "candidates": [{"spacing_m": 500.0, "above_ground_m": [100.0]}],
        "targets": {"receiver_above_ground_m": 1.5},
        "count": 2,
        "mode": "fast",
    }
    found = server.client.post("/placements", json=body, headers={"Prefer": "wait=60"}).json()["result"]
    assert found["value_m"] < found["before_m"]
    assert f"{found['before_m']:.2f} m before, {found['value_m']:.2f} m with all of them" in told
    assert f"falls below {found['bound_m']:.2f} m" in told
    least = [f"P{number} less by {one['marginal_m']:.2f} m" for number, one in enumerate(found["placed"], start=1)]
    assert page.value("[...document.querySelectorAll('#found .list span')].map((one) => one.innerText)") == least


def test_what_each_place_would_see_is_a_layer(page: Browser, server: Server) -> None:
    take(page, "valley")
    page.click("#mode-coverage")
    page.click("#find-sites")
    page.until("document.querySelector('input[value=sites]')?.checked")
    told = shares(page)
    assert sum(told) == pytest.approx(100.0, abs=0.5)
    body = {
        "dem_id": mission(page)["ground"]["dem_id"],
        "site_above_ground_m": 100.0,
        "receiver_above_ground_m": 1.5,
        "sites": 0,
    }
    answer = server.client.post("/site-maps", json=body, headers={"Prefer": "wait=60"}).json()
    # the legend's first border is a fifth of the most that any place sees
    fifth = 20.0 * answer["result"]["seen_share_quantiles"]["most"]
    first = page.text("#legend tbody th").split("<")[1]
    assert float(first.split("%")[0]) == pytest.approx(fifth, abs=0.06)
    page.choose(field(page, "Height above ground, m"), "20")
    page.until("!!document.querySelector('.inspector .stale-note')")
    settled(page)


@pytest.mark.parametrize("remedy", ["Add", "Move"])
def test_a_path_that_anchors_block_is_opened_by_anchors_that_were_tried(page: Browser, remedy: str) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, 645600.0, 5136000.0))
    page.click_at(*at(page, 650500.0, 5138500.0))
    page.choose(field(page, "Steepest"), "30")
    page.choose(field(page, "Anchors in sight"), "3")
    page.click("#plan-path")
    offered = f"[...document.querySelectorAll('#remedies li')].find((one) => one.innerText.startsWith('{remedy} '))"
    page.until(f"!!{offered}")
    told = page.value(f"{offered}.innerText")
    before = mission(page)["anchors"]
    page.value(f"{offered}.querySelector('button').click()")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    after = mission(page)["anchors"]
    if remedy == "Add":
        assert after[: len(before)] == before
        assert 1 <= len(after) - len(before) <= 2
    else:
        changed = [new for old, new in zip(before, after, strict=True) if new != old]
        assert 1 <= len(changed) <= len(before)
        for one in changed:
            assert f"{one['id']} to E {one['east_m']:.0f} N {one['north_m']:.0f}" in told
    page.click("#undo")
    assert mission(page)["anchors"] == before
    # the start was refused at first, for too few anchors are in sight of it
    assert all("422" in complaint for complaint in page.complaints)
    page.complaints.clear()
