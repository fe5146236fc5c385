"""A headless Chromium that tests steer through its DevTools protocol: load, click, type, look."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.sync.client import ClientConnection, connect

NAMES = ("chromium", "chromium-browser", "google-chrome")
MAY_TAKE_S = 150.0
ARROWS = {"ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
KEYS = {**ARROWS, "Delete": 46, "Enter": 13, "Escape": 27, "Tab": 9, "z": 90, "y": 89}
CONTROL = 2  # of DevTools' key modifiers
# Pixels of a share of an element's box, once a press there meets it: in place for two frames, enabled, nothing over it.
PRESSABLE = """(async () => {{
  const one = {element};
  if (!one || one.disabled) return null;
  one.scrollIntoView({{block: 'nearest'}});
  const box = () => {{ const b = one.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; }};
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  const before = box();
  await frame();
  await frame();
  const [left, top, width, height] = box();
  if ([left, top, width, height].some((value, at) => value !== before[at])) return null;
  const [x, y] = [left + {across} * width, top + {down} * height];
  return one.contains(document.elementFromPoint(x, y)) ? [x, y] : null;
}})()"""


@dataclass
class Browser:
    """One page; complaints collects what it wrote to its console as an error and what it could not load."""

    socket: ClientConnection
    sent: int = 0
    complaints: list[str] = field(default_factory=list)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self.sent += 1
        self.socket.send(json.dumps({"id": self.sent, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv(MAY_TAKE_S))
            self._listen(message)
            if message.get("id") == self.sent:
                assert "error" not in message, message
                return dict(message["result"])

    def _listen(self, message: dict[str, Any]) -> None:
        if message.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(str(message["params"]["exceptionDetails"]))
        if message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
            self.complaints.append(message["params"]["entry"]["text"])

    def open(self, url: str) -> None:
        self.call("Page.navigate", url=url)
        self.until("document.readyState === 'complete'")

    def value(self, expression: str) -> Any:
        told = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    def until(self, expression: str) -> Any:
        deadline_s = time.monotonic() + MAY_TAKE_S
        while not (found := self.value(expression)):
            assert time.monotonic() < deadline_s, f"never: {expression}; the page shows {self.text('body')}"
            time.sleep(0.05)
        return found

    def text(self, selector: str) -> str:
        return str(self.value(f"document.querySelector({selector!r}).innerText"))

    def click(self, selector: str, across: float = 0.5, down: float = 0.5) -> None:
        """Press and let go of the mouse at a share of the element's width and height, once it lies there on top."""
        self.click_on(f"document.querySelector({selector!r})", across, down)

    def click_on(self, element: str, across: float = 0.5, down: float = 0.5, times: int = 1) -> None:
        """The same of what an expression finds."""
        x, y = self.until(PRESSABLE.format(element=element, across=across, down=down))
        self.click_at(x, y, times)

    def type_over(self, selector: str, text: str) -> None:
        """Click three times into a field, which takes hold of all that stands there, type, and leave it."""
        self.click_on(f"document.querySelector({selector!r})", times=3)
        self.call("Input.insertText", text=text)
        self.press("Tab")

    def forget(self, origin: str) -> None:
        """Leave the page, so that it writes no more, and clear all that it kept in the browser."""
        self.open("about:blank")
        self.call("Storage.clearDataForOrigin", origin=origin, storageTypes="all")

    def place(self, selector: str, across: float = 0.5, down: float = 0.5) -> tuple[float, float]:
        """Pixels of a share of the element's width and height."""
        box = self.value(
            f"(() => {{ const e = document.querySelector({selector!r}); e.scrollIntoView({{block: 'nearest'}}); "
            "const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()"
        )
        return box[0] + across * box[2], box[1] + down * box[3]

    def click_at(self, x: float, y: float, times: int = 1) -> None:
        self.mouse("mouseMoved", x, y)
        for number in range(1, times + 1):
            for kind in ("mousePressed", "mouseReleased"):
                self.mouse(kind, x, y, button="left", clickCount=number)

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8, pause_s: float = 0.02) -> None:
        """Press at one place of the page, move in steps to another, let go."""
        self.mouse("mouseMoved", *start)
        self.mouse("mousePressed", *start, button="left", clickCount=1)
        for number in range(1, steps + 1):
            x, y = (a + (b - a) * number / steps for a, b in zip(start, end, strict=True))
            self.mouse("mouseMoved", x, y, button="left", buttons=1)
            time.sleep(pause_s)
        self.mouse("mouseReleased", *end, button="left", clickCount=1)

    def press(self, key: str, modifiers: int = 0) -> None:
        code = f"Key{key.upper()}" if len(key) == 1 else key
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                code=code,
                windowsVirtualKeyCode=KEYS[key],
                modifiers=modifiers,
            )

    def write(self, selector: str, text: str) -> None:
        """Put the cursor into a field and type."""
        self.value(f"document.querySelector({selector!r}).focus()")
        self.call("Input.insertText", text=text)

    def choose(self, selector: str, value: str) -> None:
        """Take an option of a select, or type into a field, as its user would be seen doing it."""
        self.value(
            f"(() => {{ const e = document.querySelector({selector!r}); e.value = {value!r}; "
            "e.dispatchEvent(new Event('change', {bubbles: true})); })()"
        )

    def pick(self, selector: str, words: str) -> None:
        """Open a select with the mouse, go to the option that begins with these words, and take it."""
        options = f"[...document.querySelector({selector!r}).options].filter((one) => !one.disabled)"
        steps = self.until(
            f"(({{all, now}}) => {{ const to = all.findIndex((one) => one.text.startsWith({words!r})); "
            f"return to < 0 ? null : [to - all.indexOf(now)]; }})({{all: {options}, "
            f"now: document.querySelector({selector!r}).selectedOptions[0]}})"
        )[0]
        self.click(selector)
        for _ in range(abs(steps)):
            self.press("ArrowDown" if steps > 0 else "ArrowUp")
        self.press("Enter")

    def let_go(self, paths: Sequence[Path], x: float, y: float) -> None:
        """Files, or a folder, dragged from elsewhere onto the page and let go there."""
        carried = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=x, y=y, data=carried)

    def upload(self, selector: str, path: Path) -> None:
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(path)])

    def screenshot(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))


@contextmanager
def browsing(folder: Path) -> Iterator[Browser]:
    """A browser with a fresh profile in that folder; skips the test where there is none."""
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip("no Chromium here (Debian package chromium)")
    command = [program, "--headless=new", "--remote-debugging-port=0", f"--user-data-dir={folder}", "--disable-gpu"]
    command += ["--no-first-run", "--disable-dev-shm-usage", "--window-size=1500,1000", "--no-proxy-server"]
    if os.geteuid() == 0:
        command.append("--no-sandbox")  # Chromium has no sandbox for root
    process = subprocess.Popen([*command, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with connect(_page(folder, process), max_size=None, proxy=None) as socket:
            browser = Browser(socket)
            for domain in ("Page", "Runtime", "Log", "DOM"):
                browser.call(f"{domain}.enable")
            yield browser
    finally:
        process.terminate()
        process.wait(30)


def _page(folder: Path, process: subprocess.Popen[bytes]) -> str:
    """Address of the first page's socket, once the browser has said on which port it listens."""
    told, deadline_s = folder / "DevToolsActivePort", time.monotonic() + MAY_TAKE_S
    while time.monotonic() < deadline_s:
        assert process.poll() is None, f"Chromium ended with {process.returncode}"
        if told.is_file() and (lines := told.read_text().splitlines()):
            pages = httpx.get(f"http://127.0.0.1:{lines[0]}/json/list", trust_env=False).json()
            for page in pages:
                if page["type"] == "page":
                    return str(page["webSocketDebuggerUrl"])
        time.sleep(0.05)
    raise AssertionError("Chromium did not open a page in time")
