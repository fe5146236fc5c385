"""The planner in a headless Chromium: how long it takes to open, follow a drag, read a place, move a slider."""

from __future__ import annotations

import gzip
import io
import tempfile
import time
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil

from benchmarks.report import Row, Table, duration
from benchmarks.service.over_http import wait_until_warm
from benchmarks.terrains import DATA, fractal_m
from service.cli.own_service import running_service
from service.http.web_page import BUILT
from tests.service.browser import Browser, browsing
from tests.stories.mission_by_mouse import mission_by_mouse

__all__ = ["planner"]

CELL_M = 30.0
DRAG_POSTS, SLIDER_POSTS = 878, 2048  # about 770,000 and 4 million posts
ANCHORS, STEPS, SLIDER_S = 6, 10, 3.0
DRAGS = 1000
NO_RESULTS = ("sightline.sqlite3", "service.log")  # a line of the log for each request
REAL = {"bigtujunga": "bigtujunga.tif", "Gale crater, Mars": "mmgis_gale_missionDEM.tif"}
NOTE = """\
A rough fractal ground of 30 m cells in a local frame, as an upload; anchors 120 m above it; window 1500 by 1000,
headless and without a graphics card, the service on the same machine. A drag moves one of 6 anchors in 10 steps: from a
step to the first map that is newer, from letting go to the map of the last place. Slider: the antenna's height with all
anchors in sight on the map, frames drawn in 3 s. Read-out: from resting the pointer to clearances, dilution and error
from the service; height, slope and sight are there at once. DEMs of others lie in ../shared. 1,000 drags are what
the page asks for in them, without the page; memory and files after a tenth of them, and at the end. The README's
mission goes by mouse events from a page that knows nothing: five drones found and taken, a path, three files saved."""
FRAMES = (
    "(async () => { const all = [...document.querySelectorAll('input[type=range]')]; "
    "const e = all.find((one) => one.max === '30'); "
    "const begun = performance.now(); let n = 0; const drawn = planner.times.frameTimesMs.length; "
    "while (performance.now() - begun < %d) { e.value = String(0.5 + (n++ %% 50) / 2); "
    "e.dispatchEvent(new Event('input', {bubbles: true})); await new Promise((r) => requestAnimationFrame(r)); } "
    "return (planner.times.frameTimesMs.length - drawn) / ((performance.now() - begun) / 1000); })()"
)
PAINT_MS = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"


def planner() -> Table:
    """The page's targets (docs/planner.md), each once on a warm service."""
    real = {called: DATA / file for called, file in REAL.items() if (DATA / file).is_file()}
    with tempfile.TemporaryDirectory() as name, running_service(Path(name)) as client:
        wait_until_warm(client)
        dems = {posts: _uploaded(client, posts) for posts in (DRAG_POSTS, SLIDER_POSTS)}
        remains = _thousand_drags(client, Path(name))
        with browsing(Path(name) / "profile") as page:
            rows = [_mission(page, client, Path(name)), *_opening(page, client)]
            rows += _dragging(page, client, dems[DRAG_POSTS])
            rows += _sliding(page, client, dems[SLIDER_POSTS])
            for called, path in real.items():
                rows += _on_real_ground(page, client, called, path)
            rows += remains
            complaints = page.complaints
    size = sum(
        len(gzip.compress(path.read_bytes())) for path in BUILT.iterdir() if path.suffix in (".js", ".css", ".html")
    )
    rows.append(Row(("built page, gzipped", f"{size / 1000:.0f} kB"), "≤ 600 kB", size <= 600_000))
    rows.append(Row(("console errors", str(len(complaints))), "0", not complaints))
    return Table("The planner in a browser", ("what", "measured"), rows, NOTE)


def _on_real_ground(page: Browser, client: httpx.Client, called: str, path: Path) -> list[Row]:
    """Map, drag and read-out over a DEM that others measured."""
    with path.open("rb") as file:
        dem = client.post("/dems", files={"file": (path.name, file)}).raise_for_status().json()
    began_s = time.perf_counter()
    client.get(f"/dems/{dem['id']}/heights").raise_for_status()
    heights_s = time.perf_counter() - began_s
    rows = _dragging(page, client, dem, f"{called}, {dem['rows']} × {dem['cols']}")
    return [
        Row((f"{called}: heights as numbers, the first time", duration(heights_s)), "≤ 2 s", heights_s <= 2.0),
        *rows,
    ]


def _thousand_drags(client: httpx.Client, folder: Path) -> list[Row]:
    """What a drag asks for, a thousand times: a coarse map on the way, the whole one of the place where it ends."""
    dem = client.post("/dems", params={"sample": "jacksboro"}).raise_for_status().json()
    bounds = dem["bounds_of_posts_m"]

    def drag(number: int) -> None:
        share = 0.1 + 0.8 * (number % 997) / 997.0
        place = {
            "east_m": bounds["west"] + share * (bounds["east"] - bounds["west"]),
            "north_m": bounds["south"] + (1.0 - share) * (bounds["north"] - bounds["south"]),
        }
        anchors = [{"id": "D1", **place, "altitude_m": dem["highest_m"] + 20.0}]
        for level in (1, 0):
            body = {"dem_id": dem["id"], "anchors": anchors, "level": level, "show": "needed_height"}
            client.post("/previews", json=body).raise_for_status()

    for number in range(DRAGS // 10):
        drag(number)
    before = _held(folder)
    for number in range(DRAGS):
        drag(number + 1)
    memory, disk = (after - first for after, first in zip(_held(folder), before, strict=True))
    return [
        Row(
            (f"{DRAGS:,} drags: memory of the service's processes", f"{memory / 1e6:+.0f} MB"),
            "≤ 32 MB more",
            memory <= 32e6,
        ),
        Row(("the same: its data folder", f"{disk:+,} bytes"), "0", disk == 0),
    ]


def _held(folder: Path) -> tuple[int, int]:
    """Bytes of memory of all processes that this one began, and of files but store and log."""
    memory = sum(child.memory_info().rss for child in psutil.Process().children(recursive=True))
    files = [path for path in folder.rglob("*") if path.is_file() and not path.name.startswith(NO_RESULTS)]
    return memory, sum(path.stat().st_size for path in files)


def _mission(page: Browser, client: httpx.Client, folder: Path) -> Row:
    """The whole of the README's mission, pictures of its steps included."""
    saved = folder / "saved"
    saved.mkdir()
    began_s = time.perf_counter()
    page.open(str(client.base_url))
    page.until("!!document.getElementById('mode-ground') && !!window.planner")
    mission_by_mouse(page, saved, lambda step: page.screenshot(folder / f"{step}.png"))
    whole_s = time.perf_counter() - began_s
    return Row(("the README's mission by mouse: place, plan, export", duration(whole_s)), "≤ 90 s", whole_s <= 90.0)


def _opening(page: Browser, client: httpx.Client) -> list[Row]:
    page.open(str(client.base_url))
    page.until("!!document.getElementById('mode-ground')")
    paint_s = page.until(PAINT_MS) / 1000.0
    began_s = time.perf_counter()
    page.choose("#ground-choice", "sample:jacksboro")
    page.until("window.planner?.times.frameTimesMs.length > 0")
    ready_s = time.perf_counter() - began_s
    return [
        Row(("first paint", duration(paint_s)), "≤ 1 s", paint_s <= 1.0),
        Row(("a sample chosen, its map drawn", duration(ready_s)), "≤ 2 s", ready_s <= 2.0),
    ]


def _dragging(page: Browser, client: httpx.Client, dem: dict[str, Any], called: str = "770,000 posts") -> list[Row]:
    _open_mission(page, client, dem)
    first_s, full_s = list[float](), list[float]()
    for number in range(3):
        start = _pixel(page, number)
        page.mouse("mouseMoved", *start)
        page.mouse("mousePressed", *start, button="left", clickCount=1)
        for step in range(1, STEPS + 1):
            asked, began_s = page.value("planner.times.surfaceTimesMs.length"), time.perf_counter()
            page.mouse("mouseMoved", start[0] + 4.0 * step, start[1] + 2.0 * step, button="left", buttons=1)
            page.until(f"window.planner?.times.surfaceTimesMs.length > {asked}")
            first_s.append(time.perf_counter() - began_s)
        began_s = time.perf_counter()
        page.mouse("mouseReleased", start[0] + 4.0 * STEPS, start[1] + 2.0 * STEPS, button="left", clickCount=1)
        page.until("window.planner?.mapAtRest()")
        full_s.append(first_s[-1] + time.perf_counter() - began_s)
    probes_s = list[float]()
    for number in range(10):
        x, y = page.place("#map", 0.4 + 0.01 * number, 0.5)
        asked = page.value("planner.times.probeTimesMs.length")
        page.mouse("mouseMoved", x, y)
        page.until(f"window.planner?.times.probeTimesMs.length > {asked}")
        probes_s.append(page.value("planner.times.probeTimesMs.at(-1)") / 1000.0)
    first, full, probe = (float(np.median(times_s)) for times_s in (first_s, full_s, probes_s))
    return [
        Row((f"drag, {called}, 6 anchors: first new map, median", duration(first)), "≤ 150 ms", first <= 0.15),
        Row(("the same: full map", duration(full)), "≤ 500 ms", full <= 0.5),
        Row(("read-out of a place from the service, median", duration(probe)), "≤ 50 ms", probe <= 0.05),
    ]


def _sliding(page: Browser, client: httpx.Client, dem: dict[str, Any]) -> list[Row]:
    _open_mission(page, client, dem)
    page.click("#mode-coverage")
    page.until("window.planner?.atRest()")
    frames = float(page.value(FRAMES % int(1000 * SLIDER_S)))
    return [Row(("slider over 4 million posts", f"{frames:.0f} frames/s"), "≥ 30 frames/s", frames >= 30.0)]


def _uploaded(client: httpx.Client, posts: int) -> dict[str, Any]:
    file = io.BytesIO()
    np.save(file, fractal_m(posts))
    query = {"filename": "fractal.npy", "cell_m": str(CELL_M), "crs": "local"}
    answer = client.post("/dems", params=query, content=file.getvalue()).raise_for_status()
    return dict(answer.json())


def _open_mission(page: Browser, client: httpx.Client, dem: dict[str, Any]) -> None:
    """Open the page on a ground with anchors, a mission that the service keeps."""
    bounds = dem["bounds_of_posts_m"]
    across_m, up_m = bounds["east"] - bounds["west"], bounds["north"] - bounds["south"]
    base = {"kind": "drone", "height_m": 120.0, "height_from": "above_ground_m", "ranging_sigma_m": 0.1}
    none = {"max_range_m": None, "azimuth_from_deg": None, "azimuth_to_deg": None}
    anchors = [
        {
            "id": f"D{number + 1}",
            "east_m": bounds["west"] + across_m * (0.3 + 0.2 * (number % 3)),
            "north_m": bounds["south"] + up_m * (0.35 + 0.3 * (number // 3)),
            **base,
            **none,
        }
        for number in range(ANCHORS)
    ]
    ground = {"dem_id": dem["id"], "name": dem["name"], "sha256": dem["sha256"]}
    mission = {"format": "sightline-mission", "version": 1, "name": "bench", "ground": ground, "anchors": anchors}
    told = client.post("/missions", json=mission).json()
    page.open(f"{str(client.base_url).rstrip('/')}{told['links']['page']}")
    page.until("!!document.getElementById('mode-anchors')")
    page.click("#mode-anchors")
    page.until(f"window.planner?.times.surfaceTimesMs.length >= {ANCHORS}")
    page.until("window.planner?.atRest()")


def _pixel(page: Browser, number: int) -> tuple[float, float]:
    """Where an anchor is on the page."""
    x, y = page.value(
        "(() => { const m = planner.mission().anchors["
        f"{number}]; const p = planner.map.getPixelFromCoordinate([m.east_m, m.north_m]); "
        "const b = document.getElementById('map').getBoundingClientRect(); return [p[0] + b.left, p[1] + b.top]; })()"
    )
    return x, y
