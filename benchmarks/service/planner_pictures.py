"""Pictures of the planner (docs/planner.md): ``python -m benchmarks.service.planner_pictures --out docs/images``.

Those of the README's mission are taken while it is done by mouse; --steps FOLDER takes one after each of its steps too.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dem_samples
from tests.service.browser import Browser, browsing
from tests.service.running import Server, running
from tests.stories.mission_by_mouse import mission_by_mouse
from tests.stories.planner import at, field, mission, open_planner, place_anchors, press_button, settled, slide, take
from tests.stories.test_planner_live import PLACES, rounds

__all__ = ["main"]

WIDTH, HEIGHT = 1440, 900
PINNED, FLIES_TO = (648000.0, 5136500.0), ((650000.0, 5135400.0), (649300.0, 5134900.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    parser.add_argument("--steps", type=Path, help="folder of a picture after each step of the mission")
    options = parser.parse_args()
    for folder in (options.out, options.steps):
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name, _planner(Path(name)) as (page, server):
        saved = Path(name) / "saved"
        saved.mkdir()
        _mission(page, server, saved, options.out, options.steps)
        _profile(page, options.out)
        _time(page, options.out)
        _live(page, server, options.out)
        _usable(page, server, options.out)


@contextmanager
def _planner(folder: Path) -> Iterator[tuple[Browser, Server]]:
    with running(folder / "data") as server, browsing(folder / "profile") as page:
        page.call("Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=False)
        yield page, server


def _mission(page: Browser, server: Server, saved: Path, out: Path, steps: Path | None) -> None:
    number = 0

    def look(step: str) -> None:
        nonlocal number
        number += 1
        if steps is not None:
            page.screenshot(steps / f"{number}-{step.replace(' ', '-')}.png")
        if step == "places found":
            page.click("#map-after")
            settled(page)
            page.screenshot(out / "planner-placing.png")
        if step == "a path":
            page.screenshot(out / "planner-path.png")

    open_planner(page, server)
    mission_by_mouse(page, saved, look)


def _profile(page: Browser, out: Path) -> None:
    """Of the same mission: a place, who is hidden there, and the line to one of them."""
    press_button(page, "Close", ".told button")
    page.click("#mode-coverage")
    press_button(page, "Anchors in sight", ".layers label")
    page.click_at(*at(page, *PINNED))
    page.click_on("document.querySelectorAll('#readout button')[planner.mission().anchors.length - 1]")
    page.until("!!document.querySelector('.drawer canvas')")
    settled(page)
    page.screenshot(out / "planner-profile.png")
    press_button(page, "Close", ".drawer button")
    press_button(page, "Unpin", "#readout button")


def _time(page: Browser, out: Path) -> None:
    """Of the same mission: one drone flies on, and the map is that of a moment."""
    page.click("#mode-anchors")
    page.click("#anchor-list li:nth-child(3) button")
    page.click("#flies-to")
    for place in FLIES_TO:
        page.click_at(*at(page, *place))
    page.click("#mode-air")
    for label, value in (("Lasts, min", "12"), ("A frame every, min", "1")):
        page.type_over(field(page, label), value)
    page.click("#calculate-frames")
    page.until("!!document.getElementById('frames-answer')")
    settled(page)
    page.click("#frame")
    settled(page)
    page.screenshot(out / "planner-time.png")


def _live(page: Browser, server: Server, out: Path) -> None:
    """A session on another mission: five drones, one of them heard too late from half the drive on."""
    open_planner(page, server)
    take(page, "valley")
    place_anchors(page, PLACES)
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, 648000.0, 5136500.0))
    page.click_at(*at(page, 650500.0, 5138500.0))
    page.type_over(field(page, "Steepest"), "40")
    page.click("#plan-path")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    page.click("#mode-live")
    page.click("#open-session")
    page.until("!!document.getElementById('listening')")
    session = str(page.value("document.querySelector('.inspector code').textContent")).removesuffix("/stream")
    for time_s, ranges in rounds(dem_samples.load_sample("valley"), mission(page)["anchors"], 60):
        measured = [{"anchor_id": name, "range_m": range_m} for name, range_m in ranges.items()]
        body = {"epochs": [{"time_s": time_s, "ranges": measured}]}
        server.client.post(f"{session}/epochs", json=body).raise_for_status()
    page.until("(document.querySelector('.inspector .slider output')?.textContent ?? '').startsWith('60 of 60')")
    settled(page)
    page.screenshot(out / "planner-live.png")


def _usable(page: Browser, server: Server, out: Path) -> None:
    """Signals of three drones under trees, in the dark."""
    open_planner(page, server)
    take(page, "valley")
    place_anchors(page)
    page.click("#mode-ground")
    page.type_over(field(page, "One height everywhere"), "6")
    page.click("#mode-coverage")
    page.pick(field(page, "Maps, paths and places are of"), "usable signals")
    page.pick(field(page, "Radio of those"), "2.4 GHz")
    press_button(page, "Margin of the best signal", ".layers label")
    page.click("#theme")
    slide(page, field(page, "Margin wanted"), "10")
    page.click_at(*at(page, *PINNED))
    settled(page)
    page.screenshot(out / "planner-usable.png")


if __name__ == "__main__":
    main()
