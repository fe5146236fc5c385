"""What requests bring: bodies in JSON, files streamed to disk with digest and limit, and how long the client waits.

Bodies are taken in whole and handed to a worker, for the process that answers everybody must not parse them.
"""

from __future__ import annotations

import asyncio
import hashlib
import re
import uuid
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

from fastapi import Depends, Header, Request
from python_multipart import MultipartParser
from python_multipart.exceptions import MultipartParseError
from python_multipart.multipart import parse_options_header

from service.errors import MediaTypeError, NotJsonError, RequestError
from service.jobs.channel import BodyArguments

from .context import Service, ServiceDep
from .guard.body_limit import too_large
from .guard.uploads import Place
from .problems import is_json

__all__ = ["Upload", "WaitDep", "clean_name", "json_body", "long_body", "receive", "receive_files"]

BLOCK_BYTES = 1024 * 1024
MAX_NAME_LENGTH = 100
# file systems count bytes, 255 at most, and a letter can have four
MAX_NAME_BYTES = 200
MAX_BOUNDARY_BYTES = 200  # RFC 2046 allows 70, the parser 256
SUFFIX_OF_TYPE = {"image/tiff": ".tif", "application/x-npz": ".npz", "application/x-npy": ".npy"}
WAIT = re.compile(r"(?:^|[,;])\s*wait\s*=\s*\"?(\d{1,9})\"?\s*(?=$|[,;])", re.IGNORECASE)
FORM_BYTES = 64 * 1024  # what a form has beside its files, at most
# Longer ones lie on disk while they wait, and one at a time is checked, so that others come by.
BIG_BYTES = 1024 * 1024


@dataclass(frozen=True, slots=True)
class Upload:
    """A received file: where it lies, what it was called (without folders), its size and SHA-256."""

    path: Path
    name: str
    size_bytes: int
    sha256: str


@asynccontextmanager
async def receive(
    request: Request, service: Service, max_bytes: int, limit_name: str, file_name: str | None = None
) -> AsyncIterator[Upload]:
    """The request's file, on disk inside the block and removed after it. Raises as ``receive_files``."""
    async with receive_files(request, service, max_bytes, limit_name, file_name, most=1) as (upload,):
        yield upload


@asynccontextmanager
async def receive_files(
    request: Request, service: Service, max_bytes: int, limit_name: str, file_name: str | None = None, *, most: int
) -> AsyncIterator[tuple[Upload, ...]]:
    """The request's files, one to ``most`` and together of max_bytes, on disk inside the block and removed after it.

    Raises BodyTooLargeError, RequestError, BusyError when others take all places, TooSlowError.
    """
    told_bytes = _told_bytes(request)
    if told_bytes is not None and told_bytes > max_bytes + FORM_BYTES:
        raise too_large(max_bytes, limit_name)
    async with service.uploads.place(told_bytes) as place:
        folder = service.folder.incoming / uuid.uuid4().hex
        await asyncio.to_thread(folder.mkdir)
        try:
            uploads = await _received(request, folder, place, max_bytes, limit_name, file_name, most)
            place.receiving = False
            yield uploads
        finally:
            await asyncio.to_thread(service.folder.remove, folder)


def _told_bytes(request: Request) -> int | None:
    length = request.headers.get("content-length", "")
    return int(length) if length.isdecimal() else None


async def _received(
    request: Request, folder: Path, place: Place, max_bytes: int, limit_name: str, file_name: str | None, most: int
) -> tuple[Upload, ...]:
    declared = request.headers.get("content-type", "")
    media_type, options = parse_options_header(declared)
    form = _Form(options.get(b"boundary", b""), most) if media_type == b"multipart/form-data" else None
    sinks, size_bytes = list[_Sink](), 0
    async for chunk in request.stream():
        place.take(len(chunk))
        for number, data in [(0, chunk)] if form is None else form.parse(chunk):
            if number == len(sinks):
                if sinks:
                    await asyncio.to_thread(sinks[-1].write)
                sinks.append(_Sink(folder / str(number)))
            sinks[number].take(data)
            size_bytes += len(data)
        if size_bytes > max_bytes:
            raise too_large(max_bytes, limit_name)
        if sinks and sinks[-1].pending_bytes >= BLOCK_BYTES:
            await asyncio.to_thread(sinks[-1].write)
    names = [_name_in_header(request) or f"upload{SUFFIX_OF_TYPE.get(media_type.decode('latin-1'), '')}"]
    if form is not None:
        names = form.check_complete().file_names
    if file_name is not None and len(names) == 1:
        names = [file_name]
    named = zip(sinks, names, strict=True)
    return tuple([await asyncio.to_thread(sink.kept_as, clean_name(name)) for sink, name in named])


def clean_name(name: str) -> str:
    """A file name without folders, control or quoting characters, never empty and never hidden."""
    last = re.split(r"[/\\]", name)[-1]
    plain = re.sub(r"[^\w.() +-]", "_", last).lstrip(". ")
    stem, dot, suffix = plain.rpartition(".")
    stem = stem[: max(MAX_NAME_LENGTH - len(suffix) - 1, 0)]
    while stem and len(f"{stem}{dot}{suffix}".encode()) > MAX_NAME_BYTES:
        stem = stem[:-1]
    return f"{stem}{dot}{suffix}"[:MAX_NAME_LENGTH].encode()[:MAX_NAME_BYTES].decode(errors="ignore") or "upload"


def _name_in_header(request: Request) -> str | None:
    _, options = parse_options_header(request.headers.get("content-disposition", ""))
    name = options.get(b"filename")
    return None if name is None else name.decode("utf-8", "replace")


class _Sink:
    """Takes bytes as they come, and writes and hashes them in a thread, block by block."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self._file = folder / "file"
        self._pending = bytearray()
        self._sha256 = hashlib.sha256()
        self._size_bytes = 0

    @property
    def pending_bytes(self) -> int:
        return len(self._pending)

    def take(self, data: bytes) -> None:
        self._size_bytes += len(data)
        self._pending += data

    def write(self) -> None:
        block, self._pending = self._pending, bytearray()
        self._sha256.update(block)
        with self._file.open("ab") as file:
            file.write(block)

    def kept_as(self, name: str) -> Upload:
        """All of it, under the name whose suffix, and for .hgt the name itself, tells how to read it.

        Raises RequestError where nothing came.
        """
        if not self._size_bytes:
            raise RequestError(f"{name} is empty.")
        self.write()
        return Upload(self._file.rename(self._file.with_name(name)), name, self._size_bytes, self._sha256.hexdigest())


class _Form:
    """The files of a multipart form, ``most`` of them; anything else in the form is refused, not ignored."""

    def __init__(self, boundary: bytes, most: int) -> None:
        if not boundary:
            raise RequestError("The multipart form has no boundary.")
        if len(boundary) > MAX_BOUNDARY_BYTES:
            raise RequestError(f"The boundary of the multipart form is longer than {MAX_BOUNDARY_BYTES} bytes.")
        self.file_names: list[str] = []
        self._most = most
        self._parsed: list[tuple[int, bytes]] = []
        self._header_name = bytearray()
        self._header_value = bytearray()
        self._headers: dict[bytes, bytes] = {}
        self._ended = False
        self._parser = MultipartParser(
            boundary,
            {
                "on_header_field": lambda data, start, end: self._header_name.extend(data[start:end]),
                "on_header_value": lambda data, start, end: self._header_value.extend(data[start:end]),
                "on_header_end": self._on_header_end,
                "on_headers_finished": self._on_headers_finished,
                "on_part_data": lambda data, start, end: self._on_data(data[start:end]),
                "on_end": self._on_end,
            },
        )

    def parse(self, chunk: bytes) -> list[tuple[int, bytes]]:
        """(number of the file, bytes of it) in the next chunk of the form."""
        try:
            self._parser.write(chunk)
        except MultipartParseError as error:
            raise RequestError("The multipart form is damaged.") from error
        parsed, self._parsed = self._parsed, []
        return parsed

    def check_complete(self) -> Self:
        """Raises RequestError unless the form came to its end and had a file."""
        if not self.file_names:
            raise RequestError("The form has no file; send one, for instance with `curl -F file=@dem.tif`.")
        if not self._ended:
            raise RequestError("The multipart form ended before its last part was complete.")
        return self

    def _on_header_end(self) -> None:
        self._headers[bytes(self._header_name).lower()] = bytes(self._header_value)
        self._header_name.clear()
        self._header_value.clear()

    def _on_headers_finished(self) -> None:
        _, options = parse_options_header(self._headers.pop(b"content-disposition", b""))
        self._headers.clear()
        field = options.get(b"name", b"").decode("utf-8", "replace")
        name = options.get(b"filename")
        if name is None:
            raise RequestError(f"The form field {field[:40]!r} is not known; options go into the query, the file here.")
        if len(self.file_names) == self._most:
            alone = "more than one file; send one at a time" if self._most == 1 else f"more than {self._most} files"
            raise RequestError(f"The form has {alone}.")
        self.file_names.append(name.decode("utf-8", "replace"))
        self._on_data(b"")

    def _on_data(self, data: bytes) -> None:
        self._parsed.append((len(self.file_names) - 1, data))

    def _on_end(self) -> None:
        self._ended = True


async def _wait_s(
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
    told_bytes = _told_bytes(request)
    if told_bytes is not None and told_bytes <= min(BIG_BYTES, settings.max_pairs_bytes):
        yield {"body": await json_body(request)}, False
        return
    _refuse_other_types(request)
    async with receive(request, service, settings.max_pairs_bytes, "max_pairs_bytes", "body.json") as body:
        yield {"path": str(body.path)}, True


def _refuse_other_types(request: Request) -> None:
    if not is_json(request):
        raise MediaTypeError("The body must be JSON and say so, with the header 'Content-Type: application/json'.")
