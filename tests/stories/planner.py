"""A planner's hands on the page: what the stories of the planner do again and again."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

from tests.service.browser import Browser
from tests.service.running import Server

PIXEL = (
    "(() => {{ planner.map.updateSize(); planner.map.renderSync(); "
    "const p = planner.map.getPixelFromCoordinate([{east}, {north}]); "
    "const b = document.getElementById('map').getBoundingClientRect(); return [p[0] + b.left, p[1] + b.top]; }})()"
)
# what a hand does that lets files go on the page; each is its name and its bytes in base 64
DROP = """(() => {{
  const carried = new DataTransfer();
  const bytes = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
  for (const [name, text] of {files}) carried.items.add(new File([bytes(text)], name));
  document.body.dispatchEvent(new DragEvent('drop', {{bubbles: true, cancelable: true, dataTransfer: carried}}));
}})()"""
RANGES = {"jacksboro": "415 ×", "valley": "320 ×", "crater": "240 ×"}
VALLEY = ((646500, 5136500), (649500, 5138500), (648000, 5135800))


def open_planner(page: Browser, server: Server) -> None:
    """The page as somebody sees it who has never been here."""
    for _ in range(3):
        page.forget(server.url.rstrip("/"))
        page.open(server.url)
        page.until("!!document.getElementById('mode-ground') && !!window.planner")
        # a busy browser writes down what a page kept after that page is gone, and after all was cleared
        if page.value("planner.mission().ground === null && planner.mission().anchors.length === 0"):
            return
    raise AssertionError("The page opens with the mission of the page before.")


def take(page: Browser, sample: str) -> None:
    page.click("#mode-ground")
    page.until(f"!!document.querySelector('#ground-choice option[value=\"sample:{sample}\"]')")
    page.choose("#ground-choice", f"sample:{sample}")
    page.until(f"(document.querySelector('.inspector .facts')?.textContent ?? '').includes('{RANGES[sample]}')")
    settled(page)


def at(page: Browser, east_m: float, north_m: float) -> tuple[float, float]:
    """Pixels of a place on the map, which is drawn for it as it is now."""
    x, y = page.value(PIXEL.format(east=east_m, north=north_m))
    return x, y


def press_button(page: Browser, words: str, among: str = "button") -> None:
    """The button (or what else is pressed) that begins with these words, once it is there and enabled."""
    page.click_on(f"[...document.querySelectorAll({among!r})].find((b) => b.textContent.trim().startsWith({words!r}))")


def field(page: Browser, label: str) -> str:
    """Selector of the field with that label."""
    labels = "[...document.querySelectorAll('.inspector label')]"
    name = page.until(f"{labels}.find((one) => one.textContent.trim().startsWith({label!r}))?.htmlFor")
    return f'[id="{name}"]'


def place_anchors(page: Browser, places: tuple[tuple[float, float], ...] = VALLEY) -> None:
    """Click each on the map, then move it to the highest ground near."""
    page.click("#mode-anchors")
    for number, place in enumerate(places, start=1):
        page.click_at(*at(page, *place))
        page.until(f"document.querySelectorAll('#anchor-list li').length === {number}")
        press_button(page, "To the highest ground")
    settled(page)


def settled(page: Browser) -> None:
    """Wait until nothing is being calculated, nor about to be, and the legend says what the map shows."""
    page.until("window.planner?.atRest()")


def shares(page: Browser) -> list[float]:
    """The shares of the legend, per cent, unknown last; once they have followed the map."""
    settled(page)
    cells = page.value("[...document.querySelectorAll('#legend td')].map((cell) => parseFloat(cell.textContent))")
    return [float(cell) for cell in cells]


def let_go(page: Browser, paths: list[Path]) -> None:
    """Files, let go on the page together."""
    files = [(one.name, base64.b64encode(one.read_bytes()).decode()) for one in paths]
    page.value(DROP.format(files=json.dumps(files)))


def slide(page: Browser, selector: str, value: str) -> None:
    """A slider on its way to a value."""
    page.value(
        f"(() => {{ const e = document.querySelector({selector!r}); e.value = {value!r}; "
        "e.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )


def mission(page: Browser) -> dict[str, Any]:
    """The mission as it stands on the page."""
    return dict(page.value("planner.mission()"))


def requests(page: Browser) -> int:
    """How many requests the page has made."""
    return int(page.value("performance.getEntriesByType('resource').length"))


def in_view(page: Browser, selector: str) -> bool:
    """Whether the whole of an element lies within the window."""
    return bool(
        page.value(
            f"(() => {{ const b = document.querySelector({selector!r}).getBoundingClientRect(); "
            "return b.height > 0 && b.top >= 0 && b.bottom <= innerHeight && b.left >= 0 && b.right <= innerWidth; })()"
        )
    )
