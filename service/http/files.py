"""Finished files as answers: ETag, If-None-Match and ranges."""

from __future__ import annotations

import asyncio
from pathlib import Path

from fastapi import Request, Response
from fastapi.responses import FileResponse
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope, Send

from service.errors import NotFoundError, RangeError

__all__ = ["file_answer"]


class _File(FileResponse):
    """A file whose refusals of a Range header are problems, as all refusals are."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        assert self.stat_result is not None
        size_bytes = self.stat_result.st_size

        async def send_unless_refused(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] in (400, 416):
                refusal = RangeError(
                    f"The Range header does not name bytes of this file, which has {size_bytes:,}; send for instance "
                    "'Range: bytes=0-99', or leave it out."
                )
                raise HTTPException(416, headers={"Content-Range": f"bytes */{size_bytes}"}) from refusal
            await send(message)

        await super().__call__(scope, receive, send_unless_refused)


async def file_answer(request: Request, path: Path, media_type: str, version: str) -> Response:
    """The file, or 304 when the client has this version of it. Raises NotFoundError when it was just deleted."""
    etag = f'"{version}"'
    asked = {tag.strip().removeprefix("W/") for tag in request.headers.get("if-none-match", "").split(",")}
    # the content under one digest never changes
    headers = {"ETag": etag, "Cache-Control": "private, no-cache"}
    if etag in asked or "*" in asked:
        return Response(status_code=304, headers=headers)
    try:
        stat = await asyncio.to_thread(path.stat)
    except FileNotFoundError as error:
        raise NotFoundError("file", path.name) from error
    return _File(path, headers=headers, media_type=media_type, filename=path.name, stat_result=stat)
