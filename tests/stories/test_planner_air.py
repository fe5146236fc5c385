"""A drone's flight planned on the page: ends clicked on the map, the way through the air and its files."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
import pytest

from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import at, field, place_anchors, press_button, settled, take

MARKED = (
    "planner.map.getAllLayers().find((one) => one.getZIndex() === 18).getSource().getFeatures()"
    ".filter((one) => one.getGeometry().getType() === 'Point')"
)
START, GOAL = (645600.0, 5136000.0), (650500.0, 5138500.0)
ANSWER = "(document.getElementById('flight-answer')?.textContent ?? '')"


def along(corners: list[dict[str, Any]], distance_m: float) -> tuple[float, float]:
    """The place so far along the corners, straight through the air from each to the next."""
    at_m = np.array([(one["east_m"], one["north_m"], one["altitude_m"]) for one in corners])
    reached_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(at_m, axis=0), axis=1))])
    return float(np.interp(distance_m, reached_m, at_m[:, 0])), float(np.interp(distance_m, reached_m, at_m[:, 1]))


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
    # its profile in the drawer: ground, flight and from where up positioning is good enough, as the table has them
    (table,) = [one["href"] for one in found["layers"] if one["name"] == "flight.csv"]
    rows = list(csv.DictReader(io.StringIO(server.client.get(table).text)))
    settled(page)
    press_button(page, "Profile of the flight")
    page.until("!!document.querySelector('.drawer .u-over')")
    assert page.text(".drawer strong") == "Profile of the flight"
    labels = page.value("[...document.querySelectorAll('.drawer .u-label')].map((one) => one.textContent)")
    assert labels == ["distance, m", "ground, m", "flown, m", "good enough from here up, m"]
    x, y = page.place(".drawer .u-over", 0.5, 0.5)
    page.mouse("mouseMoved", x, y)
    page.until(f"{MARKED}.length === 1")
    values = "[...document.querySelectorAll('.drawer .u-value')].map((one) => parseFloat(one.textContent))"
    distance_m, ground_m, flown_m, floor_m = page.value(values)
    row = min(rows, key=lambda one: abs(float(one["distance_m"]) - distance_m))
    assert distance_m == pytest.approx(found["result"]["totals"]["length_m"] / 2.0, rel=0.05)
    assert ground_m == pytest.approx(float(row["ground_m"]), abs=0.1)
    assert flown_m == pytest.approx(float(row["altitude_m"]), abs=0.1)
    assert floor_m == pytest.approx(float(row["floor_m"]), abs=0.1)
    assert flown_m >= floor_m > ground_m - 0.1
    # the mark on the map lies where the flight is then
    east_m, north_m = page.value(f"{MARKED}[0].getGeometry().getCoordinates()")
    assert (east_m, north_m) == pytest.approx(along(found["result"]["corners"], distance_m), abs=1.0)
    # and a pointer over the flight on the map is read in the profile
    quarter_m = found["result"]["totals"]["length_m"] / 4.0
    page.mouse("mouseMoved", *at(page, *along(found["result"]["corners"], quarter_m)))
    told = "parseFloat(document.querySelector('.drawer .u-value').textContent)"
    page.until(f"Math.abs({told} - {quarter_m}) < 100")
