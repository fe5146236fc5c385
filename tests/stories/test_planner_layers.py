"""What the planner's map shows, switched at once, and what a planner draws on it: story by story of what it is for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio

from tests.service.browser import Browser
from tests.stories.planner import (
    at,
    field,
    let_go,
    mission,
    place_anchors,
    press_button,
    settled,
    shares,
    take,
)

START, GOAL, BETWEEN = (645600, 5136000), (650500, 5138500), (648300, 5137600)
ASKED = (
    "performance.getEntriesByType('resource').map((one) => new URL(one.name).pathname)"
    ".filter((path) => !path.startsWith('/missions')).length"
)
INSPECTOR = "document.querySelector('.inspector').textContent"
FEATURES = "planner.map.getAllLayers().flatMap((one) => one.getSource()?.getFeatures?.() ?? []).length"
DISTANCE = "parseFloat((document.querySelector('.drawer .u-value')?.textContent ?? '').replace(',', ''))"


def show(page: Browser, layer: str) -> list[float]:
    """Shares of the legend of a layer."""
    page.click(f"input[name=overlay][value={layer}]")
    page.until(f"document.querySelector('input[name=overlay][value={layer}]').checked")
    return shares(page)


def test_what_a_file_does_not_say_is_asked_for_beside_its_warning(page: Browser, tmp_path: Path) -> None:
    heights = np.full((20, 30), 100, np.int16)
    heights[5, :] = -77  # unknown, and nothing says so
    with rasterio.open(
        tmp_path / "bare.tif", "w", driver="GTiff", width=30, height=20, count=1, dtype="int16",
        transform=rasterio.Affine(10.0, 0.0, 0.0, 0.0, -10.0, 0.0),
    ) as file:  # fmt: skip
        file.write(heights, 1)
    let_go(page, [tmp_path / "bare.tif"])
    page.until("document.querySelector('.inspector details')?.open === true")
    page.choose(field(page, "CRS of its positions"), "EPSG:32632")
    page.choose(field(page, "Value that means unknown"), "-77")
    page.choose(field(page, "What heights count from"), "EGM96")
    press_button(page, "Read with these")
    page.until(f"{INSPECTOR}.includes('EPSG:32632') && {INSPECTOR}.includes('5.0 %')")
    assert "EGM96" in page.value(INSPECTOR)
    page.complaints.clear()  # the refusal of a file without a CRS


def test_relief_slope_and_permitted_ground_are_there_before_anything_is_planned(page: Browser) -> None:
    take(page, "valley")
    slope = show(page, "slope")
    asked = page.value(ASKED)
    permitted = show(page, "permitted")
    page.click("#mode-path")
    page.choose(field(page, "Steepest"), "10")
    page.until("document.querySelector('#legend').textContent.includes('10°')")
    gentle = shares(page)
    assert gentle[0] == pytest.approx(sum(slope[:2]), abs=0.3), "below 10 degrees"
    assert gentle[0] < permitted[0]
    assert page.value(ASKED) == asked, "the page paints it; what is saved is the mission"
    page.click(".layers input[type=checkbox]")
    settled(page)


def test_every_layer_of_coverage_is_there_at_once_also_of_an_anchor_with_a_sector(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.choose(field(page, "Longest range"), "2500")
    page.choose(field(page, "Sector from"), "20")
    page.choose(field(page, "to, °"), "140")
    press_button(page, "Duplicate")
    page.until("planner.mission().anchors.length === 4")
    last, copy = mission(page)["anchors"][2:]
    assert {**copy, "id": last["id"], "east_m": last["east_m"]} == last
    page.click("#mode-coverage")
    page.click("input[name=overlay][value=one]")
    limited = show(page, "one")
    assert 0.0 < limited[1] < 30.0, "its sector is a third of a circle"
    for layer in ("count", "margin", "dilution", "error"):
        assert sum(show(page, layer)) == pytest.approx(100.0, abs=0.6), layer
    page.click("#unit")
    page.until("document.getElementById('legend').textContent.includes(' ft')")
    page.click("#unit")


def test_a_mark_goes_along_profile_and_map_together(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.click_at(*at(page, 648000, 5136500))
    press_button(page, "Profile to D2")
    page.until("!!document.querySelector('.drawer .u-over')")
    before = page.value(FEATURES)
    x, y = page.place(".drawer .u-over", 0.3, 0.5)
    page.mouse("mouseMoved", x, y)
    page.until(f"{FEATURES} === {before + 1}")
    # and back: the pointer over the map, half way to the anchor
    second = mission(page)["anchors"][1]
    half = (648000 + second["east_m"]) / 2.0, (5136500 + second["north_m"]) / 2.0
    page.mouse("mouseMoved", *at(page, *half))
    whole = float(np.hypot(second["east_m"] - 648000.0, second["north_m"] - 5136500.0))
    page.until(f"Math.abs({DISTANCE} - {whole / 2.0}) < {0.05 * whole}")
    page.mouse("mouseMoved", *at(page, *(np.add(half, (-900.0, 700.0)))))
    page.until(f"!({DISTANCE} >= 0)")


def test_way_points_no_go_and_keep_in_are_drawn_and_the_path_has_its_strips(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, *START))
    page.click_at(*at(page, *GOAL))
    page.click("#tool-way-point")
    page.click_at(*at(page, *BETWEEN))
    page.until("planner.mission().route.way_points.length === 1")
    for tool, corners in (
        ("no-go", ((646900, 5136300), (647500, 5136300), (647200, 5136900))),
        ("keep-in", ((644700, 5135300), (651200, 5135300), (651200, 5139200), (644700, 5139200))),
    ):
        page.click(f"#tool-{tool}")
        for corner in corners[:-1]:
            page.click_at(*at(page, *corner))
        page.click_at(*at(page, *corners[-1]), times=2)
    page.until("planner.mission().route.no_go.length === 1 && planner.mission().route.keep_in.length === 1")
    page.choose(field(page, "Steepest"), "35")
    page.click("#plan-path")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    for strip in ("slope", "sight", "dilution", "error", "bubble"):
        page.choose(field(page, "Colour of the line"), strip)
        settled(page)
    press_button(page, "Profile of the path")
    page.until("!!document.querySelector('.drawer canvas')")
    # more places are sought along it as well
    page.click("#mode-coverage")
    page.choose(field(page, "Where"), "path")
    page.choose(field(page, "How many"), "1")
    page.click("#find-more")
    page.until("document.querySelectorAll('#found .list li').length === 1")
    assert "less by" in page.text("#found .list"), "what it takes off the error along the path"
