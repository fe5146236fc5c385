"""The web page at ``/``: a few files without a build step, which ask the same HTTP API that everybody asks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse
from starlette.staticfiles import StaticFiles

__all__ = ["install"]

PAGE = Path(__file__).parent / "page"
# Everything comes from the service itself: the page works without internet, and nothing else gets a say in it.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class _Files(StaticFiles):
    """Files that a browser asks after each time, so that a new version is never mixed with an old one."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        answer = super().file_response(*args, **kwargs)
        answer.headers.update(HEADERS)
        return answer


def install(app: FastAPI) -> None:
    """Add the page and its files to the app."""

    async def start_page(request: Request) -> Response:
        return FileResponse(PAGE / "index.html", headers=HEADERS)

    app.add_route("/", start_page, methods=["GET", "HEAD"], include_in_schema=False)
    app.mount("/page", _Files(directory=PAGE))
