"""A mission planner at the page, in a real browser: from an empty page to a mission, by mouse and by keyboard."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path

import gpxpy
import pytest

import dem_samples
import terrain
from tests.service.browser import CONTROL, Browser
from tests.service.running import Server
from tests.stories.mission_by_mouse import EXPORTED, GOAL, START, mission_by_mouse
from tests.stories.planner import (
    VALLEY,
    at,
    field,
    in_view,
    mission,
    place_anchors,
    press_button,
    requests,
    settled,
    shares,
    slide,
    take,
)


def test_the_readmes_mission_from_an_empty_page_by_mouse(page: Browser, tmp_path: Path) -> None:
    seen: list[str] = []

    def look(step: str) -> None:
        page.screenshot(tmp_path / f"{len(seen) + 1}.png")
        seen.append(step)
        if step == "places found":
            assert in_view(page, "#found .list")
        if step == "a path":
            assert in_view(page, "#path-answer h3")

    mission_by_mouse(page, tmp_path, look)
    assert seen == ["an empty page", "a ground", "places found", "places taken", "a path", "files"]
    worst = re.search(r"Worst dilution on the path below 5\D+([\d.]+)", page.text("#go-no-go"))
    assert worst is not None
    assert float(worst[1]) < 5.0
    kept = mission(page)
    plan, archive, track = (tmp_path / name for name in EXPORTED)
    items = json.loads(plan.read_text())["mission"]["items"]
    flown = [item["params"][4:6] for item in items if item["command"] == 16]  # MAV_CMD_NAV_WAYPOINT
    frame = dem_samples.load_sample("valley")
    assert len(flown) == len(kept["anchors"]) == 5
    for (lat_deg, lon_deg), one in zip(flown, kept["anchors"], strict=True):
        assert terrain.to_grid_frame(frame, lon_deg, lat_deg) == pytest.approx((one["east_m"], one["north_m"]), abs=0.1)
    with zipfile.ZipFile(archive) as inside:
        assert any(name.endswith(".npz") for name in inside.namelist())
    with track.open() as file:
        [way] = gpxpy.parse(file).tracks
    ends = [way.segments[0].points[number] for number in (0, -1)]
    for point, place in zip(ends, (START, GOAL), strict=True):
        metres = terrain.to_grid_frame(frame, point.longitude, point.latitude)
        assert metres == pytest.approx(place, abs=frame.cell_east_m)


def test_a_blocked_path_tells_where_and_by_what_and_the_remedy_opens_it(page: Browser) -> None:
    take(page, "valley")
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, *START))
    page.click_at(*at(page, *GOAL))
    page.choose(field(page, "Steepest"), "20")
    page.click("#plan-path")
    page.until("!!document.getElementById('remedies')")
    assert "what blocks it near" in page.text("#path-answer")
    assert "slope" in page.text("#remedies")
    assert in_view(page, "#remedies")
    needed = re.search(r"slopes up to ([\d.]+) deg", page.text("#remedies"))
    assert needed is not None
    press_button(page, "Do it and plan")
    page.until("document.getElementById('path-answer').textContent.includes('validator passed')")
    taken_deg = mission(page)["rover"]["max_slope_deg"]
    assert float(needed[1]) <= taken_deg <= float(needed[1]) + 0.11


def test_while_an_anchor_is_dragged_the_map_follows_and_undo_is_one_step(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    before, shown = mission(page)["anchors"][2], shares(page)
    asked = page.value("planner.times.surfaceTimesMs.length")
    place = before["east_m"], before["north_m"]
    page.drag(at(page, *place), at(page, place[0] + 900, place[1] + 600), steps=12, pause_s=0.08)
    settled(page)
    after = mission(page)["anchors"][2]
    assert after["east_m"] - before["east_m"] == pytest.approx(900, abs=15)
    # more than once on the way, and only for the one that moved
    assert page.value("planner.times.surfaceTimesMs.length") - asked >= 2
    assert shares(page) != shown
    page.click("#undo")
    settled(page)
    assert mission(page)["anchors"][2] == before
    assert shares(page) == shown
    page.press("y", CONTROL)
    settled(page)
    assert mission(page)["anchors"][2] == after


def test_sliders_recolour_the_map_without_a_request(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    settled(page)
    shown, asked = shares(page), requests(page)
    low = page.value("planner.map.getAllLayers()[0].getSource().getRevision()")
    slider = field(page, "Antenna above ground")
    for height_m in ("5", "12", "25"):
        slide(page, slider, height_m)
    higher = shares(page)
    assert higher[0] < shown[0], "from higher up fewer places see nobody"
    assert sum(higher) == pytest.approx(100.0, abs=0.5)
    assert requests(page) == asked
    assert page.value("planner.map.getAllLayers()[0].getSource().getRevision()") > low


def test_the_numbers_on_the_map_are_those_of_the_service(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page)
    told = shares(page)
    kept = mission(page)
    anchors = [
        {"id": one["id"], "east_m": one["east_m"], "north_m": one["north_m"], one["height_from"]: one["height_m"]}
        for one in kept["anchors"]
    ]
    body = {"dem_id": kept["ground"]["dem_id"], "anchors": anchors, "receiver_above_ground_m": 1.5}
    answer = server.client.post("/visibility-maps", json=body, headers={"Prefer": "wait=60"}).json()
    histogram = [100.0 * share["share"] for share in answer["result"]["count_histogram"]]
    assert told[:-1] == pytest.approx(histogram, abs=0.11)


def test_places_are_typed_in_metres_or_degrees_and_a_refusal_stands_where_one_acts(page: Browser) -> None:
    take(page, "valley")
    page.click("#mode-anchors")
    page.write("textarea", "647000 5136000\n46.384338, 10.950419\n")
    page.click("#add-typed")
    page.until("document.querySelectorAll('#anchor-list li').length === 2")
    by_degrees = mission(page)["anchors"][1]
    assert (by_degrees["east_m"], by_degrees["north_m"]) == pytest.approx((649975.0, 5138600.0), abs=0.2)
    page.write("textarea", "12, 13")
    page.click("#add-typed")
    page.until("!!document.getElementById('refusal')")
    assert "outside the ground" in page.text("#refusal")
    assert in_view(page, "#refusal")
    page.choose(field(page, "Height"), "-5")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('above_ground_m')")
    assert in_view(page, "#refusal")
    assert page.complaints
    assert all("422" in complaint for complaint in page.complaints)
    page.complaints.clear()


def test_an_anchor_moves_by_keys_is_deleted_and_comes_back(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page, VALLEY[:1])
    before = mission(page)["anchors"][0]
    page.value("document.getElementById('map').focus()")
    page.press("ArrowRight")
    cell_m = dem_samples.load_sample("valley").cell_east_m
    assert mission(page)["anchors"][0]["east_m"] == pytest.approx(before["east_m"] + cell_m)
    page.press("Delete")
    assert mission(page)["anchors"] == []
    page.press("z", CONTROL)
    page.press("z", CONTROL)
    assert mission(page)["anchors"] == [before]


def test_the_cursor_reads_height_degrees_and_who_is_in_sight_and_a_pin_opens_a_profile(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.click_at(*at(page, 648000, 5136500))
    page.until("document.getElementById('readout').textContent.includes('D1')")
    told = page.text("#readout")
    assert "°" in told
    assert "height" in told
    press_button(page, "Profile to D1")
    page.until("!!document.querySelector('.drawer canvas')")
    assert "clearance" in page.text(".drawer [role=status]")


def test_a_mission_outlives_the_page_and_goes_through_its_file(page: Browser, server: Server, tmp_path: Path) -> None:
    take(page, "valley")
    place_anchors(page)
    kept = mission(page)
    page.open(server.url)
    page.until("(document.querySelector('.inspector .facts')?.textContent ?? '').includes('320 ×')")
    assert mission(page)["anchors"] == kept["anchors"]
    file = tmp_path / "mission.json"
    file.write_text(json.dumps({**kept, "name": "From a file"}))
    page.click("#mode-brief")
    press_button(page, "New mission")
    assert mission(page)["anchors"] == []
    page.upload("#mission-file", file)
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('From a file')")
    assert mission(page)["anchors"] == kept["anchors"]
    assert mission(page)["ground"]["sha256"] == dem_samples.load_sample("valley").digest


def test_another_ground_tells_what_has_no_place_on_it_and_undo_leads_back(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    take(page, "crater")
    assert "D1, D2, D3" in page.text("#notice")
    assert mission(page)["anchors"] == []
    page.click("#undo")
    page.until("(document.querySelector('.inspector .facts')?.textContent ?? '').includes('320 ×')")
    assert len(mission(page)["anchors"]) == 3


def test_a_click_on_an_anchor_moves_nothing_and_a_tool_in_hand_is_used_where_it_stands(page: Browser) -> None:
    take(page, "valley")
    page.click("#mode-anchors")
    page.write("textarea", "647000.4 5136000.3\n649500.6 5138000.7\n")
    page.click("#add-typed")
    page.until("document.querySelectorAll('#anchor-list li').length === 2")
    before = mission(page)
    places = [(one["east_m"], one["north_m"]) for one in before["anchors"]]
    page.click("#mode-coverage")
    page.click_at(*at(page, *places[0]))
    page.click("#mode-anchors")
    page.until("document.querySelector('#anchor-list li button').getAttribute('aria-pressed') === 'true'")
    assert mission(page) == before
    page.click("#flies-to")
    page.click_at(*at(page, *places[1]))
    page.until("planner.mission().anchors[0].flies_to.length === 1")
    assert mission(page)["anchors"][1] == before["anchors"][1]
    page.click("#undo")
    page.click("#undo")
    assert mission(page)["anchors"] == []
