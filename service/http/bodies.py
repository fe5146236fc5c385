"""Bodies in JSON: taken in whole and handed to a worker, for the process that answers everybody must not parse them."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import Request
from pydantic import BaseModel

from service.errors import BusyError, MediaTypeError, NotJsonError

from .context import Service
from .uploads import receive

__all__ = ["body_of", "is_json", "json_body", "long_body"]

# Longer ones lie on disk while they wait, and one at a time is checked, so that others come by.
BIG_BYTES = 1024 * 1024


def body_of(model: type[BaseModel]) -> dict[str, Any]:
    """How OpenAPI documents a body that is read here."""
    content = {"application/json": {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}}}
    return {"requestBody": {"required": True, "content": content}}


def is_json(request: Request) -> bool:
    """Whether the body says that it is JSON."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    return media_type == "application/json" or media_type.endswith("+json")


async def json_body(request: Request) -> str:
    """The text of a body that may have max_json_bytes. Raises MediaTypeError, NotJsonError."""
    _refuse_other_types(request)
    try:
        return (await request.body()).decode()
    except UnicodeDecodeError as error:
        raise NotJsonError("The body is not valid JSON: it is not UTF-8 text.") from error


@asynccontextmanager
async def long_body(request: Request, service: Service) -> AsyncIterator[tuple[dict[str, str], bool]]:
    """(the body as arguments of a check, whether it is big): a file inside the block, or its text where it is short.

    It may have max_pairs_bytes. Raises MediaTypeError, NotJsonError, BodyTooLargeError, BusyError.
    """
    settings = service.settings
    length = request.headers.get("content-length", "")
    if length.isdecimal() and int(length) <= min(BIG_BYTES, settings.max_pairs_bytes):
        yield {"body": await json_body(request)}, False
        return
    _refuse_other_types(request)
    if service.uploads.locked():
        raise BusyError(
            f"{settings.max_uploads} uploads are under way, which is the limit; try again in a moment",
            limit_name="max_uploads",
            limit=settings.max_uploads,
        )
    async with (
        service.uploads,
        receive(request, service.folder, settings.max_pairs_bytes, "max_pairs_bytes", "body.json") as body,
    ):
        yield {"path": str(body.path)}, True


def _refuse_other_types(request: Request) -> None:
    if not is_json(request):
        raise MediaTypeError("The body must be JSON and say so, with the header 'Content-Type: application/json'.")
