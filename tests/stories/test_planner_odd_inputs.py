"""What is odd, wrong or hostile on the planner: a clear sentence each, no error in the console, nothing lost."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.service.browser import CONTROL, Browser
from tests.service.running import Server, running
from tests.stories.planner import VALLEY, at, field, mission, open_planner, place_anchors, press_button, settled, take

REFUSAL = "(document.getElementById('refusal')?.textContent ?? '')"
# a browser that keeps nothing, as one does that was told to take no cookies
KEEPS_NOTHING = """for (const name of ["localStorage", "sessionStorage"])
  Object.defineProperty(window, name, { get() { throw new DOMException("Access is denied.", "SecurityError"); } });"""
NO_WEBGL = """for (const kind of [HTMLCanvasElement, OffscreenCanvas]) {
  const before = kind.prototype.getContext;
  kind.prototype.getContext = function (name, ...more) {
    return /webgl|webgpu/.test(name) ? null : before.call(this, name, ...more);
  };
}"""
# characters until a browser's room for one origin is full
FILL = """(() => { let text = "x".repeat(1 << 20); for (let n = 0; text.length > 0; )
  try { localStorage.setItem(`full ${n}`, text); n += 1; } catch { text = text.slice(0, text.length >> 1); } })()"""
QUICK: dict[str, Any] = {"workers": 1, "spare_workers": 0, "rehearse": "maps"}


@pytest.fixture
def page(browser: Browser, server: Server) -> Iterator[Browser]:
    """The page as it opens for the first time; of errors its console has told what the service refused alone."""
    open_planner(browser, server)
    browser.complaints.clear()
    yield browser
    told, refused = list(browser.complaints), "the server responded with a status of 4"
    browser.complaints.clear()
    assert [one for one in told if refused not in one] == []


@pytest.fixture
def before(browser: Browser) -> Iterator[Any]:
    """Have the page meet something before any of its own scripts runs, from the next time it opens to the end."""
    told = []

    def meet(script: str) -> None:
        told.append(browser.call("Page.addScriptToEvaluateOnNewDocument", source=script)["identifier"])

    yield meet
    for one in told:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=one)


def sentences(page: Browser) -> list[str]:
    """What is told as refused, whichever part of the page refused it."""
    return list(page.value("[...document.querySelectorAll('.told .refusal')].map((one) => one.textContent)"))


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("folder.tif", None, "folder"),
        ("empty.tif", b"", "empty"),
        ("picture.png", b"\x89PNG\r\n\x1a\n" + 64 * b"\0", "picture.png"),
        ("notes.json", b"[1, 2, 3]", "notes.json is no mission"),
        ("broken.json", b"{", "broken.json is no mission"),
        ("no.zip", b"PK\x03\x04 nothing", "no.zip is no mission"),
        ("broken.kml", b"<kml", "broken.kml"),
        ("broken.plan", b"{}", "broken.plan"),
    ],
)
def test_a_file_of_a_wrong_kind_is_told_where_one_looks(
    page: Browser, tmp_path: Path, name: str, content: bytes | None, told: str
) -> None:
    take(page, "valley")
    page.click("#mode-coverage")
    kept = mission(page)
    path = tmp_path / name
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    page.let_go([path], *page.place("#map"))
    page.until(f"{REFUSAL} !== ''")
    (sentence,) = sentences(page)
    assert told in sentence
    assert "service" not in sentence, "it is the file that is at fault"
    assert mission(page) == kept


def test_a_number_that_is_none_or_out_of_its_limits_changes_nothing(page: Browser) -> None:
    take(page, "valley")
    kept = mission(page)
    page.click("#mode-path")
    page.type_over(field(page, "Steepest"), "999")
    page.until(f"{REFUSAL}.includes('from 1 to 90')")
    page.type_over(field(page, "Anchors in sight"), "1.5")
    page.until(f"{REFUSAL}.includes('whole number')")
    page.type_over(field(page, "Anchors in sight"), "0")
    page.until(f"{REFUSAL} === ''")
    page.click("#mode-coverage")
    page.click("#rules")
    # what may be left empty is not left empty by what is no number
    page.type_over(field(page, "Ceiling above ground"), "90")
    page.until("planner.mission().rules.max_above_ground_m === 90")
    page.type_over(field(page, "Ceiling above ground"), "9e")
    page.until(f"{REFUSAL}.includes('wants a number')")
    assert mission(page) == {**kept, "rules": {**kept["rules"], "max_above_ground_m": 90}}


def test_undo_goes_back_through_all_modes_and_gives_up_a_drag_under_way(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page, VALLEY[:2])
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, 645600, 5136000))
    page.click_at(*at(page, 650500, 5138500))
    page.click("#mode-anchors")
    whole = mission(page)
    place = whole["anchors"][1]["east_m"], whole["anchors"][1]["north_m"]
    x, y = at(page, *place)
    page.mouse("mouseMoved", x, y)
    page.mouse("mousePressed", x, y, button="left", clickCount=1)
    page.mouse("mouseMoved", x + 60, y + 10, button="left", buttons=1)
    page.until(f"planner.mission().anchors[1].east_m !== {place[0]}")
    page.press("z", CONTROL)
    assert mission(page) == whole, "what was under way is given up, and no step before it"
    page.mouse("mouseReleased", x + 60, y + 10, button="left", clickCount=1)
    settled(page)
    steps = 0
    while page.value("!document.getElementById('undo').disabled"):
        page.press("z", CONTROL)
        steps += 1
    assert mission(page)["ground"] is None
    for _ in range(steps):
        page.press("y", CONTROL)
    page.until("document.getElementById('redo').disabled")
    settled(page)
    after = mission(page)
    assert after["route"] == whole["route"]
    assert len(after["anchors"]) == 2
    assert after["anchors"][0] == whole["anchors"][0]


def test_a_page_loaded_again_in_the_middle_of_a_search_goes_on_as_it_was(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    kept, here = mission(page), page.value("location.href")
    page.click("#mode-coverage")
    page.click("#find-more")
    page.until("!!document.querySelector('.busy')")
    page.open(here)
    page.until("!!window.planner && planner.mission().anchors.length === 3")
    settled(page)
    assert mission(page) == kept
    assert sentences(page) == []
    page.click("#mode-coverage")
    page.click("#find-more")
    page.until("document.querySelectorAll('#found .list li').length === 2")


def test_a_service_that_starts_again_answers_what_it_was_asked_meanwhile(browser: Browser, tmp_path: Path) -> None:
    with running(tmp_path / "data", **QUICK) as first:
        open_planner(browser, first)
        take(browser, "valley")
        place_anchors(browser, VALLEY[:2])
        port = first.url.rpartition(":")[2]
        first.kill()
        browser.choose(field(browser, "Height"), "150")
        browser.until(
            "[...document.querySelectorAll('.told .refusal')].some((one) => /does not answer/.test(one.textContent))"
        )
        assert len(sentences(browser)) == 1
        with running(tmp_path / "data", **QUICK, port=port) as second:
            settled(browser)
            browser.until("document.querySelectorAll('.told .refusal').length === 0")
            assert mission(browser)["anchors"][1]["height_m"] == 150
            assert second.client.get("/missions").json()["total"] == 1
    browser.complaints.clear()


def test_a_browser_without_room_says_so_when_the_service_is_away_as_well(browser: Browser, tmp_path: Path) -> None:
    with running(tmp_path / "data", **QUICK) as first:
        open_planner(browser, first)
        take(browser, "valley")
        browser.value(FILL)
        browser.complaints.clear()
        place_anchors(browser, VALLEY[:1])
        assert browser.complaints == []
        first.kill()
        browser.choose(field(browser, "Height"), "150")
        browser.until("(document.getElementById('unsaved')?.textContent ?? '').includes('no room')")
        with running(tmp_path / "data", **QUICK, port=first.url.rpartition(":")[2]):
            settled(browser)
            browser.until("document.getElementById('keeping').textContent.includes(': saved')")
    browser.complaints.clear()


def test_a_browser_that_keeps_nothing_plans_as_any_other(page: Browser, server: Server, before: Any) -> None:
    before(KEEPS_NOTHING)
    page.open(server.url)
    page.until("!!document.getElementById('mode-ground') && !!window.planner")
    take(page, "valley")
    place_anchors(page, VALLEY[:1])
    page.until("document.getElementById('keeping').textContent.includes(': saved')")
    page.open(page.value("location.href"))
    page.until("!!window.planner && planner.mission().anchors.length === 1")


def test_without_webgl_the_map_is_drawn_all_the_same(page: Browser, server: Server, before: Any) -> None:
    before(NO_WEBGL)
    page.open(server.url)
    page.until("!!document.getElementById('mode-ground') && !!window.planner")
    assert page.value("document.createElement('canvas').getContext('webgl2')") is None
    take(page, "valley")
    place_anchors(page, VALLEY[:1])
    page.until("planner.times.frameTimesMs.length > 0")
    colours = page.value(
        "(() => { const seen = new Set(); for (const one of document.querySelectorAll('#map canvas')) { "
        "const data = one.getContext('2d').getImageData(0, 0, one.width, one.height).data; "
        "for (let at = 0; at < data.length; at += 4000) seen.add(`${data[at]},${data[at + 1]},${data[at + 2]}`); } "
        "return seen.size; })()"
    )
    assert colours > 20


def test_over_a_slow_network_the_page_says_what_it_waits_for(page: Browser) -> None:
    page.call("Network.enable")
    slow = {"offline": False, "latency": 400, "downloadThroughput": 60_000, "uploadThroughput": 20_000}
    page.call("Network.emulateNetworkConditions", **slow)
    try:
        page.choose("#ground-choice", "sample:valley")
        page.until("document.querySelector('.working').textContent.includes('Reading the ground')")
        page.until("(document.querySelector('.inspector .facts')?.textContent ?? '').includes('320 ×')")
        page.click("#mode-anchors")
        page.click_at(*at(page, *VALLEY[0]))
        page.until("document.querySelector('.working').textContent.includes('Lines of sight')")
        press_button(page, "Duplicate")
        settled(page)
        assert len(mission(page)["anchors"]) == 2
        assert sentences(page) == []
    finally:
        page.call(
            "Network.emulateNetworkConditions", offline=False, latency=0, downloadThroughput=-1, uploadThroughput=-1
        )
        page.call("Network.disable")


def test_a_mission_of_four_hundred_kilobytes_is_kept_undone_and_opened_again(page: Browser, tmp_path: Path) -> None:
    take(page, "valley")
    shapes = [house(number) for number in range(1600)]
    path = tmp_path / "town.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": shapes}))
    assert 300_000 < path.stat().st_size < 400_000
    page.let_go([path], *page.place("#map"))
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('1600 buildings')")
    place_anchors(page, VALLEY[:2])
    page.until("document.getElementById('keeping').textContent.includes(': saved')")
    kept = mission(page)
    page.press("z", CONTROL)
    page.press("y", CONTROL)
    settled(page)
    page.open(page.value("location.href"))
    page.until("!!window.planner && planner.mission().anchors.length === 2")
    assert mission(page) == kept
    assert sentences(page) == []


def house(number: int) -> dict[str, Any]:
    """A footprint of some metres in the valley, in rows of forty."""
    west, south = 10.93 + 2e-4 * (number % 40), 46.372 + 2e-4 * (number // 40)
    ring = [(west, south), (west + 1e-4, south), (west + 1e-4, south + 1e-4), (west, south + 1e-4), (west, south)]
    places = [[round(lon, 6), round(lat, 6)] for lon, lat in ring]
    properties = {"building": "yes", "height": 5}
    return {"type": "Feature", "properties": properties, "geometry": {"type": "Polygon", "coordinates": [places]}}


def test_a_file_that_a_mission_cannot_be_written_as_is_refused_where_one_asks(
    page: Browser, server: Server, tmp_path: Path
) -> None:
    np.save(tmp_path / "local.npy", np.zeros((40, 40), np.float32))
    dem = server.upload(tmp_path / "local.npy", cell_m=30, crs="local")
    page.open(server.url)
    page.until(f"!!document.querySelector('#ground-choice option[value=\"dem:{dem['id']}\"]')")
    page.choose("#ground-choice", f"dem:{dem['id']}")
    page.until("(document.querySelector('.inspector .facts')?.textContent ?? '').includes('40 ×')")
    box = dem["bounds_of_posts_m"]
    place_anchors(page, ((box["west"] + 600.0, box["south"] + 600.0),))
    press_button(page, "KML")
    page.until(f"{REFUSAL}.includes('no CRS')")
    assert len(sentences(page)) == 1
