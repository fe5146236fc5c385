"""Radios and trees on the planner's page: the signal of an anchor under the cursor and in the profile."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
import rasterio

import dem_samples
from terrain import to_lon_lat
from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import (
    at,
    field,
    let_go,
    mission,
    place_anchors,
    press_button,
    requests,
    settled,
    shares,
    slide,
    take,
)

PLACE = (648000.0, 5137000.0)
READOUT = "(document.getElementById('readout')?.textContent ?? '')"
SAVED = "document.querySelector('.keeping').textContent.includes(': saved')"
NOTE = "(document.querySelector('.drawer [role=status]')?.textContent ?? '')"


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


LEGEND = "(document.querySelector('#legend caption')?.textContent ?? '')"


def usable_shares(page: Browser, server: Server) -> list[float]:
    """Per cent of the ground on which so many anchors are usable, by the service; none only where that is known."""
    kept = mission(page)
    body = {
        "dem_id": kept["ground"]["dem_id"],
        "anchors": [
            {name: one[name] for name in ("id", "east_m", "north_m", "radio")} | {"above_ground_m": one["height_m"]}
            for one in kept["anchors"]
        ],
        "sight": "usable",
        "show": "needed_height",
        **({} if kept["trees"] is None else {"cover": {"canopy": {"top_m": kept["trees"]["top_m"]}}}),
    }
    line, _, numbers = server.client.post("/previews", json=body).content.partition(b"\n")
    told = json.loads(line)
    needed_m = np.frombuffer(numbers, "<f4").reshape(len(told["names"]), -1)
    count = np.count_nonzero(needed_m <= 1.5, axis=0)
    count[(count == 0) & np.isnan(needed_m).any(axis=0)] = -1
    return [100.0 * float(np.mean(count == number)) for number in range(len(kept["anchors"]) + 1)]


def test_maps_are_of_usable_signals_once_every_anchor_has_a_radio(page: Browser, server: Server) -> None:
    take(page, "valley")
    place_anchors(page)
    seen = shares(page)
    page.click("#mode-coverage")
    page.choose(field(page, "Maps, paths and places are of"), "usable")
    page.until("(document.getElementById('silent')?.textContent ?? '').includes('D1, D2, D3 have radios')")
    assert shares(page) == seen
    assert "Anchors in sight" in page.value(LEGEND)
    page.choose(field(page, "Radio of those"), "2.4GHz")
    settled(page)
    page.until(f"{LEGEND}.includes('Anchors usable')")
    bare = shares(page)
    assert bare[:-1] == pytest.approx(usable_shares(page, server), abs=0.5)
    assert bare != seen
    # the margin is a layer of its own, and the one that is wanted a slider that asks nothing
    page.click("input[name=overlay][value=signal]")
    settled(page)
    page.until(f"{LEGEND}.includes('Margin of the best signal')")
    margins, asked = shares(page), requests(page)
    assert sum(margins[3:-1]) == pytest.approx(100.0 - bare[0], abs=1.0), "from 0 dB on somebody is usable"
    slide(page, field(page, "Margin wanted"), "20")
    page.until("document.querySelector('#legend').textContent.includes('20 dB – 30 dB')")
    assert sum(shares(page)[3:-1]) < sum(margins[3:-1])
    assert requests(page) == asked
    # dilution and read-out are by what is usable too, and trees take of it
    page.click("input[name=overlay][value=count]")
    page.click("#mode-ground")
    page.choose(field(page, "One height everywhere, m"), "6")
    page.until("planner.mission().trees?.top_m === 6")
    wooded = shares(page)
    assert wooded[:-1] == pytest.approx(usable_shares(page, server), abs=0.5)
    assert wooded[0] > bare[0]
    page.until(SAVED)
    page.open(page.value("location.href"))
    page.until("!!window.planner && planner.mission().positioning.sight === 'usable'")
    page.click("#mode-coverage")
    page.until(f"{LEGEND}.includes('Anchors usable')")
    assert shares(page) == pytest.approx(wooded, abs=0.05)


def test_paths_are_of_usable_signals_where_the_maps_are_and_places_are_sought_for_a_radio(
    page: Browser, server: Server
) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    page.choose(field(page, "Maps, paths"), "usable")
    page.choose(field(page, "Radio of those"), "868MHz")
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, 645600.0, 5136000.0))
    page.click_at(*at(page, 650500.0, 5138500.0))
    page.choose(field(page, "Steepest"), "35")
    page.choose(field(page, "Usable anchors"), "1")
    page.click("#plan-path")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    (asked, *_) = server.client.get("/paths").json()["paths"]
    path = server.client.get(asked["links"]["self"]).json()["result"]
    assert path["parameters"]["sight"] == "usable"
    assert f"Fewest usable{path['totals']['fewest_anchors']}" in page.value("document.body.textContent")
    page.click("#mode-coverage")
    page.choose(field(page, "How many"), "1")
    page.until("document.querySelector('.inspector').textContent.includes('radio: 868 MHz, LoRa')")


def test_frames_over_time_are_of_usable_signals_where_no_satellite_is_among_them(
    page: Browser, server: Server, tmp_path: Path
) -> None:
    take(page, "valley")
    place_anchors(page)
    page.choose(field(page, "Radio"), "868MHz")
    page.click("#mode-coverage")
    page.choose(field(page, "Maps, paths"), "usable")
    page.choose(field(page, "Radio of those"), "868MHz")
    page.click("#mode-air")
    page.choose(field(page, "Lasts, min"), "1")
    page.choose(field(page, "A frame every, min"), "1")
    page.click("#calculate-frames")
    page.until("!!document.getElementById('frames-answer')")
    (asked, *_) = server.client.get("/morphing-maps").json()["morphing_maps"]
    assert server.client.get(asked["links"]["self"]).json()["result"]["parameters"]["sight"] == "usable"
    (tmp_path / "gps.alm").write_text("anything")
    page.upload("#orbits-file", tmp_path / "gps.alm")
    page.until("document.querySelector('.inspector').textContent.includes('frames are of what is in sight')")


def test_the_radio_of_a_satellite_on_an_anchor_is_told_to_mean_nothing(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page, (PLACE,))
    page.choose(field(page, "Radio"), "gnss-l1")
    page.until("document.querySelector('.inspector').textContent.includes('GNSS L1 is the budget of a satellite')")
    page.choose(field(page, "Radio"), "868MHz")
    page.until("!document.querySelector('.inspector').textContent.includes('satellite')")


@pytest.fixture
def crowns(tmp_path: Path) -> Path:
    """Trees of 20 m over the west of the valley, in degrees and coarser than its posts, as others write them."""
    grid = dem_samples.load_sample("valley")
    west_m, south_m, east_m, north_m = grid.bounds_m
    lon, lat = to_lon_lat(grid, np.array([west_m, west_m, east_m, east_m]), np.array([south_m, north_m] * 2))
    heights_m = np.zeros((60, 80), np.float32)
    heights_m[:, :50] = 20.0
    path = tmp_path / "chm.tif"
    across, down = float(np.ptp(lon)) / 80, float(np.ptp(lat)) / 60
    transform = rasterio.Affine(across, 0.0, float(lon.min()), 0.0, -down, float(lat.max()))
    with rasterio.open(
        path, "w", driver="GTiff", width=80, height=60, count=1, dtype="float32", crs="EPSG:4326", transform=transform
    ) as file:
        file.write(heights_m, 1)
    return path


def test_a_raster_of_trees_let_go_on_the_page_is_the_canopy_of_the_mission(page: Browser, crowns: Path) -> None:
    take(page, "valley")
    place_anchors(page, (PLACE,))
    page.choose(field(page, "Radio"), "868MHz")
    page.click("#mode-coverage")
    page.click_at(*at(page, PLACE[0] - 900.0, PLACE[1] + 100.0))
    page.until(f"{READOUT}.includes('% arrive')")
    bare_db, _ = signal_told(page)
    let_go(page, [crowns])
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('Trees are those of chm.tif')")
    told = page.text("#notice")
    assert "The canopy's raster: Warped from WGS 84" in told
    assert "resampled to the DEM's" in told
    trees = mission(page)["trees"]
    assert (trees["what"], trees["name"]) == ("heights", "chm.tif")
    assert base64.b64decode(trees["base64"]) == crowns.read_bytes()
    assert mission(page)["ground"]["name"] == "valley.npz", "the ground is still the ground"
    page.until(f"{READOUT}.includes('% arrive') && !{READOUT}.includes('{bare_db:+.0f} dB')")
    assert signal_told(page)[0] < bare_db
    press_button(page, "Profile to D1")
    page.until(f"{NOTE}.includes('of trees')")
    settled(page)
    page.until(SAVED)
    page.open(page.value("location.href"))
    page.until("!!window.planner && planner.mission().trees?.name === 'chm.tif'")
