"""A planner's missions on the page: saved by themselves, shared as a link and a file, and nothing lost on the way."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

from tests.service.browser import Browser
from tests.service.running import Server, running
from tests.stories.planner import (
    VALLEY,
    at,
    field,
    mission,
    open_planner,
    place_anchors,
    press_button,
    settled,
    take,
)


def kept_at(page: Browser) -> str:
    """The path of the mission that the page keeps, once all is saved."""
    page.until("window.planner?.atRest() && location.search.startsWith('?mission=')")
    return "/missions/" + str(page.value("new URLSearchParams(location.search).get('mission')"))


def of_service(server: Server, path: str) -> dict[str, Any]:
    return dict(server.client.get(path).json())


def rename(page: Browser, name: str) -> None:
    page.click("#mode-brief")
    page.choose(field(page, "Name of the mission"), name)


def unsent(page: Browser) -> int:
    return int(page.value("Object.keys(localStorage).filter((key) => key.startsWith('sightline.unsent.')).length"))


def test_every_change_is_saved_by_itself_and_the_address_opens_it(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page, VALLEY[:2])
    path = kept_at(page)
    there = of_service(server, path)
    assert there["mission"]["anchors"] == mission(page)["anchors"]
    assert unsent(page) == 0, "the browser keeps only what is not sent"
    rename(page, "Crossing")
    settled(page)
    later = of_service(server, path)
    assert (later["name"], later["version"] > there["version"]) == ("Crossing", True)
    assert "Crossing: saved" in page.text("#keeping")
    page.value("localStorage.clear()")
    page.open(f"{server.url}/?mission={path.rpartition('/')[2]}")
    page.until("window.planner?.mission().name === 'Crossing' && planner.mission().anchors.length === 2")


def test_versions_are_named_opened_and_undone(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page, VALLEY[:1])
    rename(page, "as briefed")
    path = kept_at(page)
    page.value("document.querySelector('#versions').open = true")
    page.until("document.querySelectorAll('#versions li').length > 0")
    page.choose(field(page, "Name this version"), "before the rain")
    page.until("document.querySelector('#versions').textContent.includes('before the rain')")
    assert [one["name"] for one in of_service(server, f"{path}/versions")["versions"]].count("before the rain") == 1
    rename(page, "as driven")
    settled(page)
    find = (
        "[...document.querySelectorAll('#versions li button')].find((b) => b.textContent.includes('before the rain'))"
    )
    page.value(f"{find}.click()")
    page.until("window.planner?.mission().name === 'as briefed'")
    settled(page)
    assert of_service(server, path)["name"] == "as briefed"
    page.click("#undo")
    assert mission(page)["name"] == "as driven"


def test_who_saves_against_somebody_else_is_told_and_may_keep_both(page: Browser, server: Server) -> None:
    take(page, "valley")
    rename(page, "Shared")
    path = kept_at(page)
    theirs = {**mission(page), "name": "Shared by Ada"}
    told = server.client.put(path, json=theirs, headers={"If-Match": "*"}, params={"by": "Ada"})
    assert told.status_code == 200
    rename(page, "Shared by me")
    page.until("!!document.getElementById('conflict')")
    assert "by Ada" in page.text("#conflict")
    assert unsent(page) == 1, "what is not saved stays here"
    assert of_service(server, path)["name"] == "Shared by Ada"
    press_button(page, "Keep both")
    page.until("!document.getElementById('conflict')")
    page.until(f"!location.search.endsWith({path.rpartition('/')[2]!r})")
    assert of_service(server, kept_at(page))["name"] == "Shared by me (copy)"
    assert of_service(server, path)["name"] == "Shared by Ada"
    assert all("412" in complaint for complaint in page.complaints)
    page.complaints.clear()


def test_of_two_that_were_saved_against_each_other_theirs_is_taken_and_mine_comes_back_by_undo(
    page: Browser, server: Server
) -> None:
    take(page, "valley")
    rename(page, "Ours")
    path = kept_at(page)
    server.client.put(path, json={**mission(page), "name": "Theirs"}, headers={"If-Match": "*"})
    rename(page, "Mine")
    page.until("!!document.getElementById('conflict')")
    press_button(page, "Take theirs")
    page.until("window.planner?.mission().name === 'Theirs'")
    page.click("#undo")
    page.until("window.planner?.mission().name === 'Mine'")
    settled(page)
    assert of_service(server, path)["name"] == "Mine"
    page.complaints.clear()


def test_missions_are_listed_duplicated_and_deleted(page: Browser, server: Server) -> None:
    take(page, "valley")
    rename(page, "To be copied")
    path = kept_at(page)
    page.value("document.querySelector('#missions').open = true")
    item = "[...document.querySelectorAll('#missions li')].find((li) => li.textContent.includes({!r}))"
    page.until(f"!!{item.format('To be copied')}")
    page.value(f"{item.format('To be copied')}.querySelectorAll('button')[1].click()")
    page.until("window.planner?.mission().name === 'To be copied (copy)'")
    copy = kept_at(page)
    assert copy != path
    delete = f"{item.format('To be copied (copy)')}.querySelectorAll('button')[2]"
    page.until(f"!!{item.format('To be copied (copy)')}")
    page.value(f"{delete}.click()")
    page.until(f"{delete}.textContent.includes('for good')")
    page.value(f"{delete}.click()")
    page.until(f"!{item.format('To be copied (copy)')}")
    assert server.client.get(copy).status_code == 404
    assert of_service(server, path)["name"] == "To be copied"


def test_a_service_that_is_away_costs_nothing(browser: Browser, tmp_path: Path) -> None:
    quick: dict[str, Any] = {"workers": 1, "spare_workers": 0, "rehearse": "maps"}
    with running(tmp_path / "data", **quick) as first:
        open_planner(browser, first)
        take(browser, "valley")
        rename(browser, "Before the cut")
        path, port = kept_at(browser), first.url.rpartition(":")[2]
        first.kill()
        rename(browser, "After the cut")
        browser.until("document.getElementById('keeping').textContent.includes('not saved')")
        assert unsent(browser) == 1
        with running(tmp_path / "data", **quick, **{"port": port}) as second:
            browser.until("document.getElementById('keeping').textContent.includes('After the cut: saved')")
            assert of_service(second, path)["name"] == "After the cut"
    browser.complaints.clear()


def test_a_mission_opens_elsewhere_with_its_ground_or_asks_for_it(
    page: Browser, browser: Browser, server: Server, tmp_path: Path
) -> None:
    take(page, "valley")
    place_anchors(page, VALLEY[:1])
    rename(page, "Travelling")
    path = kept_at(page)
    sha256 = mission(page)["ground"]["sha256"]
    files = {name: server.client.get(f"{path}/files/{name}").content for name in ("mission.json", "mission.zip")}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    with running(tmp_path / "data", workers=1, spare_workers=1, rehearse="maps") as other:
        open_planner(browser, other)
        page.click("#mode-brief")
        page.upload("#mission-file", tmp_path / "mission.json")
        page.until("(document.getElementById('refusal')?.textContent ?? '').includes('Upload that file')")
        take(page, "valley")
        page.until("window.planner?.mission().name === 'Travelling'")
        assert mission(page)["anchors"] == json.loads(files["mission.json"])["anchors"]
        page.click("#mode-brief")
        page.upload("#mission-file", tmp_path / "mission.zip")
        page.until("(document.getElementById('notice')?.textContent ?? '').includes('was here already')")
        assert mission(page)["ground"]["sha256"] == sha256
    page.complaints.clear()


PLAN = {
    "fileType": "Plan",
    "version": 1,
    "mission": {"items": [], "plannedHomePosition": [46.37, 10.93, 1500.0]},
    "geoFence": {
        "polygons": [{"inclusion": False, "polygon": [[46.37, 10.92], [46.37, 10.93], [46.376, 10.93]]}],
        "circles": [],
    },
}


def test_anchors_route_and_areas_come_from_other_programs_and_go_to_them(
    page: Browser, server: Server, tmp_path: Path
) -> None:
    take(page, "valley")
    gpx = (
        '<gpx version="1.1" creator="somebody" xmlns="http://www.topografix.com/GPX/1/1"><wpt lat="46.37" lon="10.92">'
        '<ele>2100</ele><name>Peak</name></wpt><rte><name>way</name><rtept lat="46.37" lon="10.92"/>'
        '<rtept lat="46.372" lon="10.925"/><rtept lat="46.375" lon="10.93"/></rte></gpx>'
    )
    (tmp_path / "tour.gpx").write_text(gpx)
    (tmp_path / "fence.plan").write_text(json.dumps(PLAN))
    page.click("#mode-anchors")
    page.upload("#anchor-file", tmp_path / "tour.gpx")
    page.until("window.planner?.mission().anchors.length === 1")
    (anchor,) = mission(page)["anchors"]
    assert (anchor["id"], anchor["height_from"]) == ("Peak", "altitude_m")
    assert "GPX: 1 anchors, 1 lines" in page.text("#notice")
    press_button(page, "Take as the route")
    assert len(mission(page)["route"]["way_points"]) == 1
    page.upload("#anchor-file", tmp_path / "fence.plan")
    page.until("!!document.querySelector('#in-the-file')")
    assert page.text("#in-the-file [aria-pressed=true]") == "No-go"
    page.click("#in-the-file [aria-pressed=true]")
    assert len(mission(page)["route"]["no_go"][0]) == 3
    path = kept_at(page)
    written = server.client.get(f"{path}/files/mission.kml").text
    for word in ("Peak", "no-go 1", "route"):
        assert word in written
    (tmp_path / "bad.kml").write_text("<!DOCTYPE kml [<!ENTITY a 'b'>]><kml>&a;</kml>")
    page.upload("#anchor-file", tmp_path / "bad.kml")
    page.until("!!document.getElementById('refusal')")
    assert "document type" in page.text("#refusal")
    page.complaints.clear()


def test_the_brief_is_two_to_four_pages_with_map_frames_and_decision(page: Browser, tmp_path: Path) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, 645600, 5136000))
    page.click_at(*at(page, 650500, 5138500))
    page.choose(field(page, "Steepest"), "30")
    page.click("#plan-path")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    rename(page, "On paper")
    page.value("window.print = () => { window.printed = true; }")
    page.click("#print")
    page.until("window.printed === true")
    rows = page.value("[...document.querySelectorAll('#sheet-anchors tbody tr')].map((row) => row.textContent)")
    assert [row[:2] for row in rows] == ["D1", "D2", "D3"]
    assert page.value("document.querySelector('#sheet img').naturalWidth") == 1000
    sheet = page.value("document.getElementById('sheet').textContent")
    for words in ("On paper", "open", "above mean sea level", "fewer than the 3 anchors", "start", "trees, buildings"):
        assert words in sheet
    longest = page.value(
        "[...document.querySelectorAll('#sheet-dark tbody tr')].map((row) => row.children[2].textContent)"
    )
    decided = page.value("document.querySelectorAll('#sheet-checks tr')[4].children[1].textContent")
    assert decided in longest, "the longest stretch is that of the service"
    assert page.value("getComputedStyle(document.getElementById('sheet')).display") == "none", "paper alone shows it"
    told = page.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
    paper = base64.b64decode(told["data"])
    (tmp_path / "brief.pdf").write_bytes(paper)
    assert 2 <= len(re.findall(rb"/Type\s*/Page\b", paper)) <= 4
