"""Other ways and times to leave on the planner's page: asked for, looked at, one of them taken and exported."""

from __future__ import annotations

import csv
import io
import math
from typing import Any

import numpy as np
import pytest
import shapely

from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import at, field, mission, place_anchors, settled, take

START, GOAL = (645600.0, 5136000.0), (650500.0, 5138500.0)
ANSWER = "(document.getElementById('path-answer')?.textContent ?? '')"
FOUND = f"{ANSWER}.includes('validator passed')"
SHOWN = "document.querySelector('#ways input:checked')?.value"
LINES = "planner.map.getAllLayers().find((one) => one.getZIndex() === 14).getSource().getFeatures()"


def set_ends(page: Browser) -> None:
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, *START))
    page.click_at(*at(page, *GOAL))
    page.until("planner.mission().route.goal !== null")
    page.choose(field(page, "Steepest"), "35")


def newest(server: Server) -> dict[str, Any]:
    """The path that was asked for last."""
    (path, *_) = server.client.get("/paths").json()["paths"]
    return dict(server.client.get(path["links"]["self"]).json())


def length_of(metres: float) -> str:
    return f"{metres / 1000.0:.2f} km"


def test_another_way_is_looked_at_by_mouse_and_keyboard_then_taken_and_exported(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page)
    set_ends(page)
    page.choose(field(page, "Other ways"), "3")
    page.click("#plan-path")
    page.until(FOUND)
    path = newest(server)
    assert path["request"]["alternatives"] == 3
    others = path["result"]["alternatives"]
    assert others, "the valley has more ways than one"
    # each is told beside the path, and drawn on the map by its number
    told = page.value("[...document.querySelectorAll('#ways label')].map((one) => one.innerText)")
    lengths = [path["result"]["totals"]["length_m"], *(one["totals"]["length_m"] for one in others)]
    assert len(told) == len(lengths)
    for text, length_m in zip(told, lengths, strict=True):
        assert length_of(length_m) in text
    assert page.value(f"{LINES}.length") == len(others)
    assert page.value(SHOWN) == "0"
    # a click on its line: where it is furthest from the path and the others
    settled(page)
    line = corners_of(others[0])
    rows = csv.DictReader(io.StringIO(layer_of(server, path, "path.csv")))
    away = shapely.MultiLineString(
        [[(float(row["east_m"]), float(row["north_m"])) for row in rows], *(corners_of(one) for one in others[1:])]
    )
    places = [shapely.LineString(line).interpolate(share, normalized=True) for share in np.linspace(0.02, 0.98, 97)]
    there = max(places, key=away.distance)
    page.click_at(*at(page, there.x, there.y))
    page.until(f"{SHOWN} === '1'")
    assert others[0]["sentence"] in page.value(ANSWER)
    assert f"Length{length_of(others[0]['totals']['length_m'])}" in page.value(ANSWER)
    # the arrow keys go from one to the next, and round
    page.value("document.querySelector('#ways input:checked').focus()")
    for number in (*range(2, len(others) + 1), 0, 1):
        page.press("ArrowRight")
        page.until(f"{SHOWN} === '{number}'")
    # taken, its corners are way-points, and the path along them is what is drawn, told and written
    page.click("#take-way")
    page.until("planner.mission().route.way_points.length > 0 || planner.mission().route.alternatives === 0")
    page.until(f"!document.getElementById('ways') && {FOUND} && planner.atRest()")
    route = mission(page)["route"]
    assert [(one["east_m"], one["north_m"]) for one in route["way_points"]] == line[1:-1]
    taken = newest(server)
    assert len(taken["request"]["way_points"]) == len(line) - 2
    assert taken["result"]["totals"]["length_m"] == pytest.approx(others[0]["totals"]["length_m"], rel=0.02)
    files = page.value("[...document.querySelectorAll('#path-answer a')].map((a) => [a.textContent, a.href])")
    (geojson,) = [href for name, href in files if name == "path.geojson"]
    assert taken["links"]["self"] in geojson
    assert {"path.csv", "path.gpx", "path.plan"} <= {name for name, _ in files}
    page.click("#undo")
    assert mission(page)["route"]["alternatives"] == 3
    assert mission(page)["route"]["way_points"] == []


def corners_of(way: dict[str, Any]) -> list[tuple[float, float]]:
    return [(one["east_m"], one["north_m"]) for one in way["corners"]]


def layer_of(server: Server, job: dict[str, Any], name: str) -> str:
    (link,) = [one["href"] for one in job["layers"] if one["name"] == name]
    return str(server.client.get(link).text)


def test_when_to_leave_is_asked_where_an_anchor_flies_and_one_time_is_taken(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-path")
    assert page.value("document.getElementById('leaving')") is None, "anchors that stand are the same at any time"
    page.click("#mode-anchors")
    page.click("#flies-to")
    flier = mission(page)["anchors"][2]
    page.click_at(*at(page, flier["east_m"] + 1500.0, flier["north_m"] + 1000.0))
    page.until("planner.mission().anchors[2].flies_to.length === 1")
    set_ends(page)
    page.choose(field(page, "Leaves at, min"), "5")
    page.choose(field(page, "or by, min"), "25")
    page.choose(field(page, "There by, min"), "600")
    page.click("#plan-path")
    page.until(f"document.querySelectorAll('#departures tbody tr').length === 5 && {FOUND}")
    path = newest(server)
    asked, answer = path["request"], path["result"]
    assert (asked["departure_s"], asked["leave_by_s"], asked["arrive_by_s"]) == (300.0, 1500.0, 36000.0)
    (track,) = asked["tracks"]
    assert track["id"] == "D3"
    assert {one["id"] for one in asked["anchors"]} == {"D1", "D2"}
    # it flies as fast as it is told to, and waits where it arrives for as long as anybody may be under way
    metres = math.dist((0.0, 0.0), (1500.0, 1000.0))
    arrives = next(
        point for point in track["points"] if point["east_m"] == pytest.approx(flier["east_m"] + 1500.0, abs=30)
    )
    assert arrives["time_s"] == pytest.approx(metres / flier["flies_m_per_s"], rel=0.05)
    assert track["points"][-1]["time_s"] > 36000.0
    rows = page.value("[...document.querySelectorAll('#departures tbody tr')].map((one) => one.innerText)")
    assert [row.split("\t")[0].strip() for row in rows] == ["5 min", "10 min", "15 min", "20 min", "25 min"]
    assert [("taken" in row) for row in rows] == [one["taken"] for one in answer["departures"]]
    assert answer["departures_sentence"] in page.value(ANSWER)
    # another time is taken, and kept with the mission
    other = next(at for at, one in enumerate(answer["departures"]) if not one["taken"] and one["arrival_s"] is not None)
    press_row = f"document.querySelectorAll('#departures tbody tr')[{other}].querySelector('button')"
    page.value(f"{press_row}.click()")
    page.until(f"!document.getElementById('departures') && {FOUND} && planner.atRest()")
    chosen_s = answer["departures"][other]["departure_s"]
    route = mission(page)["route"]
    assert (route["departure_s"], route["leave_by_s"], route["arrive_by_s"]) == (chosen_s, None, None)
    assert newest(server)["request"]["departure_s"] == chosen_s
