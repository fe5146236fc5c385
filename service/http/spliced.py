"""Answers with a big part that lies on disk as JSON: put in as it is, unread."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

from fastapi import Response
from fastapi.responses import StreamingResponse
from pydantic import BaseModel

__all__ = ["spliced_answer"]

BLOCK_BYTES = 1024 * 1024


def spliced_answer(state: BaseModel, name: str, path: Path | None, status: int, headers: dict[str, str]) -> Response:
    """The state with one field more, the content of the file; null where there is none yet."""
    kept = {key: value for key, value in headers.items() if key not in ("content-length", "content-type")}
    return StreamingResponse(_spliced(state.model_dump_json(), name, path), status, kept, "application/json")


async def _spliced(state: str, name: str, path: Path | None) -> AsyncIterator[bytes]:
    yield state.removesuffix("}").encode() + f',"{name}":'.encode()
    if path is None:
        yield b"null"
    else:
        with await asyncio.to_thread(path.open, "rb") as file:
            while block := await asyncio.to_thread(file.read, BLOCK_BYTES):
                yield block
    yield b"}"
