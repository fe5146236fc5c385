"""More anchors of usable signals found on the planner's page, and a search that is cancelled."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import at, field, mission, place_anchors, press_button, settled, shares, take

RADIO = "868MHz"
AREA = ((647000.0, 5136200.0), (649000.0, 5136200.0), (649000.0, 5137700.0), (647000.0, 5137700.0))
FOUND = "document.querySelectorAll('#found .list li').length"


def hear(page: Browser) -> None:
    """Three drones with radios over the valley, and everything of usable signals."""
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.choose(field(page, "Maps, paths"), "usable")
    page.choose(field(page, "Radio of those"), RADIO)
    settled(page)


def draw_area(page: Browser) -> None:
    """Where the mission takes place: a bend of the valley, so that few places are looked at from few."""
    page.click("#mode-ground")
    press_button(page, "Draw the area")
    for place in AREA[:-1]:
        page.click_at(*at(page, *place))
    page.click_at(*at(page, *AREA[-1]), times=2)
    page.until("planner.mission().area !== null")
    page.click("#mode-coverage")


def body_of(kept: dict[str, Any]) -> dict[str, Any]:
    """What the mission on the page is asked of the service with, without goal, candidates and number."""
    return {
        "dem_id": kept["ground"]["dem_id"],
        "anchors": [
            {name: one[name] for name in ("id", "east_m", "north_m", "radio")} | {one["height_from"]: one["height_m"]}
            for one in kept["anchors"]
        ],
        "sight": "usable",
        "radio": RADIO,
        "targets": {"receiver_above_ground_m": 1.5, "area": {"ring": kept["area"]}},
        "mode": "fast",
    }


def test_places_of_usable_signals_are_chosen_of_those_that_see_most(page: Browser, server: Server) -> None:
    hear(page)
    draw_area(page)
    page.choose(field(page, "How many"), "1")
    page.choose(field(page, "Places tried"), "sites")
    page.choose(field(page, "So many places"), "6")
    kept = mission(page)
    asked = body_of(kept)
    candidates = [{"best_sites": 6, "above_ground_m": [100.0], "area": {"ring": kept["area"]}}]
    page.click("#find-more")
    page.until(f"{FOUND} === 1")
    told = page.text("#found")
    body = {**asked, "candidates": candidates, "count": 1}
    job = server.client.post("/placements", json=body).json()
    answer = server.until_over(job["links"]["self"])["result"]
    (best,) = answer["placed"]
    assert "Chosen of 6 places that a map of sites proposed" in told
    assert answer["goal"] in told
    assert f"{answer['before_m']:.2f} m before, {answer['value_m']:.2f} m with all of them" in told
    assert f"P1 less by {best['marginal_m']:.2f} m" in told
    page.click("#map-count")
    before = shares(page)
    page.click("#map-after")
    after = shares(page)
    assert "Usable with all that were found" in page.text("#legend")
    assert after[0] < before[0], "with one more fewer places hear nobody"
    press_button(page, "Take all")
    page.until("planner.mission().anchors.length === 4")
    taken = mission(page)["anchors"][3]
    assert (taken["east_m"], taken["north_m"]) == (best["east_m"], best["north_m"])
    assert taken["radio"] == RADIO
    page.click("#map-count")
    assert shares(page) == pytest.approx(after, abs=1.0), "what was foretold is what comes"


def test_a_placement_under_way_is_cancelled_where_it_was_asked_for(page: Browser, server: Server) -> None:
    hear(page)
    before = server.client.get("/placements").json()["total"]
    page.choose(field(page, "Places every, m"), "150")  # hundreds of maps of signals
    page.click("#find-more")
    page.until("document.querySelector('.working').textContent.includes('Finding places')")
    page.until("document.getElementById('find-more').disabled")
    press_button(page, "Cancel")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('Cancelled')")
    page.until("!document.getElementById('find-more').disabled")
    assert page.value(FOUND) == 0
    # nothing of it is left with the service, and the page is free for the next
    assert server.client.get("/placements").json()["total"] == before
    settled(page)
