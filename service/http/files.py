"""Finished files as answers: ETag, If-None-Match and ranges."""

from __future__ import annotations

import asyncio
from pathlib import Path

from fastapi import Request, Response
from fastapi.responses import FileResponse

from service.errors import NotFoundError

__all__ = ["file_answer"]


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
    return FileResponse(path, headers=headers, media_type=media_type, filename=path.name, stat_result=stat)
