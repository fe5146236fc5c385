"""The README's mission, place, plan and export, by mouse from an empty page: its steps for a story and a benchmark."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from tests.service.browser import Browser
from tests.stories.planner import at, field, press_button, settled

__all__ = ["EXPORTED", "GOAL", "START", "mission_by_mouse"]

START, GOAL = (645600.0, 5136000.0), (650500.0, 5138500.0)
COUNT, HEIGHT_M, SPACING_M, RANGE_M, SEPARATION_M, SLOPE_DEG = 5, 120, 900, 6000, 500, 30
EXPORTED = ("Mission.anchors.plan", "Mission.mission.zip", "path.gpx")
SAVING_MAY_TAKE_S = 60.0


def mission_by_mouse(page: Browser, folder: Path, after: Callable[[str], None]) -> None:
    """From the page as it opens to the files in a folder; after each step its name is told.

    As the README's commands: five drones for a rover on the ground of the valley, and a path with a good dilution.
    """
    page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
    after("an empty page")
    page.pick("#ground-choice", "A winding valley")
    page.until("(document.querySelector('.inspector .facts')?.textContent ?? '').includes('320 ×')")
    settled(page)
    after("a ground")
    page.click("#mode-coverage")
    for label, value in (("How many", COUNT), ("Height above ground", HEIGHT_M), ("Places every", SPACING_M)):
        page.type_over(field(page, label), str(value))
    page.click("#rules")
    for label, value in (("Apart, at least", SEPARATION_M), ("Longest range", RANGE_M)):
        page.type_over(field(page, label), str(value))
    press_button(page, "The rover moves along the surface", ".inspector .check")
    page.click("#find-more")
    page.until(f"document.querySelectorAll('#found .list li').length === {COUNT}")
    settled(page)
    after("places found")
    press_button(page, "Take all")
    page.until(f"planner.mission().anchors.length === {COUNT}")
    press_button(page, "Dilution", ".layers label")
    settled(page)
    after("places taken")
    page.click("#mode-path")
    page.click("#tool-start")
    page.click_at(*at(page, *START))
    page.click_at(*at(page, *GOAL))
    page.type_over(field(page, "Steepest"), str(SLOPE_DEG))
    press_button(page, "Dilution below the limit all along", ".inspector .check")
    page.click("#plan-path")
    page.until("(document.getElementById('path-answer')?.textContent ?? '').includes('validator passed')")
    settled(page)
    after("a path")
    press_button(page, "Files", "#path-answer summary")
    page.click("#path-answer a[download='path.gpx']")
    page.click("#mode-brief")
    page.click("#save-zip")
    press_button(page, ".plan")
    _wait_for([folder / name for name in EXPORTED])
    settled(page)
    after("files")


def _wait_for(paths: list[Path]) -> None:
    """Until the browser has saved them; a file has its name once it is whole."""
    deadline_s = time.monotonic() + SAVING_MAY_TAKE_S
    while missing := [path.name for path in paths if not path.is_file()]:
        assert time.monotonic() < deadline_s, f"never saved: {missing}"
        time.sleep(0.05)
