"""Anchors with radios on the planner's page leave as files and come back as they were."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import field, mission, place_anchors, press_button, take


def test_anchors_go_out_with_their_radios_and_come_back_as_they_were(
    page: Browser, server: Server, tmp_path: Path
) -> None:
    take(page, "valley")
    place_anchors(page)
    page.choose(field(page, "Radio"), "868MHz")
    page.choose(field(page, "Longest range"), "4000")
    page.choose(field(page, "Kind"), "mast")
    press_button(page, "D1")
    page.choose(field(page, "Radio"), "uwb")
    page.until("planner.mission().anchors[0].radio === 'uwb'")
    before = mission(page)["anchors"]
    page.until("window.planner?.atRest() && location.search.startsWith('?mission=')")
    path = "/missions/" + str(page.value("new URLSearchParams(location.search).get('mission')"))
    for name in ("anchors.csv", "mission.kmz"):
        (tmp_path / name).write_bytes(server.client.get(f"{path}/files/{name}").content)
        for _ in before:
            page.click("#anchor-list .small")
        page.until("planner.mission().anchors.length === 0")
        page.upload("#anchor-file", tmp_path / name)
        page.until(f"planner.mission().anchors.length === {len(before)}")
        for one, again in zip(before, mission(page)["anchors"], strict=True):
            metres = ("east_m", "north_m", "height_m")
            assert [again[name] for name in metres] == pytest.approx([one[name] for name in metres], abs=0.01)
            assert {**again, **{name: one[name] for name in metres}} == one
    # what a format has no place for is told when it is saved
    press_button(page, ".plan")
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('no place for ids, kinds, radios')")
