"""Ground on the planner's page: several files let go at once and joined, and a box of the operator's tiles."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from service.ground.coverage import LIBRARY
from terrain import GroundLibrary, index_ground
from terrain.tiles.library import edited
from tests.service.browser import Browser
from tests.service.running import Server
from tests.stories.planner import field, in_view, let_go, mission, settled, take
from tests.terrain.tiles.cutting import cut_tif, rough

METRES = rasterio.Affine(30, 0, 700_000, 0, -30, 5_100_000)
MIDDLE_DEG = (11.62, 46.0)


@pytest.fixture
def tiles(server: Server, tmp_path: Path) -> Iterator[None]:
    """Nine tiles in the library of the service, which is emptied again."""
    cut_tif(tmp_path / "tiles", rough(120, 150), METRES, shared=True)
    with edited(server.folder / LIBRARY) as editing:
        editing.library, _ = index_ground(GroundLibrary(), [tmp_path / "tiles"])
    yield
    (server.folder / LIBRARY).unlink()


def test_a_box_drawn_over_the_tiles_becomes_the_ground(tiles: None, page: Browser) -> None:
    page.click("#mode-ground")
    page.click("#draw-box")
    page.until("planner.map.getView().getProjection().getCode() === 'degrees'")
    corner = (
        "(() => {{ planner.map.renderSync(); const p = planner.map.getPixelFromCoordinate([{lon}, {lat}]); "
        "const b = document.getElementById('map').getBoundingClientRect(); return [p[0] + b.left, p[1] + b.top]; }})()"
    )
    lon_deg, lat_deg = MIDDLE_DEG
    for lon, lat in ((lon_deg - 0.01, lat_deg - 0.006), (lon_deg + 0.01, lat_deg + 0.006)):
        page.click_at(*page.value(corner.format(lon=lon, lat=lat)))
    page.until("(document.querySelector('.inspector')?.textContent ?? '').includes('mosaic of')")
    settled(page)
    assert "mosaic of" in mission(page)["ground"]["name"]
    # 0.02 by 0.012 degrees at 46 degrees north: a degree of longitude is 77.5 km there, one of latitude 111.2 km
    assert width_and_height_m(page) == pytest.approx((0.02 * 77_480.0, 0.012 * 111_150.0), rel=0.12)


def width_and_height_m(page: Browser) -> tuple[float, float]:
    west, south, east, north = page.value("planner.map.getView().getProjection().getExtent()")
    return east - west, north - south


def test_a_box_is_typed_as_well_as_drawn_and_what_is_no_box_is_told(tiles: None, page: Browser) -> None:
    page.click("#mode-ground")
    page.until("!!document.getElementById('from-borders')")
    borders = field(page, "West, south, east, north")
    page.write(borders, "11.61, 46.01, 11.63, 45.99")
    page.click("#from-borders")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('is no box')")
    assert in_view(page, "#refusal")
    page.choose(borders, "11.61, 45.994, 11.63, 46.006")
    page.click("#from-borders")
    page.until("(planner.mission().ground?.name ?? '').startsWith('mosaic of')")
    settled(page)
    assert width_and_height_m(page) == pytest.approx((0.02 * 77_480.0, 0.012 * 111_150.0), rel=0.12)
    page.click("#undo")
    page.until("planner.mission().ground === null")


def test_corners_of_a_box_are_set_by_the_keyboard_alone(tiles: None, page: Browser) -> None:
    page.click("#mode-ground")
    page.until("!!document.getElementById('draw-box')")
    page.click("#draw-box")
    page.until("planner.map.getView().getProjection().getCode() === 'degrees'")
    center = "planner.map.getView().getCenter()"
    stood: Any = None
    # the view is fitted to the tiles once they are told
    while (stands := page.value(f"planner.map.getView().getAnimating() ? null : {center}")) is None or stands != stood:
        stood = stands
        time.sleep(0.5)
    page.value("document.getElementById('map').focus()")
    page.press("Enter")
    for axis, key in enumerate(("ArrowRight", "ArrowUp")):
        before = page.value(center)
        page.press(key)
        page.until(f"{center}[{axis}] > {before[axis]} && !planner.map.getView().getAnimating()")
    corner = page.value(center)
    page.press("Enter")
    page.until("(planner.mission().ground?.name ?? '').startsWith('mosaic of')")
    settled(page)
    west, south, east, north = (
        float(one) for one in page.value(f"document.querySelector('{field(page, 'West, s')}').value").split(",")
    )
    assert (east, north) == pytest.approx(corner, abs=1e-6)
    assert west < east
    assert south < north
    assert page.value("document.activeElement.id") == "map"


def test_escape_leads_back_from_the_tiles_to_the_ground(tiles: None, page: Browser) -> None:
    take(page, "valley")
    page.until("!!document.getElementById('draw-box')")
    page.click("#draw-box")
    page.until("planner.map.getView().getProjection().getCode() === 'degrees'")
    page.press("Escape")
    page.until("planner.map.getView().getProjection().getCode().startsWith('dem-')")


def test_several_files_let_go_at_once_are_all_read_and_the_bad_one_is_told(page: Browser, tmp_path: Path) -> None:
    for number in (1, 2):
        heights_m = np.full((4, 5), 10.0 * number)
        np.savez(tmp_path / f"{number}.npz", heights_m=heights_m, cell_east_m=10.0, cell_north_m=10.0)
    (tmp_path / "notes.tif").write_text("no picture at all")
    dropped = [tmp_path / name for name in ("1.npz", "notes.tif", "2.npz")]
    let_go(page, dropped)
    page.until("(document.getElementById('notice')?.textContent ?? '').includes('2 grounds were read')")
    page.until("(document.getElementById('refusal')?.textContent ?? '').includes('notes.tif')")
    assert mission(page)["ground"]["name"] == "1.npz"
    assert "2.npz" in page.value("document.getElementById('ground-choice').textContent")
    assert all("422" in complaint for complaint in page.complaints)
    page.complaints.clear()


def test_tiles_that_are_let_go_together_are_joined_to_one_ground(page: Browser, tmp_path: Path) -> None:
    heights_m = rough(61, 81)
    heights_m[30, 40] = np.nan
    let_go(page, cut_tif(tmp_path / "tiles", heights_m, METRES, shared=True, pieces=2))
    page.until("(document.getElementById('join')?.textContent ?? '').includes('These 4 files')")
    first = mission(page)["ground"]["name"]
    page.click("#join-tiles")
    page.until("(planner.mission().ground?.name ?? '') === 'mosaic of 4 tiles'")
    settled(page)
    assert page.text(".inspector .facts").count("81 × 61") == 1
    assert "4 tiles on one lattice were put together" in page.value("document.querySelector('.inspector').textContent")
    assert page.value("document.getElementById('join')") is None
    page.click("#undo")
    page.until(f"planner.mission().ground?.name === {first!r}")
