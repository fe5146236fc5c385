"""The planner on other bodies, small screens and for those who do not see; and that nothing comes from elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import at, in_view, mission, place_anchors, settled, take

AXE = Path(__file__).parents[2] / "service" / "page" / "testing" / "axe.min.js"
MODES = ("ground", "anchors", "coverage", "path", "air", "live", "brief")
SHIFT = 8  # of DevTools' key modifiers
SERIOUS = ("serious", "critical")


def serious(page: Browser) -> list[str]:
    """What axe-core finds serious on the page as it is, by WCAG 2.2 AA."""
    tags = json.dumps(["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"])
    found = page.value(
        f"axe.run(document, {{runOnly: {tags}}}).then((told) => told.violations.map("
        "(one) => [one.impact, one.id, one.nodes.map((node) => node.html.slice(0, 120)).join(' | ')]))"
    )
    return [f"{name}: {where}" for impact, name, where in found if impact in SERIOUS]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_serious_in_any_mode(page: Browser, theme: str) -> None:
    take(page, "valley")
    place_anchors(page)
    if page.value("document.documentElement.dataset.theme") != theme:
        page.click("#theme")
    page.value(AXE.read_text(encoding="utf-8") + "; true")
    for mode in MODES:
        page.click(f"#mode-{mode}")
        settled(page)
        assert serious(page) == [], mode


def test_on_the_moon_places_have_degrees_and_unknown_ground_is_told(page: Browser) -> None:
    take(page, "crater")
    extent = page.value("planner.map.getView().getProjection().getExtent()")
    page.mouse("mouseMoved", *at(page, extent[0] + 700, (extent[1] + extent[3]) / 2))
    page.until("document.getElementById('readout').textContent.includes('-8')")
    assert "°" in page.text("#readout")
    page.mouse("mouseMoved", *at(page, (extent[0] + extent[2]) / 2, (extent[1] + extent[3]) / 2))
    page.until("document.getElementById('readout').textContent.includes('height')")


def test_places_and_areas_are_set_by_the_keyboard_alone(page: Browser) -> None:
    take(page, "valley")
    page.click("#mode-path")
    page.click("#tool-start")
    page.value("document.getElementById('map').focus()")
    page.press("Enter")
    page.until("planner.mission().route.start !== null")
    middle = page.value("planner.map.getView().getCenter()")
    route = mission(page)["route"]
    assert (route["start"]["east_m"], route["start"]["north_m"]) == pytest.approx(middle, abs=1.0)
    page.press("ArrowRight")
    page.until(f"planner.map.getView().getCenter()[0] > {middle[0]} && !planner.map.getView().getAnimating()")
    page.press("Enter")
    page.until("planner.mission().route.goal !== null")
    assert mission(page)["route"]["goal"]["east_m"] > middle[0]
    page.click("#tool-no-go")
    page.value("document.getElementById('map').focus()")
    for key, modifiers in (("Enter", 0), ("ArrowUp", 0), ("Enter", 0), ("ArrowRight", 0), ("Enter", SHIFT)):
        page.press(key, modifiers)
        page.until("!planner.map.getView().getAnimating()")
    page.until("planner.mission().route.no_go.length === 1")
    assert len(mission(page)["route"]["no_go"][0]) == 3


def test_on_a_phone_the_map_comes_first_and_nothing_is_wider_than_the_screen(page: Browser) -> None:
    take(page, "valley")
    page.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
    try:
        assert page.value("document.documentElement.scrollWidth") <= 390
        top = "document.querySelector('{}').getBoundingClientRect().top"
        assert page.value(top.format("#map")) < page.value(top.format(".inspector"))
        assert in_view(page, "#mode-brief")
        assert page.value(top.format("#map")) < 844 / 8, "the bar leaves the screen to the map"
        assert page.value("document.querySelector('#map').getBoundingClientRect().height") > 844 / 2
    finally:
        page.call("Emulation.clearDeviceMetricsOverride")


def test_nothing_comes_from_elsewhere_and_the_reference_shows_the_api(page: Browser, server: Server) -> None:
    take(page, "valley")
    hosts = "[...new Set(performance.getEntriesByType('resource').map((one) => new URL(one.name).origin))]"
    assert page.value(hosts) == [server.url.rstrip("/")]
    page.open(f"{server.url}/docs")
    page.until("document.body.innerText.includes('/visibility-maps')")
    assert page.value(hosts) == [server.url.rstrip("/")]


def test_the_air_is_a_slider_over_the_morphing_map(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-air")
    page.click("#calculate-air")
    page.until("!!document.getElementById('air-answer')")
    settled(page)
    slider = ".inspector input[type=range]"

    def share_flyable_at(height_m: int) -> float:
        page.value(
            f"(() => {{ const e = document.querySelector('{slider}'); e.value = '{height_m}'; "
            "e.dispatchEvent(new Event('input', {bubbles: true})); })()"
        )
        settled(page)
        return float(page.value("parseFloat(document.querySelector('#legend td').textContent)"))

    low, high = share_flyable_at(0), share_flyable_at(300)
    assert low < high
