"""A drone's flight planned on the page: ends clicked on the map, the way through the air and its files."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.service.browser import Browser, browsing
from tests.service.running import Server
from tests.stories.planner import at, field, open_planner, place_anchors, take

START, GOAL = (645600.0, 5136000.0), (650500.0, 5138500.0)
ANSWER = "(document.getElementById('flight-answer')?.textContent ?? '')"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browsing(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def page(browser: Browser, server: Server) -> Iterator[Browser]:
    open_planner(browser, server)
    browser.complaints.clear()
    yield browser
    assert browser.complaints == []


def test_a_flight_over_the_morphing_map_is_planned_between_two_clicks(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-air")
    page.click("#plan-flight")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('take-off')")
    page.click("#tool-take-off")
    page.click_at(*at(page, *START))
    page.click_at(*at(page, *GOAL))
    page.until("planner.mission().flight.goal !== null")
    page.choose(field(page, "Ceiling above ground"), "900")
    page.choose(field(page, "Height at both ends"), "600")
    page.click("#plan-flight")
    page.until(f"{ANSWER}.includes('validator passed')")
    (asked, *_) = server.client.get("/flights").json()["flights"]
    found = server.client.get(asked["links"]["self"]).json()
    assert found["result"]["totals"]["margin_m"] >= -2e-3, "above the morphing map all along"
    assert found["request"]["morphing_map"]["ceiling_above_ground_m"] == 900.0
    assert f"{found['result']['totals']['length_m'] / 1000.0:.2f} km" in page.value(ANSWER)
    files = page.value("[...document.querySelectorAll('#flight-answer a')].map((a) => a.textContent)")
    assert {"flight.geojson", "flight.csv"} <= set(files)
    assert "flight.plan is not written" in page.value(ANSWER), "the valley's heights count from nothing known"
