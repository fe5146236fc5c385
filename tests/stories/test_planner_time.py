"""What changes with time on the planner's page: satellites and an anchor that flies, as a time bar with frames."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.service.browser import Browser
from tests.service.skies import TIME, almanac
from tests.stories.planner import at, field, mission, place_anchors, settled, shares, slide, take

HALF_HOUR_M = 3000.0


def frame_facts(page: Browser) -> str:
    return page.text(".time-bar .row")


def test_satellites_and_a_drone_that_flies_are_frames_on_a_time_bar(page: Browser, tmp_path: Path) -> None:
    take(page, "valley")
    place_anchors(page)
    page.click("#flies-to")
    flier = mission(page)["anchors"][2]
    page.click_at(*at(page, flier["east_m"] + HALF_HOUR_M / 2, flier["north_m"]))
    page.until("planner.mission().anchors[2].flies_to.length === 1")
    orbits = tmp_path / "made-up.alm"
    orbits.write_text(almanac())
    page.click("#mode-air")
    page.upload("#orbits-file", orbits)
    page.until("planner.mission().times.orbits?.name === 'made-up.alm'")
    page.choose("#begins", TIME[:16])
    page.choose(field(page, "Lasts, min"), "30")
    page.choose(field(page, "A frame every, min"), "10")
    page.click("#calculate-frames")
    page.until("!!document.getElementById('frames-answer')")
    assert "2007-01-27 06:00 UTC" in frame_facts(page)
    assert "3 anchors" in frame_facts(page)
    assert " 0 satellites" not in frame_facts(page)
    assert page.value("document.querySelectorAll('.frame-bars rect').length") == 4
    # at the ceiling the map shows the share that the frame's bar tells
    slide(page, field(page, "Height above ground"), "300")
    for number, clock in enumerate(("06:00", "06:10", "06:20", "06:30")):
        slide(page, "#frame", str(number))
        page.until(f"document.getElementById('frame-time').textContent.includes('{clock}')")
        told = float(frame_facts(page).split("flyable")[1].split("%")[0])
        assert shares(page)[0] == pytest.approx(told, abs=0.11)
    page.click("input[value=available]")
    assert sum(shares(page)) == pytest.approx(100.0, abs=0.5)
    assert "Share of the time" in page.text("#legend")


def test_satellites_without_a_time_are_refused_where_one_asks(page: Browser, tmp_path: Path) -> None:
    take(page, "valley")
    orbits = tmp_path / "made-up.alm"
    orbits.write_text(almanac())
    page.click("#mode-air")
    page.upload("#orbits-file", orbits)
    page.until("planner.mission().times.orbits !== null")
    page.click("#calculate-frames")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('when it begins')")
    settled(page)
