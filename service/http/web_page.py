"""The planner at ``/`` and the HTTP reference at ``/docs``: built files that ask the same API that everybody asks."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse, HTMLResponse
from starlette.staticfiles import StaticFiles

from service.access.callers import ROOT

__all__ = ["SAID_OF_EVERY_ANSWER", "install"]

# what `make page` builds from service/page/src; users need no node
BUILT = Path(__file__).parents[1] / "page" / "dist"
# Everything comes from the service itself: the page works without internet, and nothing else gets a say in it.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {"Cache-Control": "no-cache", "Content-Security-Policy": POLICY}
# unless it is a page, which has a policy of its own: nothing in it is run, or shown inside something else
SAID_OF_EVERY_ANSWER: Mapping[str, str] = {
    "Content-Security-Policy": "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class _Files(StaticFiles):
    """Files that a browser asks after each time, so that a new version is never mixed with an old one."""

    def file_response(self, full_path: Any, *args: Any, **kwargs: Any) -> Response:
        answer = super().file_response(full_path, *args, **kwargs)
        answer.headers.update(HEADERS)
        if str(full_path).endswith(".js.gz"):
            # a script that is kept packed, for it is large; every browser unpacks it
            answer.headers.update({"Content-Type": "text/javascript; charset=utf-8", "Content-Encoding": "gzip"})
        return answer


def install(app: FastAPI) -> None:
    """Add the planner, the reference and their files to the app."""
    for path, name in (("/", "index.html"), ("/docs", "docs.html")):
        app.add_route(path, _document(name), methods=["GET", "HEAD"], include_in_schema=False)
    app.mount("/page", _Files(directory=BUILT))


def _document(name: str) -> Callable[[Request], Awaitable[Response]]:
    async def document(request: Request) -> Response:
        if not ROOT.get():
            return FileResponse(BUILT / name, headers=HEADERS)
        text = await asyncio.to_thread((BUILT / name).read_text, encoding="utf-8")
        return HTMLResponse(text.replace('="/page/', f'="{ROOT.get()}/page/'), headers=HEADERS)

    return document
