"""Radios and trees on the planner's page: the signal of an anchor under the cursor and in the profile."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from tests.service.browser import Browser, browsing
from tests.service.running import Server
from tests.stories.planner import at, field, mission, open_planner, place_anchors, press_button, settled, take

PLACE = (648000.0, 5137000.0)
READOUT = "(document.getElementById('readout')?.textContent ?? '')"
SAVED = "document.querySelector('.keeping').textContent.includes(': saved')"
NOTE = "(document.querySelector('.drawer [role=status]')?.textContent ?? '')"


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


def signal_of_the_service(page: Browser, server: Server) -> tuple[float, float]:
    """(margin in dB, probability in per cent) of the only anchor, at the place that the read-out names."""
    kept = mission(page)
    (one,) = kept["anchors"]
    at_place = {"east_m": one["east_m"], "north_m": one["north_m"], "above_ground_m": one["height_m"]}
    east, north = re.findall(r"[EN] (\d+)", page.value(READOUT))[:2]
    body = {
        "dem_id": kept["ground"]["dem_id"],
        "anchors": [{"id": "D1", "radio": one["radio"], **at_place}],
        "points": [{"east_m": float(east), "north_m": float(north)}],
    }
    (point,) = server.client.post("/probe", json=body).json()["points"]
    heard = point["anchors"][0]["signal"]
    return heard["margin_db"], 100.0 * heard["probability"]


def signal_told(page: Browser) -> tuple[float, float]:
    """The same as the read-out tells it."""
    told = re.search(r"([+\u2212]\d+) dB, (\d+) % arrive", page.value(READOUT))
    assert told is not None
    return float(told[1].replace("\u2212", "-")), float(told[2])


def test_the_signal_of_an_anchor_with_a_radio_is_told_under_the_cursor_and_in_the_profile(
    page: Browser, server: Server
) -> None:
    take(page, "valley")
    place_anchors(page, (PLACE,))
    page.choose(field(page, "Radio"), "uwb")
    page.until("planner.mission().anchors[0].radio === 'uwb'")
    page.click("#mode-coverage")
    page.click_at(*at(page, PLACE[0] + 400.0, PLACE[1] + 100.0))
    page.until(f"{READOUT}.includes('% arrive')")
    assert signal_told(page) == pytest.approx(signal_of_the_service(page, server), abs=1.5)
    press_button(page, "Profile to D1")
    page.until(f"{NOTE}.includes('signal')")
    assert "UWB, 6.5 GHz" in page.value(NOTE)
    settled(page)
    page.until(SAVED)
    # there and back before anything is sent: the mission is saved still, and is what is opened again
    page.value("document.getElementById('undo').click()")
    page.until("planner.mission().anchors[0].radio === null")
    page.value("document.getElementById('redo').click()")
    page.until("planner.mission().anchors[0].radio === 'uwb'")
    settled(page)
    page.until(SAVED)
    page.open(page.value("location.href"))
    page.until("!!window.planner && planner.mission().anchors[0]?.radio === 'uwb'")


def test_trees_of_one_height_weaken_the_signal_and_stand_in_the_profile(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page, (PLACE,))
    page.choose(field(page, "Radio"), "868MHz")
    page.click("#mode-ground")
    page.click_at(*at(page, PLACE[0] + 400.0, PLACE[1] + 100.0))
    page.until(f"{READOUT}.includes('% arrive')")
    bare_db, _ = signal_told(page)
    page.choose(field(page, "One height everywhere, m"), "18")
    page.until("planner.mission().trees?.top_m === 18")
    page.until(f"{READOUT}.includes('% arrive') && !{READOUT}.includes('{bare_db:+.0f} dB')")
    assert signal_told(page)[0] < bare_db
    press_button(page, "Profile to D1")
    page.until(f"{NOTE}.includes('of trees')")
    assert "tops of crowns" in page.value("document.querySelector('.drawer .u-legend').textContent")
    page.choose(field(page, "Crowns begin at, m"), "30")
    page.until("(document.getElementById('refusal')?.textContent ?? '') !== ''")
    assert mission(page)["trees"]["base_m"] == 0
    page.complaints.clear()  # the refusal of crowns that begin above their tops
    page.click("#undo")
    page.until(f"planner.mission().trees === null && {READOUT}.includes('{bare_db:+.0f} dB')")
