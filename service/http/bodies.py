"""What requests bring: bodies in JSON, and how long the client is willing to wait.

Bodies are taken in whole and handed to a worker, for the process that answers everybody must not parse them.
"""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import Depends, Header, Request

from service.errors import BusyError, MediaTypeError, NotJsonError
from service.jobs.channel import BodyArguments

from .context import Service, ServiceDep
from .uploads import receive

__all__ = ["WaitDep", "is_json", "json_body", "long_body"]

WAIT = re.compile(r"(?:^|[,;])\s*wait\s*=\s*\"?(\d{1,9})\"?\s*(?=$|[,;])", re.IGNORECASE)
# Longer ones lie on disk while they wait, and one at a time is checked, so that others come by.
BIG_BYTES = 1024 * 1024


def _wait_s(
    service: ServiceDep,
    prefer: Annotated[
        str | None,
        Header(
            description="`wait=SECONDS`: answer when the calculation is done, or with 202 after so many seconds "
            "(the setting SIGHTLINE_MAX_WAIT_S caps it). Without it the answer comes at once.",
            examples=["wait=10"],
        ),
    ] = None,
) -> float | None:
    """Seconds to wait, at most what the settings allow; None when no wait is wanted or none that is understood."""
    found = None if prefer is None else WAIT.search(prefer)
    return None if found is None else min(float(found[1]), service.settings.max_wait_s)


WaitDep = Annotated[float | None, Depends(_wait_s)]


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
async def long_body(request: Request, service: Service) -> AsyncIterator[tuple[BodyArguments, bool]]:
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
