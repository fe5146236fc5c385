"""A server of files with ranges on the loopback interface, that can be told to misbehave."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path


@dataclass
class RangeServer:
    """Files by path. asked: (path, first byte) of every request; served: bytes that went out.

    how: well, html, redirect, no_ranges, short (fewer bytes than promised), error, slow, elsewhere (another part).
    fails_after: requests that go well before ``how`` begins.
    """

    folder: Path
    url: str = ""
    how: str = "well"
    fails_after: int = 0
    version: str = '"1"'
    asked: list[tuple[str, int]] = field(default_factory=list)
    served: int = 0


@contextmanager
def serving(folder: Path) -> Iterator[RangeServer]:
    told = RangeServer(folder)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *args: object) -> None:
            """Be quiet."""

        def do_GET(self) -> None:
            first, last = (int(n) for n in re.findall(r"\d+", self.headers.get("Range", "bytes=0-0")))
            told.asked.append((self.path, first))
            how = told.how if len(told.asked) > told.fails_after else "well"
            file = told.folder / self.path.lstrip("/")
            if how == "redirect":
                self.answer(302, b"", {"Location": "http://example.com/elsewhere.tif"})
            elif how == "html":
                self.answer(200, b"<!DOCTYPE html><html>Sign in</html>", {"Content-Type": "text/html"})
            elif how == "error":
                self.answer(503, b"")
            elif not file.is_file():
                self.answer(404, b"")
            else:
                self.give(file.read_bytes(), first, last, how)

        def give(self, content: bytes, first: int, last: int, how: str) -> None:
            last = min(last, len(content) - 1)
            part = content[first : last + 1]
            if how == "no_ranges":
                self.answer(200, content)
                return
            if how == "slow":
                time.sleep(1.0)
            if how == "short":
                part = part[: len(part) // 2]
            if how == "elsewhere":
                first += 1
            headers = {"Content-Range": f"bytes {first}-{last}/{len(content)}", "ETag": told.version}
            self.answer(206, part, headers)

        def answer(self, status: int, body: bytes, headers: dict[str, str] | None = None) -> None:
            told.served += len(body)
            self.send_response(status)
            for name, value in (headers or {}).items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            try:
                self.wfile.write(body)
            except BrokenPipeError:
                self.close_connection = True

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    told.url = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    try:
        yield told
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
