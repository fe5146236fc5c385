"""A mission planner at the web page, in a real browser: take a ground, place anchors by clicking, read the map."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import dem_samples
from tests.service.browser import Browser, browsing
from tests.service.running import Server

OVERLAY_IS_THERE = "(() => { const e = document.getElementById('overlay'); return !e.hidden && e.naturalWidth > 0; })()"
HILLSHADE_IS_THERE = "document.getElementById('hillshade').naturalWidth > 0"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browsing(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def page(browser: Browser, server: Server) -> Iterator[Browser]:
    """The page as it opens; at the end it has complained about nothing."""
    browser.complaints.clear()
    browser.open(server.url)
    yield browser
    assert browser.complaints == []


def take_jacksboro(page: Browser) -> None:
    page.choose("#ground", "sample:jacksboro")
    page.until(HILLSHADE_IS_THERE)
    page.until("document.getElementById('ground-facts').textContent.includes('jacksboro.tif')")


def test_clicks_become_anchors_and_anchors_a_map_with_numbers(page: Browser) -> None:
    take_jacksboro(page)
    for across, down in ((0.25, 0.3), (0.75, 0.25), (0.7, 0.75)):
        page.click("#map", across, down)
    assert page.value("document.querySelectorAll('#anchors tbody tr').length") == 3
    page.click("#ask")
    page.until(OVERLAY_IS_THERE)
    assert "Anchors in sight" in page.text("#legend")
    shares = page.value("[...document.querySelectorAll('#legend td')].map((cell) => parseFloat(cell.textContent))")
    assert sum(share for share in shares if share is not None) == pytest.approx(100.0, abs=0.5)
    numbers = page.text("#numbers")
    assert all(name in numbers for name in ("D1", "D2", "D3"))
    assert "visible.tif" in page.value("document.getElementById('downloads').textContent")
    assert page.text("#error") == ""


def test_the_same_anchors_are_asked_how_well_they_fix_a_position(page: Browser) -> None:
    take_jacksboro(page)
    for across, down in ((0.2, 0.2), (0.8, 0.2), (0.5, 0.5), (0.5, 0.8)):
        page.click("#map", across, down)
    page.click("input[value=dop-maps]")
    page.click("#ask")
    page.until(OVERLAY_IS_THERE)
    assert "PDOP" in page.text("#legend")
    assert "PDOP below 5" in page.text("#numbers")
    page.choose("#receiver", "3")
    assert "has changed since" in page.text("#stale")


def test_an_anchor_is_where_it_was_clicked_and_moves_and_goes_by_keys(page: Browser) -> None:
    take_jacksboro(page)
    page.click("#map", 0.5, 0.5)
    where = "[1, 2].map((n) => document.querySelectorAll('#anchors tbody input')[n].valueAsNumber)"
    east_m, north_m = page.value(where)
    grid = dem_samples.load_sample("jacksboro")
    middle_east_m = grid.origin_east_m + (grid.cols - 1) / 2 * grid.cell_east_m
    middle_north_m = grid.origin_north_m - (grid.rows - 1) / 2 * grid.cell_north_m
    assert (east_m, north_m) == pytest.approx((middle_east_m, middle_north_m), abs=grid.cell_east_m)
    page.value("document.querySelector('.marker').focus()")
    page.press("ArrowRight")
    assert page.value(where) == pytest.approx([east_m + grid.cell_east_m, north_m], abs=1e-6)
    page.press("Delete")
    assert page.value("document.querySelectorAll('.marker').length") == 0


def test_a_dem_of_ones_own_is_uploaded(page: Browser) -> None:
    page.upload("#file", dem_samples.sample_path("valley"))
    page.until(HILLSHADE_IS_THERE)
    page.until("document.getElementById('ground-facts').textContent.includes('valley.npz')")


def test_what_goes_wrong_is_told_in_one_sentence(page: Browser, tmp_path: Path) -> None:
    page.click("#ask")
    assert page.text("#error") == "Choose a ground first."
    take_jacksboro(page)
    page.click("#map", 0.5, 0.5)
    page.choose("#anchors tbody tr td:nth-child(4) input", "-5")
    page.click("#ask")
    page.until("document.getElementById('error').textContent.includes('above_ground_m')")
    no_dem = tmp_path / "letter.tif"
    no_dem.write_text("Dear planner,")
    page.upload("#file", no_dem)
    page.until("document.getElementById('error').textContent.includes('letter.tif')")
    # refusals are answers to the page, and an error to the browser's own log
    assert all("422" in complaint for complaint in page.complaints)
    page.complaints.clear()


def test_everything_that_can_be_used_has_a_name_for_those_who_do_not_see(page: Browser) -> None:
    take_jacksboro(page)
    page.click("#map", 0.5, 0.5)
    nameless = page.value(
        "[...document.querySelectorAll('input, select, button, progress, img')].filter((e) => !e.hidden "
        "&& !e.labels?.length && !e.getAttribute('aria-label') && !e.textContent.trim() && !e.alt).map((e) => e.id)"
    )
    assert nameless == []
