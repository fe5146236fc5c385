"""Anchors saved from the page for other programs, read as these would read them; and lengths in feet."""

from __future__ import annotations

import csv
import io
import json
import re
import time
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from pyproj import Transformer

import dem_samples
from terrain import height_at
from tests.service.browser import MAY_TAKE_S, Browser
from tests.stories.planner import at, field, mission, place_anchors, press_button, settled, take

FOOT_M = 0.3048
READOUT = "(document.getElementById('readout')?.textContent ?? '')"
KML = "{http://www.opengis.net/kml/2.2}"
GPX = "{http://www.topografix.com/GPX/1/1}"


def saved_by(page: Browser, button: str, folder: Path) -> bytes:
    """What lies in the folder once that button of the exports was pressed."""
    folder.mkdir()
    page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
    names = page.value("[...document.querySelectorAll('[aria-label=Export] button')].map((one) => one.textContent)")
    page.click(f"[aria-label=Export] button:nth-of-type({names.index(button) + 1})")
    deadline_s = time.monotonic() + MAY_TAKE_S
    while not (whole := [one for one in folder.iterdir() if one.suffix != ".crdownload" and one.stat().st_size > 0]):
        assert time.monotonic() < deadline_s, f"{button} saved nothing"
        time.sleep(0.05)
    (file,) = whole
    return file.read_bytes()


def places_of_kml(text: bytes) -> dict[str, tuple[float, float]]:
    """Longitude and latitude of the points, by name."""
    marks = ElementTree.fromstring(text).iter(f"{KML}Placemark")
    found = {}
    for mark in marks:
        point = mark.find(f"{KML}Point/{KML}coordinates")
        if point is not None and point.text is not None:
            lon, lat, *_ = point.text.strip().split(",")
            found[str(mark.findtext(f"{KML}name"))] = (float(lon), float(lat))
    return found


def test_anchors_are_saved_for_every_program_that_is_named(page: Browser, tmp_path: Path) -> None:
    take(page, "valley")
    place_anchors(page)
    kept = {one["id"]: one for one in mission(page)["anchors"]}
    grid = dem_samples.load_sample("valley")
    to_degrees = Transformer.from_crs(grid.crs, 4326, always_xy=True)
    degrees = {name: to_degrees.transform(one["east_m"], one["north_m"]) for name, one in kept.items()}

    rows = list(csv.DictReader(io.StringIO(saved_by(page, "CSV", tmp_path / "csv").decode())))
    assert {row["id"]: (float(row["east_m"]), float(row["north_m"])) for row in rows} == {
        name: pytest.approx((one["east_m"], one["north_m"]), abs=0.01) for name, one in kept.items()
    }
    features = json.loads(saved_by(page, "GeoJSON", tmp_path / "geojson"))["features"]
    points = {one["id"]: one["geometry"]["coordinates"][:2] for one in features}
    assert points == {name: pytest.approx(place, abs=2e-7) for name, place in degrees.items()}
    kml = saved_by(page, "KML", tmp_path / "kml")
    assert places_of_kml(kml) == {name: pytest.approx(place, abs=2e-7) for name, place in degrees.items()}
    with zipfile.ZipFile(io.BytesIO(saved_by(page, "KMZ", tmp_path / "kmz"))) as kmz:
        assert places_of_kml(kmz.read("doc.kml")) == places_of_kml(kml)
    ways = ElementTree.fromstring(saved_by(page, "GPX", tmp_path / "gpx")).findall(f"{GPX}wpt")
    assert {one.findtext(f"{GPX}name"): (float(one.attrib["lon"]), float(one.attrib["lat"])) for one in ways} == {
        name: pytest.approx(place, abs=2e-7) for name, place in degrees.items()
    }
    items = json.loads(saved_by(page, ".plan", tmp_path / "plan"))["mission"]["items"]
    flown = [item["params"][4:6] for item in items if item["command"] == 16]  # MAV_CMD_NAV_WAYPOINT
    assert flown == [pytest.approx(place[::-1], abs=2e-7) for place in degrees.values()]
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('no place for ids')")


def test_lengths_are_told_in_feet_and_stay_so(page: Browser) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-coverage")
    place_m = (648000.0, 5136500.0)
    page.click_at(*at(page, *place_m))
    page.until(f"/height [\\d.]+ m/.test({READOUT})")
    page.click("#unit")
    page.until(f"/height [\\d.]+ ft/.test({READOUT})")
    east, north = re.findall(r"[EN] (\d+)", page.value(READOUT))[:2]
    told = re.search(r"height ([\d.]+) ft", page.value(READOUT))
    assert told is not None
    ground_m = float(height_at(dem_samples.load_sample("valley"), float(east), float(north)))
    # the place is told to a metre, and the valley is at most as steep as 45 degrees
    assert float(told[1]) * FOOT_M == pytest.approx(ground_m, abs=1.0)
    antenna = "(document.querySelector('.inspector .slider output')?.textContent ?? '')"
    page.until(f"{antenna} === '{1.5 / FOOT_M:.1f} ft'")
    press_button(page, "Profile to D1")
    page.until("(document.querySelector('.drawer .u-legend')?.textContent ?? '').includes('distance, ft')")
    one = mission(page)["anchors"][0]
    box = page.place(".drawer .u-over", 0.999, 0.5)
    page.mouse("mouseMoved", *box)
    away = "parseFloat(document.querySelector('.drawer .u-value').textContent)"
    whole_m = float(np.hypot(one["east_m"] - float(east), one["north_m"] - float(north)))
    page.until(f"Math.abs({away} * {FOOT_M} - {whole_m}) < {0.02 * whole_m}")
    # what is typed is in feet as well, and kept in metres
    page.choose(field(page, "Height above ground, ft"), "400")
    page.until(f"Math.abs(planner.mission().placing.above_ground_m - {400 * FOOT_M}) < 1e-6")
    page.click("input[name=overlay][value=margin]")
    settled(page)
    page.until("document.querySelector('#legend').textContent.includes('66 ft')")
    settled(page)
    page.open(page.value("location.href"))
    page.until("!!window.planner && document.getElementById('unit').textContent === 'Metres'")
    page.click("#unit")
    page.until("document.getElementById('unit').textContent === 'Feet'")
    page.until("planner.mission().anchors.length === 3")
    assert mission(page)["anchors"][0] == one, "what is kept is in metres"
