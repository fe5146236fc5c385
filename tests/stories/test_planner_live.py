"""A drive seen on the planner's page: a session that is watched as it judges, and a log played back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import dem_samples
from terrain import ElevationGrid, height_at
from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import at, field, mission, place_anchors, press_button, settled, take

PLACES = (
    (646500.0, 5136500.0),
    (649500.0, 5138500.0),
    (648000.0, 5135800.0),
    (647200.0, 5138200.0),
    (648900.0, 5137000.0),
)
ANTENNA_M, TOO_LONG_M = 1.5, 25.0
LISTENS = "!!document.getElementById('listening')"
DRAWN = (
    "planner.map.getAllLayers().find((one) => one.getZIndex() === 22).getSource().getFeatures()"
    ".flatMap((one) => [one.getStyle()].flat())"
)


@pytest.fixture(scope="module")
def valley() -> ElevationGrid:
    return dem_samples.load_sample("valley")


def rounds(
    valley: ElevationGrid, anchors: list[dict[str, Any]], seconds: int
) -> Iterator[tuple[float, dict[str, float]]]:
    """Time and true ranges of a rover that drives east, the first anchor's 25 m too long from half the drive on."""
    for second in range(seconds):
        east_m, north_m = 648000.0 + second, 5136500.0
        altitude_m = float(height_at(valley, east_m, north_m)) + ANTENNA_M
        ranges = {}
        for anchor in anchors:
            up_m = float(height_at(valley, anchor["east_m"], anchor["north_m"])) + anchor["height_m"] - altitude_m
            ranges[anchor["id"]] = math.hypot(anchor["east_m"] - east_m, anchor["north_m"] - north_m, up_m)
        if second >= seconds // 2:
            ranges[anchors[0]["id"]] += TOO_LONG_M
        yield float(second), ranges


def told(page: Browser) -> tuple[float, float]:
    """East and north of the rover as the panel tells it."""
    cells = page.value("[...document.querySelectorAll('#live-answer dd')].slice(0, 2).map((one) => one.textContent)")
    return float(cells[0]), float(cells[1])


def verdict(page: Browser, number: int) -> str:
    return str(page.value(f"document.querySelectorAll('#verdicts tbody tr')[{number}].cells[1].textContent"))


def test_a_rover_is_watched_while_its_session_judges(page: Browser, server: Server, valley: ElevationGrid) -> None:
    take(page, "valley")
    place_anchors(page, PLACES)
    page.click("#mode-live")
    page.click("#open-session")
    page.until(LISTENS)
    session = str(page.value("document.querySelector('.inspector code').textContent")).removesuffix("/stream")
    for time_s, ranges in rounds(valley, mission(page)["anchors"], 12):
        measured = [{"anchor_id": name, "range_m": range_m} for name, range_m in ranges.items()]
        body = {"epochs": [{"time_s": time_s, "ranges": measured}]}
        assert server.client.post(f"{session}/epochs", json=body).is_success
    page.until("(document.querySelector('.inspector .slider output')?.textContent ?? '').startsWith('12 of 12')")
    assert told(page) == pytest.approx((648011.0, 5136500.0), abs=2.0)
    assert [verdict(page, number) for number in range(5)] == ["occluded", *["in sight"] * 4]
    assert "%" in page.value("document.querySelector('#verdicts tbody tr').cells[2].textContent")
    drawn = "planner.map.getAllLayers().find((one) => one.getZIndex() === 22).getSource().getFeatures().length"
    # rings, lines; trail, ellipse, rover; what occluded ranges say against the map: where, and a line to the anchor
    page.until(f"{drawn} === {5 + 5 + 3 + 2}")


def test_a_session_of_anchors_with_radios_is_foretold_by_their_signals(
    page: Browser, server: Server, valley: ElevationGrid
) -> None:
    take(page, "valley")
    place_anchors(page, PLACES)
    page.click("#mode-coverage")
    page.choose(field(page, "Maps, paths"), "usable")
    page.choose(field(page, "Radio of those"), "868MHz")
    settled(page)
    page.click("#mode-live")
    page.click("#open-session")
    page.until(LISTENS)
    session = str(page.value("document.querySelector('.inspector code').textContent")).removesuffix("/stream")
    for time_s, ranges in rounds(valley, mission(page)["anchors"], 6):
        measured = [{"anchor_id": name, "range_m": range_m} for name, range_m in ranges.items()]
        told = server.client.post(f"{session}/epochs", json={"epochs": [{"time_s": time_s, "ranges": measured}]}).json()
    page.until("(document.querySelector('.inspector .slider output')?.textContent ?? '').startsWith('6 of 6')")
    foretold = {one["anchor_id"]: one for one in told["answers"][-1]["predicted"]}
    assert all(one["p_usable"] is not None for one in foretold.values())
    cells = page.value("[...document.querySelectorAll('#verdicts tbody tr')].map((row) => row.cells[2].innerText)")
    for one, cell in zip(foretold.values(), cells, strict=True):
        assert cell.startswith(f"{100.0 * one['p_sight']:.1f} %, usable {100.0 * one['p_usable']:.1f} %")


def test_what_lies_ahead_on_the_planned_path_is_told_live(page: Browser, server: Server, valley: ElevationGrid) -> None:
    take(page, "valley")
    place_anchors(page, PLACES)
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, 648000.0, 5136500.0))
    page.click_at(*at(page, 650500.0, 5138500.0))
    page.choose(field(page, "Steepest"), "40")
    page.click("#plan-path")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    page.click("#mode-live")
    page.click("#open-session")
    page.until(LISTENS)
    session = str(page.value("document.querySelector('.inspector code').textContent")).removesuffix("/stream")
    for time_s, ranges in rounds(valley, mission(page)["anchors"], 4):
        measured = [{"anchor_id": name, "range_m": range_m} for name, range_m in ranges.items()]
        body = {"epochs": [{"time_s": time_s, "ranges": measured}]}
        assert server.client.post(f"{session}/epochs", json=body).is_success
    page.until("!!document.getElementById('ahead')")
    page.until("(document.querySelector('.inspector .slider output')?.textContent ?? '').startsWith('4 of 4')")
    told = server.client.get(f"{session}/advice").json()
    shown = page.text("#ahead")
    assert f"bubble ahead: {max(told['bubble_m']):.2f} m" in shown
    assert page.value("document.querySelectorAll('#ahead li').length") == len(told["stretches"])
    for stretch in told["stretches"]:
        assert f"{stretch['fewest']} usable" in shown
    if told["stretches"] and told["move"] is not None:
        page.until(f"document.getElementById('ahead').innerText.includes({told['move']['sentence']!r})")


def test_a_path_through_a_building_and_ranges_against_the_map_are_told_live(
    page: Browser, server: Server, valley: ElevationGrid
) -> None:
    """A session that somebody else opened, with a path and buildings of its own, is watched."""
    take(page, "valley")
    place_anchors(page, PLACES)
    kept = mission(page)
    corners = [(648040.0, 5136480.0), (648080.0, 5136480.0), (648080.0, 5136520.0), (648040.0, 5136520.0)]
    hall = {"type": "Polygon", "coordinates": [[list(corner) for corner in (*corners, corners[0])]]}
    features = [{"type": "Feature", "properties": {"building": "yes", "height": "6"}, "geometry": hall}]
    geojson = {"type": "FeatureCollection", "coordinates_are": "metres", "features": features}
    anchors = [
        {
            **{name: one[name] for name in ("id", "east_m", "north_m")},
            "altitude_m": float(height_at(valley, one["east_m"], one["north_m"])) + one["height_m"],
        }
        for one in kept["anchors"]
    ]
    body = {
        "name": "Another drive",
        "anchors": anchors,
        "dem_id": kept["ground"]["dem_id"],
        "antenna_above_ground_m": ANTENNA_M,
        "cover": {"footprints": {"geojson": geojson}},
        "drive": {"path_m": [[648000.0, 5136500.0], [648300.0, 5136500.0]], "min_anchors": 3},
    }
    opened = server.client.post("/detectors", json=body)
    assert opened.status_code == 201, opened.text
    links = opened.json()["links"]
    assert server.client.get(links["drive"]).json()["path_m"] == body["drive"]["path_m"]  # type: ignore[index] # an object
    page.click("#mode-live")
    watch = "button[aria-label='Watch Another drive']"
    page.until(f'!!document.querySelector("{watch}")')
    page.click(watch)
    page.until(LISTENS)
    for time_s, ranges in rounds(valley, kept["anchors"], 20):
        measured = [{"anchor_id": name, "range_m": range_m} for name, range_m in ranges.items()]
        sent = server.client.post(links["epochs"], json={"epochs": [{"time_s": time_s, "ranges": measured}]})
        assert sent.is_success
    page.until("!!document.getElementById('obstructed')")
    assert page.text("#obstructed").startswith("through a building in ")
    (wrong,) = server.client.get(links["map_doubts"]).json()["features"]
    # the page asks every few seconds: what it tells in the end is what the session knows in the end
    begins = f"{wrong['properties']['anchor_id']}: the map has it {wrong['properties']['expected']}, "
    look = f"Look at {wrong['properties']['bearing_deg']:.0f}°"
    told = "(document.getElementById('doubts')?.innerText ?? '')"
    page.until(f"{told}.startsWith({begins!r}) && {told}.includes({look!r})")
    # both are drawn as well
    page.until(f"{DRAWN}.some((style) => style.getText()?.getText() === 'D1?')")
    page.until(f"{DRAWN}.some((style) => style.getStroke()?.getLineDash()?.join() === '2,6')")
    assert page.complaints == []
    server.client.delete(links["self"])
    page.until("!!document.getElementById('refusal')")
    # the session is over: at most what the page was asking just then is answered so, and what was told stays
    assert all("410" in complaint for complaint in page.complaints)
    page.complaints.clear()
    assert page.text("#doubts").startswith(begins)


def test_a_log_is_played_back_on_a_time_bar(
    page: Browser, server: Server, valley: ElevationGrid, tmp_path: Path
) -> None:
    take(page, "valley")
    place_anchors(page, PLACES)
    log = tmp_path / "drive.csv"
    # as another program writes them: a column for each anchor, millimetres and milliseconds
    drive = list(rounds(valley, mission(page)["anchors"], 20))
    head = ["time_ms", *(f"{name} range [mm]" for name in drive[0][1])]
    rows = [[f"{1000.0 * time_s:.0f}", *(f"{1000.0 * one:.0f}" for one in ranges.values())] for time_s, ranges in drive]
    log.write_text("\n".join(";".join(row) for row in [head, *rows]))
    before = server.client.get("/detectors").json()["total"]
    page.click("#mode-live")
    page.upload("#log-file", log)
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('20 epochs')")
    settled(page)
    assert told(page) == pytest.approx((648000.0, 5136500.0), abs=2.0)
    assert verdict(page, 0) == "in sight"
    page.value(
        "(() => { const e = document.querySelector('.inspector input[type=range]'); e.value = '19'; "
        "e.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )
    page.until("document.querySelector('.inspector .slider output').textContent.startsWith('20 of 20, 19.0 s')")
    assert told(page) == pytest.approx((648019.0, 5136500.0), abs=2.0)
    assert verdict(page, 0) == "occluded"
    # where the map hides the drone its ranges were true for long
    assert page.text("#doubts").startswith("D1: the map has it hidden, ")
    assert "s say in sight" in page.text("#doubts")
    assert server.client.get("/detectors").json()["total"] == before, "the session of a log is closed behind it"


def test_a_log_that_takes_long_is_stopped_and_leaves_no_session(
    page: Browser, server: Server, valley: ElevationGrid, tmp_path: Path
) -> None:
    take(page, "valley")
    place_anchors(page, PLACES)
    log = tmp_path / "hours.csv"
    ((_, ranges),) = rounds(valley, mission(page)["anchors"], 1)
    measured = ",".join(f"{one:.2f}" for one in ranges.values())
    log.write_text("\n".join([",".join(["time_s", *ranges]), *(f"{second},{measured}" for second in range(12_000))]))
    before = server.client.get("/detectors").json()["total"]
    page.click("#mode-live")
    page.upload("#log-file", log)
    press_button(page, "Cancel")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('Cancelled')")
    settled(page)
    assert page.value("document.querySelector('#verdicts') === null"), "nothing of it is shown"
    assert server.client.get("/detectors").json()["total"] == before


def test_a_file_that_is_no_log_is_refused_by_what_it_lacks(page: Browser, tmp_path: Path) -> None:
    take(page, "valley")
    place_anchors(page, PLACES[:3])
    wrong = tmp_path / "anchors.csv"
    wrong.write_text("id,east_m\nD1,3\n")
    page.click("#mode-live")
    page.upload("#log-file", wrong)
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('anchors.csv')")
    assert all("422" in complaint for complaint in page.complaints)
    page.complaints.clear()
